//! Bringing a log down to a lower rate.

use std::sync::Arc;

use dose3_lie::{Pose, se3};

use crate::stretch::stretches;
use crate::{Error, Rate, Source, Trajectory};

/// Rates that differ by less are one rate: nominal and measured ones differ by a percent or two.
const RATE_TOLERANCE: f64 = 0.05;

/// Whether a log of `hertz` poses a second has the rate `other`: RobotCar's 20 Hz are 19.9 to 20.1.
pub fn same_rate(hertz: f64, other: f64) -> bool {
    (hertz / other - 1.0).abs() <= RATE_TOLERANCE
}

/// The log at `hertz` poses a second, interpolated between neighbours (rotation along the geodesic,
/// translation straight).
///
/// Each gap-free stretch is sampled from its own first stamp on and starts a new stretch of the result, so
/// nothing is invented across a gap. Each pose keeps the row of the recorded pose nearest to it, and the log the
/// stamps it was recorded with ([`Trajectory::source`]). A log that is slower than `hertz` by up to five percent is resampled all the
/// same: RobotCar's 20 Hz are 19.9 to 20.1.
///
/// # Errors
/// [`Error::Upsampling`] where the log is slower; [`Error::Parameter`] where `hertz` is not positive and finite
/// or beyond 1e6, or where
/// the allowed gaps are so long that most of the result would be interpolated.
///
/// ```
/// use dose3_datasets::{resample, synthetic};
///
/// let drive = synthetic::trajectory(synthetic::Platform::Vehicle, 1, 101, 20.0);
/// let slow = resample(&drive, 10.0)?;
/// assert_eq!(slow.len(), 51);
/// assert!(resample(&slow, 20.0).is_err());
/// # Ok::<(), dose3_datasets::Error>(())
/// ```
pub fn resample(trajectory: &Trajectory, hertz: f64) -> Result<Trajectory, Error> {
    resample_at(trajectory, hertz, 0.0)
}

/// The log at `hertz` poses a second: as it is where it already is within five percent of that, else interpolated
/// down by [`resample`].
///
/// # Errors
/// Those of [`resample`].
///
/// ```
/// use dose3_datasets::{at_rate, synthetic};
///
/// let drive = synthetic::trajectory(synthetic::Platform::Vehicle, 1, 101, 20.0);
/// assert_eq!(at_rate(&drive, 20.5)?, drive);
/// assert_eq!(at_rate(&drive, 10.0)?.len(), 51);
/// # Ok::<(), dose3_datasets::Error>(())
/// ```
pub fn at_rate(trajectory: &Trajectory, hertz: f64) -> Result<Trajectory, Error> {
    if same_rate(trajectory.rate.hertz, hertz) {
        return Ok(trajectory.clone());
    }
    resample(trajectory, hertz)
}

/// As [`resample`], with the first sample of each stretch `phase` steps (0 to 1) after its first stamp.
pub(crate) fn resample_at(
    trajectory: &Trajectory,
    hertz: f64,
    phase: f64,
) -> Result<Trajectory, Error> {
    if !(hertz > 0.0 && hertz <= 1e6) {
        let found = format!("{hertz:?}");
        return Err(Error::Parameter {
            what: "rate in hertz",
            expected: "above 0 and at most 1e6",
            found,
        });
    }
    if hertz > trajectory.rate.hertz * (1.0 + RATE_TOLERANCE) {
        return Err(Error::Upsampling {
            name: trajectory.name.clone(),
            from: trajectory.rate.hertz,
            to: hertz,
            hint: "interpolated poses would carry no motion of their own; use a model for the lower rate",
        });
    }
    let period = 1e9 / hertz;
    let mut result = Trajectory {
        stamps: Vec::new(),
        poses: Vec::new(),
        rows: Vec::new(),
        breaks: Vec::new(),
        rate: Rate {
            hertz,
            source: trajectory.rate.source,
        },
        ..trajectory.clone()
    };
    for stretch in stretches(trajectory, trajectory.max_gap) {
        let stamps = &trajectory.stamps[stretch.clone()];
        let poses = &trajectory.poses[stretch.clone()];
        let rows = &trajectory.rows[stretch];
        let span = (stamps[stamps.len() - 1] - stamps[0]) as f64;
        // Half a nanosecond of grace, so that rounding of the stamps does not cost the last pose.
        let steps = (span + 0.5) / period - phase;
        if steps < 0.0 {
            continue;
        }
        let samples = steps as usize + 1;
        if !result.poses.is_empty() {
            result.breaks.push(result.poses.len());
        }
        if samples > 1000 + 100 * stamps.len() {
            return Err(Error::Parameter {
                what: "largest gap",
                expected: "short enough that a log is not mostly interpolated",
                found: format!(
                    "{samples} samples from {} poses of {}",
                    stamps.len(),
                    trajectory.name
                ),
            });
        }
        let mut after = 0;
        for index in 0..samples {
            let stamp = stamps[0] + ((index as f64 + phase) * period).round() as i64;
            while after + 1 < stamps.len() && stamps[after] < stamp {
                after += 1;
            }
            if result.stamps.last().is_some_and(|last| *last >= stamp) {
                continue;
            }
            let before = after.saturating_sub(1);
            let nearest = if stamp - stamps[before] <= stamps[after] - stamp {
                before
            } else {
                after
            };
            result.stamps.push(stamp);
            result.rows.push(rows[nearest]);
            result.poses.push(between(stamps, poses, after, stamp));
        }
    }
    if result.stamps != trajectory.stamps {
        result.source = Some(recorded(trajectory));
    }
    if (trajectory.rate.hertz - hertz).abs() > 1e-9 * hertz {
        result.report.resampled_from = Some(trajectory.rate.hertz);
    }
    Ok(result)
}

/// Stamps and rows of the log before any resampling.
fn recorded(trajectory: &Trajectory) -> Arc<Source> {
    trajectory.source.clone().unwrap_or_else(|| {
        Arc::new(Source {
            stamps: trajectory.stamps.clone(),
            rows: trajectory.rows.clone(),
        })
    })
}

/// The pose at `stamp`, where `after` is the first index not before it.
fn between(stamps: &[i64], poses: &[Pose], after: usize, stamp: i64) -> Pose {
    if after == 0 || stamps[after] <= stamp {
        return poses[after];
    }
    let before = after - 1;
    let share = (stamp - stamps[before]) as f64 / (stamps[after] - stamps[before]) as f64;
    se3::interpolate(&poses[before], &poses[after], share)
}
