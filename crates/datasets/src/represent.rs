//! What the network sees of a window: two representations, and the constants that scale them.

use dose3_lie::{Pose, Vector, so3};
use serde::{Deserialize, Serialize};

use crate::increments::motions;
use crate::{Error, Frame, Trajectory, Window};

/// A window whose largest displacement is below this many metres stands still and is not scaled up.
const STANDING: f64 = 1e-9;
/// Root mean square of the scaled rotation angles of increments, radians: the size at which noise of unit
/// variance and signal compare.
const ROTATION_TARGET: f64 = 0.5;
/// No scaled rotation angle is larger; beyond pi a large turn would look like a small one.
const LARGEST_ANGLE: f64 = 3.0;
/// The smallest scale of an axis over the largest.
const SMALLEST_AXIS: f64 = 1e-3;
/// Share of the trusted increments whose angle must stay unclipped.
const UNCLIPPED: f64 = 0.999;

/// The kind of a representation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Kind {
    /// The paper's windows: positions minus the first, divided by the largest displacement; rotations as given.
    Paper,
    /// Body-frame increments `T_i^-1 T_{i+1}` in forward-left-up axes, scaled by stored constants.
    Motion,
}

impl Kind {
    /// Poses that a window needs for a tensor of `length` elements: an increment takes two.
    pub fn poses(self, length: usize) -> usize {
        match self {
            Self::Paper => length,
            Self::Motion => length + 1,
        }
    }

    /// The name used on the command line and in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Paper => "paper",
            Self::Motion => "motion",
        }
    }
}

impl std::fmt::Display for Kind {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.pad(self.name())
    }
}

impl std::str::FromStr for Kind {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self, Error> {
        [Self::Paper, Self::Motion]
            .into_iter()
            .find(|kind| kind.name() == text)
            .ok_or_else(|| Error::UnknownName {
                what: "representation",
                found: text.to_owned(),
                expected: "paper, motion".to_owned(),
            })
    }
}

/// Where the scale comes from.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Scaling {
    /// [`Kind::Paper`] only: each window by its own largest displacement. The scale itself is then lost.
    PerWindow,
    /// One scale for all, to be resolved into [`Scaling::Stored`] by [`Representation::fit`] on trusted data.
    PerDataset,
    /// [`Kind::Motion`] only: one scale for each body axis, to be resolved into [`Scaling::StoredAxes`]. A car
    /// moves a metre forward and a centimetre sideways; one scale for both hides the centimetres.
    PerAxis,
    /// Constants that travel with the model.
    Stored {
        /// Metres that become 1: translations are divided by it. Positive.
        translation: f64,
        /// Factor on the rotation tangent, `exp(k log R)`; 1 leaves rotations as they are. Positive.
        rotation: f64,
    },
    /// As [`Scaling::Stored`] with constants for the forward, left and up axes of the body.
    StoredAxes {
        /// Metres that become 1 on each axis. Positive.
        translation: [f64; 3],
        /// Factors on the coordinates of the rotation tangent. Positive.
        rotation: [f64; 3],
    },
}

impl Scaling {
    /// Stored constants on each axis: metres that become 1, and factors on the rotation tangent.
    pub fn stored(&self) -> Option<([f64; 3], [f64; 3])> {
        match *self {
            Self::Stored {
                translation,
                rotation,
            } => Some(([translation; 3], [rotation; 3])),
            Self::StoredAxes {
                translation,
                rotation,
            } => Some((translation, rotation)),
            Self::PerWindow | Self::PerDataset | Self::PerAxis => None,
        }
    }
}

/// How poses become numbers for the network.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Representation {
    /// `paper` or `motion`.
    pub kind: Kind,
    /// The scale.
    pub scaling: Scaling,
}

/// A window in f32, row-major, ready for the network.
#[derive(Debug, Clone, PartialEq)]
pub struct WindowTensor {
    /// Number of elements L.
    pub length: usize,
    /// `[L, 3]`
    pub translation: Vec<f32>,
    /// `[L, 9]`, row-major rotation matrices.
    pub rotation: Vec<f32>,
}

impl Representation {
    /// The paper's: per-window scale, no constants.
    pub const PAPER: Self = Self {
        kind: Kind::Paper,
        scaling: Scaling::PerWindow,
    };

    /// A representation with its constants taken from trusted windows.
    ///
    /// `Paper` with [`Scaling::PerDataset`] stores the largest displacement of any window. `Motion` stores the
    /// root mean square of the step lengths, and the factor that brings the root mean square of the step
    /// angles to 0.5 rad, or less where more than one step in a thousand would otherwise exceed 3 rad. Scales of
    /// data that never moves are 1. `PerAxis` does the same for each body axis, with one limit on the angle. [`Scaling::PerWindow`] and [`Scaling::Stored`] are taken as they are.
    ///
    /// # Errors
    /// [`Error::Parameter`] for `Motion` with `PerWindow` (the scale must not come from the log under test),
    /// for constants that are not positive, and for windows that are not windows of `trajectories`.
    pub fn fit(
        kind: Kind,
        scaling: Scaling,
        trajectories: &[Trajectory],
        windows: &[Window],
    ) -> Result<Self, Error> {
        let scaling = match (kind, scaling) {
            (Kind::Paper, Scaling::PerDataset) => {
                let mut largest = 0.0_f64;
                for window in windows {
                    largest = largest.max(largest_displacement(poses_of(window, trajectories)?));
                }
                Scaling::Stored {
                    translation: positive_or_one(largest),
                    rotation: 1.0,
                }
            }
            (Kind::Motion, Scaling::PerDataset) => fit_motion(trajectories, windows)?,
            (Kind::Motion, Scaling::PerAxis) => fit_axes(trajectories, windows)?,
            (_, scaling) => scaling,
        };
        let representation = Self { kind, scaling };
        representation.check()?;
        Ok(representation)
    }

    /// Checks what a file may have brought in.
    ///
    /// # Errors
    /// [`Error::Parameter`] for `Motion` with `PerWindow`, for an unresolved `PerDataset`, and for constants that
    /// are not positive and finite.
    pub fn check(&self) -> Result<(), Error> {
        let fault = |found: String| {
            Err(Error::Parameter {
                what: "scaling of the representation",
                expected: "per window (paper only) or positive stored constants",
                found,
            })
        };
        match (self.kind, self.scaling) {
            (Kind::Paper, Scaling::PerWindow) => Ok(()),
            (_, Scaling::Stored { .. }) | (Kind::Motion, Scaling::StoredAxes { .. }) => {
                let constants = self.scaling.stored().into_iter();
                if constants
                    .flat_map(|(translation, rotation)| [translation, rotation])
                    .flatten()
                    .all(|value| value.is_finite() && value > 0.0)
                {
                    Ok(())
                } else {
                    fault(format!("{:?}", self.scaling))
                }
            }
            (kind, scaling) => fault(format!("{scaling:?} with {kind}")),
        }
    }

    /// The tensor of one window: L elements from L poses (`Paper`) or from L + 1 poses (`Motion`, see
    /// [`Kind::poses`]). `frame` is that of the log; `Paper` takes rotations as given and does not use it.
    ///
    /// # Errors
    /// [`Error::Parameter`] for fewer poses than one element needs, for constants that [`Self::check`] refuses,
    /// and for poses that are not finite.
    ///
    /// ```
    /// use dose3_datasets::{Frame, Representation};
    /// use dose3_lie::{Pose, Rotation, Vector};
    ///
    /// let step = |x| Pose { rotation: Rotation::identity(), translation: Vector::new(x, 0.0, 0.0) };
    /// let tensor = Representation::PAPER.represent(&[step(10.0), step(12.0), step(14.0)], Frame::BodyFlu)?;
    /// assert_eq!(tensor.translation, [0.0, 0.0, 0.0, 0.5, 0.0, 0.0, 1.0, 0.0, 0.0]);
    /// # Ok::<(), dose3_datasets::Error>(())
    /// ```
    pub fn represent(&self, poses: &[Pose], frame: Frame) -> Result<WindowTensor, Error> {
        self.check()?;
        if poses.len() < self.kind.poses(1) {
            return Err(Error::Parameter {
                what: "window",
                expected: "at least one element long",
                found: format!("{} poses", poses.len()),
            });
        }
        let elements = match self.kind {
            Kind::Paper => paper(poses, self.scaling),
            Kind::Motion => motion(poses, frame, self.scaling),
        };
        WindowTensor::from_poses(&elements)
    }

    /// [`Self::represent`] for a window of a slice of logs.
    ///
    /// # Errors
    /// As [`Self::represent`]; [`Error::Parameter`] where the window is not one of `trajectories`.
    pub fn represent_window(
        &self,
        window: &Window,
        trajectories: &[Trajectory],
    ) -> Result<WindowTensor, Error> {
        let poses = poses_of(window, trajectories)?;
        self.represent(poses, trajectories[window.trajectory].frame)
    }
}

impl WindowTensor {
    fn from_poses(elements: &[Pose]) -> Result<Self, Error> {
        let mut tensor = Self {
            length: elements.len(),
            translation: Vec::with_capacity(3 * elements.len()),
            rotation: Vec::with_capacity(9 * elements.len()),
        };
        for pose in elements {
            tensor
                .translation
                .extend(pose.translation.iter().map(|value| *value as f32));
            // nalgebra stores columns; the transpose's columns are the rows.
            tensor.rotation.extend(
                pose.rotation
                    .matrix()
                    .transpose()
                    .iter()
                    .map(|value| *value as f32),
            );
        }
        if tensor
            .translation
            .iter()
            .chain(&tensor.rotation)
            .all(|value| value.is_finite())
        {
            Ok(tensor)
        } else {
            Err(Error::Parameter {
                what: "window",
                expected: "finite poses within the range of f32 after scaling",
                found: "NaN or infinity".to_owned(),
            })
        }
    }
}

fn poses_of<'a>(window: &Window, trajectories: &'a [Trajectory]) -> Result<&'a [Pose], Error> {
    window.poses(trajectories).ok_or_else(|| Error::Parameter {
        what: "window",
        expected: "within one of the logs",
        found: format!("{window:?} with {} logs", trajectories.len()),
    })
}

/// `max_i |p_i - p_0|_inf`, metres.
fn largest_displacement(poses: &[Pose]) -> f64 {
    let first = poses
        .first()
        .map_or_else(Vector::zeros, |pose| pose.translation);
    poses
        .iter()
        .map(|pose| (pose.translation - first).amax())
        .fold(0.0, f64::max)
}

fn positive_or_one(value: f64) -> f64 {
    if value > STANDING && value.is_finite() {
        value
    } else {
        1.0
    }
}

/// Paper, section on data: positions relative to the first pose, divided by the maximum translation.
fn paper(poses: &[Pose], scaling: Scaling) -> Vec<Pose> {
    let (scale, factor) = match scaling {
        Scaling::Stored {
            translation,
            rotation,
        } => (translation, rotation),
        _ => (positive_or_one(largest_displacement(poses)), 1.0),
    };
    let first = poses[0].translation;
    poses
        .iter()
        .map(|pose| Pose {
            rotation: if factor == 1.0 {
                pose.rotation
            } else {
                so3::scale(factor, &pose.rotation)
            },
            translation: (pose.translation - first) / scale,
        })
        .collect()
}

fn motion(poses: &[Pose], frame: Frame, scaling: Scaling) -> Vec<Pose> {
    let (scale, factor) = scaling.stored().unwrap_or(([1.0; 3], [1.0; 3]));
    let (scale, factor) = (Vector::from(scale), Vector::from(factor));
    let axes = frame.to_forward_left_up();
    motions(poses)
        .map(|step| {
            let mut tangent = (axes * so3::log(&step.rotation)).component_mul(&factor);
            let angle = tangent.norm();
            if angle > LARGEST_ANGLE {
                tangent *= LARGEST_ANGLE / angle;
            }
            Pose {
                rotation: so3::exp(&tangent),
                translation: (axes * step.translation).component_div(&scale),
            }
        })
        .collect()
}

fn fit_motion(trajectories: &[Trajectory], windows: &[Window]) -> Result<Scaling, Error> {
    let mut squares = 0.0;
    let mut angles = Vec::new();
    for window in windows {
        for step in motions(poses_of(window, trajectories)?) {
            squares += step.translation.norm_squared();
            angles.push(so3::log(&step.rotation).norm());
        }
    }
    if angles.is_empty() {
        return Ok(Scaling::Stored {
            translation: 1.0,
            rotation: 1.0,
        });
    }
    let count = angles.len() as f64;
    let translation = positive_or_one((squares / count).sqrt());
    let angle = (angles.iter().map(|angle| angle * angle).sum::<f64>() / count).sqrt();
    angles.sort_by(f64::total_cmp);
    let rank = ((count * UNCLIPPED) as usize).min(angles.len() - 1);
    let largest = angles[rank];
    let rotation = if angle > STANDING {
        (ROTATION_TARGET / angle).min(LARGEST_ANGLE / largest.max(STANDING))
    } else {
        1.0
    };
    Ok(Scaling::Stored {
        translation,
        rotation,
    })
}

fn fit_axes(trajectories: &[Trajectory], windows: &[Window]) -> Result<Scaling, Error> {
    let (mut steps, mut turns) = (Vector::zeros(), Vector::zeros());
    let mut tangents = Vec::new();
    for window in windows {
        let poses = poses_of(window, trajectories)?;
        let axes = trajectories[window.trajectory].frame.to_forward_left_up();
        for step in motions(poses) {
            let tangent = axes * so3::log(&step.rotation);
            steps += (axes * step.translation).map(|x| x * x);
            turns += tangent.map(|x| x * x);
            tangents.push(tangent);
        }
    }
    let count = tangents.len().max(1) as f64;
    // An axis that hardly moves is not blown up into rounding errors.
    let rms = |squares: Vector| {
        let rms = (squares / count).map(f64::sqrt);
        rms.map(|axis| positive_or_one(axis.max(rms.max() * SMALLEST_AXIS)))
    };
    let (translation, angles) = (rms(steps), rms(turns));
    let mut rotation = angles.map(|angle| ROTATION_TARGET / angle);
    if turns == Vector::zeros() {
        rotation = Vector::repeat(1.0);
    }
    let mut angles: Vec<f64> = tangents
        .iter()
        .map(|tangent| tangent.component_mul(&rotation).norm())
        .collect();
    angles.sort_by(f64::total_cmp);
    let rank = (count * UNCLIPPED) as usize;
    if let Some(largest) = angles.get(rank.min(angles.len().saturating_sub(1))) {
        rotation *= (LARGEST_ANGLE / largest.max(STANDING)).min(1.0);
    }
    Ok(Scaling::StoredAxes {
        translation: translation.into(),
        rotation: rotation.into(),
    })
}
