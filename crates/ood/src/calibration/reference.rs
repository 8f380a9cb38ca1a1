//! Held-out trusted scores, to which others are compared.

use crate::error::Error;
use crate::score::Score;
use crate::statistics::quantile_sorted;
use serde::{Deserialize, Serialize};

/// Beyond this quantile the tail is taken as exponential.
const TAIL: f64 = 0.9;

/// Scores of held-out trusted windows or logs, in ascending order; never empty.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Vec<Score>", into = "Vec<Score>")]
pub struct Reference {
    sorted: Vec<Score>,
    tail: Tail,
}

/// `p(s) = p(start) exp(-(s - start) / scale)`.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Tail {
    start: f64,
    scale: f64,
}

impl Reference {
    /// From scores in any order.
    ///
    /// # Errors
    /// [`Error::TooFew`] for none.
    pub fn new(mut scores: Vec<Score>) -> Result<Self, Error> {
        if scores.is_empty() {
            return Err(Error::TooFew {
                what: "trusted scores",
                needed: 1,
                found: 0,
                hint: "a p-value needs trusted scores to compare with",
            });
        }
        scores.sort();
        let values: Vec<f64> = scores.iter().map(|s| s.value()).collect();
        let start = quantile_sorted(&values, TAIL);
        let over: Vec<f64> = values
            .iter()
            .map(|v| v - start)
            .filter(|&v| v > 0.0)
            .collect();
        let mean = over.iter().sum::<f64>() / over.len().max(1) as f64;
        let scale = mean.max(1e-9 * start.abs().max(1.0));
        Ok(Self {
            sorted: scores,
            tail: Tail { start, scale },
        })
    }

    /// How many scores.
    #[must_use]
    #[allow(clippy::len_without_is_empty)] // It is never empty.
    pub fn len(&self) -> usize {
        self.sorted.len()
    }

    /// The scores, ascending.
    #[must_use]
    pub fn scores(&self) -> &[Score] {
        &self.sorted
    }

    /// The `q` quantile.
    #[must_use]
    pub fn quantile(&self, q: f64) -> f64 {
        let values: Vec<f64> = self.sorted.iter().map(|s| s.value()).collect();
        quantile_sorted(&values, q)
    }

    /// `(1 + #{reference >= score}) / (n + 1)`: the conformal p-value, in `[1/(n+1), 1]`. If the
    /// score is exchangeable with the reference, `P(p <= a) <= a` for every a.
    #[must_use]
    pub fn p_value(&self, score: Score) -> f64 {
        let below = self.sorted.partition_point(|&s| s < score);
        (1 + self.len() - below) as f64 / (self.len() + 1) as f64
    }

    /// The smallest p-value there is: `1 / (n + 1)`.
    #[must_use]
    pub fn smallest_p_value(&self) -> f64 {
        1.0 / (self.len() + 1) as f64
    }

    /// The threshold of which `score > threshold` is the same as `p_value(score) <= alpha`: the
    /// bottom `alpha` of the likelihoods. Where alpha is finer than
    /// [`smallest_p_value`](Self::smallest_p_value), it is the highest reference score, and what is
    /// beyond it has a p-value above alpha.
    #[must_use]
    pub fn threshold(&self, alpha: f64) -> Score {
        let n = self.len();
        // Guarded against alpha (n + 1) falling short of an integer by rounding.
        let may_exceed = (alpha * (n + 1) as f64 * (1.0 + 1e-12)).floor() as usize;
        let rank = may_exceed.saturating_sub(1).min(n - 1);
        self.sorted[n - 1 - rank]
    }

    /// ln p(score) without a lower end: the logarithm of the p-value up to the 0.9 quantile, from
    /// there on an exponential tail with the mean excess of the reference. It falls strictly with
    /// the score in the tail, so that far and very far windows stay apart when p-values are
    /// combined; a verdict never rests on it without calibration of its own.
    #[must_use]
    pub fn ln_p(&self, score: Score) -> f64 {
        let over = score.value() - self.tail.start;
        if over <= 0.0 {
            return self.p_value(score).ln();
        }
        let at_start = self.p_value(Score::new(self.tail.start)).ln();
        at_start - over / self.tail.scale
    }
}

impl TryFrom<Vec<Score>> for Reference {
    type Error = Error;

    fn try_from(scores: Vec<Score>) -> Result<Self, Error> {
        Self::new(scores)
    }
}

impl From<Reference> for Vec<Score> {
    fn from(reference: Reference) -> Self {
        reference.sorted
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn reference(values: &[f64]) -> Reference {
        Reference::new(values.iter().map(|&v| Score::new(v)).collect()).unwrap()
    }

    #[test]
    fn p_values_by_hand() {
        let r = reference(&[3.0, 1.0, 2.0, 2.0]);
        let p = |v: f64| r.p_value(Score::new(v));
        assert_eq!(
            [p(0.0), p(1.0), p(2.0), p(2.5), p(3.0), p(4.0)],
            [1.0, 1.0, 0.8, 0.4, 0.4, 0.2]
        );
        assert_eq!(r.smallest_p_value(), 0.2);
        assert!(Reference::new(vec![]).is_err());
    }

    #[test]
    fn thresholds_by_hand() {
        let values: Vec<f64> = (1..=99).map(f64::from).collect();
        let r = reference(&values);
        // 5 % of 100: four reference scores may be as high.
        assert_eq!(r.threshold(0.05), Score::new(95.0));
        assert_eq!(r.threshold(0.01), Score::new(99.0));
        assert_eq!(r.threshold(0.001), Score::new(99.0));
        assert_eq!(r.threshold(1.0), Score::new(1.0));
    }

    #[test]
    fn ln_p_joins_at_the_tail_and_never_ends() {
        let values: Vec<f64> = (0..=100).map(f64::from).collect();
        let r = reference(&values);
        let at = |v: f64| r.ln_p(Score::new(v));
        assert_eq!(at(90.0), r.p_value(Score::new(90.0)).ln());
        // Mean excess over 90 of 91..=100 is 5.5.
        assert!((at(90.0) - at(101.0) - 2.0).abs() < 1e-12);
        assert!(at(1e6) > at(1e7) && at(1e299).is_finite());
        let constant = reference(&[2.0; 10]);
        assert!(constant.ln_p(Score::new(3.0)) < -1e6);
        assert_eq!(constant.ln_p(Score::new(2.0)), 0.0);
    }

    proptest! {
        #[test]
        fn threshold_and_p_value_agree(
            values in prop::collection::vec(-5_i32..5, 1..60),
            at in -6_i32..6,
            alpha in 0.01_f64..1.0,
        ) {
            let r = reference(&values.iter().map(|&v| f64::from(v)).collect::<Vec<_>>());
            let score = Score::new(f64::from(at));
            let beyond = score > r.threshold(alpha);
            if alpha >= r.smallest_p_value() {
                prop_assert_eq!(beyond, r.p_value(score) <= alpha);
            } else {
                prop_assert_eq!(beyond, r.p_value(score) <= r.smallest_p_value());
            }
        }

        #[test]
        fn ln_p_never_rises(mut at in prop::collection::vec(-10.0_f64..200.0, 2..20)) {
            let r = reference(&(0..50).map(|i| f64::from(i * i % 37)).collect::<Vec<_>>());
            at.sort_by(f64::total_cmp);
            for pair in at.windows(2) {
                prop_assert!(r.ln_p(Score::new(pair[1])) <= r.ln_p(Score::new(pair[0])) + 1e-12);
            }
        }
    }
}
