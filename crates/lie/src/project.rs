//! The nearest rotation to a matrix that is almost one.

use crate::{Matrix, Rotation};

/// A rotation and how far the matrix was from one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Projected {
    /// The nearest rotation in the Frobenius norm.
    pub rotation: Rotation,
    /// Largest absolute entry of `M^T M - I`; 0 for a rotation, about twice a relative error of the entries.
    pub error: f64,
}

/// Why a matrix was not taken for a rotation.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum ProjectionError {
    /// An entry is NaN or infinite.
    #[error("the matrix has an entry that is not finite")]
    NotFinite,
    /// A direction is lost: the matrix is zero, or has rank below 3 to rounding.
    #[error("the matrix is singular (determinant {determinant:e}), so it has no nearest rotation")]
    Singular {
        /// Determinant of the matrix.
        determinant: f64,
    },
    /// The matrix mirrors space, as a left-handed frame does.
    #[error(
        "the matrix is a reflection (determinant {determinant}), not a rotation: is one axis flipped?"
    )]
    Reflection {
        /// Determinant of the matrix, below 0.
        determinant: f64,
    },
    /// Further from orthogonal than the caller allows.
    #[error(
        "the matrix is not orthogonal: R^T R differs from the identity by {error:e}, allowed is {tolerance:e}"
    )]
    TooFar {
        /// Largest absolute entry of `R^T R - I`.
        error: f64,
        /// The tolerance that the caller gave.
        tolerance: f64,
    },
}

/// Volume of the matrix, its entries divided by the largest, below which it counts as singular.
const SINGULAR_BELOW: f64 = 1e-12;

/// Largest absolute entry of `matrix^T matrix - I`.
pub fn orthogonality_error(matrix: &Matrix) -> f64 {
    (matrix.tr_mul(matrix) - Matrix::identity()).amax()
}

/// The rotation nearest to `matrix` in the Frobenius norm, if `matrix` is within `tolerance` of orthogonal.
///
/// `tolerance` bounds the largest absolute entry of `matrix^T matrix - I`; it has no unit. For entries
/// printed with 7 digits 1e-6 is ample.
///
/// # Errors
/// In this order: [`ProjectionError::NotFinite`], [`Singular`](ProjectionError::Singular),
/// [`Reflection`](ProjectionError::Reflection), [`TooFar`](ProjectionError::TooFar).
///
/// ```
/// use dose3_lie::{Matrix, so3};
/// let printed = Matrix::new(0.866025, -0.5, 0.0, 0.5, 0.866025, 0.0, 0.0, 0.0, 1.0);
/// let projected = so3::project(&printed, 1e-5).unwrap();
/// assert!(projected.error > 1e-7);
/// assert!(so3::project(&printed, 1e-8).is_err());
/// ```
pub fn project(matrix: &Matrix, tolerance: f64) -> Result<Projected, ProjectionError> {
    if !matrix.iter().all(|entry| entry.is_finite()) {
        return Err(ProjectionError::NotFinite);
    }
    let determinant = matrix.determinant();
    // Divided first, so that very large and very small entries neither overflow nor vanish.
    let largest = matrix.amax();
    let volume = (matrix / largest).determinant();
    if largest == 0.0 || volume.abs() < SINGULAR_BELOW {
        return Err(ProjectionError::Singular { determinant });
    }
    if volume < 0.0 {
        return Err(ProjectionError::Reflection { determinant });
    }
    let error = orthogonality_error(matrix);
    // Written so that a tolerance of NaN refuses.
    if error <= tolerance {
        let rotation = Rotation::from_matrix_unchecked(orthogonal_factor(matrix / largest));
        Ok(Projected { rotation, error })
    } else {
        Err(ProjectionError::TooFar { error, tolerance })
    }
}

/// The orthogonal factor `U V^T` of the polar decomposition of a regular matrix.
///
/// Newton's iteration `X <- (c X + (c X)^-T) / 2` with Higham's scaling `c` (Higham, "Computing the polar
/// decomposition", 1986). It converges quadratically; the result is orthogonal to 6e-16, where the product
/// of the factors of nalgebra's SVD is so to 4e-15.
fn orthogonal_factor(matrix: Matrix) -> Matrix {
    let mut current = matrix;
    // Scaled Newton needs at most 9 steps for condition numbers up to 1e16.
    for _ in 0..16 {
        let Some(inverse) = current.try_inverse() else {
            break;
        };
        let scale = (inverse.norm() / current.norm()).sqrt();
        let next = (current * scale + inverse.transpose() / scale) * 0.5;
        let change = (next - current).amax();
        current = next;
        if change < 1e-15 {
            break;
        }
    }
    current
}
