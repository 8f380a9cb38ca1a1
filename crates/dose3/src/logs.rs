//! Reading logs with a user's overrides.

use crate::error::{Error, Result, Setting};
use dose3_datasets::{
    Format, Frame, Kind, LoadOptions, RateSource, Representation, Trajectory, load_all, resample,
    same_rate,
};
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

/// What a user may say about logs whose files do not.
#[derive(Clone, Debug)]
pub struct ReadOptions {
    /// Format, where content should not decide.
    pub format: Option<Format>,
    /// Body frame, where the format's is wrong.
    pub frame: Option<Frame>,
    /// Rate of logs without stamps, hertz.
    pub nominal_rate: Option<f64>,
    /// Metres in one unit of position.
    pub unit: f64,
    /// Stamps of a KITTI log.
    pub times: Option<PathBuf>,
    /// Longest step that is not a gap, seconds.
    pub max_gap: Option<f64>,
}

impl Default for ReadOptions {
    fn default() -> Self {
        Self {
            format: None,
            frame: None,
            nominal_rate: None,
            unit: 1.0,
            times: None,
            max_gap: None,
        }
    }
}

/// Reads every log under `paths`.
///
/// # Errors
/// The first log that cannot be read; options out of range.
pub fn read(paths: &[PathBuf], options: &ReadOptions) -> Result<Vec<Trajectory>> {
    if !(options.unit.is_finite() && options.unit > 0.0) {
        let expected = "a positive number of metres";
        return Err(Error::setting(Setting::Unit, options.unit, expected));
    }
    if let Some(rate) = options
        .nominal_rate
        .filter(|r| !(r.is_finite() && *r > 0.0))
    {
        let expected = "a positive number of hertz";
        return Err(Error::setting(Setting::NominalRate, rate, expected));
    }
    let load = LoadOptions {
        format: options.format,
        times: options.times.clone(),
        max_gap: options.max_gap,
        ..LoadOptions::default()
    };
    let mut trajectories = load_all(paths, &load)?;
    for t in &mut trajectories {
        apply(t, options)?;
    }
    Ok(trajectories)
}

fn apply(t: &mut Trajectory, options: &ReadOptions) -> Result<()> {
    if let Some(frame) = options.frame {
        t.frame = frame;
    }
    if options.unit != 1.0 {
        t.poses
            .iter_mut()
            .for_each(|p| p.translation *= options.unit);
    }
    if let Some(hertz) = options.nominal_rate {
        if t.rate.source == RateSource::Stamps {
            return Err(Error::HasStamps {
                log: t.name.clone(),
                hertz: t.rate.hertz,
            });
        }
        let step = 1e9 / hertz;
        for (i, stamp) in t.stamps.iter_mut().enumerate() {
            *stamp = (i as f64 * step).round() as i64;
        }
        t.rate.hertz = hertz;
    }
    Ok(())
}

/// A log that steps this many times farther than the model's data is in another unit. The other
/// way round proves nothing: logs may stand still.
const UNIT_FACTOR: f64 = 100.0;

/// Median distance between consecutive poses, metres.
fn median_step(t: &Trajectory) -> f64 {
    let mut steps: Vec<f64> = t
        .poses
        .windows(2)
        .map(|pair| (pair[1].translation - pair[0].translation).norm())
        .collect();
    steps.sort_by(f64::total_cmp);
    steps.get(steps.len() / 2).copied().unwrap_or_default()
}

/// What a log must be like to be judged.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Needs {
    /// How poses become numbers.
    pub representation: Representation,
    /// Whether statistics are taken of metres and radians per pose in the body frame, past the
    /// representation (`kinematic`).
    pub metric: bool,
    /// Rate of the data it was made from, hertz.
    pub rate: f64,
    /// Body frame of that data.
    pub frame: Frame,
}

impl Needs {
    /// Whether time and axes matter, not only the order of poses.
    pub fn exacting(&self) -> bool {
        self.metric || self.representation.kind == Kind::Motion
    }

    /// Known axes are compared as they are mapped (forward-left-up where there is a forward axis);
    /// unknown ones only with logs of the same source.
    fn accepts(&self, frame: Frame) -> bool {
        frame == self.frame || (self.frame != Frame::Sensor && frame != Frame::Sensor)
    }
}

/// Fits a log to what it is to be judged by. A `paper` model counts poses, so another rate is only
/// noted; where time and axes matter, a faster log is interpolated down, and a slower one, one in
/// another kind of frame or in another unit is refused. Answers
/// the notes for the user.
///
/// # Errors
/// A log that does not fit.
pub fn conform(trajectory: Trajectory, needs: &Needs) -> Result<(Trajectory, Vec<String>)> {
    let mut notes = Vec::new();
    let (own, rate) = (trajectory.rate.hertz, needs.rate);
    let (name, ratio) = (&trajectory.name, own / rate);
    let nominal = trajectory.rate.source == RateSource::Nominal;
    if nominal {
        notes.push(format!(
            "no stamps in the file: {own:.4} Hz is the data set's nominal rate"
        ));
    }
    if !needs.exacting() {
        if !same_rate(own, rate) {
            notes.push(format!(
                "the log has {own:.4} Hz, the trusted logs {rate:.4} Hz; a paper model counts \
                 poses, so a window spans another time"
            ));
        }
        return Ok((trajectory, notes));
    }
    if !needs.accepts(trajectory.frame) {
        return Err(Error::Frame {
            log: name.clone(),
            found: trajectory.frame,
            expected: needs.frame,
        });
    }
    if trajectory.frame.has_forward() != needs.frame.has_forward() {
        notes.push(format!(
            "the log is in frame {}, the trusted logs in {}: another kind of body, its axes are \
             compared as they are",
            trajectory.frame, needs.frame
        ));
    }
    if let Some((translation, _)) = needs.representation.scaling.stored() {
        let translation = translation.into_iter().fold(0.0, f64::max);
        let step = median_step(&trajectory) * ratio;
        if step > translation * UNIT_FACTOR {
            return Err(Error::NotMetres {
                log: name.clone(),
                step,
                expected: translation,
            });
        }
    }
    if same_rate(own, rate) {
        return Ok((trajectory, notes));
    }
    if own < rate {
        return Err(Error::TooSlow {
            log: name.clone(),
            found: own,
            needed: rate,
            nominal,
        });
    }
    notes.push(format!(
        "interpolated from {own:.4} Hz down to {rate:.4} Hz"
    ));
    Ok((resample(&trajectory, rate)?, notes))
}
