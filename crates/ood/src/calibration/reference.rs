//! Held-out trusted scores, to which others are compared.

use super::tails::Tails;
use crate::error::Error;
use crate::score::Score;
use crate::statistics::quantile_sorted;
use serde::{Deserialize, Serialize};

/// Scores of held-out trusted windows or logs, in ascending order; never empty.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Vec<Score>", into = "Vec<Score>")]
pub struct Reference {
    sorted: Vec<Score>,
    tails: Tails,
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
        let tails = Tails::of(&values);
        Ok(Self {
            sorted: scores,
            tails,
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

    /// The logarithm of the p-value, made to fall strictly with the score from end to end: windows that
    /// no reference score tells apart stay apart when the p-values of several groups are combined. A
    /// verdict never rests on it without calibration of its own.
    ///
    /// At the reference scores it is [`p_value`](Self::p_value), half a rank less at the lowest; between
    /// them it is linear in p, so up to `1 / (n + 1)` above it. From the 0.9 quantile up it is an exponential tail with the mean excess
    /// of the reference. Below the lowest score `1 - p`, half a rank there, falls as
    /// `1 / (1 + distance / scale)`, with the mean shortfall under the 0.1 quantile as scale.
    #[must_use]
    pub fn ln_p(&self, score: Score) -> f64 {
        let Tails { upper, lower } = self.tails;
        let over = score.value() - upper.start;
        if over > 0.0 {
            return self.rank(Score::new(upper.start)).ln() - over / upper.scale;
        }
        let below = self.sorted.partition_point(|&s| s < score);
        let next = self.sorted.get(below).map_or(upper.start, |s| s.value());
        let next = next.min(upper.start);
        let p_next = self.rank(Score::new(next));
        let Some(&previous) = self.sorted[..below].last() else {
            let under = (lower.start - score.value()) / lower.scale;
            return (-(1.0 - p_next) / (1.0 + under)).ln_1p();
        };
        let left = (next - score.value()) / (next - previous.value());
        // Tied reference scores are several ranks at one place; the way to the next one is a single rank.
        let drop = (self.rank(previous) - p_next).min(self.smallest_p_value());
        (p_next + left * drop).ln()
    }

    /// As [`ln_p`](Self::ln_p), with the tail of a prediction: the scale is known from `clusters`
    /// independent exceedances only, and integrated out under the prior 1/scale the exponential tail
    /// becomes `(1 + z / clusters)^-clusters` for z scales beyond its start.
    #[must_use]
    pub(super) fn predictive_ln_p(&self, score: Score, clusters: f64) -> f64 {
        let upper = self.tails.upper;
        let over = score.value() - upper.start;
        if over <= 0.0 {
            return self.ln_p(score);
        }
        let start = self.rank(Score::new(upper.start)).ln();
        start - clusters * (over / upper.scale / clusters).ln_1p()
    }

    /// The score whose [`predictive_ln_p`](Self::predictive_ln_p) is `ln p`; where `p` is larger than what
    /// the tail starts at, that start.
    #[must_use]
    pub(super) fn predictive_score(&self, p: f64, clusters: f64) -> f64 {
        let upper = self.tails.upper;
        let fall = self.rank(Score::new(upper.start)) / p;
        upper.start + upper.scale * clusters * (fall.ln().max(0.0) / clusters).exp_m1()
    }

    /// The p-value, of which half a rank is left for what lies below the lowest score.
    fn rank(&self, score: Score) -> f64 {
        let highest = 1.0 - 0.5 * self.smallest_p_value();
        self.p_value(score).min(highest)
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
    fn equal_highest_scores_do_not_end_the_tail() {
        // Four of twelve are the highest, as runs of windows that share their lowest one: none is beyond the 0.9 quantile.
        let r = reference(&[0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 9.0, 9.0, 9.0, 9.0]);
        let at = |v: f64| r.ln_p(Score::new(v));
        // Over the median 5.5 the mean excess is (0.5 + 1.5 + 4 * 3.5) / 6.
        assert!((at(9.0) - at(10.0) - 6.0 / 16.0).abs() < 1e-12);
        // Of two equal scores, over the lowest of three.
        let r = reference(&[0.0, 3.0, 3.0]);
        assert!((r.ln_p(Score::new(3.0)) - r.ln_p(Score::new(6.0)) - 1.0).abs() < 1e-12);
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
        assert_eq!(constant.ln_p(Score::new(2.0)), (1.0 - 0.5 / 11.0_f64).ln());
    }

    #[test]
    fn ln_p_below_the_lowest_score_by_hand() {
        let values: Vec<f64> = (0..=100).map(f64::from).collect();
        let r = reference(&values);
        // Half a rank of 102 is left at 0; the mean shortfall under 10 of 0..=9 is 5.5.
        for (at, share) in [(0.0, 1.0), (-5.5, 0.5), (-55.0, 1.0 / 11.0)] {
            let p = r.ln_p(Score::new(at)).exp();
            assert!((1.0 - p - share * 0.5 / 102.0).abs() < 1e-15, "{at}: {p}");
        }
        assert_eq!(r.p_value(Score::new(-55.0)), 1.0);
    }

    #[test]
    fn ln_p_keeps_windows_apart_beyond_both_ends() {
        let spread = reference(&[5e11, 6e11, 1e12, 2e12, 9e11, 7e11]);
        for r in [spread, reference(&[2.0; 10]), reference(&[-3.0])] {
            // Distances that the scores themselves can hold.
            let size = r.quantile(0.5).abs();
            let mut ends = vec![-1e250, -1e100];
            ends.extend((-20..20).map(|i| size * f64::from(i) / 4.0));
            ends.extend([1e100, 1e250]);
            for pair in ends.windows(2) {
                let [lower, higher] = [pair[0], pair[1]].map(|v| r.ln_p(Score::new(v)));
                assert!(lower > higher && higher.is_finite(), "{pair:?}");
            }
        }
        let stored: Reference = serde_json::from_str("[3.0, 1.0, 2.0]").unwrap();
        assert_eq!(stored, reference(&[1.0, 2.0, 3.0]));
    }

    proptest! {
        #![proptest_config(crate::property_cases::cases(256))]

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
        fn ln_p_falls_strictly_and_stays_within_a_rank_of_the_p_value(
            values in prop::collection::vec(-9_i32..9, 1..60),
            mut at in prop::collection::vec(-40.0_f64..40.0, 2..20),
        ) {
            let r = reference(&values.iter().map(|&v| f64::from(v)).collect::<Vec<_>>());
            at.extend(values.iter().map(|&v| f64::from(v)));
            at.sort_by(f64::total_cmp);
            at.dedup();
            let start = r.quantile(0.9);
            for pair in at.windows(2) {
                let [lower, higher] = [pair[0], pair[1]].map(|v| r.ln_p(Score::new(v)));
                // Neighbours that differ by a rounding error may tie.
                prop_assert!(lower > higher || pair[1] - pair[0] < 1e-9 && lower == higher);
            }
            for v in at.into_iter().filter(|&v| v <= start) {
                let (p, ranked) = (r.p_value(Score::new(v)), r.ln_p(Score::new(v)).exp());
                let rank = r.smallest_p_value() * (1.0 + 1e-9);
                prop_assert!((ranked - p).abs() <= rank, "{} {} at {}", ranked, p, v);
            }
        }
    }
}
