//! One property suite over every group: each property is written once, for a [`group::Group`], and
//! [`suite!`] runs it on SO(3) and on SE(3). What only one group has follows in a file of its own.

mod algebra;
mod group;
mod jacobians;
mod metric;
#[path = "../../../ood/src/property_cases.rs"]
mod property_cases;
mod round_trip;
mod se3_only;

/// Runs every property on one group.
macro_rules! suite {
    ($module:ident, $group:ty; $($file:ident: $($property:ident),+);+ $(;)?) => {
        mod $module {
            $($(
                #[test]
                fn $property() {
                    crate::$file::$property::<$group>();
                }
            )+)+
        }
    };
}

/// Lists the properties once, so that no group can miss one.
macro_rules! suites {
    ($($module:ident: $group:ty),+) => {
        $(suite! { $module, $group;
            algebra: associativity, identity, inverse, inverse_negates_the_tangent, matrices_multiply;
            algebra: scale_by_one_and_zero, scale_is_additive, scale_by_whole_numbers, scale_by_minus_one;
            round_trip: exp_equals_the_matrix_exponential, special_angles_on_the_axes, special_angles_conjugated;
            round_trip: exactly_pi, short_tangents, beyond_two_pi, log_then_exp, equivariance_under_conjugation;
            metric: zero_only_at_itself, symmetry, triangle_inequality, left_invariance, right_invariance;
            metric: small_distances;
        })+
    };
}

suites!(so3: crate::group::So3, se3: crate::group::Se3);
