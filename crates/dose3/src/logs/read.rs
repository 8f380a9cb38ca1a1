//! Reading logs with what a user says about them.

use super::list;
use crate::error::{Error, Result, Setting};
use dose3_datasets::{
    Frame, LoadOptions, Rate, RateSource, ReadOption, Remark, RemarkKind, Trajectory, load_all,
    make_unique,
};
use std::path::PathBuf;

/// What a user may say about logs whose files do not.
#[derive(Clone, Debug, PartialEq)]
pub struct ReadOptions {
    /// How files are read: format, stamps, columns, gaps.
    pub load: LoadOptions,
    /// Body frame of logs whose format does not say it.
    pub frame: Option<Frame>,
    /// Body frames of single logs, by name, whatever their format says.
    pub frames: Vec<(String, Frame)>,
    /// Rate of logs without stamps, or whose stamps only count poses, hertz.
    pub nominal_rate: Option<f64>,
    /// Metres in one unit of position; other than 1, it replaces what a header says.
    pub unit: f64,
}

impl Default for ReadOptions {
    fn default() -> Self {
        Self {
            load: LoadOptions::default(),
            frame: None,
            frames: Vec::new(),
            nominal_rate: None,
            unit: 1.0,
        }
    }
}

/// Reads every log under `paths`.
///
/// # Errors
/// The first log that cannot be read; options out of range.
pub fn read(paths: &[PathBuf], options: &ReadOptions) -> Result<Vec<Trajectory>> {
    options.check()?;
    let mut trajectories = load_all(paths, &options.load)?;
    for t in &mut trajectories {
        apply(t, options)?;
    }
    Ok(trajectories)
}

/// Reads every log under `paths` on its own: a log that cannot be read does not stop the others. Names are unique
/// among those that were read; a log that two paths name is read once.
///
/// # Errors
/// Options out of range.
pub fn read_each(
    paths: &[PathBuf],
    options: &ReadOptions,
) -> Result<Vec<(PathBuf, Result<Trajectory>)>> {
    Ok(find_each(paths, options)?.logs)
}

/// What was found under some paths.
#[derive(Debug, Default)]
pub struct Found {
    /// Every log with its path, or what is wrong with it.
    pub logs: Vec<(PathBuf, Result<Trajectory>)>,
    /// Files in folders that are no logs, and why.
    pub skipped: Vec<(PathBuf, String)>,
}

/// As [`read_each`], with the files in folders that were passed over.
///
/// # Errors
/// Options out of range.
pub fn find_each(paths: &[PathBuf], options: &ReadOptions) -> Result<Found> {
    let listing = list(paths, options)?;
    let mut read: Vec<(PathBuf, Result<Trajectory>)> = Vec::new();
    for file in &listing.files {
        let logs = file.read(options).into_iter();
        read.extend(logs.map(|log| (file.path.clone(), log)));
    }
    make_unique(read.iter_mut().filter_map(|(_, log)| log.as_mut().ok()));
    Ok(Found {
        logs: read,
        skipped: listing.skipped,
    })
}

impl ReadOptions {
    /// Checks the numbers.
    ///
    /// # Errors
    /// [`Error::Setting`] for a unit or a rate that is not positive.
    pub fn check(&self) -> Result<()> {
        if !(self.unit.is_finite() && self.unit > 0.0) {
            let expected = "a positive number of metres";
            return Err(Error::setting(Setting::Unit, self.unit, expected));
        }
        let not_positive = |rate: &f64| !(rate.is_finite() && *rate > 0.0);
        if let Some(rate) = self.nominal_rate.filter(not_positive) {
            let expected = "a positive number of hertz";
            return Err(Error::setting(Setting::NominalRate, rate, expected));
        }
        Ok(())
    }
}

/// Applies to a log what files of its kind do not say.
///
/// # Errors
/// [`Error::HasStamps`] where a nominal rate is named for a log with stamps.
pub fn apply(t: &mut Trajectory, options: &ReadOptions) -> Result<()> {
    apply_frame(t, options);
    if options.unit != 1.0 {
        // Who says the unit knows better than the header, which was obeyed.
        let factor = options.unit / t.report.length_unit.unwrap_or(1.0);
        t.poses.iter_mut().for_each(|p| p.translation *= factor);
    }
    if let Some(hertz) = options.nominal_rate {
        let counts = |remark: &Remark| remark.kind == RemarkKind::StampsAreAnIndex;
        if t.rate.source == RateSource::Stamps && !t.report.remarks.iter().any(counts) {
            return Err(Error::HasStamps {
                log: t.name.clone(),
                hertz: t.rate.hertz,
            });
        }
        let step = 1e9 / hertz;
        for (i, stamp) in t.stamps.iter_mut().enumerate() {
            *stamp = (i as f64 * step).round() as i64;
        }
        t.rate = Rate {
            hertz,
            source: RateSource::Nominal,
        };
        // What was remarked about the rate is settled.
        let settled = [RemarkKind::StampsAreAnIndex, RemarkKind::UnknownRate];
        let remarks = &mut t.report.remarks;
        remarks.retain(|remark| !settled.contains(&remark.kind));
    }
    Ok(())
}

/// A frame given for all logs is for those whose format does not say it; one given for this log holds in any case.
fn apply_frame(t: &mut Trajectory, options: &ReadOptions) {
    let own = options.frames.iter().find(|(log, _)| *log == t.name);
    let text = match (own, options.frame) {
        (Some((_, frame)), _) if *frame != t.frame => {
            let text = format!(
                "body frame {frame} as given for this log, its format says {}",
                t.frame
            );
            t.frame = *frame;
            text
        }
        (None, Some(frame)) if t.frame == Frame::Sensor => {
            t.frame = frame;
            return;
        }
        (None, Some(frame)) if frame != t.frame => format!(
            "body frame {} by the format; the frame given for all logs, {frame}, is for those of unknown frame",
            t.frame
        ),
        _ => return,
    };
    let remark = Remark {
        kind: RemarkKind::Frame,
        text,
        option: Some(ReadOption::Frame),
    };
    t.report.remarks.push(remark);
}
