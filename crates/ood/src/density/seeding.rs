//! Where EM starts: k-means from seeded k-means++ centres.

use crate::error::Error;
use linfa::prelude::{DatasetBase, Fit, ParamGuard, Predict};
use linfa_clustering::{KMeans, KMeansInit};
use ndarray::{Array2, ArrayView1};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Lloyd iterations: EM refines the clusters anyway.
const ITERATIONS: u64 = 50;

/// The cluster of each row that a mixture started from; nothing for densities that start from nothing.
///
/// A fit without some of the rows may start from the clusters of the others: it is drawn once instead of
/// anew, and every parameter is still estimated from its own rows alone.
#[derive(Clone, Debug, Default)]
pub(crate) struct Start(Option<Vec<usize>>);

impl Start {
    pub fn of(clusters: Vec<usize>) -> Self {
        Self(Some(clusters))
    }

    /// The start of some of the rows.
    pub fn select(&self, rows: &[usize]) -> Self {
        let some = |clusters: &Vec<usize>| rows.iter().map(|&row| clusters[row]).collect();
        Self(self.0.as_ref().map(some))
    }

    pub fn clusters(&self) -> Option<&[usize]> {
        self.0.as_deref()
    }
}

/// The cluster of each row. linfa's k-means takes an older generator of random numbers than this
/// workspace and starts every run from the same one; so the k-means++ centres (Arthur and
/// Vassilvitskii 2007) are drawn here, and linfa iterates from them.
pub(super) fn clusters(rows: &Array2<f64>, k: usize, seed: u64) -> Result<Vec<usize>, Error> {
    if k == 1 {
        return Ok(vec![0; rows.nrows()]);
    }
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let model = KMeans::params(k)
        .n_runs(1)
        .max_n_iterations(ITERATIONS)
        .tolerance(1e-3)
        .init_method(KMeansInit::Precomputed(plus_plus(rows, k, &mut rng)))
        .check()?
        .fit(&DatasetBase::from(rows.view()))?;
    Ok(model.predict(rows).to_vec())
}

/// k-means++: each next centre is a row drawn with probability proportional to its squared distance
/// to the nearest centre so far.
fn plus_plus(rows: &Array2<f64>, k: usize, rng: &mut ChaCha8Rng) -> Array2<f64> {
    let mut centres = Array2::zeros((k, rows.ncols()));
    let mut pick = rng.random_range(0..rows.nrows());
    let mut nearest = vec![f64::INFINITY; rows.nrows()];
    for index in 0..k {
        let centre = rows.row(pick);
        centres.row_mut(index).assign(&centre);
        for (distance, row) in nearest.iter_mut().zip(rows.outer_iter()) {
            *distance = distance.min(squared_distance(row, centre));
        }
        pick = draw(&nearest, rng);
    }
    centres
}

fn squared_distance(a: ArrayView1<'_, f64>, b: ArrayView1<'_, f64>) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum()
}

/// An index with probability proportional to its weight; where all weights are zero (every row is a
/// centre already) any index will do.
fn draw(weights: &[f64], rng: &mut ChaCha8Rng) -> usize {
    let total: f64 = weights.iter().sum();
    let mut left = rng.random::<f64>() * total;
    for (index, weight) in weights.iter().enumerate() {
        left -= weight;
        if left < 0.0 {
            return index;
        }
    }
    weights.iter().rposition(|&w| w > 0.0).unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn well_separated_blobs_are_found_from_any_seed() {
        let rows = Array2::from_shape_fn((60, 2), |(i, j)| {
            let centre = [[0.0, 0.0], [10.0, 0.0], [0.0, 10.0]][i % 3][j];
            centre + 0.1 * ((i * 7 + j * 3) % 11) as f64
        });
        for seed in 0..20 {
            let found = clusters(&rows, 3, seed).unwrap();
            for i in 3..60 {
                assert_eq!(found[i], found[i % 3], "seed {seed}");
            }
            assert_ne!(found[0], found[1]);
            assert_ne!(found[1], found[2]);
            assert_ne!(found[0], found[2]);
        }
    }

    #[test]
    fn equal_rows_do_not_break_it() {
        let rows = Array2::ones((5, 2));
        assert_eq!(clusters(&rows, 3, 1).unwrap().len(), 5);
    }
}
