//! What only rigid motions have: points, relative poses, interpolation.

use dose3_lie::{Pose, Vector, se3, so3};
use proptest::prelude::*;

use crate::group::{Group, METRES_PER_RADIAN, Se3, So3, config, element, gap, tangent};

fn point() -> impl Strategy<Value = Vector> {
    prop::array::uniform3(-5.0..5.0).prop_map(Vector::from)
}

#[test]
fn points_move_as_the_matrix_says() {
    proptest!(config(), |(pose in element::<Se3>(), point in point())| {
        let moved = (pose.matrix() * point.push(1.0)).xyz();
        prop_assert!((pose.transform_point(&point) - moved).amax() < 1e-14);
    });
}

#[test]
fn relative_pose_leads_from_one_to_the_other() {
    proptest!(config(), |(a in element::<Se3>(), b in element::<Se3>())| {
        prop_assert!(gap::<Se3>(&a.compose(&a.relative(&b)), &b) < 1e-13);
        prop_assert!(gap::<Se3>(&a.relative(&b), &(a.inverse() * b)) < 1e-13);
    });
}

#[test]
fn pure_translations_and_pure_rotations() {
    proptest!(config(), |(phi in tangent::<So3>(0.0..3.0), rho in point())| {
        let slide = se3::exp(&Se3::tangent(rho, Vector::zeros()));
        prop_assert_eq!(slide, Pose::new(So3::identity(), rho));
        let turn = se3::exp(&Se3::tangent(Vector::zeros(), phi));
        prop_assert_eq!(turn, Pose::new(so3::exp(&phi), Vector::zeros()));
    });
}

#[test]
fn interpolation_follows_the_geodesic() {
    proptest!(config(), |(a in element::<Se3>(), b in element::<Se3>(), u in 0.0..1.0)| {
        prop_assert!(gap::<Se3>(&se3::interpolate(&a, &b, 0.0), &a) < 1e-15);
        prop_assert!(gap::<Se3>(&se3::interpolate(&a, &b, 1.0), &b) < 5e-15);
        let between = se3::interpolate(&a, &b, u);
        let whole = se3::distance(&a, &b, METRES_PER_RADIAN);
        prop_assert!((se3::distance(&a, &between, METRES_PER_RADIAN) - u * whole).abs() < 1e-13);
        prop_assert!((se3::distance(&between, &b, METRES_PER_RADIAN) - (1.0 - u) * whole).abs() < 1e-13);
        let straight = a.translation + (b.translation - a.translation) * u;
        prop_assert!((between.translation - straight).norm() < 1e-14);
    });
}
