//! From raw values to a log: the repairs and refusals that all formats share.

mod finish;
mod lost;

use std::path::{Path, PathBuf};

use dose3_lie::{Matrix, Pose, ProjectionError, Rotation, Vector, so3};
use nalgebra::{Quaternion, UnitQuaternion};

use crate::error::Place;
#[cfg(feature = "recordings")]
use crate::read::table::check_coordinate;
use crate::{
    Error, Format, LoadOptions, LoadReport, LostKind, LostSpan, Rate, RateSource, ReadOption,
    RowKind, StampUnit,
};

/// Deviation of a matrix from orthogonality that rounding to seven digits explains.
const MATRIX_ROUNDING: f64 = 1e-5;
/// Deviation of a quaternion's norm that rounding to four decimals explains.
const QUATERNION_ROUNDING: f64 = 1e-3;

/// Dates in nanoseconds are larger than this, stamps from the start of a recording smaller (three years).
const A_DATE: i64 = 100_000_000_000_000_000;

/// Collects the poses of one file.
pub(crate) struct Collector<'a> {
    path: &'a Path,
    options: &'a LoadOptions,
    /// What was repaired so far.
    pub report: LoadReport,
    /// Whether poses are chained from relative ones: the first is the identity, and another one says nothing.
    pub chained: bool,
    stamps: Vec<i64>,
    poses: Vec<Pose>,
    rows: Vec<u64>,
    /// Place of each pose among all rows, lost ones too, of files without stamps.
    indices: Vec<usize>,
    index: usize,
    seen: usize,
    breaks: Vec<usize>,
    stamp_unit: Option<StampUnit>,
    row_kind: RowKind,
    times: Option<(PathBuf, Vec<(usize, i64)>)>,
    /// Deviation from orthogonality that the digits of the file explain.
    coarseness: f64,
}

impl<'a> Collector<'a> {
    pub fn new(path: &'a Path, options: &'a LoadOptions) -> Self {
        Self {
            path,
            options,
            report: LoadReport::default(),
            chained: false,
            stamps: Vec::new(),
            poses: Vec::new(),
            rows: Vec::new(),
            indices: Vec::new(),
            index: 0,
            seen: 0,
            breaks: Vec::new(),
            stamp_unit: None,
            row_kind: RowKind::Line,
            times: None,
            coarseness: 0.0,
        }
    }

    /// A collector for some rows of the same file, which only counts repairs.
    pub fn part(&self) -> Self {
        Self {
            coarseness: self.coarseness,
            ..Self::new(self.path, self.options)
        }
    }

    /// Adds what was repaired in some rows.
    pub fn add_repairs(&mut self, part: &LoadReport) {
        let report = &mut self.report;
        report.truncated_tail += part.truncated_tail;
        report.quaternions_normalised += part.quaternions_normalised;
        report.rotations_projected += part.rotations_projected;
        report.largest_rotation_error = report
            .largest_rotation_error
            .max(part.largest_rotation_error);
    }

    /// The file has stamps, in this unit.
    pub fn stamps_in(&mut self, unit: StampUnit) {
        self.stamp_unit = Some(unit);
    }

    /// The stamps of the file say nothing.
    #[cfg(feature = "recordings")]
    pub fn have_no_stamps(&mut self) {
        self.stamp_unit = None;
    }

    /// Refuses a coordinate that no log has.
    #[cfg(feature = "recordings")]
    pub fn check_coordinate(&self, place: Place, value: f64) -> Result<(), Error> {
        check_coordinate(self.path, place, value)
    }

    /// What the rows of this file are.
    pub fn rows_are(&mut self, kind: RowKind) {
        self.row_kind = kind;
    }

    /// Matrices are written with so few decimals that they are this far from orthogonal.
    pub fn matrices_are_coarse(&mut self, deviation: f64) {
        self.coarseness = deviation;
    }

    /// Stamps that another file holds for the rows of this one, with their lines.
    pub fn take_times(&mut self, path: PathBuf, stamps: Vec<(usize, i64)>) {
        self.times = Some((path, stamps));
    }

    /// The last pose taken and its stamp.
    pub fn last(&self) -> Option<(i64, Pose)> {
        Some((*self.stamps.last()?, *self.poses.last()?))
    }

    /// Number of rows seen without a stamp.
    pub fn seen(&self) -> usize {
        self.seen
    }

    /// The next pose starts a new stretch.
    pub fn start_stretch(&mut self) {
        if self.breaks.last() != Some(&self.poses.len()) {
            self.breaks.push(self.poses.len());
        }
    }

    /// The stamp of row `index` of a file without stamps.
    pub fn nominal(&mut self, format: Format, index: usize) -> i64 {
        self.index = index;
        self.seen = self.seen.max(index.saturating_add(1));
        nominal_stamp(index, self.hertz(format).0)
    }

    /// The stamp of the next row of a file without stamps.
    pub fn next_nominal(&mut self, format: Format) -> i64 {
        self.nominal(format, self.seen)
    }

    /// The stamps of rows of a file without stamps.
    pub fn nominal_stamps(&self, format: Format, rows: std::ops::Range<usize>) -> Vec<i64> {
        let hertz = self.hertz(format).0;
        rows.map(|index| nominal_stamp(index, hertz)).collect()
    }

    /// Leaves the places of missing frames empty, up to frame `index`.
    pub fn skip_to(&mut self, index: usize) {
        self.report.missing_frames += index.saturating_sub(self.seen);
        self.seen = self.seen.max(index);
    }

    fn hertz(&self, format: Format) -> (f64, RateSource) {
        match (self.options.rate, format.nominal_rate()) {
            (Some(hertz), _) => (hertz, RateSource::Given),
            (None, Some(hertz)) => (hertz, RateSource::Nominal),
            (None, None) => (Rate::UNKNOWN_HERTZ, RateSource::Unknown),
        }
    }

    /// Whether rows of this kind count as lost.
    pub fn looks_for(&self, kind: LostKind) -> bool {
        self.options.lost.is_empty() || self.options.lost.contains(&kind)
    }

    /// Counts a row without a pose; the next pose starts a new stretch.
    pub fn lose(
        &mut self,
        place: Place,
        row: u64,
        stamp: Option<i64>,
        kind: LostKind,
    ) -> Result<(), Error> {
        if self.options.strict {
            return Err(self.strict_fault(place, kind));
        }
        self.start_stretch();
        let before = self.poses.len();
        match self.report.lost.last_mut() {
            Some(span) if span.before == before => {
                span.last_row = row;
                span.rows += 1;
                span.last_stamp = stamp;
            }
            _ => self.report.lost.push(LostSpan {
                kind,
                first_row: row,
                last_row: row,
                rows: 1,
                before,
                first_stamp: stamp,
                last_stamp: stamp,
            }),
        }
        Ok(())
    }

    fn strict_fault(&self, place: Place, kind: LostKind) -> Error {
        let found = match kind {
            LostKind::Nan => "no value (NaN or infinity)",
            LostKind::Zero => "zeros for a rotation",
            LostKind::Identity => "the identity in the midst of the log",
        };
        let hint = "tracking was lost there; reading that is not strict counts it as a gap";
        Error::input(self.path, place, "a pose", found, hint).option(ReadOption::Lost)
    }

    /// Takes a pose. Its stamp must not lie before the last one.
    ///
    /// The same stamp again is a repetition (dropped) or a conflict (dropped too, the first wins): both happen
    /// in real logs and neither needs a guess. A stamp that runs backward means a reset clock or shuffled
    /// lines; sorting would hide exactly the fault a log is tested for, so it is an error. A stamp of zero among
    /// dates was never filled in.
    pub fn push(&mut self, place: Place, stamp: i64, pose: Pose) -> Result<(), Error> {
        let row = match place {
            Place::Line(row) | Place::Array(row) | Place::Pose(row) | Place::Message(row) => {
                row as u64
            }
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
            if stamp == 0 && last_stamp > A_DATE {
                return self.lose(place, row, Some(stamp), LostKind::Zero);
            }
            if stamp < last_stamp {
                let unit = self.stamp_unit.unwrap_or(StampUnit::Seconds);
                return Err(Error::input(
                    self.path,
                    place,
                    format!("a stamp after {} {}", unit.write(last_stamp), unit.symbol()),
                    format!(
                        "{} {}, {:.6} s back",
                        unit.write(stamp),
                        unit.symbol(),
                        last_stamp.abs_diff(stamp) as f64 * 1e-9
                    ),
                    "sort the file by its stamps, or cut it where the clock was reset",
                ));
            }
            if stamp == last_stamp {
                self.report.repeated_stamps.push(stamp);
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
        self.indices.push(self.index);
        Ok(())
    }

    /// Whether these stamps increase, and are after the last one taken.
    pub fn follows(&self, stamps: &[i64]) -> bool {
        let after = |first: &i64| self.stamps.last().is_none_or(|last| last < first);
        stamps.first().is_none_or(after) && stamps.windows(2).all(|pair| pair[0] < pair[1])
    }

    /// Takes rows whose stamps follow, as [`Self::push_row`] would take each; `first` is the place of the first among the
    /// rows of a file without stamps.
    pub fn append(
        &mut self,
        mut stamps: Vec<i64>,
        rows: &mut Vec<u64>,
        poses: &mut Vec<Pose>,
        first: Option<usize>,
    ) {
        match first {
            None => {
                let count = self.indices.len() + stamps.len();
                self.indices.resize(count, self.index);
            }
            Some(first) => {
                self.indices.extend(first..first + stamps.len());
                self.seen = self.seen.max(first + stamps.len());
                self.index = self.seen.saturating_sub(1);
            }
        }
        move_behind(&mut self.stamps, &mut stamps);
        move_behind(&mut self.rows, rows);
        move_behind(&mut self.poses, poses);
    }

    /// The rotation nearest to a matrix of `path` (a folder's log has a file for each), within the tolerance.
    pub fn rotation(
        &mut self,
        path: &Path,
        place: Place,
        matrix: &Matrix,
    ) -> Result<Rotation, Error> {
        let tolerance = self.options.rotation_tolerance.max(self.coarseness);
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
}

/// Moves what is in `more` behind what is in `all`, without a copy where that is empty.
fn move_behind<T>(all: &mut Vec<T>, more: &mut Vec<T>) {
    if all.is_empty() {
        std::mem::swap(all, more);
    } else {
        all.append(more);
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
            "is the matrix scaled, or row- and column-major confused?"
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
