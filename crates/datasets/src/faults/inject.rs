//! A fault put into a log.

use std::ops::Range;

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use super::{Fault, Injection, coupling, filter, level, motion, pose, side, stamps, timing};
use crate::{Error, Trajectory, stretches};

impl Fault {
    /// The log with the fault in poses `range` of it (start included, end not).
    ///
    /// # Errors
    /// [`Error::Parameter`] for a severity outside its range, and for a range of fewer than two poses or not within
    /// one gap-free stretch ([`stretches`]) of the log.
    pub fn inject(
        &self,
        log: &Trajectory,
        range: Range<usize>,
        seed: u64,
    ) -> Result<Injection, Error> {
        self.check()?;
        let stretch = stretch_of(log, &range)?;
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut faulty = log.clone();
        let within = range.start + 1..range.end;
        let changed = range.start.max(1)..(range.end + 1).min(log.len());
        let affected = match *self {
            Self::Jump { metres } => {
                motion::jump(&mut faulty, &range, metres, &mut rng);
                within.start..within.start + 1
            }
            Self::Freeze { seconds } => timing::freeze(&mut faulty, &range, seconds),
            Self::Drop { share } => timing::drop(&mut faulty, &range, share, &mut rng),
            Self::JitterPosition { metres } => {
                pose::jitter_position(&mut faulty.poses[range], metres, &mut rng);
                changed
            }
            Self::JitterRotation { radians } => {
                pose::jitter_rotation(&mut faulty.poses[range], radians, &mut rng);
                changed
            }
            Self::DriftYaw { radians_per_second } => {
                motion::drift_yaw(&mut faulty, &range, radians_per_second, &mut rng);
                within
            }
            Self::DriftPosition { metres_per_second } => {
                motion::drift_position(&mut faulty, &range, metres_per_second, &mut rng);
                within
            }
            Self::DriftScale { per_second } => {
                motion::scale(&mut faulty, &range, |seconds| 1.0 + per_second * seconds);
                within
            }
            Self::Scale { factor } => {
                motion::scale(&mut faulty, &range, |_| factor);
                within
            }
            Self::Reversal => {
                motion::reverse(&mut faulty, &range);
                within
            }
            Self::TimeWarp { depth } => {
                timing::warp(&mut faulty, &range, depth);
                within
            }
            Self::Mounting { radians } => {
                let angle = side(&mut rng) * radians;
                pose::mounting(&mut faulty.poses[range], log.frame, angle);
                changed
            }
            Self::RollPitchSwap => {
                pose::swap_roll_and_pitch(&mut faulty.poses[range], log.frame);
                changed
            }
            Self::Handedness { axis } => {
                motion::mirror(&mut faulty, &range, axis);
                within
            }
            Self::MirroredPositions { axis } => {
                motion::mirror_positions(&mut faulty, &range, axis);
                within
            }
            Self::DegreesForRadians => {
                pose::degrees_for_radians(&mut faulty.poses[range]);
                changed
            }
            Self::Slip { metres_per_second } => {
                let speed = side(&mut rng) * metres_per_second;
                motion::slip(&mut faulty, &range, speed);
                within
            }
            Self::Rate { factor } => timing::rate(&mut faulty, &range, factor),
            Self::PositionLate { seconds } => {
                let late = coupling::position_late(log, &stretch, &range, seconds);
                motion::take_positions(&mut faulty, &range, &late);
                within
            }
            Self::AttitudeLate { seconds } => {
                let late = coupling::attitude_late(log, &stretch, &range, seconds);
                motion::take_steps(&mut faulty, &range, &late);
                within
            }
            Self::LeverArm { axis, metres } => {
                let arm = axis.direction(log.frame) * (side(&mut rng) * metres);
                let moved = coupling::lever_arm(&log.poses[range.clone()], arm);
                motion::take_positions(&mut faulty, &range, &moved);
                within
            }
            Self::Extrinsic { axis, radians } => {
                let turn = axis.direction(log.frame) * (side(&mut rng) * radians);
                let turned = coupling::extrinsic(&log.poses[range.clone()], turn);
                motion::take_steps(&mut faulty, &range, &turned);
                within
            }
            Self::Smooth { seconds } => {
                let smooth = filter::smooth(log, &stretch, &range, seconds);
                motion::take_steps(&mut faulty, &range, &smooth);
                within
            }
            Self::SmoothPosition { seconds } => {
                let smooth = filter::smooth(log, &stretch, &range, seconds);
                let smooth: Vec<_> = smooth.iter().map(|pose| pose.translation).collect();
                motion::take_positions(&mut faulty, &range, &smooth);
                within
            }
            Self::BridgedGap { seconds } => filter::bridge(&mut faulty, &range, seconds),
            Self::Quantised { metres } => {
                pose::quantise(&mut faulty.poses[range], metres);
                changed
            }
            Self::SinglePrecision => {
                pose::single_precision(&mut faulty.poses[range], log.frame);
                changed
            }
            Self::FrozenHeight => {
                let flat = level::frozen_height(&log.poses[range.clone()], log.frame);
                motion::take_positions(&mut faulty, &range, &flat);
                within
            }
            Self::Level => {
                let level = level::level(&log.poses[range.clone()], log.frame);
                motion::take_steps(&mut faulty, &range, &level);
                within
            }
            Self::HeadingFromCourse => {
                let course = level::heading_from_course(log, &stretch, &range);
                motion::take_steps(&mut faulty, &range, &course);
                within
            }
            Self::Stale { share } => filter::stale(&mut faulty, &range, share, &mut rng),
            Self::Interpolated { factor } => filter::interpolate(&mut faulty, &range, factor),
            Self::Closure { metres, seconds } => {
                motion::closure(&mut faulty, &range, metres, seconds, &mut rng)
            }
            Self::Stall { seconds } => stamps::stall(&mut faulty, &range, seconds),
            Self::Burst { seconds } => stamps::burst(&mut faulty, &range, seconds),
            Self::StampJitter { seconds } => {
                stamps::jitter(&mut faulty, &range, seconds, &mut rng);
                within
            }
            Self::Doubled { share } => stamps::double(&mut faulty, &range, share, &mut rng),
            Self::Uneven { depth } => {
                stamps::uneven(&mut faulty, &range, depth, &mut rng);
                within
            }
            Self::Thinned { factor } => stamps::thin(&mut faulty, &range, factor),
        };
        if faulty.stamps != log.stamps {
            // What was recorded before a resampling no longer belongs to it.
            faulty.source = None;
        }
        Ok(Injection {
            trajectory: faulty,
            affected,
        })
    }

    /// The faulty log alone.
    ///
    /// # Errors
    /// As [`Self::inject`].
    pub fn apply(
        &self,
        log: &Trajectory,
        range: Range<usize>,
        seed: u64,
    ) -> Result<Trajectory, Error> {
        Ok(self.inject(log, range, seed)?.trajectory)
    }

    /// The poses of the faulty log that count as faulty ([`Injection::affected`]), alone.
    ///
    /// # Errors
    /// As [`Self::inject`].
    pub fn affected(
        &self,
        log: &Trajectory,
        range: Range<usize>,
        seed: u64,
    ) -> Result<Range<usize>, Error> {
        Ok(self.inject(log, range, seed)?.affected)
    }
}

/// The gap-free stretch that holds the range.
fn stretch_of(log: &Trajectory, range: &Range<usize>) -> Result<Range<usize>, Error> {
    let stretch = stretches(log, log.max_gap)
        .into_iter()
        .find(|stretch| stretch.start <= range.start && range.end <= stretch.end);
    match stretch {
        Some(stretch) if range.len() >= 2 => Ok(stretch),
        _ => Err(Error::Parameter {
            what: "range of the fault",
            expected: "at least two poses within one gap-free stretch of the log",
            found: format!("{}..{} of {} poses", range.start, range.end, log.len()),
        }),
    }
}
