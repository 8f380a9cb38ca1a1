//! Faults for people's own tests, and logs to put them into.

use crate::error::guarded;
use crate::settings::parsed;
use crate::trajectory::Trajectory;
use dose3_datasets::faults::{Control, Fault};
use dose3_datasets::stretches;
use dose3_datasets::synthetic::{Platform, trajectory};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use std::ops::Range;

/// The log with a fault in poses `start` to `stop`, and the poses whose step is faulty. A control changes all of it.
#[pyfunction]
#[pyo3(signature = (fault, log, start, stop, seed))]
pub fn inject(
    fault: &str,
    log: &Trajectory,
    start: Option<usize>,
    stop: Option<usize>,
    seed: u64,
) -> PyResult<(Trajectory, usize, usize)> {
    let log = &log.log;
    if let Ok(control) = fault.parse::<Control>() {
        let changed = guarded(|| Ok(control.apply(log, seed)?))?;
        return Ok((Trajectory::new(changed), 0, 0));
    }
    let fault: Fault = parsed("fault", fault)?;
    let usual = middle(log);
    let range = start.unwrap_or(usual.start)..stop.unwrap_or(usual.end);
    let injected = guarded(|| Ok(fault.inject(log, range, seed)?))?;
    let affected = injected.affected;
    let log = Trajectory::new(injected.trajectory);
    Ok((log, affected.start, affected.end))
}

/// The middle half of the longest gap-free stretch.
fn middle(log: &dose3::Trajectory) -> Range<usize> {
    let longest = stretches(log, log.max_gap)
        .into_iter()
        .max_by_key(Range::len);
    let longest = longest.unwrap_or(0..0);
    let quarter = longest.len() / 4;
    longest.start + quarter..longest.end - quarter
}

/// Poses that a machine has memory for.
const MOST_POSES: usize = 10_000_000;
/// Rates of poses that the motion of these bodies can be followed at, hertz.
const LEAST_RATE: f64 = 0.1;
const MOST_RATE: f64 = 10_000.0;

/// A log that nobody recorded: a vehicle, a hand-held object or a drone.
#[pyfunction]
pub fn synthetic(platform: &str, seed: u64, poses: usize, rate: f64) -> PyResult<Trajectory> {
    let platform: Platform = parsed("platform", platform)?;
    if !(2..=MOST_POSES).contains(&poses) {
        let found = format!("poses is {poses}, expected 2 to {MOST_POSES}");
        return Err(PyValueError::new_err(found));
    }
    if !(LEAST_RATE..=MOST_RATE).contains(&rate) {
        let found = format!("rate is {rate}, expected {LEAST_RATE} to {MOST_RATE} hertz");
        return Err(PyValueError::new_err(found));
    }
    guarded(|| Ok(Trajectory::new(trajectory(platform, seed, poses, rate))))
}
