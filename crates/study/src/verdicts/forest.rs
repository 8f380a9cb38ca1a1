//! Isolation forest (Liu, Ting and Zhou 2008): rows that few random cuts set apart are unusual.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

const TREES: usize = 100;
/// Rows that a tree is grown from.
const SAMPLE: usize = 256;

/// The trees.
pub struct Forest {
    trees: Vec<Tree>,
    /// Path length that an unusual row is measured by.
    usual: f64,
}

enum Tree {
    Leaf {
        rows: usize,
    },
    Cut {
        column: usize,
        at: f64,
        below: Box<Tree>,
        above: Box<Tree>,
    },
}

impl Forest {
    /// Grows the trees; `rows` are of one length.
    pub fn fit(rows: &[Vec<f64>], seed: u64) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let sample = SAMPLE.min(rows.len());
        let depth = (sample as f64).log2().ceil() as usize;
        let mut tree = || {
            let chosen: Vec<&[f64]> = (0..sample)
                .map(|_| rows[rng.random_range(0..rows.len())].as_slice())
                .collect();
            grow(&chosen, depth, &mut rng)
        };
        Self {
            trees: (0..TREES).map(|_| tree()).collect(),
            usual: path_length(sample),
        }
    }

    /// `2^(-mean path length / usual path length)`, in (0, 1); higher is more unusual.
    pub fn score(&self, row: &[f64]) -> f64 {
        let sum: f64 = self.trees.iter().map(|tree| tree.path(row)).sum();
        (-(sum / self.trees.len() as f64) / self.usual.max(f64::MIN_POSITIVE)).exp2()
    }
}

impl Tree {
    fn path(&self, row: &[f64]) -> f64 {
        match self {
            Self::Leaf { rows } => path_length(*rows),
            Self::Cut {
                column,
                at,
                below,
                above,
            } => 1.0 + if row[*column] < *at { below } else { above }.path(row),
        }
    }
}

fn grow(rows: &[&[f64]], depth: usize, rng: &mut ChaCha8Rng) -> Tree {
    let leaf = Tree::Leaf { rows: rows.len() };
    if depth == 0 || rows.len() < 2 {
        return leaf;
    }
    let column = rng.random_range(0..rows[0].len());
    let values = || rows.iter().map(|row| row[column]);
    let low = values().fold(f64::INFINITY, f64::min);
    let high = values().fold(f64::NEG_INFINITY, f64::max);
    if low >= high {
        return leaf;
    }
    let at = rng.random_range(low..high);
    let (below, above): (Vec<&[f64]>, Vec<&[f64]>) = rows.iter().partition(|row| row[column] < at);
    Tree::Cut {
        column,
        at,
        below: Box::new(grow(&below, depth - 1, rng)),
        above: Box::new(grow(&above, depth - 1, rng)),
    }
}

/// Mean path length of an unsuccessful search in a binary tree of so many rows.
fn path_length(rows: usize) -> f64 {
    const EULER: f64 = 0.577_215_664_901_532_9;
    match rows {
        0 | 1 => 0.0,
        2 => 1.0,
        n => {
            let n = n as f64;
            2.0 * ((n - 1.0).ln() + EULER) - 2.0 * (n - 1.0) / n
        }
    }
}

#[cfg(test)]
mod tests {
    use super::Forest;

    #[test]
    fn a_row_apart_is_more_unusual() {
        // Sums of waves are nearly normal: rare at the edges, where a forest cuts them off early.
        let wave = |i: usize, k: f64| {
            (1..7)
                .map(|j| (i as f64 * k * f64::from(j * j)).sin())
                .sum()
        };
        let rows: Vec<Vec<f64>> = (0..300).map(|i| vec![wave(i, 0.7), wave(i, 1.3)]).collect();
        let forest = Forest::fit(&rows, 1);
        let (inside, apart) = (forest.score(&[0.1, -0.2]), forest.score(&[9.0, -9.0]));
        assert!(inside < 0.5 && apart > 0.6, "{inside} {apart}");
        assert_eq!(Forest::fit(&rows, 1).score(&[0.1, -0.2]), inside);
        // Rows that are all the same leave nothing to cut.
        let flat = Forest::fit(&vec![vec![1.0]; 10], 1);
        assert!(flat.score(&[1.0]).is_finite());
    }
}
