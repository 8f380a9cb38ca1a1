//! Rigid-body poses: one rotation and one translation.

use nalgebra::{Isometry3, Matrix4, UnitQuaternion};
use serde::{Deserialize, Serialize};

use crate::project::{ProjectionError, project};
use crate::{Matrix, Rotation, Vector, so3};

/// How far from orthogonal the rotation of a stored pose may be (see [`ProjectionError::TooFar`]).
///
/// Products of a few thousand exact rotations stay well below it.
const STORED_TOLERANCE: f64 = 1e-6;

/// An element of SE(3): maps a point of the body frame to `rotation * point + translation`.
///
/// Serialised as `{"rotation": [[..], [..], [..]], "translation": [..]}`, rows first; reading refuses
/// a matrix that is not a rotation.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "StoredPose", into = "StoredPose")]
pub struct Pose {
    /// Orientation of the body in the reference frame.
    pub rotation: Rotation,
    /// Position of the body in the reference frame, in metres.
    pub translation: Vector,
}

impl Pose {
    /// A pose from its two parts.
    pub fn new(rotation: Rotation, translation: Vector) -> Self {
        Self {
            rotation,
            translation,
        }
    }

    /// The pose that moves nothing.
    pub fn identity() -> Self {
        Self::new(Rotation::identity(), Vector::zeros())
    }

    /// Group product: first `other`, then `self`.
    ///
    /// ```
    /// use dose3_lie::{Pose, Rotation, Vector};
    /// let left_turn = Pose::new(Rotation::from_axis_angle(&Vector::z_axis(), std::f64::consts::FRAC_PI_2), Vector::zeros());
    /// let ahead = Pose::new(Rotation::identity(), Vector::x());
    /// assert!((left_turn.compose(&ahead).translation - Vector::y()).norm() < 1e-15);
    /// ```
    pub fn compose(&self, other: &Self) -> Self {
        Self::new(
            so3::compose(&self.rotation, &other.rotation),
            self.transform_point(&other.translation),
        )
    }

    /// The pose that undoes this one.
    pub fn inverse(&self) -> Self {
        let rotation = so3::inverse(&self.rotation);
        Self::new(rotation, -(rotation * self.translation))
    }

    /// `self^-1 other`: the other pose as seen from this body.
    pub fn relative(&self, other: &Self) -> Self {
        let rotation = so3::inverse(&self.rotation);
        Self::new(
            so3::compose(&rotation, &other.rotation),
            rotation * (other.translation - self.translation),
        )
    }

    /// A point of the body frame, in reference coordinates (metres).
    pub fn transform_point(&self, point: &Vector) -> Vector {
        self.rotation * point + self.translation
    }

    /// The homogeneous 4x4 matrix.
    pub fn matrix(&self) -> Matrix4<f64> {
        let mut matrix = self.rotation.to_homogeneous();
        matrix
            .fixed_view_mut::<3, 1>(0, 3)
            .copy_from(&self.translation);
        matrix
    }

    /// Whether every number in the pose is finite.
    pub fn is_finite(&self) -> bool {
        let mut entries = self.rotation.matrix().iter().chain(self.translation.iter());
        entries.all(|entry| entry.is_finite())
    }
}

impl Default for Pose {
    fn default() -> Self {
        Self::identity()
    }
}

/// The same motion; a quaternion that is not quite of unit length gives a matrix that is not quite a rotation.
impl From<Isometry3<f64>> for Pose {
    fn from(isometry: Isometry3<f64>) -> Self {
        Self::new(
            isometry.rotation.to_rotation_matrix(),
            isometry.translation.vector,
        )
    }
}

impl From<Pose> for Isometry3<f64> {
    fn from(pose: Pose) -> Self {
        let rotation = UnitQuaternion::from_rotation_matrix(&pose.rotation);
        Self::from_parts(pose.translation.into(), rotation)
    }
}

impl std::ops::Mul for Pose {
    type Output = Self;

    fn mul(self, other: Self) -> Self {
        self.compose(&other)
    }
}

/// The serialised form of a [`Pose`].
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct StoredPose {
    rotation: [[f64; 3]; 3],
    translation: [f64; 3],
}

impl From<Pose> for StoredPose {
    fn from(pose: Pose) -> Self {
        let rows = pose.rotation.matrix().transpose();
        Self {
            rotation: rows.into(),
            translation: pose.translation.into(),
        }
    }
}

impl TryFrom<StoredPose> for Pose {
    type Error = ProjectionError;

    fn try_from(stored: StoredPose) -> Result<Self, ProjectionError> {
        let rotation = Matrix::from(stored.rotation).transpose();
        let translation = Vector::from(stored.translation);
        if !translation.iter().all(|entry| entry.is_finite()) {
            return Err(ProjectionError::NotFinite);
        }
        project(&rotation, STORED_TOLERANCE)?;
        // Kept as written, so that storing and reading gives back the same bits.
        Ok(Self::new(
            Rotation::from_matrix_unchecked(rotation),
            translation,
        ))
    }
}
