//! A long simulated day of a stream: faults, pauses, jumps of the world and of the clock, and everything that a
//! driver sends by mistake, at random. Memory must not grow, and a stream that is reset must be as a new one.

use anyhow::{Result, ensure};
use dose3::stream::{Said, Stream, StreamOptions};
use dose3::{Detector, Pose};
use dose3_datasets::Trajectory;
use dose3_datasets::faults::Fault;
use dose3_datasets::synthetic::{Platform, suite, trajectory};
use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde::Serialize;
use std::collections::BTreeMap;
use std::time::Instant;

/// Poses a second.
const HERTZ: f64 = 20.0;
/// Nanoseconds from pose to pose.
const STEP: i64 = 50_000_000;
/// Poses of a part: ten minutes.
const PART: usize = 12_000;
/// Parts after which the stream is reset: six hours.
const RESET: usize = 36;
/// Share of parts with a fault.
const FAULTY: f64 = 0.3;
/// Share of the boundaries between parts where the estimator begins anew, far away.
const JUMPS: f64 = 0.2;
/// Share of them where poses pause.
const PAUSES: f64 = 0.3;
/// Share of them where the clock goes back.
const BACK: f64 = 0.05;

/// What came of it.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Soak {
    /// Simulated hours.
    pub hours: f64,
    /// Poses pushed.
    pub poses: u64,
    /// Windows judged.
    pub windows: u64,
    /// Parts with a fault.
    pub faults: u64,
    /// Alarms raised.
    pub alarms: u64,
    /// Events, by kind.
    pub events: BTreeMap<String, u64>,
    /// Bytes of a state as JSON: the largest after the first and after the last part.
    pub state_bytes: [usize; 2],
    /// Memory of the process in kB after a tenth of the parts and after the last; none where it cannot be told.
    pub memory_kb: [Option<u64>; 2],
    /// Resets after which the stream was compared with a new one.
    pub resets: u64,
    /// Seconds that it took.
    pub seconds: f64,
}

/// So many parts of ten minutes.
///
/// # Errors
/// A failing fit; a stream that is not as a new one after a reset.
pub fn run(parts: usize, seed: u64) -> Result<Soak> {
    let begin = Instant::now();
    let trusted = suite(Platform::Vehicle, 6, 1);
    let detector = Detector::builder().fit(&trusted)?;
    let monitor = detector.monitor(&StreamOptions::default())?;
    let frame = Platform::Vehicle.frame();
    let mut stream = monitor.stream(frame)?;
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut soak = Soak::default();
    let mut clock = 0;
    let mut place = Pose::identity();
    for part in 0..parts {
        let log = part_of(&mut rng, seed.wrapping_add(part as u64), &mut soak)?;
        play(
            &mut stream,
            &log,
            (&mut clock, &mut place),
            &mut rng,
            &mut soak,
        )?;
        let bytes = serde_json::to_vec(&stream.state())?.len();
        if part == 0 {
            soak.state_bytes = [bytes; 2];
        }
        soak.state_bytes[1] = soak.state_bytes[1].max(bytes);
        if part == parts / 10 {
            soak.memory_kb[0] = memory_kb();
        }
        if (part + 1).is_multiple_of(RESET) || part + 1 == parts {
            soak.windows += stream.windows();
            stream.reset();
            let fresh = monitor.stream(frame)?;
            ensure!(stream.state() == fresh.state(), "a reset left something");
            soak.resets += 1;
        }
    }
    soak.memory_kb[1] = memory_kb();
    soak.hours = soak.poses as f64 / HERTZ / 3600.0;
    soak.seconds = begin.elapsed().as_secs_f64();
    Ok(soak)
}

/// Ten minutes of driving, sometimes with a fault.
fn part_of(rng: &mut impl Rng, seed: u64, soak: &mut Soak) -> Result<Trajectory> {
    let log = trajectory(Platform::Vehicle, 1000 + seed, PART, HERTZ);
    if rng.random::<f64>() >= FAULTY {
        return Ok(log);
    }
    soak.faults += 1;
    let all = Fault::suite();
    let (.., fault) = &all[rng.random_range(0..all.len())];
    let start = rng.random_range(1000..PART - 1000);
    let length = rng.random_range(100..600);
    Ok(fault.apply(&log, start..start + length, rng.random())?)
}

/// Pushes a part behind what was before.
fn play(
    stream: &mut Stream,
    log: &Trajectory,
    (clock, place): (&mut i64, &mut Pose),
    rng: &mut impl Rng,
    soak: &mut Soak,
) -> Result<()> {
    if rng.random::<f64>() < JUMPS {
        place.translation.x += 1e5;
    }
    *clock += STEP;
    if rng.random::<f64>() < PAUSES {
        *clock += rng.random_range(1..60_i64) * 1_000_000_000;
    }
    if rng.random::<f64>() < BACK {
        *clock -= 86_400_000_000_000;
    }
    // The part goes on where the last one ended.
    let origin = log.poses[0].inverse();
    let offset = *clock - log.stamps[0];
    let begin = *place;
    let mut last = *place;
    for (stamp, pose) in log.stamps.iter().zip(&log.poses) {
        let stamp = stamp + offset;
        let pose = begin * (origin * *pose);
        (last, *clock) = (pose, stamp);
        let chance: f64 = rng.random();
        if chance < 0.01 {
            continue;
        }
        push(stream, stamp, pose, soak)?;
        if chance < 0.013 {
            push(stream, stamp, pose, soak)?;
        } else if chance < 0.016 {
            push(stream, stamp - 2 * STEP, pose, soak)?;
        } else if chance < 0.017 {
            let nowhere = Pose::new(pose.rotation, pose.translation * f64::NAN);
            push(stream, stamp + 1, nowhere, soak)?;
        }
    }
    *place = last;
    Ok(())
}

fn push(stream: &mut Stream, stamp: i64, pose: Pose, soak: &mut Soak) -> Result<()> {
    soak.poses += 1;
    for said in stream.push(stamp, pose)? {
        match said {
            Said::Window(window) => {
                ensure!(window.chance > 0.0 && window.chance <= 1.0, "{window:?}");
            }
            Said::Alarm(alarm) => {
                let raised = alarm.alarm == dose3::stream::AlarmKind::Raised;
                soak.alarms += u64::from(raised);
            }
            Said::Event(event) => {
                let value = serde_json::to_value(event)?;
                let kind = value["event"].as_str().unwrap_or_default().to_owned();
                *soak.events.entry(kind).or_default() += 1;
            }
        }
    }
    Ok(())
}

/// Memory of this process, kB, where the system says it.
#[must_use]
pub fn memory_kb() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|line| line.starts_with("VmRSS:"))?;
    line.split_whitespace().nth(1)?.parse().ok()
}

#[cfg(test)]
mod tests {
    use super::run;

    #[test]
    fn memory_of_a_stream_does_not_grow_and_a_reset_leaves_nothing() {
        let soak = run(6, 3).unwrap();
        assert!(soak.poses > 70_000 && soak.windows > 3_000, "{soak:?}");
        assert_eq!(soak.resets, 1);
        for kind in ["rate", "late", "doubled", "bad-pose"] {
            assert!(soak.events.contains_key(kind), "{soak:?}");
        }
        // Numbers have more or fewer digits; their number is the same.
        let [first, most] = soak.state_bytes;
        assert!(most < first * 3 / 2, "{soak:?}");
    }
}
