//! How well scores tell out-of-distribution from in-distribution, with intervals over logs.
//!
//! OOD is the positive class and a higher score is more OOD. `id` are scores of in-distribution
//! windows (or logs) that no density has seen, `ood` those of the other data set.

mod bootstrap;
mod curve;

pub use bootstrap::{Bootstrap, Estimate, Grouped, Interval, estimate, estimate_all};

use crate::error::Error;
use crate::score::Score;
use curve::{Curve, Entry};
use serde::{Deserialize, Serialize};

/// A number in [0, 1] that compares two lists of scores. The ends are exact: perfectly separated
/// lists have an [`auroc`] of 1, not of 1 less a rounding error.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Metric {
    /// See [`auroc`].
    Auroc,
    /// See [`aupr_in`].
    AuprIn,
    /// See [`aupr_out`].
    AuprOut,
    /// See [`fpr_at_95tpr`].
    FprAt95Tpr,
    /// Share of OOD scores beyond a threshold.
    DetectionAt(Score),
    /// Share of ID scores beyond a threshold.
    FalseAlarmAt(Score),
}

impl Metric {
    /// The value for two lists.
    ///
    /// # Errors
    /// [`Error::TooFew`] where a list is empty.
    pub fn of(self, id: &[Score], ood: &[Score]) -> Result<f64, Error> {
        Ok(self.of_curve(&curve_of(id, ood)?))
    }

    fn of_curve(self, curve: &Curve) -> f64 {
        match self {
            Metric::Auroc => curve.auroc(),
            Metric::AuprIn => curve.aupr_in(),
            Metric::AuprOut => curve.aupr_out(),
            Metric::FprAt95Tpr => curve.fpr_at_tpr(95),
            Metric::DetectionAt(threshold) => curve.beyond(threshold).1,
            Metric::FalseAlarmAt(threshold) => curve.beyond(threshold).0,
        }
    }
}

fn curve_of(id: &[Score], ood: &[Score]) -> Result<Curve, Error> {
    for (what, list) in [("ID scores", id), ("OOD scores", ood)] {
        if list.is_empty() {
            return Err(Error::TooFew {
                what,
                needed: 1,
                found: 0,
                hint: "a metric compares two lists of scores",
            });
        }
    }
    let id = id.iter().map(|&score| Entry::new(score, false));
    let ood = ood.iter().map(|&score| Entry::new(score, true));
    let entries = curve::sorted(id.chain(ood).collect());
    Ok(Curve::new(entries.into_iter()))
}

/// The ROC curve as (false positive rate, true positive rate), from (0, 0) to (1, 1), a point for each
/// distinct score. The area below its straight lines is [`auroc`].
///
/// # Errors
/// [`Error::TooFew`] where a list is empty.
pub fn roc(id: &[Score], ood: &[Score]) -> Result<Vec<(f64, f64)>, Error> {
    Ok(curve_of(id, ood)?.roc())
}

/// Area under the ROC curve: the chance that a random OOD score is higher than a random ID score,
/// ties counted as one half (midranks).
///
/// # Errors
/// [`Error::TooFew`] where a list is empty.
pub fn auroc(id: &[Score], ood: &[Score]) -> Result<f64, Error> {
    Metric::Auroc.of(id, ood)
}

/// Average precision with ID as the positive class and low scores first:
/// `sum_n (recall_n - recall_{n-1}) precision_n` over the distinct scores. It depends on how many
/// windows either side has.
///
/// # Errors
/// [`Error::TooFew`] where a list is empty.
pub fn aupr_in(id: &[Score], ood: &[Score]) -> Result<f64, Error> {
    Metric::AuprIn.of(id, ood)
}

/// Average precision with OOD as the positive class and high scores first, as [`aupr_in`].
///
/// # Errors
/// [`Error::TooFew`] where a list is empty.
pub fn aupr_out(id: &[Score], ood: &[Score]) -> Result<f64, Error> {
    Metric::AuprOut.of(id, ood)
}

/// Share of ID scores that are flagged when the threshold is so low that at least 95 % of the OOD
/// scores are; the smallest such share over all thresholds, not interpolated.
///
/// # Errors
/// [`Error::TooFew`] where a list is empty.
pub fn fpr_at_95tpr(id: &[Score], ood: &[Score]) -> Result<f64, Error> {
    Metric::FprAt95Tpr.of(id, ood)
}

/// Share of scores beyond a threshold.
///
/// # Errors
/// [`Error::TooFew`] for no scores.
pub fn detection_rate(scores: &[Score], threshold: Score) -> Result<f64, Error> {
    Metric::DetectionAt(threshold).of(scores, scores)
}
