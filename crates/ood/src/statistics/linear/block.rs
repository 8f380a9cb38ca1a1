//! Columns and values of the block.

use super::{CHANNELS, LAGS, LinearPredictor, REACH};
use crate::error::Error;
use crate::statistics::{AXES, Column, Workspace, quantile_sorted};

/// A residual (metres or radians per pose) below this counts as this under a logarithm.
const FLOOR: f64 = 1e-5;
/// The quantiles over a window.
const QUANTILES: [(f64, &str); 3] = [(0.5, "median"), (0.9, "q90"), (1.0, "max")];

/// The values of each axis stay together: from the other axes alone, then with its own neighbours.
pub(in crate::statistics) fn columns() -> Vec<Column> {
    let mut columns = Vec::new();
    for part in AXES {
        for regressors in ["others", "others_and_neighbours"] {
            for (_, quantile) in QUANTILES {
                let name = format!("{part}.left_by_{regressors}.log_{quantile}");
                columns.push(Column { part, name });
            }
        }
    }
    columns
}

/// Only increments with all their neighbours in the window count.
pub(in crate::statistics) fn values(
    predictor: &LinearPredictor,
    increments: &[f64],
    work: &mut Workspace,
    out: &mut Vec<f64>,
) -> Result<(), Error> {
    predictor.residuals_into(increments, work)?;
    let Workspace {
        residuals,
        series: sizes,
        ..
    } = work;
    if residuals.len() < LAGS {
        return Err(Error::TooFew {
            what: "body-frame increments",
            needed: LAGS,
            found: residuals.len(),
            hint: "an increment is predicted from three on both sides",
        });
    }
    let inner = &residuals[REACH..residuals.len() - REACH];
    for axis in 0..CHANNELS {
        for regressors in 0..2 {
            sizes.clear();
            sizes.extend(inner.iter().map(|r| r[regressors][axis].abs()));
            sizes.sort_unstable_by(f64::total_cmp);
            let log = |(q, _)| quantile_sorted(sizes, q).max(FLOOR).ln();
            out.extend(QUANTILES.map(log));
        }
    }
    Ok(())
}
