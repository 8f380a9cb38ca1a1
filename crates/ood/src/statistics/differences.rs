//! Robust quantiles of how body velocity and angular rate change, without a network.
//!
//! The second and third differences of the poses remove the motion and leave the sensor's noise. The
//! median and the 0.9 quantile over the window are not moved by the few jumps that a sound sensor
//! shows, as means and maxima of [`kinematic`](super::kinematic) are; the maximum is kept for faults
//! of a single step.

use super::kinematic::{differences, expect_steps, of_axis};
use super::{AXES, CHANNELS, Column, Workspace, quantile_sorted};
use crate::error::Error;

/// A difference (metres or radians per pose and pose) below this counts as this under a logarithm.
const FLOOR: f64 = 1e-5;
/// The quantiles over a window.
const QUANTILES: [(f64, &str); 3] = [(0.5, "median"), (0.9, "q90"), (1.0, "max")];

/// The values of each axis stay together: first differences of the increments, then second ones.
pub(super) fn columns() -> Vec<Column> {
    let mut columns = Vec::new();
    for part in AXES {
        for order in ["first", "second"] {
            for (_, quantile) in QUANTILES {
                let name = format!("{part}.{order}_difference.log_{quantile}");
                columns.push(Column { part, name });
            }
        }
    }
    columns
}

pub(super) fn values(
    increments: &[f64],
    work: &mut Workspace,
    out: &mut Vec<f64>,
) -> Result<(), Error> {
    expect_steps(increments, 3, "second differences need three increments")?;
    let Workspace {
        series,
        first,
        second,
        ..
    } = work;
    for axis in 0..CHANNELS {
        of_axis(increments, axis, series);
        differences(series, first);
        differences(first, second);
        for series in [&mut *first, &mut *second] {
            series.iter_mut().for_each(|x| *x = x.abs());
            series.sort_unstable_by(f64::total_cmp);
            let log = |(q, _)| quantile_sorted(series, q).max(FLOOR).ln();
            out.extend(QUANTILES.map(log));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn differences_by_hand() {
        // Forward steps 1, 1, 3, 1: first differences 0, 2, -2, second ones 2, -4.
        let steps = [1.0, 1.0, 3.0, 1.0];
        let increments: Vec<f64> = steps
            .iter()
            .flat_map(|&x| [x, 0., 0., 0., 0., 0.])
            .collect();
        let (mut work, mut out) = (Workspace::default(), Vec::new());
        values(&increments, &mut work, &mut out).unwrap();
        assert_eq!(out.len(), columns().len());
        assert_eq!(out[0], 2.0_f64.ln());
        assert_eq!(out[2], 2.0_f64.ln());
        assert_eq!(out[3], 3.0_f64.ln());
        assert_eq!(out[5], 4.0_f64.ln());
        // An axis that never moves is the floor, not minus infinity.
        assert!(out[6..].iter().all(|&x| x == FLOOR.ln()));
        assert!(values(&increments[..12], &mut work, &mut out).is_err());
        assert!(values(&increments[..13], &mut work, &mut out).is_err());
    }

    #[test]
    fn one_jump_moves_the_maximum_only() {
        let mut increments: Vec<f64> = (0..60)
            .flat_map(|i| [1.0 + 0.01 * f64::from(i % 2), 0., 0., 0., 0., 0.])
            .collect();
        let values = |increments: &[f64], out: &mut Vec<f64>| {
            super::values(increments, &mut Workspace::default(), out)
        };
        let (mut sound, mut jumped) = (Vec::new(), Vec::new());
        values(&increments, &mut sound).unwrap();
        increments[30 * CHANNELS] += 5.0;
        values(&increments, &mut jumped).unwrap();
        assert!((sound[0] - jumped[0]).abs() < 1e-9 && (sound[1] - jumped[1]).abs() < 1e-9);
        assert!(jumped[2] > sound[2] + 5.0);
    }
}
