//! Kinematics without a network: per axis, the mean, the log mean square and the log maximum of the
//! body-frame increments (velocity and angular rate per pose) and of their differences. A strong
//! baseline on faults; whatever is shipped must be better.

use super::trace::CHANNELS;
use super::{AXES, Column, Workspace};
use crate::error::{Error, expect_len};

/// An increment (metres or radians per pose) below this counts as this under a logarithm: below a
/// sensor's resolution the logarithm would only tell how a log was rounded.
const FLOOR: f64 = 1e-5;

const QUANTITIES: [&str; 3] = ["mean", "log_mean_square", "log_max"];

/// The values of each axis stay together: velocity, then its differences.
pub(super) fn columns() -> Vec<Column> {
    let mut columns = Vec::new();
    for part in AXES {
        for what in ["rate", "change"] {
            for quantity in QUANTITIES {
                let name = format!("{part}.{what}.{quantity}");
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
    expect_steps(increments, 2, "differences need two increments")?;
    let Workspace { series, first, .. } = work;
    for axis in 0..CHANNELS {
        of_axis(increments, axis, series);
        differences(series, first);
        for series in [&*series, &*first] {
            let count = series.len() as f64;
            let mean_square = series.iter().map(|x| x * x).sum::<f64>() / count;
            let max = series.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
            out.push(series.iter().sum::<f64>() / count);
            out.push(mean_square.max(FLOOR * FLOOR).ln());
            out.push(max.max(FLOOR).ln());
        }
    }
    Ok(())
}

/// An error for fewer than `needed` increments.
pub(super) fn expect_steps(
    increments: &[f64],
    needed: usize,
    hint: &'static str,
) -> Result<(), Error> {
    let length = increments.len() / CHANNELS;
    expect_len("body-frame increments", length * CHANNELS, increments.len())?;
    if length < needed {
        return Err(Error::TooFew {
            what: "body-frame increments",
            needed,
            found: length,
            hint,
        });
    }
    Ok(())
}

/// The increments of one axis.
pub(super) fn of_axis(increments: &[f64], axis: usize, out: &mut Vec<f64>) {
    out.clear();
    out.extend(increments.iter().skip(axis).step_by(CHANNELS));
}

/// From one element of a series to the next.
pub(super) fn differences(series: &[f64], out: &mut Vec<f64>) {
    out.clear();
    out.extend(series.windows(2).map(|w| w[1] - w[0]));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_steady_drive_by_hand() {
        // 1 m forward per pose, then 2 m; turning left by 0.1 rad per pose.
        let increments = [1.0, 0., 0., 0., 0., 0.1, 2.0, 0., 0., 0., 0., 0.1];
        let (mut work, mut out) = (Workspace::default(), Vec::new());
        values(&increments, &mut work, &mut out).unwrap();
        assert_eq!(out.len(), columns().len());
        assert_eq!(out[0], 1.5);
        assert_eq!(out[1], 2.5_f64.ln());
        assert_eq!(out[2], 2.0_f64.ln());
        assert_eq!(out[3], 1.0);
        assert_eq!(out[4], 0.0);
        // Standing still is the floor, not minus infinity.
        assert_eq!(out[8], FLOOR.ln());
        assert!((out[30] - 0.1).abs() < 1e-15);
        assert!((out[35] - FLOOR.ln()).abs() < 1e-12);
        assert!(values(&increments[..6], &mut work, &mut out).is_err());
        assert!(values(&increments[..7], &mut work, &mut out).is_err());
    }
}
