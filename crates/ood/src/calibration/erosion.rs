//! Runs of windows that are all unusual.
//!
//! One high window is chance; three overlapping ones share a fault. The eroded score of a run of `q`
//! consecutive windows is the lowest of theirs, `E_i = min(T_i, ..., T_{i+q-1})` (a grey-scale erosion
//! by a flat element of q windows), within one gap-free stretch of a log.

use crate::error::Error;
use crate::score::Score;
use serde::{Deserialize, Serialize};

/// How long a run is, and the share of the chance of error that it may spend.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Duration {
    /// Windows of a run.
    pub windows: usize,
    /// Weight among the durations, in (0, 1]; they sum to 1.
    pub weight: f64,
}

impl Duration {
    /// The durations of a detector whose windows overlap `overlap`-fold (window length over stride,
    /// rounded up): three quarters of a window's length with weight 0.8, and three lengths with 0.2.
    ///
    /// On validation logs runs of three windows called most faults of 10 to 100 poses, runs of six and
    /// twelve fewer; the long run sees what is weak and lasting.
    #[must_use]
    pub fn of_overlap(overlap: usize) -> Vec<Self> {
        let short = (0.75 * overlap as f64).round().max(1.0) as usize;
        let of = |windows, weight| Self { windows, weight };
        vec![of(short, 0.8), of(4 * short, 0.2)]
    }

    /// Checks a list of durations.
    ///
    /// # Errors
    /// [`Error::Parameter`] for none, for a run without windows, for weights that are not positive or do
    /// not sum to 1.
    pub fn check(durations: &[Self]) -> Result<(), Error> {
        let total: f64 = durations.iter().map(|d| d.weight).sum();
        let each = durations.iter().all(|d| d.windows > 0 && d.weight > 0.0);
        if each && (total - 1.0).abs() < 1e-9 {
            return Ok(());
        }
        Err(Error::Parameter {
            name: "durations",
            value: format!("{durations:?}"),
            expected: "each needs at least one window and a positive weight, and weights sum to 1",
        })
    }
}

/// The lowest score of every run of `run` consecutive windows: `n - run + 1` of them, none where there are
/// fewer windows than that.
#[must_use]
pub fn erode(scores: &[Score], run: usize) -> Vec<Score> {
    scores
        .windows(run.max(1))
        .filter_map(|window| window.iter().copied().min())
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn of(values: &[i32]) -> Vec<Score> {
        values.iter().map(|&v| Score::new(f64::from(v))).collect()
    }

    #[test]
    fn erosion_by_hand() {
        let scores = of(&[1, 5, 4, 6, 2, 9]);
        assert_eq!(erode(&scores, 1), scores);
        assert_eq!(erode(&scores, 3), of(&[1, 4, 2, 2]));
        assert_eq!(erode(&scores, 6), of(&[1]));
        assert!(erode(&scores, 7).is_empty());
        assert!(erode(&[], 1).is_empty());
    }

    #[test]
    fn durations_by_hand() {
        let windows = |overlap| -> Vec<usize> {
            Duration::of_overlap(overlap)
                .iter()
                .map(|d| d.windows)
                .collect()
        };
        assert_eq!(windows(4), [3, 12]);
        assert_eq!(windows(1), [1, 4]);
        assert_eq!(windows(8), [6, 24]);
        for overlap in [1, 4, 9] {
            Duration::check(&Duration::of_overlap(overlap)).unwrap();
        }
        let of = |windows, weight| Duration { windows, weight };
        for bad in [
            vec![],
            vec![of(0, 1.0)],
            vec![of(3, 0.5)],
            vec![of(3, 1.5), of(4, -0.5)],
            vec![of(3, f64::NAN)],
        ] {
            assert!(Duration::check(&bad).is_err(), "{bad:?}");
        }
    }

    proptest! {
        #![proptest_config(crate::property_cases::cases(256))]

        #[test]
        fn a_longer_run_is_no_higher(
            values in prop::collection::vec(-20_i32..20, 1..40),
            run in 1_usize..12,
        ) {
            let scores = of(&values);
            let (shorter, longer) = (erode(&scores, run), erode(&scores, run + 1));
            prop_assert_eq!(shorter.len(), (scores.len() + 1).saturating_sub(run));
            for (i, eroded) in longer.iter().enumerate() {
                prop_assert_eq!(*eroded, shorter[i].min(shorter[i + 1]));
            }
        }
    }
}
