//! From raw values to a [`Trajectory`]: the repairs and refusals that all formats share.

use std::collections::HashSet;
use std::path::{Path, PathBuf};

use dose3_lie::{Matrix, Pose, ProjectionError, Rotation, Vector, so3};
use nalgebra::{Quaternion, UnitQuaternion};

use super::plausible;
#[cfg(feature = "recordings")]
use super::table::check_coordinate;
use crate::error::Place;
use crate::{
    Error, Format, LoadOptions, LoadReport, LostKind, LostSpan, Rate, RateSource, ReadOption,
    Remark, RemarkKind, RowKind, StampUnit, Trajectory, naming, stretch,
};

/// Deviation of a matrix from orthogonality that rounding to seven digits explains.
const MATRIX_ROUNDING: f64 = 1e-5;
/// Deviation of a quaternion's norm that rounding to four decimals explains.
const QUATERNION_ROUNDING: f64 = 1e-3;

/// Dates in nanoseconds are larger than this, stamps from the start of a recording smaller (three years).
const A_DATE: i64 = 100_000_000_000_000_000;
/// The identity counts as lost tracking where the log jumps there by this many typical steps.
const IDENTITY_JUMP: f64 = 4.0;

/// Collects the poses of one file.
pub(crate) struct Collector<'a> {
    path: &'a Path,
    options: &'a LoadOptions,
    /// What was repaired so far.
    pub report: LoadReport,
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

    /// About so many poses will come.
    pub fn expect(&mut self, poses: usize) {
        self.stamps.reserve(poses);
        self.poses.reserve(poses);
        self.rows.reserve(poses);
        self.indices.reserve(poses);
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

    /// A log whose own stamps give the rate.
    pub fn finish(self, format: Format) -> Result<Trajectory, Error> {
        self.build(format, RateSource::Stamps, 1.0)
    }

    /// A log whose stamps were made up, from a nominal rate or the one given, unless a file of times was taken.
    pub fn finish_without_stamps(mut self, format: Format) -> Result<Trajectory, Error> {
        for span in &mut self.report.lost {
            (span.first_stamp, span.last_stamp) = (None, None);
        }
        if let Some((path, times)) = self.times.take()
            && self.options.rate.is_none()
        {
            return self.with_times(format, &path, &times);
        }
        let (hertz, source) = self.hertz(format);
        if source == RateSource::Unknown {
            let text = format!(
                "the file says neither when its poses were nor their rate: {hertz} Hz is put in; say the rate{}",
                if format.frame() == crate::Frame::Sensor {
                    ". Nor does it say what the body's axes are"
                } else {
                    ""
                }
            );
            let remark = Remark::new(RemarkKind::UnknownRate, text).option(ReadOption::Rate);
            self.report.remarks.push(remark);
        }
        self.build(format, source, hertz)
    }

    fn with_times(
        mut self,
        format: Format,
        path: &Path,
        times: &[(usize, i64)],
    ) -> Result<Trajectory, Error> {
        // A cut-off last pose leaves its stamp without a partner.
        let expected = self.seen + self.report.truncated_tail;
        if times.len() != expected && times.len() != self.seen {
            return Err(Error::input(
                path,
                Place::File,
                format!(
                    "{expected} stamps, one for each pose of {}",
                    self.path.display()
                ),
                times.len().to_string(),
                "the times belong to another sequence, or one of the two files is cut off; \
                 without a times file the nominal 10 Hz is taken",
            ));
        }
        let (poses, rows) = (
            std::mem::take(&mut self.poses),
            std::mem::take(&mut self.rows),
        );
        let (indices, breaks) = (
            std::mem::take(&mut self.indices),
            std::mem::take(&mut self.breaks),
        );
        self.stamps.clear();
        self.stamps_in(StampUnit::Seconds);
        for (number, ((pose, row), index)) in poses.into_iter().zip(rows).zip(indices).enumerate() {
            let Some((line, stamp)) = times.get(index).copied() else {
                break;
            };
            if breaks.contains(&number) {
                self.start_stretch();
            }
            // The stamps are the part that can be out of order: errors name the times file.
            if let Some((last, _)) = self.last()
                && stamp < last
            {
                return Err(Error::input(
                    path,
                    Place::Line(line),
                    format!("a stamp after {} s", StampUnit::Seconds.write(last)),
                    format!("{} s", StampUnit::Seconds.write(stamp)),
                    "sort the poses by their stamps, or cut the log where the clock was reset",
                ));
            }
            self.push_row(Place::Line(line), row, stamp, pose)?;
        }
        self.finish(format)
    }

    fn build(
        mut self,
        format: Format,
        source: RateSource,
        hertz: f64,
    ) -> Result<Trajectory, Error> {
        self.refuse_shared_stamps()?;
        self.lose_identities()?;
        self.leave_out_zero_stamps();
        if self.poses.len() < 2 {
            let lost = self.report.lost_rows();
            let found = match self.poses.len() {
                0 if lost > 0 => format!("none, {lost} rows without a pose"),
                0 => "none".to_owned(),
                _ => "one".to_owned(),
            };
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
        let hertz = match source {
            RateSource::Stamps => {
                stretch::median_step(&self.stamps).map_or(hertz, |step| 1.0 / step)
            }
            _ => hertz,
        };
        let (name, group) = naming::name(self.path, format);
        let mut trajectory = Trajectory {
            name,
            group,
            path: self.path.to_path_buf(),
            format,
            frame: format.frame(),
            rate: Rate { hertz, source },
            row_kind: self.row_kind,
            rows: self.rows,
            stamp_unit: self.stamp_unit,
            source: None,
            stamps: self.stamps,
            poses: self.poses,
            breaks: self.breaks,
            max_gap: self.options.max_gap,
            report: self.report,
        };
        let stretches = stretch::stretches(&trajectory, trajectory.max_gap);
        trajectory.report.gaps = stretches.len() - 1 - trajectory.breaks.len();
        plausible::remark(&mut trajectory, &stretches);
        Ok(trajectory)
    }

    /// Refuses a log most of whose rows have a stamp that another row has, too.
    fn refuse_shared_stamps(&self) -> Result<(), Error> {
        let (kept, shared) = (self.poses.len(), self.report.conflicting_stamps);
        if shared <= kept || self.stamp_unit.is_none() {
            return Ok(());
        }
        let all = kept + shared + self.report.repeated_poses;
        let unit = self.stamp_unit.unwrap_or(StampUnit::Seconds);
        let (found, hint) = if let [stamp] = self.stamps[..] {
            (
                format!(
                    "the stamp {} {} on all {all} rows",
                    unit.write(stamp),
                    unit.symbol()
                ),
                "were the stamps kept in 32-bit floating point? Write them with all digits, or say the rate",
            )
        } else if self.stamps.iter().all(|stamp| stamp % 1_000_000_000 == 0) {
            (
                format!("{all} rows with {kept} stamps in whole seconds"),
                "the stamps lost their decimals; write them with all digits, or say the rate",
            )
        } else {
            (
                format!("{all} rows with {kept} different stamps"),
                "were the stamps kept in 32-bit floating point? Write them with all digits, or say the rate",
            )
        };
        Err(Error::input(
            self.path,
            Place::File,
            "a stamp of its own on each row",
            found,
            hint,
        )
        .option(ReadOption::Rate))
    }

    /// Takes out what says that tracking was lost by being the identity.
    fn lose_identities(&mut self) -> Result<(), Error> {
        let named = self.options.lost.contains(&LostKind::Identity);
        if !named && !self.options.lost.is_empty() {
            return Ok(());
        }
        let identity: Vec<bool> = self
            .poses
            .iter()
            .map(|pose| *pose == Pose::identity())
            .collect();
        if !identity.contains(&true) || identity.iter().all(|lost| *lost) {
            return Ok(());
        }
        let mut steps: Vec<f64> = (1..self.poses.len())
            .filter(|index| !identity[*index] && !identity[index - 1])
            .map(|index| (self.poses[index].translation - self.poses[index - 1].translation).norm())
            .collect();
        steps.sort_by(f64::total_cmp);
        let typical = steps.get(steps.len() / 2).copied().unwrap_or(0.0);
        let far = |index: usize| self.poses[index].translation.norm() > IDENTITY_JUMP * typical;
        let mut lost = vec![false; identity.len()];
        let mut start = 0;
        while start < identity.len() {
            let same = identity[start..]
                .iter()
                .take_while(|other| **other == identity[start]);
            let end = start + same.count();
            let before = start.checked_sub(1);
            let after = (end < identity.len()).then_some(end);
            let jumps = typical > 0.0 && before.is_none_or(far) && after.is_none_or(far);
            if identity[start] && (named || jumps) {
                lost[start..end].fill(true);
            }
            start = end;
        }
        self.take_out(&lost)
    }

    /// Removes poses, as lost by the identity.
    fn take_out(&mut self, lost: &[bool]) -> Result<(), Error> {
        if !lost.contains(&true) {
            return Ok(());
        }
        let (stamps, poses) = (
            std::mem::take(&mut self.stamps),
            std::mem::take(&mut self.poses),
        );
        let (rows, indices) = (
            std::mem::take(&mut self.rows),
            std::mem::take(&mut self.indices),
        );
        let breaks: HashSet<usize> = std::mem::take(&mut self.breaks).into_iter().collect();
        let mut spans = std::mem::take(&mut self.report.lost).into_iter().peekable();
        for index in 0..poses.len() {
            while let Some(mut span) = spans.next_if(|span| span.before <= index) {
                span.before = self.poses.len();
                self.start_stretch();
                self.report.lost.push(span);
            }
            if breaks.contains(&index) {
                self.start_stretch();
            }
            if lost[index] {
                let stamp = self.stamp_unit.map(|_| stamps[index]);
                let place = match self.row_kind {
                    RowKind::Line => Place::Line(rows[index] as usize),
                    RowKind::Message => Place::Message(rows[index] as usize),
                    _ => Place::Pose(rows[index] as usize),
                };
                self.lose(place, rows[index], stamp, LostKind::Identity)?;
                continue;
            }
            self.stamps.push(stamps[index]);
            self.poses.push(poses[index]);
            self.rows.push(rows[index]);
            self.indices.push(indices[index]);
        }
        let before = self.poses.len();
        self.report
            .lost
            .extend(spans.map(|span| LostSpan { before, ..span }));
        Ok(())
    }

    /// Leaves out first stamps of (nearly) zero before dates, which were never filled in.
    fn leave_out_zero_stamps(&mut self) {
        let early = self.stamps.partition_point(|stamp| *stamp < A_DATE / 100);
        let dates = self
            .stamps
            .get(self.stamps.len() / 2)
            .is_some_and(|stamp| *stamp > A_DATE);
        if early == 0 || !dates || early > 1 + self.stamps.len() / 10 {
            return;
        }
        let unit = self.stamp_unit.unwrap_or(StampUnit::Seconds);
        let text = format!(
            "{} {} has the stamp {} {} while the others are dates like {}: {early} row(s) at the start left out",
            self.row_kind,
            self.rows[0],
            unit.write(self.stamps[0]),
            unit.symbol(),
            unit.write(self.stamps[early]),
        );
        self.report
            .remarks
            .push(Remark::new(RemarkKind::OutlierStamp, text));
        self.stamps.drain(..early);
        self.poses.drain(..early);
        self.rows.drain(..early);
        self.indices.drain(..early);
        self.breaks = self
            .breaks
            .iter()
            .filter_map(|index| index.checked_sub(early))
            .collect();
        for span in &mut self.report.lost {
            span.before = span.before.saturating_sub(early);
        }
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
