//! Rows of tables, each told by its contents: what is computed of a window, and what ranks windows by it.

use crate::learned::Baseline;
use anyhow::{Context, Result};
use dose3::Measured;
use dose3_diffusion::NoiseSharing;
use dose3_ood::StatisticsSet;
use dose3_ood::statistics::{Sample, TraceSummary};
use serde::Serialize;

/// A row.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Row {
    /// Statistics of a window, ranked by a density over those of trusted windows.
    Statistics(Statistics),
    /// The score of a baseline that was trained once, and is not fitted to what is trusted.
    Learned(Baseline),
}

/// Statistics of a noise estimator, or of the poses themselves, under a density.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Statistics {
    /// Their names.
    pub set: &'static str,
    /// The noise they are computed with; none where they need no network.
    pub noise: Option<Noise>,
    /// The steps that count; halves are for statistics that sum over steps.
    pub part: Part,
    /// The density, where it is not that of the run.
    pub density: Option<&'static str>,
}

/// Noise of a window.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Noise {
    /// Whether all windows share it.
    pub sharing: NoiseSharing,
    /// Draws a window.
    pub draws: usize,
}

/// Which of the visited diffusion steps count.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Part {
    /// All.
    All,
    /// The half with less noise.
    LowNoise,
    /// The half with more noise.
    HighNoise,
}

impl Statistics {
    const fn new(set: &'static str, noise: Option<Noise>) -> Self {
        Self {
            set,
            noise,
            part: Part::All,
            density: None,
        }
    }

    /// With draws that every window has of its own, as in the paper.
    pub const fn own(set: &'static str, draws: usize) -> Self {
        let sharing = NoiseSharing::Own;
        Self::new(set, Some(Noise { sharing, draws }))
    }

    /// With draws that all windows share.
    pub const fn shared(set: &'static str, draws: usize) -> Self {
        let sharing = NoiseSharing::Shared;
        Self::new(set, Some(Noise { sharing, draws }))
    }

    /// Along the deterministic path, without drawn noise.
    pub const fn without_noise(set: &'static str) -> Self {
        let sharing = NoiseSharing::None;
        Self::new(set, Some(Noise { sharing, draws: 1 }))
    }

    /// Of the poses alone.
    pub const fn without_network(set: &'static str) -> Self {
        Self::new(set, None)
    }

    const fn part(self, part: Part) -> Self {
        Self { part, ..self }
    }

    const fn density(self, density: &'static str) -> Self {
        Self {
            density: Some(density),
            ..self
        }
    }

    /// The numbers of one window, measured with at least as many draws as this row has.
    ///
    /// # Errors
    /// A statistic that cannot be computed.
    pub fn evaluate(&self, set: &StatisticsSet, window: &Measured<'_>) -> Result<Vec<f64>> {
        let Some(Noise { draws, .. }) = self.noise else {
            return Ok(window.row(set)?);
        };
        let sample = window.sample();
        let traces = sample
            .traces
            .get(..draws)
            .with_context(|| format!("statistics {} need {draws} draws", self.set))?;
        let cut: Vec<TraceSummary>;
        let traces = match self.part {
            Part::All => traces,
            part => {
                cut = traces.iter().map(|t| part.of(t)).collect();
                &cut
            }
        };
        Ok(set.evaluate(&Sample { traces, ..sample })?)
    }
}

impl Part {
    fn of(self, trace: &TraceSummary) -> TraceSummary {
        let half = trace.steps.len() / 2;
        let mut trace = trace.clone();
        match self {
            Self::All => {}
            Self::LowNoise => trace.steps.truncate(half),
            Self::HighNoise => {
                trace.steps.drain(..half);
            }
        }
        trace
    }
}

const fn row(statistics: Statistics) -> Row {
    Row::Statistics(statistics)
}

/// The paper's 24 numbers, one draw a window.
pub const SPLIT: Row = row(Statistics::own("paper24", 1));
/// The same with one draw that all windows share.
pub const SPLIT_SHARED: Row = row(Statistics::shared("paper24", 1));
/// The same with two.
pub const SPLIT_SHARED2: Row = row(Statistics::shared("paper24", 2));
/// The split statistics with two draws a window.
pub const SPLIT_OWN2: Row = row(Statistics::own("paper24", 2));
/// The same with four.
pub const SPLIT_OWN4: Row = row(Statistics::own("paper24", 4));
/// Of the half of the steps with less noise.
pub const LOW_NOISE: Row = row(Statistics::shared("paper24", 1).part(Part::LowNoise));
/// Of the half of the steps with more noise.
pub const HIGH_NOISE: Row = row(Statistics::shared("paper24", 1).part(Part::HighNoise));
/// Under a mixture of one component, as the authors' code.
pub const ONE_COMPONENT: Row = row(Statistics::shared("paper24", 1).density("mixture:1"));
/// The 12 numbers under a mixture of one, as the authors' code.
pub const TWELVE_ONE_COMPONENT: Row = row(Statistics::own("paper12", 1).density("mixture:1"));
/// The paper's 12 numbers, one draw a window.
pub const TWELVE: Row = row(Statistics::own("paper12", 1));
/// Translation alone, one draw a window.
pub const R3: Row = row(Statistics::own("r3", 1));
/// Translation alone, one draw that all windows share.
pub const R3_SHARED: Row = row(Statistics::shared("r3", 1));
/// Denoising error and mean estimate by noise band: this project's statistics.
pub const RESIDUAL: Row = row(Statistics::shared("residual+eps-mean", 1));
/// DiffPath, one number.
pub const ONE_PATH: Row = row(Statistics::without_noise("diffpath1"));
/// DiffPath, six numbers.
pub const SIX_PATH: Row = row(Statistics::without_noise("diffpath6"));
/// Raw moments of the represented poses.
pub const MOMENTS: Row = row(Statistics::without_network("moments24"));
/// Body-frame kinematics.
pub const KINEMATIC: Row = row(Statistics::without_network("kinematic"));

/// Rows of the main table: those that the paper prints, in its order, then the others.
pub const MAIN: [Row; 9] = [
    R3,
    TWELVE,
    SPLIT,
    SPLIT_SHARED2,
    RESIDUAL,
    ONE_PATH,
    SIX_PATH,
    MOMENTS,
    KINEMATIC,
];
/// Those of them that need a network.
pub const NETWORK: &[Row] = MAIN.split_at(7).0;
/// Rows of the tables of lengths and steps.
pub const BOTH_NOISES: [Row; 2] = [SPLIT, SPLIT_SHARED];
/// Rows of the table of training sets.
pub const TRAINING_SETS: [Row; 4] = [R3, R3_SHARED, SPLIT, SPLIT_SHARED];
/// What choices of the evaluation do to the split statistics of one and the same network.
pub const READINGS: [Row; 9] = [
    SPLIT,
    SPLIT_OWN2,
    SPLIT_OWN4,
    SPLIT_SHARED,
    SPLIT_SHARED2,
    LOW_NOISE,
    HIGH_NOISE,
    ONE_COMPONENT,
    TWELVE_ONE_COMPONENT,
];
/// The learned baselines.
pub const LEARNED: [Row; 2] = [Row::Learned(Baseline::Jem), Row::Learned(Baseline::Glow)];

/// What a row of the main table is called there.
pub fn label(row: &Row) -> &'static str {
    const LABELS: [(Row, &str); 11] = [
        (LEARNED[0], "JEM (trained on KITTI, not refitted)"),
        (
            LEARNED[1],
            "Glow, likelihood ratio (trained on KITTI, not refitted)",
        ),
        (R3, "R^3, translation alone (6)"),
        (TWELVE, "SE(3), no split (12 statistics)"),
        (SPLIT, "SE(3), rotation split (24 statistics)"),
        (
            SPLIT_SHARED2,
            "SE(3), rotation split, two noise draws shared by all windows",
        ),
        (
            RESIDUAL,
            "not in the paper: denoising error and mean estimate by noise band, one shared draw",
        ),
        (ONE_PATH, "DiffPath, 1-D (deterministic path)"),
        (SIX_PATH, "DiffPath, 6-D (deterministic path)"),
        (MOMENTS, "no network: raw moments of the poses (24)"),
        (KINEMATIC, "no network: body-frame kinematics"),
    ];
    LABELS
        .iter()
        .find(|(known, _)| known == row)
        .map_or("", |(_, label)| label)
}

/// The name that the paper's tables have for a row, where they print it.
pub fn printed_name(row: &Row) -> Option<&'static str> {
    match *row {
        Row::Learned(baseline) => Some(baseline.name()),
        R3 => Some("r3"),
        TWELVE => Some("paper12"),
        SPLIT => Some("paper24"),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use dose3_ood::statistics::Trace;

    #[test]
    fn rows_of_a_list_differ_and_their_statistics_are_known() {
        for rows in [&MAIN[..], &TRAINING_SETS, &READINGS] {
            for (i, row) in rows.iter().enumerate() {
                assert!(!rows[..i].contains(row), "{row:?}");
                let Row::Statistics(statistics) = row else {
                    panic!("{row:?} is learned")
                };
                let set: StatisticsSet = statistics.set.parse().unwrap();
                assert_eq!(set.needs_trace(), statistics.noise.is_some());
                if let Some(density) = statistics.density {
                    density.parse::<dose3_ood::DensityConfig>().unwrap();
                }
            }
        }
        let labelled = |row: &Row| !label(row).is_empty();
        assert!(MAIN.iter().chain(&LEARNED).all(labelled));
        let needs = |row: &&Row| matches!(row, Row::Statistics(s) if s.noise.is_some());
        assert_eq!(MAIN.iter().filter(needs).count(), NETWORK.len());
        assert!(NETWORK.iter().all(|row| needs(&row)));
    }

    #[test]
    fn halves_split_the_steps() {
        let eps_hat: Vec<f32> = (0..5 * 12).map(|i| (i / 12) as f32).collect();
        let trace = TraceSummary::of(&Trace {
            steps: 5,
            length: 2,
            eps_hat: &eps_hat,
            eps: &[0.0; 12],
        })
        .unwrap();
        let means = |part: Part| -> Vec<f64> {
            part.of(&trace).steps.iter().map(|s| s.eps[0][0]).collect()
        };
        assert_eq!(means(Part::All), [0.0, 1.0, 2.0, 3.0, 4.0]);
        assert_eq!(means(Part::LowNoise), [0.0, 1.0]);
        assert_eq!(means(Part::HighNoise), [2.0, 3.0, 4.0]);
    }
}
