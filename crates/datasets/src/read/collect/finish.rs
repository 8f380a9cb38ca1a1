//! The log that the rows of a file make.

use std::path::Path;

use super::Collector;
use crate::error::Place;
use crate::read::plausible;
use crate::{
    Error, Format, Rate, RateSource, ReadOption, Remark, RemarkKind, StampUnit, Trajectory, naming,
    stretch,
};

impl Collector<'_> {
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
}
