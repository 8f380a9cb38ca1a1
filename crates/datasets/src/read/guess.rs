//! What the data say where a file does not: the unit of stamps, the order of quaternions, the unit of angles.

use dose3_lie::{Rotation, Vector};

use crate::StampUnit;

/// Rates that pose sources have, hertz.
const PLAUSIBLE_HERTZ: std::ops::RangeInclusive<f64> = 0.5..=2000.0;
/// Seconds between poses that are dated.
const LONGEST_STEP: f64 = 1000.0;
/// A reading under which the motion is this many times rougher is the wrong one.
pub(crate) const DECIDED: f64 = 2.0;
/// The same where a header or the habit of a format says otherwise.
pub(crate) const OVERRULED: f64 = 10.0;
/// Steps compared along a log.
const STEPS: usize = 200;

/// What stamps look like.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Stamps {
    /// Of this unit, for the reason given.
    Unit(StampUnit, &'static str),
    /// 0, 1, 2, ...
    Index,
    /// Seconds, and nothing against it.
    Seconds,
    /// Steps of 100 ns since the year 1601 or 1, as Windows counts.
    Ticks,
}

/// Judges stamps by their size: dates are told by their magnitude, others by the rate that each unit makes.
///
/// `whole` says whether all of them are written without a decimal other than zero.
pub(crate) fn stamps(values: &[f64], whole: bool) -> Stamps {
    let mut sizes: Vec<f64> = values.iter().map(|value| value.abs()).collect();
    sizes.sort_by(f64::total_cmp);
    let Some(&median) = sizes.get(sizes.len() / 2) else {
        return Stamps::Seconds;
    };
    let mut steps: Vec<f64> = values.windows(2).map(|pair| pair[1] - pair[0]).collect();
    steps.retain(|step| *step > 0.0);
    steps.sort_by(f64::total_cmp);
    let step = steps.get(steps.len() / 2).copied();
    // Dates lie close together; what grows from zero is none.
    let dates = sizes[sizes.len() / 10] > 0.8 * median;
    // Ticks since 1601 from 2000 to 2044, and since 1 from 1997 to 2060; as nanoseconds they would be half a year in 1974 or 1990.
    if dates && ((1.26e17..1.4e17).contains(&median) || (6.3e17..6.5e17).contains(&median)) {
        return Stamps::Ticks;
    }
    // Seconds since 1970 from 1973 to 2096, and the same date in smaller units; microseconds since a machine started have the
    // size of a date in seconds, but not its steps.
    for unit in StampUnit::ALL {
        let factor = 10_f64.powi(9 - unit.shift());
        let steps = step.is_none_or(|step| step < LONGEST_STEP * factor);
        if dates && steps && (1e8 * factor..4e9 * factor).contains(&median) {
            return match unit {
                StampUnit::Seconds => Stamps::Seconds,
                _ => Stamps::Unit(unit, "their size is that of a date since 1970"),
            };
        }
    }
    let Some(step) = step else {
        return Stamps::Seconds;
    };
    if whole && step == 1.0 {
        return Stamps::Index;
    }
    if PLAUSIBLE_HERTZ.contains(&(1.0 / step)) || !whole && step < 10.0 {
        return Stamps::Seconds;
    }
    for (unit, reason) in [
        (
            StampUnit::Milliseconds,
            "as seconds the rate would be below that of any pose source, as milliseconds it is plausible",
        ),
        (
            StampUnit::Microseconds,
            "as seconds or milliseconds the rate would be below that of any pose source",
        ),
        (
            StampUnit::Nanoseconds,
            "in larger units the rate would be below that of any pose source",
        ),
    ] {
        if PLAUSIBLE_HERTZ.contains(&(10_f64.powi(9 - unit.shift()) / step)) {
            return Stamps::Unit(unit, reason);
        }
    }
    Stamps::Seconds
}

/// Whether stamps of this unit have a rate that pose sources have.
pub(crate) fn makes_a_rate(values: &[f64], unit: StampUnit) -> bool {
    let mut steps: Vec<f64> = values.windows(2).map(|pair| pair[1] - pair[0]).collect();
    steps.sort_by(f64::total_cmp);
    let step = steps.get(steps.len() / 2);
    step.is_some_and(|step| PLAUSIBLE_HERTZ.contains(&(10_f64.powi(9 - unit.shift()) / step)))
}

/// How rough a motion is: the change of the body-frame velocity from step to step over its size, 0 for a body that
/// always moves along its own axes. `None` for a body that stands still.
///
/// Permuting the numbers of a quaternion keeps all angles between poses, so body rates cannot tell the right order;
/// the direction of motion as the body sees it can.
pub(crate) fn roughness(positions: &[Vector], rotations: &[Rotation]) -> Option<f64> {
    let stride = (positions.len() / STEPS).max(1);
    let picked: Vec<usize> = (0..positions.len()).step_by(stride).collect();
    let velocities: Vec<Vector> = picked
        .windows(2)
        .map(|pair| rotations[pair[0]].inverse() * (positions[pair[1]] - positions[pair[0]]))
        .collect();
    let size: f64 = velocities.iter().map(|v| v.norm()).sum();
    let change: f64 = velocities
        .windows(2)
        .map(|pair| (pair[1] - pair[0]).norm())
        .sum();
    (size > 0.0 && size.is_finite() && velocities.len() > 2).then(|| change / size)
}

/// How many times rougher the motion is under the second reading than under the first.
pub(crate) fn preference(positions: &[Vector], first: &[Rotation], second: &[Rotation]) -> f64 {
    // A thousandth of the speed is rounding.
    match (roughness(positions, first), roughness(positions, second)) {
        (Some(first), Some(second)) => (second + 1e-3) / (first + 1e-3),
        _ => 1.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stamps_are_told_by_size_and_rate() {
        let series = |start: f64, step: f64| {
            (0..25)
                .map(|i| start + f64::from(i) * step)
                .collect::<Vec<_>>()
        };
        let unit = |stamps| match stamps {
            Stamps::Unit(unit, _) => Some(unit),
            _ => None,
        };
        for (start, step, whole, expected) in [
            (1.6e9, 0.1, false, None),
            (1.6e12, 100.0, true, Some(StampUnit::Milliseconds)),
            (1.6e15, 1e5, true, Some(StampUnit::Microseconds)),
            (1.6e18, 1e8, true, Some(StampUnit::Nanoseconds)),
            (0.0, 100.0, true, Some(StampUnit::Milliseconds)),
            (0.0, 33.3, false, Some(StampUnit::Milliseconds)),
            (0.0, 5e4, true, Some(StampUnit::Microseconds)),
            (0.0, 5e7, true, Some(StampUnit::Nanoseconds)),
            (1.2e8, 1e5, true, Some(StampUnit::Microseconds)),
            (0.0, 0.005, false, None),
            (0.0, 2.0, true, None),
            (0.0, 2.5, false, None),
        ] {
            assert_eq!(
                unit(stamps(&series(start, step), whole)),
                expected,
                "{start} {step}"
            );
        }
        assert_eq!(stamps(&series(7.0, 1.0), true), Stamps::Index);
        assert_eq!(stamps(&[], true), Stamps::Seconds);
    }
}
