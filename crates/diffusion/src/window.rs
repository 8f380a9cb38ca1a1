//! Views of one window of poses, and the noise drawn for it.

use crate::error::{Error, check_len};
use dose3_lie::{Rotation, Vector};
use nalgebra::Matrix3;
use rand::Rng;
use rand_distr::{Distribution, StandardNormal};

/// One represented window of `length` poses.
#[derive(Clone, Copy, Debug)]
pub struct Window<'a> {
    /// Translations, `[length, 3]`.
    pub translation: &'a [f32],
    /// Rotation matrices, row-major, `[length, 9]`.
    pub rotation: &'a [f32],
}

impl Window<'_> {
    /// Number of poses.
    ///
    /// # Errors
    /// [`Error::Shape`] where the two parts differ in length or do not hold whole poses.
    pub fn length(&self) -> Result<usize, Error> {
        let length = self.translation.len() / 3;
        check_len("window translation", length * 3, self.translation.len())?;
        check_len("window rotation", length * 9, self.rotation.len())?;
        Ok(length)
    }
}

/// The noise of one window: `N(0, I)` for translations, a tangent vector for rotations.
#[derive(Clone, Debug, PartialEq)]
pub struct Noise {
    /// `[length, 3]`
    pub translation: Vec<f32>,
    /// Tangent vectors at the identity, `[length, 3]`, radians.
    pub rotation: Vec<f32>,
}

/// Where a rotation's noise comes from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum RotationNoise {
    /// `v ~ N(0, I)` in the tangent space, mapped by exp (paper, equation of IG_SO(3)).
    #[default]
    Tangent,
    /// The heat kernel on SO(3) with the same scale; its tangent vector is the group logarithm,
    /// so its norm never exceeds pi.
    IgSo3,
}

impl Noise {
    /// No noise for `length` poses.
    pub(crate) fn zeros(length: usize) -> Self {
        Self {
            translation: vec![0.0; length * 3],
            rotation: vec![0.0; length * 3],
        }
    }

    /// Draws the noise of `length` poses.
    pub fn draw<R: Rng + ?Sized>(rng: &mut R, length: usize, kind: RotationNoise) -> Self {
        let translation = normals(rng, length * 3);
        let rotation = match kind {
            RotationNoise::Tangent => normals(rng, length * 3),
            RotationNoise::IgSo3 => {
                let unit = unit_igso3();
                (0..length)
                    .flat_map(|_| {
                        let v = unit.sample_tangent(rng);
                        [v.x as f32, v.y as f32, v.z as f32]
                    })
                    .collect()
            }
        };
        Self {
            translation,
            rotation,
        }
    }
}

fn unit_igso3() -> &'static dose3_lie::igso3::IgSo3 {
    // Threads of a pool may wait here for the first of them. It computes the table alone, without
    // the pool, and so cannot be handed one of those that wait.
    static UNIT: std::sync::OnceLock<dose3_lie::igso3::IgSo3> = std::sync::OnceLock::new();
    UNIT.get_or_init(|| dose3_lie::igso3::IgSo3::new(1.0).expect("1 is a valid scale"))
}

/// Standard normal numbers.
pub(crate) fn normals<R: Rng + ?Sized>(rng: &mut R, n: usize) -> Vec<f32> {
    (0..n).map(|_| StandardNormal.sample(rng)).collect()
}

/// Reads pose `i`'s rotation from a `[length, 9]` slice, and takes the f32 matrix back to SO(3) in
/// f64 so that its rounding does not reach the logarithm.
pub(crate) fn read_rotation(rotation: &[f32], i: usize) -> Rotation {
    let m = Matrix3::from_row_iterator(rotation[i * 9..i * 9 + 9].iter().map(|v| f64::from(*v)));
    // One Newton step of the polar decomposition: f32 matrices are orthogonal to 1e-7, so this
    // lands at 1e-14.
    let r = m * 1.5 - m * m.transpose() * m * 0.5;
    Rotation::from_matrix_unchecked(r)
}

/// Reads the 3-vector of row `i`.
pub(crate) fn read_vector(values: &[f32], i: usize) -> Vector {
    Vector::new(
        f64::from(values[i * 3]),
        f64::from(values[i * 3 + 1]),
        f64::from(values[i * 3 + 2]),
    )
}

/// Writes a rotation as nine row-major f32.
pub(crate) fn write_rotation(r: &Rotation, out: &mut [f32]) {
    let m = r.matrix();
    for row in 0..3 {
        for column in 0..3 {
            out[row * 3 + column] = m[(row, column)] as f32;
        }
    }
}

/// Writes a vector as three f32.
pub(crate) fn write_vector(v: &Vector, out: &mut [f32]) {
    out[0] = v.x as f32;
    out[1] = v.y as f32;
    out[2] = v.z as f32;
}
