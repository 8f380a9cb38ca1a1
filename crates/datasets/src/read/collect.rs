//! From raw values to a [`Trajectory`]: the repairs and refusals that all formats share.

use std::path::Path;

use dose3_lie::{Matrix, Pose, ProjectionError, Rotation, Vector, so3};
use nalgebra::{Quaternion, UnitQuaternion};

use crate::error::Place;
use crate::{
    Error, Format, LoadOptions, LoadReport, Rate, RateSource, RowKind, StampUnit, Trajectory,
    naming, stretch,
};

/// Deviation of a matrix from orthogonality that rounding to seven digits explains.
const MATRIX_ROUNDING: f64 = 1e-5;
/// Deviation of a quaternion's norm that rounding to four decimals explains.
const QUATERNION_ROUNDING: f64 = 1e-3;

/// Collects the poses of one file.
pub(crate) struct Collector<'a> {
    path: &'a Path,
    options: &'a LoadOptions,
    /// What was repaired so far.
    pub report: LoadReport,
    stamps: Vec<i64>,
    poses: Vec<Pose>,
    rows: Vec<u64>,
    breaks: Vec<usize>,
    stamp_unit: Option<StampUnit>,
}

impl<'a> Collector<'a> {
    pub fn new(path: &'a Path, options: &'a LoadOptions) -> Self {
        Self {
            path,
            options,
            report: LoadReport::default(),
            stamps: Vec::new(),
            poses: Vec::new(),
            rows: Vec::new(),
            breaks: Vec::new(),
            stamp_unit: None,
        }
    }

    /// The file has stamps, in this unit.
    pub fn stamps_in(&mut self, unit: StampUnit) {
        self.stamp_unit = Some(unit);
    }

    /// The last pose taken and its stamp.
    pub fn last(&self) -> Option<(i64, Pose)> {
        Some((*self.stamps.last()?, *self.poses.last()?))
    }

    /// Number of poses taken.
    pub fn len(&self) -> usize {
        self.poses.len()
    }

    /// The next pose starts a new stretch.
    pub fn start_stretch(&mut self) {
        if self.breaks.last() != Some(&self.poses.len()) {
            self.breaks.push(self.poses.len());
        }
    }

    /// Takes a pose. Its stamp must not lie before the last one.
    ///
    /// The same stamp again is a repetition (dropped) or a conflict (dropped too, the first wins): both happen
    /// in real logs and neither needs a guess. A stamp that runs backward means a reset clock or shuffled
    /// lines; sorting would hide exactly the fault a log is tested for, so it is an error.
    pub fn push(&mut self, place: Place, stamp: i64, pose: Pose) -> Result<(), Error> {
        let row = match place {
            Place::Line(row) | Place::Array(row) => row as u64,
            Place::File => self.poses.len() as u64,
        };
        self.push_row(place, row, stamp, pose)
    }

    /// As [`Self::push`], where the pose stands in row `row` and its stamp at `place`, perhaps of another file.
    pub fn push_row(
        &mut self,
        place: Place,
        row: u64,
        stamp: i64,
        pose: Pose,
    ) -> Result<(), Error> {
        if let Some((last_stamp, last_pose)) = self.last() {
            if stamp < last_stamp {
                return Err(Error::input(
                    self.path,
                    place,
                    format!("a stamp after {last_stamp} ns"),
                    format!(
                        "{stamp} ns, {:.6} s back",
                        last_stamp.abs_diff(stamp) as f64 * 1e-9
                    ),
                    "sort the file by its stamps, or cut it where the clock was reset",
                ));
            }
            if stamp == last_stamp {
                if pose == last_pose {
                    self.report.repeated_poses += 1;
                } else {
                    self.report.conflicting_stamps += 1;
                }
                return Ok(());
            }
        }
        self.stamps.push(stamp);
        self.poses.push(pose);
        self.rows.push(row);
        Ok(())
    }

    /// The rotation nearest to a matrix of `path` (a folder's log has a file for each), within the tolerance.
    pub fn rotation(
        &mut self,
        path: &Path,
        place: Place,
        matrix: &Matrix,
    ) -> Result<Rotation, Error> {
        let tolerance = self.options.rotation_tolerance;
        match so3::project(matrix, tolerance) {
            Ok(projected) => {
                self.report.largest_rotation_error =
                    self.report.largest_rotation_error.max(projected.error);
                if projected.error > MATRIX_ROUNDING {
                    self.report.rotations_projected += 1;
                }
                Ok(projected.rotation)
            }
            Err(fault) => Err(matrix_fault(path, place, &fault)),
        }
    }

    /// The rotation of a quaternion whose norm is 1 within the tolerance.
    pub fn quaternion(
        &mut self,
        place: Place,
        w: f64,
        x: f64,
        y: f64,
        z: f64,
    ) -> Result<Rotation, Error> {
        let quaternion = Quaternion::new(w, x, y, z);
        let norm = quaternion.norm();
        let error = (norm - 1.0).abs();
        if error.is_nan() || error > self.options.quaternion_tolerance {
            let hint = if norm < 1e-6 {
                "a zero quaternion is a pose that was never filled in; remove the line"
            } else {
                "are the columns in another order, or is this another format?"
            };
            let found = format!("norm {norm:.6} of ({w}, {x}, {y}, {z}) (w, x, y, z)");
            return Err(Error::input(
                self.path,
                place,
                "a unit quaternion",
                found,
                hint,
            ));
        }
        self.report.largest_rotation_error = self.report.largest_rotation_error.max(error);
        if error > QUATERNION_ROUNDING {
            self.report.quaternions_normalised += 1;
        }
        Ok(UnitQuaternion::from_quaternion(quaternion).to_rotation_matrix())
    }

    /// A log whose own stamps give the rate.
    pub fn finish(self, format: Format) -> Result<Trajectory, Error> {
        let step = stretch::median_step(&self.stamps);
        let rate = Rate {
            hertz: step.map_or(1.0, |step| 1.0 / step),
            source: RateSource::Stamps,
        };
        self.build(format, rate)
    }

    /// A log whose stamps were made up from the data set's nominal rate.
    pub fn finish_nominal(self, format: Format, hertz: f64) -> Result<Trajectory, Error> {
        self.build(
            format,
            Rate {
                hertz,
                source: RateSource::Nominal,
            },
        )
    }

    fn build(mut self, format: Format, rate: Rate) -> Result<Trajectory, Error> {
        if self.poses.len() < 2 {
            let found = if self.poses.is_empty() { "none" } else { "one" };
            return Err(Error::input(
                self.path,
                Place::File,
                "at least two poses",
                found,
                "a header or a single pose is no log; the recording may have failed",
            ));
        }
        self.breaks
            .retain(|index| *index > 0 && *index < self.poses.len());
        let (name, group) = naming::name(self.path, format);
        let mut trajectory = Trajectory {
            name,
            group,
            path: self.path.to_path_buf(),
            format,
            frame: format.frame(),
            rate,
            row_kind: match format {
                Format::Iros20 => RowKind::Record,
                Format::Iros20Poses => RowKind::File,
                _ => RowKind::Line,
            },
            rows: self.rows,
            stamp_unit: self.stamp_unit,
            source: None,
            stamps: self.stamps,
            poses: self.poses,
            breaks: self.breaks,
            max_gap: self.options.max_gap,
            report: self.report,
        };
        let stretches = stretch::stretches(&trajectory, trajectory.max_gap).len();
        trajectory.report.gaps = stretches - 1 - trajectory.breaks.len();
        Ok(trajectory)
    }
}

fn matrix_fault(path: &Path, place: Place, fault: &ProjectionError) -> Error {
    let hint = match fault {
        ProjectionError::NotFinite => "remove the poses without a value",
        ProjectionError::Reflection { .. } => {
            "the axes are left-handed: one axis is mirrored, or two columns are swapped"
        }
        ProjectionError::Singular { .. } => "the pose was never filled in, or columns are missing",
        ProjectionError::TooFar { .. } => {
            "is the matrix scaled, or row- and column-major confused? A larger rotation tolerance would accept it"
        }
    };
    Error::input(path, place, "a rotation matrix", fault.to_string(), hint)
}

/// `index` steps of `1 / hertz` seconds, in nanoseconds.
pub(crate) fn nominal_stamp(index: usize, hertz: f64) -> i64 {
    (index as f64 * 1e9 / hertz).round() as i64
}

/// `R = Rz(yaw) Ry(pitch) Rx(roll)`, radians.
pub(crate) fn euler_rotation(roll: f64, pitch: f64, yaw: f64) -> Rotation {
    Rotation::from_euler_angles(roll, pitch, yaw)
}

/// A pose from its parts.
pub(crate) fn pose(rotation: Rotation, translation: [f64; 3]) -> Pose {
    Pose {
        rotation,
        translation: Vector::from(translation),
    }
}
