//! Localisation: whether the poses of a fault score higher than those around it.

use super::prober::Poses;
use anyhow::Result;
use dose3_ood::Score;
use dose3_ood::localise::PoseReference;
use dose3_ood::metrics::auroc;
use dose3_ood::statistics::CHANNELS;
use serde::Serialize;
use std::ops::Range;

/// Every so many windows of trusted logs show what trusted poses look like.
pub const EVERY: usize = 4;
/// Numbers of a pose that need no network.
const DIFFERENCES: usize = 2 * CHANNELS;

/// Poses of one fault in one set.
#[derive(Clone, Debug, Serialize)]
pub struct PoseCell {
    /// Letter of the set.
    pub set: char,
    /// The fault with its severity.
    pub fault: String,
    /// Poses inside the fault.
    pub inside: usize,
    /// Poses of the same windows outside of it.
    pub outside: usize,
    /// AUROC of pose scores, inside against outside.
    pub auroc: f64,
    /// The same without the network's part of the score.
    pub without_network: f64,
}

/// Pose scores of a set.
pub struct Locator {
    all: PoseReference,
    differences: PoseReference,
}

impl Locator {
    /// From the poses of trusted windows.
    ///
    /// # Errors
    /// Too few poses.
    pub fn fit(windows: &[Poses]) -> Result<Self> {
        let rows = windows.concat();
        let differences: Poses = rows.iter().map(|row| row[..DIFFERENCES].to_vec()).collect();
        Ok(Self {
            all: PoseReference::fit(&rows)?,
            differences: PoseReference::fit(&differences)?,
        })
    }

    /// Poses inside against outside of each window's range, of all windows together; none where
    /// one side is empty. The first entry of a window's poses is its second pose.
    ///
    /// # Errors
    /// Poses of another length.
    pub fn cell(
        &self,
        set: char,
        fault: String,
        windows: &[(Poses, Range<usize>)],
    ) -> Result<Option<PoseCell>> {
        let (mut full, mut alone) = (Sides::default(), Sides::default());
        for (poses, affected) in windows {
            for (i, row) in poses.iter().enumerate() {
                let inside = affected.contains(&(i + 1));
                full.add(inside, self.all.score(row)?);
                alone.add(inside, self.differences.score(&row[..DIFFERENCES])?);
            }
        }
        if full.inside.is_empty() || full.outside.is_empty() {
            return Ok(None);
        }
        Ok(Some(PoseCell {
            set,
            fault,
            inside: full.inside.len(),
            outside: full.outside.len(),
            auroc: full.auroc()?,
            without_network: alone.auroc()?,
        }))
    }
}

#[derive(Default)]
struct Sides {
    inside: Vec<Score>,
    outside: Vec<Score>,
}

impl Sides {
    fn add(&mut self, inside: bool, score: Score) {
        let side = if inside {
            &mut self.inside
        } else {
            &mut self.outside
        };
        side.push(score);
    }

    fn auroc(&self) -> Result<f64> {
        Ok(auroc(&self.outside, &self.inside)?)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn inside_counts_from_the_second_pose() {
        let row = |x: f64| vec![x; DIFFERENCES];
        let trusted: Poses = (0..10).map(|i| row(f64::from(i % 3))).collect();
        let locator = Locator::fit(&[trusted]).unwrap();
        // Poses 3 and 4 of the window are faulty: entries 2 and 3.
        let poses: Poses = [0.0, 1.0, 9.0, 8.0, 1.0].map(row).to_vec();
        let cell = |range| locator.cell('K', "jump".into(), &[(poses.clone(), range)]);
        let found = cell(3..5).unwrap().unwrap();
        assert_eq!((found.inside, found.outside), (2, 3));
        assert_eq!((found.auroc, found.without_network), (1.0, 1.0));
        assert!(cell(1..2).unwrap().unwrap().auroc < 0.5);
        assert!(cell(0..10).unwrap().is_none());
    }
}
