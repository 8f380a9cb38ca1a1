//! The weighted ROC curve that all metrics read.

use crate::score::Score;

/// A score with its class; its weight is how often it is counted.
#[derive(Clone, Copy, Debug)]
pub(super) struct Entry {
    pub score: Score,
    pub is_ood: bool,
    pub weight: f64,
}

impl Entry {
    pub fn new(score: Score, is_ood: bool) -> Self {
        Self {
            score,
            is_ood,
            weight: 1.0,
        }
    }
}

/// Highest score first.
pub(super) fn sorted(mut entries: Vec<Entry>) -> Vec<Entry> {
    entries.sort_by_key(|entry| std::cmp::Reverse(entry.score));
    entries
}

/// Weights of ID and OOD at each distinct score, highest first.
pub(super) struct Curve {
    points: Vec<(Score, f64, f64)>,
    id: f64,
    ood: f64,
}

impl Curve {
    /// From entries in descending order, each class with some weight.
    pub fn new(sorted: impl Iterator<Item = Entry>) -> Self {
        let mut points: Vec<(Score, f64, f64)> = Vec::new();
        let (mut id, mut ood) = (0.0, 0.0);
        for entry in sorted {
            let (i, o) = if entry.is_ood {
                (0.0, entry.weight)
            } else {
                (entry.weight, 0.0)
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
        let (mut above, mut won) = (0.0, 0.0);
        for &(_, id, ood) in &self.points {
            won += id * (above + 0.5 * ood);
            above += ood;
        }
        won / (self.id * self.ood)
    }

    pub fn aupr_out(&self) -> f64 {
        let positives_first = self.points.iter().map(|&(_, id, ood)| (ood, id));
        average_precision(positives_first, self.ood)
    }

    pub fn aupr_in(&self) -> f64 {
        let positives_first = self.points.iter().rev().map(|&(_, id, ood)| (id, ood));
        average_precision(positives_first, self.id)
    }

    pub fn fpr_at_tpr(&self, tpr: f64) -> f64 {
        let (mut id_above, mut ood_above) = (0.0, 0.0);
        for &(_, id, ood) in &self.points {
            id_above += id;
            ood_above += ood;
            // Guarded against a sum that falls short of 95 % by rounding.
            if ood_above >= tpr * self.ood * (1.0 - 1e-12) {
                break;
            }
        }
        id_above / self.id
    }

    /// Shares of (ID, OOD) at or above each distinct score, from (0, 0) to (1, 1).
    pub fn roc(&self) -> Vec<(f64, f64)> {
        let (mut id_above, mut ood_above) = (0.0, 0.0);
        let above = self.points.iter().map(|&(_, id, ood)| {
            id_above += id;
            ood_above += ood;
            (id_above / self.id, ood_above / self.ood)
        });
        std::iter::once((0.0, 0.0)).chain(above).collect()
    }

    /// Shares of (ID, OOD) beyond a threshold.
    pub fn beyond(&self, threshold: Score) -> (f64, f64) {
        let over = self.points.iter().take_while(|p| p.0 > threshold);
        let (id, ood) = over.fold((0.0, 0.0), |sum, p| (sum.0 + p.1, sum.1 + p.2));
        (id / self.id, ood / self.ood)
    }
}

/// `blocks` of tied (positives, negatives), best first.
fn average_precision(blocks: impl Iterator<Item = (f64, f64)>, total: f64) -> f64 {
    let (mut positives, mut all, mut area) = (0.0, 0.0, 0.0);
    for (positive, negative) in blocks {
        positives += positive;
        all += positive + negative;
        if positive > 0.0 {
            area += positive / total * positives / all;
        }
    }
    area
}
