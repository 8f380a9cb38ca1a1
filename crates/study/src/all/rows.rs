//! The rows of the study that are statistics of a noise estimator, or of the poses themselves, under a
//! density.

use anyhow::{Context, Result};
use dose3::features::WindowData;
use dose3_diffusion::NoiseSharing;
use dose3_ood::StatisticsSet;
use dose3_ood::statistics::{Sample, TraceSummary};
use serde::Serialize;

/// Which of the visited diffusion steps count.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub enum Part {
    /// All.
    All,
    /// The half with less noise.
    LowNoise,
    /// The half with more noise.
    HighNoise,
}

/// A row.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Row {
    /// Its name in results.
    pub key: &'static str,
    /// The statistics.
    pub statistics: &'static str,
    /// The noise they are computed with; none where they need no network.
    pub noise: Option<NoiseSharing>,
    /// Noise draws a window.
    pub draws: usize,
    /// The steps that count; halves are for statistics that sum over steps.
    pub part: Part,
    /// The density, where it is not that of the run.
    pub density: Option<&'static str>,
    /// What it is called in tables.
    pub label: &'static str,
}

impl Row {
    const fn new(
        key: &'static str,
        statistics: &'static str,
        noise: Option<NoiseSharing>,
        draws: usize,
        label: &'static str,
    ) -> Self {
        Self {
            key,
            statistics,
            noise,
            draws,
            part: Part::All,
            density: None,
            label,
        }
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

    /// The row of one window, whose traces hold at least this row's draws.
    ///
    /// # Errors
    /// A statistic that cannot be computed.
    pub fn evaluate(&self, set: &StatisticsSet, data: &WindowData) -> Result<Vec<f64>> {
        let sample = data.sample();
        if !set.needs_trace() {
            return Ok(set.evaluate(&sample)?);
        }
        let traces = sample
            .traces
            .get(..self.draws)
            .with_context(|| format!("row {} needs {} draws", self.key, self.draws))?;
        if self.part == Part::All {
            return Ok(set.evaluate(&Sample { traces, ..sample })?);
        }
        let cut: Vec<TraceSummary> = traces.iter().map(|t| self.part.of(t)).collect();
        Ok(set.evaluate(&Sample {
            traces: &cut,
            ..sample
        })?)
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

const OWN: Option<NoiseSharing> = Some(NoiseSharing::PerWindow);
const COMMON: Option<NoiseSharing> = Some(NoiseSharing::Common);
const NO_NOISE: Option<NoiseSharing> = Some(NoiseSharing::None);

const SPLIT: Row = Row::new(
    "paper24",
    "paper24",
    OWN,
    1,
    "SE(3), rotation split (24 statistics)",
);
const SPLIT_COMMON: Row = Row::new(
    "paper24-common",
    "paper24",
    COMMON,
    1,
    "SE(3), rotation split, one noise draw for all windows",
);
const R3: Row = Row::new("r3", "r3", OWN, 1, "R^3, translation alone (6)");
const R3_COMMON: Row = Row::new(
    "r3-common",
    "r3",
    COMMON,
    1,
    "R^3, one noise draw for all windows",
);
const RESIDUAL: Row = Row::new(
    "residual",
    "residual+eps-mean",
    COMMON,
    1,
    "DOSE3's own: denoising error and mean estimate by noise band",
);
const ONE_PATH: Row = Row::new(
    "diffpath1",
    "diffpath1",
    NO_NOISE,
    1,
    "DiffPath, 1-D (deterministic path)",
);
const SIX_PATH: Row = Row::new(
    "diffpath6",
    "diffpath6",
    NO_NOISE,
    1,
    "DiffPath, 6-D (deterministic path)",
);

/// Rows of the main table that need a network.
pub const NETWORK: [Row; 7] = [
    R3,
    Row::new(
        "paper12",
        "paper12",
        OWN,
        1,
        "SE(3), no split (12 statistics)",
    ),
    SPLIT,
    Row::new(
        "paper24-common",
        "paper24",
        COMMON,
        2,
        "SE(3), rotation split, two noise draws for all windows",
    ),
    RESIDUAL,
    ONE_PATH,
    SIX_PATH,
];

/// Rows of the main table that need none.
pub const PLAIN: [Row; 2] = [
    Row::new(
        "moments24",
        "moments24",
        None,
        1,
        "no network: raw moments of the poses (24)",
    ),
    Row::new(
        "kinematic",
        "kinematic",
        None,
        1,
        "no network: body-frame kinematics",
    ),
];

/// Rows of the tables of lengths, steps and readings.
pub const BOTH_NOISES: [Row; 2] = [SPLIT, SPLIT_COMMON];

/// Rows of the table of training sets.
pub const TRAINING_SETS: [Row; 4] = [R3, R3_COMMON, SPLIT, SPLIT_COMMON];

/// What choices of the evaluation do to the split statistics of one and the same network.
pub const READINGS: [Row; 9] = [
    SPLIT,
    Row::new("draws2", "paper24", OWN, 2, "2 noise draws a window"),
    Row::new("draws4", "paper24", OWN, 4, "4 noise draws a window"),
    SPLIT_COMMON,
    Row::new(
        "common2",
        "paper24",
        COMMON,
        2,
        "2 noise draws for all windows",
    ),
    Row::new(
        "low-noise",
        "paper24",
        COMMON,
        1,
        "the half of the steps with less noise",
    )
    .part(Part::LowNoise),
    Row::new(
        "high-noise",
        "paper24",
        COMMON,
        1,
        "the half of the steps with more noise",
    )
    .part(Part::HighNoise),
    Row::new(
        "one-component",
        "paper24",
        COMMON,
        1,
        "a mixture of one component, as the authors' code",
    )
    .density("mixture:1"),
    Row::new(
        "twelve-one-component",
        "paper12",
        OWN,
        1,
        "12 statistics under a mixture of one, as the authors' code",
    )
    .density("mixture:1"),
];

#[cfg(test)]
mod tests {
    use super::*;
    use dose3_ood::statistics::Trace;
    use std::collections::BTreeSet;

    #[test]
    fn keys_differ_within_a_list_and_statistics_are_known() {
        let main: Vec<Row> = NETWORK.into_iter().chain(PLAIN).collect();
        for rows in [&main[..], &TRAINING_SETS, &READINGS] {
            let keys: BTreeSet<&str> = rows.iter().map(|r| r.key).collect();
            assert_eq!(keys.len(), rows.len());
            for row in rows {
                let set: StatisticsSet = row.statistics.parse().unwrap();
                assert_eq!(set.needs_trace(), !PLAIN.iter().any(|p| p.key == row.key));
                if let Some(density) = row.density {
                    density.parse::<dose3_ood::DensityConfig>().unwrap();
                }
            }
        }
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
