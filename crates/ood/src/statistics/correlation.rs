//! The block `cc`: how axes go together, and with what delay.
//!
//! A body that is measured by one rigid, well-timed sensor ties its axes together: sideways velocity follows from
//! yaw rate by where the sensor sits, and in the same instant. An offset in time between position and attitude, another
//! lever arm, a filter on one of both change which axes go together, and when, but hardly how much each of them moves.
//!
//! For each of 14 pairs of series (see `PAIRS`) over the window, both less their mean, the cross-correlation is
//! taken at lags from 5 poses before to 5 after. Two numbers a pair: Fisher's z (artanh) of the correlation at lag 0, and
//! the lag, in poses, of the strongest correlation of either sign, refined by a parabola and multiplied by the
//! size of the correlation there, so that the lag of nothing is near 0. A series that does not move by a tenth of a
//! millimetre or milliradian correlates with nothing: where all stands still, all numbers are 0.
//!
//! Pairs were chosen on validation logs: all 15 pairs of axes, of their differences, or both, call more sound logs and
//! fewer faulty ones.

use super::twist::{Twist, halfway_into};
use super::{AXES, Column, Workspace};
use crate::error::Error;

/// Largest lag, poses.
const REACH: usize = 5;
const LAGS: usize = 2 * REACH + 1;
/// Increments that lags and differences need.
const FEWEST: usize = LAGS + 1;
/// Root mean square (metres, radians per pose; for a product their product with a tenth) that counts as no motion.
const FLOOR: f64 = 1e-4;
const PRODUCT_FLOOR: f64 = 1e-5;
/// A correlation of 1 would have an infinite z.
const STRONGEST: f64 = 0.999;

/// A series over a window.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Series {
    /// One of the axes.
    Axis(usize),
    /// Forward velocity times the turn about an axis: how fast the velocity's direction turns away.
    ForwardTurn(usize),
}

use Series::{Axis, ForwardTurn};

/// What goes with what, and whether both are differenced in time first. Changes show the couplings of what moves
/// fast (lever arms, lean and dive); the sideways and upward velocity itself shows offsets in time.
const PAIRS: [(Series, Series, bool); 14] = [
    (Axis(0), Axis(4), true),
    (Axis(0), Axis(5), true),
    (Axis(1), Axis(3), true),
    (Axis(1), Axis(5), true),
    (Axis(2), Axis(3), true),
    (Axis(2), Axis(4), true),
    (Axis(3), Axis(5), true),
    (Axis(3), Axis(4), true),
    (Axis(4), Axis(5), true),
    (Axis(1), ForwardTurn(5), false),
    (Axis(2), ForwardTurn(4), false),
    (Axis(3), ForwardTurn(5), true),
    (Axis(1), ForwardTurn(5), true),
    (Axis(2), ForwardTurn(4), true),
];

impl Series {
    fn part(self) -> &'static str {
        match self {
            Axis(axis) | ForwardTurn(axis) => AXES[axis],
        }
    }

    fn of(self, twist: &Twist) -> f64 {
        match self {
            Axis(axis) => twist[axis],
            ForwardTurn(axis) => twist[0] * twist[axis],
        }
    }

    fn floor(self) -> f64 {
        match self {
            Axis(_) => FLOOR,
            ForwardTurn(_) => PRODUCT_FLOOR,
        }
    }

    /// Less its mean.
    fn values(self, twists: &[Twist], differenced: bool, out: &mut Vec<f64>) {
        out.clear();
        if differenced {
            let pairs = twists.windows(2);
            out.extend(pairs.map(|pair| self.of(&pair[1]) - self.of(&pair[0])));
        } else {
            out.extend(twists.iter().map(|t| self.of(t)));
        }
        let mean = out.iter().sum::<f64>() / out.len() as f64;
        out.iter_mut().for_each(|x| *x -= mean);
    }
}

/// Two columns a pair; they belong to its first axis.
pub(super) fn columns() -> Vec<Column> {
    let mut columns = Vec::new();
    for (first, second, differenced) in PAIRS {
        let part = first.part();
        let other = match second {
            Axis(_) => second.part().to_owned(),
            ForwardTurn(_) => format!("forward_times_{}", second.part()),
        };
        let order = if differenced { "change" } else { "rate" };
        for quantity in ["z", "lag"] {
            let name = format!("{part}.{order}_with_{other}.{quantity}");
            columns.push(Column { part, name });
        }
    }
    columns
}

pub(super) fn values(
    increments: &[f64],
    work: &mut Workspace,
    out: &mut Vec<f64>,
) -> Result<(), Error> {
    let Workspace {
        twists,
        first: x,
        second: y,
        ..
    } = work;
    halfway_into(increments, twists)?;
    if twists.len() < FEWEST {
        return Err(Error::TooFew {
            what: "body-frame increments",
            needed: FEWEST,
            found: twists.len(),
            hint: "correlations are taken up to five poses apart",
        });
    }
    for (first, second, differenced) in PAIRS {
        first.values(twists, differenced, x);
        second.values(twists, differenced, y);
        let correlation = cross_correlation(x, y, first.floor(), second.floor());
        out.push(correlation[REACH].clamp(-STRONGEST, STRONGEST).atanh());
        out.push(weighted_lag(&correlation));
    }
    Ok(())
}

/// Of `x` at t with `y` at t + lag, for lags -5 to 5; both have mean 0.
fn cross_correlation(x: &[f64], y: &[f64], x_floor: f64, y_floor: f64) -> [f64; LAGS] {
    // Divided by the root mean squares first: products of large numbers overflow.
    let size = |series: &[f64], floor: f64| {
        let most = series.iter().fold(floor, |m, v| m.max(v.abs()));
        let square = series.iter().map(|v| (v / most).powi(2)).sum::<f64>() / series.len() as f64;
        most * (square + (floor / most).powi(2)).sqrt()
    };
    let (x_size, y_size) = (size(x, x_floor), size(y, y_floor));
    std::array::from_fn(|k| {
        let (x, y) = match k.checked_sub(REACH) {
            Some(lag) => (&x[..x.len() - lag], &y[lag..]),
            None => (&x[REACH - k..], &y[..y.len() - (REACH - k)]),
        };
        let pairs = x.iter().zip(y).map(|(a, b)| (a / x_size) * (b / y_size));
        pairs.sum::<f64>() / (x.len() + k.abs_diff(REACH)) as f64
    })
}

/// Lag of the strongest correlation times its size.
fn weighted_lag(correlation: &[f64; LAGS]) -> f64 {
    let mut peak = REACH;
    for k in 0..LAGS {
        if correlation[k].abs() > correlation[peak].abs() {
            peak = k;
        }
    }
    let size = |k: usize| correlation[k].abs();
    let mut lag = peak as f64 - REACH as f64;
    if peak > 0 && peak + 1 < LAGS {
        let bend = size(peak - 1) - 2.0 * size(peak) + size(peak + 1);
        if bend < 0.0 {
            let shift = 0.5 * (size(peak - 1) - size(peak + 1)) / bend;
            lag += shift.clamp(-0.5, 0.5);
        }
    }
    lag * size(peak)
}

#[cfg(test)]
mod tests {
    use super::super::CHANNELS;
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    /// Sideways velocity is half of the yaw rate `delay` poses before.
    fn sway(delay: usize) -> Vec<f64> {
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        let yaw: Vec<f64> = (0..140).map(|_| rng.random_range(-0.1..0.1)).collect();
        (0..128)
            .flat_map(|t| [0.0, 0.5 * yaw[t + 5 - delay], 0.0, 0.0, 0.0, yaw[t + 5]])
            .collect()
    }

    fn row(increments: &[f64]) -> Vec<f64> {
        let mut out = Vec::new();
        values(increments, &mut Workspace::default(), &mut out).unwrap();
        out
    }

    #[test]
    fn a_delay_is_measured_in_poses() {
        let names = columns();
        let at = |name: &str| names.iter().position(|c| c.name == name).unwrap();
        let z = at("translation_y.change_with_rotation_z.z");
        let lag = at("translation_y.change_with_rotation_z.lag");
        let (none, two) = (row(&sway(0)), row(&sway(2)));
        assert_eq!(none.len(), names.len());
        // All but the turn's own part in the half-way velocity is correlated.
        assert!(
            none[z] > 2.0 && none[lag].abs() < 0.1,
            "{} {}",
            none[z],
            none[lag]
        );
        // The sideways velocity at t is the turn of t - 2.
        assert!(
            two[z] < 0.5 && (two[lag] + 2.0).abs() < 0.2,
            "{} {}",
            two[z],
            two[lag]
        );
    }

    #[test]
    fn standing_still_is_neutral_and_extremes_are_finite() {
        assert!(row(&[0.0; 20 * CHANNELS]).iter().all(|&x| x == 0.0));
        assert!(row(&[1e-9; 20 * CHANNELS]).iter().all(|&x| x.abs() < 1e-6));
        let wild: Vec<f64> = (0..20 * CHANNELS)
            .map(|i| 1e300 * (i as f64).sin())
            .collect();
        assert!(row(&wild).iter().all(|x| x.is_finite()));
        let of =
            |increments: &[f64]| values(increments, &mut Workspace::default(), &mut Vec::new());
        assert!(of(&[0.0; 11 * CHANNELS]).is_err());
        assert!(of(&[0.0; 12 * CHANNELS]).is_ok());
        assert!(of(&[f64::NAN; 20 * CHANNELS]).is_err());
    }

    #[test]
    fn the_peak_is_found_between_lags() {
        let mut correlation = [0.0; LAGS];
        correlation[6] = -0.4;
        correlation[7] = -0.4;
        assert!((weighted_lag(&correlation) - 0.6).abs() < 1e-12);
        assert_eq!(weighted_lag(&[0.0; LAGS]), 0.0);
    }
}
