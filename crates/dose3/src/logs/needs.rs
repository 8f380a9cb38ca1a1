//! What a log must be like to be judged, and how it is brought there.

use super::Note;
use crate::error::{Error, Result};
use dose3_datasets::{Frame, Kind, RateSource, Representation, Trajectory, resample, same_rate};
use std::borrow::Cow;

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
#[derive(Clone, Copy, Debug, PartialEq)]
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
    pub(crate) fn accepts(&self, frame: Frame) -> bool {
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
pub fn conform<'a>(
    trajectory: &'a Trajectory,
    needs: &Needs,
) -> Result<(Cow<'a, Trajectory>, Vec<Note>)> {
    let mut notes = Vec::new();
    let (own, rate) = (trajectory.rate.hertz, needs.rate);
    let (name, ratio) = (&trajectory.name, own / rate);
    let nominal = trajectory.rate.source == RateSource::Nominal;
    if nominal {
        notes.push(Note::NominalRate { hertz: own });
    }
    if !needs.exacting() {
        if !same_rate(own, rate) {
            notes.push(Note::OtherRate {
                hertz: own,
                trusted: rate,
            });
        }
        return Ok((Cow::Borrowed(trajectory), notes));
    }
    if trajectory.rate.source == RateSource::Unknown {
        return Err(Error::UnknownRate {
            log: name.clone(),
            needed: rate,
        });
    }
    if !needs.accepts(trajectory.frame) {
        return Err(Error::Frame {
            log: name.clone(),
            found: trajectory.frame,
            expected: needs.frame,
        });
    }
    if trajectory.frame.has_forward() != needs.frame.has_forward() {
        notes.push(Note::OtherBody {
            frame: trajectory.frame,
            trusted: needs.frame,
        });
    }
    if let Some((translation, _)) = needs.representation.scaling.stored() {
        let translation = translation.into_iter().fold(0.0, f64::max);
        let step = median_step(trajectory) * ratio;
        if step > translation * UNIT_FACTOR {
            return Err(Error::NotMetres {
                log: name.clone(),
                step,
                expected: translation,
            });
        }
    }
    if same_rate(own, rate) {
        return Ok((Cow::Borrowed(trajectory), notes));
    }
    if own < rate {
        return Err(Error::TooSlow {
            log: name.clone(),
            found: own,
            needed: rate,
            nominal,
        });
    }
    notes.push(Note::Interpolated {
        from: own,
        to: rate,
    });
    Ok((Cow::Owned(resample(trajectory, rate)?), notes))
}
