//! How often a trusted piece differs so much.

use crate::statistics::quantile_sorted;

/// A tail begins at this quantile of the trusted pieces,
const HIGH: f64 = 0.9;
/// or lower, so that so many lie beyond it: the scale of two or three says little.
const FEWEST_BEYOND: f64 = 8.0;
/// But not below their middle.
const LOWEST: f64 = 0.5;

/// The largest differences of trusted pieces, each judged by other groups, and how their chance goes on.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Tail {
    sorted: Vec<f64>,
    start: f64,
    /// Mean excess over the start.
    scale: f64,
    /// How many are beyond it.
    beyond: f64,
}

impl Tail {
    /// None for no piece.
    pub fn of(zs: impl Iterator<Item = f64>) -> Option<Self> {
        let mut sorted: Vec<f64> = zs.collect();
        if sorted.is_empty() {
            return None;
        }
        sorted.sort_by(f64::total_cmp);
        let enough = 1.0 - FEWEST_BEYOND / sorted.len() as f64;
        let start = quantile_sorted(&sorted, enough.clamp(LOWEST, HIGH));
        let excesses: Vec<f64> = sorted
            .iter()
            .map(|z| z - start)
            .filter(|e| *e > 0.0)
            .collect();
        let beyond = excesses.len().max(1) as f64;
        let mean = excesses.iter().sum::<f64>() / beyond;
        Some(Self {
            scale: mean.max(1e-9 * start.max(1.0)),
            sorted,
            start,
            beyond,
        })
    }

    /// The largest.
    pub fn most(&self) -> f64 {
        self.sorted.last().copied().unwrap_or(0.0)
    }

    /// Chance of a difference of `z` or more: its rank up to the start of the tail; from there on an exponential tail
    /// whose scale is known from c pieces only, and integrated out, `(1 + excess / (c scale))^-c`.
    pub fn chance(&self, z: f64) -> f64 {
        let over = z - self.start;
        if over <= 0.0 {
            return self.rank(z);
        }
        let fall = self.beyond * (over / self.scale / self.beyond).ln_1p();
        (self.rank(self.start) * (-fall).exp()).max(f64::MIN_POSITIVE)
    }

    fn rank(&self, z: f64) -> f64 {
        let below = self.sorted.partition_point(|&s| s < z);
        (1 + self.sorted.len() - below) as f64 / (self.sorted.len() + 1) as f64
    }
}

#[cfg(test)]
mod tests {
    use super::Tail;

    #[test]
    fn chances_by_hand() {
        // 0, 1, ..., 100: ten beyond 90, by 5.5 on average.
        let tail = Tail::of((0..=100).map(f64::from)).unwrap();
        assert_eq!(tail.chance(0.0), 1.0);
        assert_eq!(tail.chance(50.0), 52.0 / 102.0);
        let beyond = |excess: f64| 12.0 / 102.0 * (1.0 + excess / 55.0).powi(-10);
        assert!((tail.chance(101.0) - beyond(11.0)).abs() < 1e-15);
        assert_eq!(tail.most(), 100.0);
        // Of twenty, eight: beyond 11.4 are 12 to 19, by 4.1 on average.
        let few = Tail::of((0..20).map(f64::from)).unwrap();
        let expected = 9.0 / 21.0 * (1.0_f64 + 8.0 / (8.0 * 4.1)).powi(-8);
        assert!((few.chance(19.4) - expected).abs() < 1e-12);
        // Equal ones, one, none.
        let equal = Tail::of([2.0; 9].into_iter()).unwrap();
        assert!(equal.chance(2.0) == 1.0 && equal.chance(3.0) < 0.2);
        assert!(Tail::of([0.0].into_iter()).unwrap().chance(1e300) > 0.0);
        assert!(Tail::of([].into_iter()).is_none());
    }
}
