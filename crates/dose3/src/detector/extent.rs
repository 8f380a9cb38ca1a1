//! At which rate, and in windows of how many steps, logs are measured.

use super::short::SHORT_STEPS;
use crate::error::{Error, Result, Setting};
use crate::model_file::Model;
use dose3_datasets::{Kind, RateSource, Trajectory, same_rate, stretches};
use dose3_ood::StatisticsSet;

/// Rates at which logs may be measured, hertz.
const RATES: [f64; 2] = [2.0, 200.0];
/// Steps of a window that may be asked for.
const WINDOWS: [usize; 2] = [32, LONGEST];
/// The most of them.
pub(super) const LONGEST: usize = 4096;
/// Poses between the starts of windows at most.
pub(super) const MOST_STRIDE: usize = 1 << 20;
/// A quarter of the trusted logs may be slower or shorter than the others need; a fit leaves them out.
const LEFT_OUT: usize = 4;

/// Whether rate and window may be others than the model's: no network that was trained at these runs.
fn free(model: &Model, statistics: &StatisticsSet) -> bool {
    model.header.representation.kind == Kind::Motion && !statistics.needs_trace()
}

/// The lowest of the values but for a quarter of them.
fn most_reach<T: Copy>(
    mut values: Vec<T>,
    order: impl Fn(&T, &T) -> std::cmp::Ordering,
) -> Option<T> {
    values.sort_by(order);
    values.get(values.len() / LEFT_OUT).copied()
}

/// The rate at which trusted logs are measured: what is wanted, else the model's, or where three quarters of them do
/// not reach that, theirs. A `paper` model counts poses and takes the rate of the first log.
///
/// # Errors
/// [`Error::Setting`] for a rate out of range, or another than that of a network that is to run.
pub(super) fn rate(
    model: &Model,
    trusted: &[Trajectory],
    statistics: &StatisticsSet,
    wanted: Option<f64>,
) -> Result<f64> {
    let usual = model.header.rate;
    let [slowest, fastest] = RATES;
    let fault =
        |found: f64, expected: String| Err(Error::setting(Setting::MeasuringRate, found, expected));
    match (model.header.representation.kind, wanted) {
        (Kind::Paper, None) => Ok(trusted.first().map_or(usual, |log| log.rate.hertz)),
        (Kind::Paper, Some(rate)) => fault(rate, "none: a `paper` model counts poses".into()),
        (Kind::Motion, Some(rate)) if !free(model, statistics) && !same_rate(rate, usual) => {
            let expected =
                format!("the {usual} Hz that the network of `{statistics}` is trained at");
            fault(rate, expected)
        }
        (Kind::Motion, Some(rate)) if !(slowest..=fastest).contains(&rate) => {
            fault(rate, format!("{slowest} to {fastest} Hz"))
        }
        (Kind::Motion, Some(rate)) => Ok(rate),
        (Kind::Motion, None) if !free(model, statistics) => Ok(usual),
        (Kind::Motion, None) => {
            let known = trusted
                .iter()
                .filter(|log| log.rate.source != RateSource::Unknown);
            let rates = known.map(|log| log.rate.hertz).collect();
            let reached = most_reach(rates, f64::total_cmp).unwrap_or(usual);
            match reached < usual && !same_rate(reached, usual) {
                true => Ok(reached.max(slowest)),
                false => Ok(usual),
            }
        }
    }
}

/// Poses of the longest gap-free stretch.
pub(super) fn longest(log: &Trajectory) -> usize {
    let all = stretches(log, log.max_gap);
    all.iter().map(ExactSizeIterator::len).max().unwrap_or(0)
}

/// Steps of the windows that logs are measured in: what is wanted, else the model's, or where three quarters of the
/// logs, whose longest stretches have so many poses, do not reach that, the longest of [`SHORT_STEPS`] that they do.
///
/// # Errors
/// [`Error::Setting`] for a length out of range, or another than that of a network that is to run.
pub(super) fn window(
    model: &Model,
    stretches: Vec<usize>,
    statistics: &StatisticsSet,
    wanted: Option<usize>,
) -> Result<usize> {
    let header = &model.header;
    let [least, most] = WINDOWS;
    match wanted {
        Some(steps) if steps == header.window => Ok(steps),
        Some(steps) if !free(model, statistics) => {
            let expected = format!("the model's own {}", header.window);
            Err(Error::setting(Setting::Window, steps, expected))
        }
        Some(steps) if !(least..=most).contains(&steps) => {
            let expected = format!("{least} to {most} steps");
            Err(Error::setting(Setting::Window, steps, expected))
        }
        Some(steps) => Ok(steps),
        None if !free(model, statistics) => Ok(header.window),
        None => {
            let reached = most_reach(stretches, usize::cmp).unwrap_or(usize::MAX);
            let fits = |steps: &usize| header.representation.kind.poses(*steps) <= reached;
            let all = std::iter::once(header.window).chain(SHORT_STEPS);
            Ok(all
                .clone()
                .find(fits)
                .or(all.last())
                .unwrap_or(header.window))
        }
    }
}

/// Steps of the short windows that are measured beside those of `window` steps.
pub(super) fn short(model: &Model, window: usize, statistics: &StatisticsSet) -> Vec<usize> {
    let shorter = SHORT_STEPS.into_iter().filter(|steps| *steps < window);
    match free(model, statistics) {
        true => shorter.collect(),
        false => Vec::new(),
    }
}

/// Poses between the starts of windows of `window` steps, where those of the model's length start `stride` apart.
pub(super) fn stride(model: &Model, window: usize, stride: usize) -> usize {
    (stride * window / model.header.window).max(1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::built_in;
    use dose3_datasets::synthetic::{Platform, trajectory};

    fn logs(rates: &[f64]) -> Vec<Trajectory> {
        let log = |hertz: &f64| trajectory(Platform::Vehicle, 1, 100, *hertz);
        rates.iter().map(log).collect()
    }

    #[test]
    fn the_rate_is_one_that_most_logs_have() {
        let model = built_in::motion().unwrap();
        let (plain, network) = ("kinematic".parse().unwrap(), "residual".parse().unwrap());
        let of = |rates: &[f64], wanted| rate(&model, &logs(rates), &plain, wanted).ok();
        assert_eq!(of(&[200.0, 20.0], None), Some(10.0));
        assert_eq!(of(&[9.8, 10.1], None), Some(10.0));
        assert_eq!(of(&[5.0, 20.0], None), Some(5.0));
        // One slow log of five is left out.
        assert_eq!(of(&[5.0, 20.0, 20.0, 20.0, 20.0], None), Some(10.0));
        assert_eq!(of(&[1.0], None), Some(2.0));
        assert_eq!(of(&[20.0], Some(20.0)), Some(20.0));
        assert_eq!(of(&[20.0], Some(0.5)), None);
        assert_eq!(of(&[20.0], Some(f64::NAN)), None);
        assert_eq!(rate(&model, &logs(&[5.0]), &network, None).unwrap(), 10.0);
        assert!(rate(&model, &logs(&[5.0]), &network, Some(5.0)).is_err());
        let paper = built_in::paper().unwrap();
        assert_eq!(rate(&paper, &logs(&[7.0]), &plain, None).unwrap(), 7.0);
    }

    #[test]
    fn windows_fit_most_logs() {
        let model = built_in::motion().unwrap();
        let (plain, network) = ("kinematic".parse().unwrap(), "residual".parse().unwrap());
        let of = |poses: &[usize]| window(&model, poses.to_vec(), &plain, None).unwrap();
        assert_eq!(of(&[129, 500]), 128);
        assert_eq!(of(&[128, 500]), 64);
        assert_eq!(of(&[64, 500]), 32);
        assert_eq!(of(&[20]), 32);
        assert_eq!(of(&[40, 200, 300, 400, 500]), 128);
        assert_eq!(short(&model, 128, &plain), [64, 32]);
        assert_eq!(short(&model, 64, &plain), [32]);
        assert_eq!(stride(&model, 32, 32), 8);
        assert_eq!(window(&model, vec![40], &network, None).unwrap(), 128);
        assert!(short(&model, 128, &network).is_empty());
        for bad in [31, 5000] {
            assert!(window(&model, vec![40], &plain, Some(bad)).is_err());
        }
        assert!(window(&model, vec![40], &network, Some(64)).is_err());
    }
}
