//! Projection of nearly-orthogonal matrices: what is repaired, and what is refused.

use dose3_lie::project::orthogonality_error;
use dose3_lie::{Matrix, ProjectionError, Rotation, Vector, so3};
use proptest::prelude::*;

#[path = "../../ood/src/property_cases.rs"]
mod property_cases;

use property_cases::cases;

fn rotation() -> impl Strategy<Value = Rotation> {
    prop::array::uniform3(-3.0..3.0).prop_map(|v| so3::exp(&Vector::from(v)))
}

/// Matrices with entries in `[-1, 1]`.
fn disturbance() -> impl Strategy<Value = Matrix> {
    prop::array::uniform9(-1.0..1.0).prop_map(|entries| Matrix::from_row_slice(&entries))
}

/// A rotation R is nearest to M exactly if R^T M is symmetric and positive definite.
#[test]
fn the_nearest_rotation() {
    proptest!(cases(256), |(truth in rotation(), disturbance in disturbance(), exponent in -12.0..-0.8)| {
        let matrix = truth.matrix() + disturbance * 10_f64.powf(exponent);
        let projected = so3::project(&matrix, f64::INFINITY).unwrap();
        let rotation = projected.rotation.matrix();
        prop_assert!(orthogonality_error(rotation) < 1e-15);
        prop_assert!((rotation.determinant() - 1.0).abs() < 1e-15);

        let stretch = rotation.tr_mul(&matrix);
        prop_assert!((stretch - stretch.transpose()).amax() < 1e-15);
        prop_assert!(stretch.symmetric_eigenvalues().min() > 0.0);

        let svd = matrix.svd(true, true);
        let by_svd = svd.u.unwrap() * svd.v_t.unwrap();
        prop_assert!((rotation - by_svd).amax() < 1e-14);
    });
}

/// How far projecting moves a matrix, and how far it was from orthogonal. The nearest orthogonal matrix to one with singular
/// values 1 + s is at |s| in the Frobenius norm, where M^T M - I has 2 |s|, at most three times its largest entry.
fn moved(matrix: &Matrix) -> (f64, f64) {
    let same = so3::project(matrix, 1e-12).unwrap();
    ((same.rotation.matrix() - matrix).amax(), same.error)
}

#[test]
fn a_rotation_that_is_off_by_rounding_moves_by_no_more() {
    let (moved, error) = moved(&Matrix::new(
        -0.9669619616549008,
        -0.23446593610372202,
        0.10005143437009686,
        -0.058955073312299724,
        0.5875242854743876,
        0.807056078168396,
        -0.24800980634493028,
        0.7744939888629323,
        -0.5819365920544399,
    ));
    assert!(
        moved < 1e-15 + 1.5 * error && error < 4e-15,
        "{moved:e} {error:e}"
    );
}

#[test]
fn a_rotation_stays_and_projecting_twice_changes_nothing() {
    proptest!(cases(256), |(truth in rotation(), disturbance in disturbance())| {
        let (moved, error) = moved(truth.matrix());
        prop_assert!(moved < 1e-15 + 1.5 * error && error < 4e-15);

        let once = so3::project(&(truth.matrix() + disturbance * 1e-3), 0.1).unwrap().rotation;
        let twice = so3::project(once.matrix(), 1e-12).unwrap().rotation;
        prop_assert!((once.matrix() - twice.matrix()).amax() < 1e-15);
    });
}

#[test]
fn tolerance_bounds_the_reported_error() {
    proptest!(cases(256), |(truth in rotation(), disturbance in disturbance(), exponent in -12.0..-0.8)| {
        let matrix = truth.matrix() + disturbance * 10_f64.powf(exponent);
        let error = (matrix.transpose() * matrix - Matrix::identity()).amax();
        let accepted = so3::project(&matrix, error * 1.001 + 1e-15).unwrap();
        prop_assert!((accepted.error - error).abs() < 1e-15);
        let tolerance = accepted.error * 0.999;
        let refused = so3::project(&matrix, tolerance).unwrap_err();
        prop_assert_eq!(refused, ProjectionError::TooFar { error: accepted.error, tolerance });
    });
}

/// Entries as single-precision files print them.
#[test]
fn seven_digits() {
    let exact = so3::exp(&Vector::new(0.4, -1.1, 2.0));
    let printed = exact.matrix().map(|entry| (entry * 1e7).round() / 1e7);
    let projected = so3::project(&printed, 1e-6).unwrap();
    assert!(projected.error > 1e-9);
    assert!(so3::distance(&projected.rotation, &exact) < 1e-7);
}

#[test]
fn reflections_are_named() {
    let turn = so3::exp(&Vector::new(0.4, -1.1, 2.0));
    for flipped in 0..3 {
        let mut matrix = *turn.matrix();
        matrix.column_mut(flipped).neg_mut();
        let refused = so3::project(&matrix, 1e-3).unwrap_err();
        assert!(
            matches!(refused, ProjectionError::Reflection { determinant } if (determinant + 1.0).abs() < 1e-14),
            "{refused:?}"
        );
    }
}

#[test]
fn lost_directions_are_named() {
    let turn = *so3::exp(&Vector::new(0.4, -1.1, 2.0)).matrix();
    let mut rank_two = turn;
    rank_two.column_mut(1).fill(0.0);
    let repeated = Matrix::from_columns(&[turn.column(0), turn.column(0), turn.column(2)]);
    for matrix in [Matrix::zeros(), Matrix::repeat(1.0), rank_two, repeated] {
        let refused = so3::project(&matrix, 1e3).unwrap_err();
        assert!(
            matches!(refused, ProjectionError::Singular { determinant } if determinant.abs() < 1e-15),
            "{matrix} {refused:?}"
        );
    }
}

#[test]
fn scaled_rotations_are_too_far() {
    let turn = *so3::exp(&Vector::new(0.4, -1.1, 2.0)).matrix();
    for factor in [1e-200, 0.5, 2.0, 1e200] {
        let refused = so3::project(&(turn * factor), 1e-3).unwrap_err();
        assert!(
            matches!(refused, ProjectionError::TooFar { error, .. } if error > 0.7),
            "{factor} {refused:?}"
        );
    }
}

#[test]
fn entries_that_are_not_finite() {
    for entry in 0..9 {
        for value in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            let mut matrix = Matrix::identity();
            matrix[entry] = value;
            assert_eq!(so3::project(&matrix, 1.0), Err(ProjectionError::NotFinite));
        }
    }
}

#[test]
fn a_tolerance_of_nan_refuses() {
    assert!(so3::project(&Matrix::identity(), f64::NAN).is_err());
    assert!(so3::project(&Matrix::identity(), -1.0).is_err());
    assert!(so3::project(&Matrix::identity(), 0.0).is_ok());
}

#[test]
fn messages_say_what_to_do() {
    let mirrored = Matrix::from_diagonal(&Vector::new(1.0, 1.0, -1.0));
    assert_eq!(
        so3::project(&mirrored, 1e-3).unwrap_err().to_string(),
        "the matrix is a reflection (determinant -1), not a rotation: is one axis flipped?"
    );
    assert_eq!(
        so3::project(&(Matrix::identity() * 2.0), 1e-3)
            .unwrap_err()
            .to_string(),
        "the matrix is not orthogonal: R^T R differs from the identity by 3e0, allowed is 1e-3"
    );
}
