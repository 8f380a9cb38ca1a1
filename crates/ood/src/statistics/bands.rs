//! Statistics per axis in bands of the noise level.
//!
//! A sum over all steps lets the noisiest steps, where every window looks alike, drown the quiet
//! ones. So the steps are cut into [`BANDS`] bands of equal size, band 0 with the least noise, and
//! each axis keeps its own number. Mean squares enter by their logarithm, which makes them close to
//! Gaussian.

use super::statistic::Statistic;
use super::trace::CHANNELS;
use super::{AXES, Column, TraceSummary};
use crate::error::Error;

/// Number of noise bands.
pub const BANDS: usize = 6;

/// A mean square below this counts as this; it is far under the error of f32 arithmetic on noise of
/// size 1.
const SQUARE_FLOOR: f64 = 1e-12;

/// The band of one of `count` steps.
pub(super) fn band(step: usize, count: usize) -> usize {
    step * BANDS / count
}

/// Axis first, then quantity, then band: the columns of an axis stay together.
pub(super) fn columns(quantities: &[&str]) -> Vec<Column> {
    let mut columns = Vec::new();
    for part in AXES {
        for quantity in quantities {
            for band in 0..BANDS {
                let name = format!("{part}.{quantity}.band_{band}");
                columns.push(Column { part, name });
            }
        }
    }
    columns
}

pub(super) fn residual(trace: &TraceSummary, out: &mut Vec<f64>) -> Result<(), Error> {
    let rows: Vec<_> = trace.steps.iter().map(|s| s.residual).collect();
    let means = band_means(Statistic::Residual, &rows, 0)?;
    push(out, &[&means], log_floored);
    Ok(())
}

pub(super) fn residual_quantiles(trace: &TraceSummary, out: &mut Vec<f64>) -> Result<(), Error> {
    check_steps(Statistic::ResidualQuantiles, trace.steps.len(), 0)?;
    for rows in [&trace.residual_q90, &trace.residual_max] {
        crate::error::expect_len("noise bands of a trace summary", BANDS, rows.len())?;
    }
    push(
        out,
        &[&trace.residual_q90, &trace.residual_max],
        log_floored,
    );
    Ok(())
}

pub(super) fn eps_mean(trace: &TraceSummary, out: &mut Vec<f64>) -> Result<(), Error> {
    let rows: Vec<_> = trace.steps.iter().map(|s| s.eps[0]).collect();
    let means = band_means(Statistic::EpsMean, &rows, 0)?;
    push(out, &[&means], |mean| mean);
    Ok(())
}

pub(super) fn change(trace: &TraceSummary, out: &mut Vec<f64>) -> Result<(), Error> {
    // The first step has no step before it.
    let rows: Vec<_> = trace.steps.iter().skip(1).map(|s| s.change[1]).collect();
    let means = band_means(Statistic::Change, &rows, 1)?;
    push(out, &[&means], log_floored);
    Ok(())
}

fn check_steps(statistic: Statistic, rows: usize, lost: usize) -> Result<(), Error> {
    if rows < BANDS {
        return Err(Error::TooFewSteps {
            statistic,
            needed: BANDS + lost,
            found: rows + lost,
        });
    }
    Ok(())
}

/// Means of the rows of each band; `lost` rows of the trace have no value.
fn band_means(
    statistic: Statistic,
    rows: &[[f64; CHANNELS]],
    lost: usize,
) -> Result<Vec<[f64; CHANNELS]>, Error> {
    check_steps(statistic, rows.len(), lost)?;
    let mut means = vec![[0.0; CHANNELS]; BANDS];
    let mut counts = [0_usize; BANDS];
    for (step, row) in rows.iter().enumerate() {
        let b = band(step, rows.len());
        counts[b] += 1;
        for (sum, value) in means[b].iter_mut().zip(row) {
            *sum += value;
        }
    }
    for (mean, &count) in means.iter_mut().zip(&counts) {
        for value in mean {
            *value /= count as f64;
        }
    }
    Ok(means)
}

/// Writes quantities of shape `[band][axis]` in the order of [`columns`].
fn push(out: &mut Vec<f64>, quantities: &[&Vec<[f64; CHANNELS]>], map: impl Fn(f64) -> f64) {
    for axis in 0..CHANNELS {
        for quantity in quantities {
            out.extend(quantity.iter().map(|row| map(row[axis])));
        }
    }
}

fn log_floored(square: f64) -> f64 {
    square.max(SQUARE_FLOOR).ln()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_band_gets_steps() {
        for count in BANDS..100 {
            let mut sizes = [0_usize; BANDS];
            for step in 0..count {
                sizes[band(step, count)] += 1;
            }
            assert!(sizes.iter().all(|&n| n > 0), "{count}: {sizes:?}");
            assert!(sizes.iter().max().unwrap() - sizes.iter().min().unwrap() <= 1);
        }
    }
}
