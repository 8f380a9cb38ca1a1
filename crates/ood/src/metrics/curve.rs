//! The weighted ROC curve that all metrics read.
//!
//! Everything is counted in integers and divided last, so that a metric is exactly 0 or 1 where
//! it should be and never beyond: rounding keeps the order of numerator and denominator.

use crate::score::Score;

/// A score with its class, and how often it is counted.
#[derive(Clone, Copy, Debug)]
pub(super) struct Entry {
    pub score: Score,
    pub is_ood: bool,
    pub count: u64,
}

impl Entry {
    pub fn new(score: Score, is_ood: bool) -> Self {
        Self {
            score,
            is_ood,
            count: 1,
        }
    }
}

/// Highest score first.
pub(super) fn sorted(mut entries: Vec<Entry>) -> Vec<Entry> {
    entries.sort_by_key(|entry| std::cmp::Reverse(entry.score));
    entries
}

/// Numbers of ID and OOD at each distinct score, highest first.
pub(super) struct Curve {
    points: Vec<(Score, u64, u64)>,
    id: u64,
    ood: u64,
}

impl Curve {
    /// From entries in descending order, some of each class.
    pub fn new(sorted: impl Iterator<Item = Entry>) -> Self {
        let mut points: Vec<(Score, u64, u64)> = Vec::new();
        let (mut id, mut ood) = (0, 0);
        for entry in sorted {
            let (i, o) = match entry.is_ood {
                true => (0, entry.count),
                false => (entry.count, 0),
            };
            id += i;
            ood += o;
            match points.last_mut() {
                Some(last) if last.0 == entry.score => {
                    last.1 += i;
                    last.2 += o;
                }
                _ => points.push((entry.score, i, o)),
            }
        }
        Self { points, id, ood }
    }

    /// Every pair counts: an OOD score wins over the ID scores below it, and half of its ties.
    pub fn auroc(&self) -> f64 {
        let (mut above, mut won_twice) = (0_u128, 0_u128);
        for &(_, id, ood) in &self.points {
            won_twice += u128::from(id) * (2 * above + u128::from(ood));
            above += u128::from(ood);
        }
        let pairs = u128::from(self.id) * u128::from(self.ood);
        won_twice as f64 / (2 * pairs) as f64
    }

    pub fn aupr_out(&self) -> f64 {
        let positives_first = self.points.iter().map(|&(_, id, ood)| (ood, id));
        average_precision(positives_first, self.ood)
    }

    pub fn aupr_in(&self) -> f64 {
        let positives_first = self.points.iter().rev().map(|&(_, id, ood)| (id, ood));
        average_precision(positives_first, self.id)
    }

    /// Share of ID where at least `percent` of 100 OOD are flagged.
    pub fn fpr_at_tpr(&self, percent: u64) -> f64 {
        let (mut id_above, mut ood_above) = (0, 0);
        for &(_, id, ood) in &self.points {
            id_above += id;
            ood_above += ood;
            if 100 * ood_above >= percent * self.ood {
                break;
            }
        }
        share(id_above, self.id)
    }

    /// Shares of (ID, OOD) at or above each distinct score, from (0, 0) to (1, 1).
    pub fn roc(&self) -> Vec<(f64, f64)> {
        let (mut id_above, mut ood_above) = (0, 0);
        let above = self.points.iter().map(|&(_, id, ood)| {
            id_above += id;
            ood_above += ood;
            (share(id_above, self.id), share(ood_above, self.ood))
        });
        std::iter::once((0.0, 0.0)).chain(above).collect()
    }

    /// Shares of (ID, OOD) beyond a threshold.
    pub fn beyond(&self, threshold: Score) -> (f64, f64) {
        let over = self.points.iter().take_while(|p| p.0 > threshold);
        let (id, ood) = over.fold((0, 0), |sum, p| (sum.0 + p.1, sum.1 + p.2));
        (share(id, self.id), share(ood, self.ood))
    }
}

/// `blocks` of tied (positives, negatives), best first.
fn average_precision(blocks: impl Iterator<Item = (u64, u64)>, total: u64) -> f64 {
    let (mut positives, mut all, mut area) = (0, 0, 0.0);
    for (positive, negative) in blocks {
        positives += positive;
        all += positive + negative;
        if positive > 0 {
            // At most `positive`, an integer, however it is rounded: the sum is at most `total`.
            area += positive as f64 * share(positives, all);
        }
    }
    area / total as f64
}

fn share(part: u64, whole: u64) -> f64 {
    part as f64 / whole as f64
}
