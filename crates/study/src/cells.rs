//! One cell of a table: fit a density on an in-distribution set, test it against another set.

use crate::sets::DataSet;
use anyhow::{Context, Result};
use dose3_ood::metrics::{Bootstrap, Estimate, Grouped, Metric, estimate_all};
use dose3_ood::{DensityConfig, DensityModel, Score};
use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

/// How in-distribution test windows are chosen.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Protocol {
    /// The ID logs are split in two: one part fits the density, the other is tested.
    Paper,
    /// As the authors' code evaluates: the density is fitted on all ID windows, and a random tenth
    /// of the same windows is tested.
    ReleasedCode,
}

impl Protocol {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Paper, Self::ReleasedCode];

    /// Its name in tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Paper => "paper",
            Self::ReleasedCode => "released-code",
        }
    }
}

/// The metrics of one cell.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Cell {
    /// Letter of the ID set.
    pub id: char,
    /// Letter of the OOD set.
    pub ood: char,
    /// Windows the density was fitted on.
    pub fit_windows: usize,
    /// ID windows tested.
    pub id_windows: usize,
    /// OOD windows tested.
    pub ood_windows: usize,
    /// Area under the ROC curve, OOD positive.
    pub auroc: Estimate,
    /// Area under the precision-recall curve, ID positive.
    pub aupr_in: Estimate,
    /// Area under the precision-recall curve, OOD positive.
    pub aupr_out: Estimate,
    /// Share of ID windows rejected where 95 % of OOD windows are.
    pub fpr_at_95_tpr: Estimate,
}

/// The columns that letters in this order give: first against second, second against first, and so on.
pub fn columns(letters: &[char]) -> Vec<(char, char)> {
    let mut columns = Vec::new();
    for (i, a) in letters.iter().enumerate() {
        for b in &letters[i + 1..] {
            columns.extend([(*a, *b), (*b, *a)]);
        }
    }
    columns
}

/// What is needed of one set: its statistics, one row a window.
pub struct Rows<'a> {
    /// The set.
    pub set: &'a DataSet,
    /// One row of statistics a window.
    pub rows: &'a [Vec<f64>],
}

/// The windows that fit a density under `protocol`, and those that are tested as in-distribution.
pub fn split(set: &DataSet, protocol: Protocol, seed: u64) -> (Vec<usize>, Vec<usize>) {
    let windows = 0..set.windows.len();
    match protocol {
        Protocol::Paper => {
            windows.partition(|w| !set.test_logs.contains(&set.windows[*w].trajectory))
        }
        Protocol::ReleasedCode => {
            let mut shuffled: Vec<usize> = windows.clone().collect();
            shuffled.shuffle(&mut ChaCha8Rng::seed_from_u64(seed));
            shuffled.truncate(set.windows.len().div_ceil(10));
            (windows.collect(), shuffled)
        }
    }
}

/// The ID side of a column, ready to be tested against any OOD set.
pub struct Fitted {
    density: DensityModel,
    fit_windows: usize,
    tested: Side,
}

/// Scores with the log that each window was cut from.
pub struct Side {
    /// One score a window.
    pub scores: Vec<Score>,
    /// The group of logs that each belongs to.
    pub groups: Vec<usize>,
}

impl Side {
    /// The scores of chosen windows of a set.
    pub fn of(set: &DataSet, windows: &[usize], scores: Vec<Score>) -> Self {
        let groups = set.groups();
        Self {
            scores,
            groups: windows.iter().map(|w| groups[*w]).collect(),
        }
    }

    fn grouped(&self) -> Grouped<'_> {
        Grouped {
            scores: &self.scores,
            logs: &self.groups,
        }
    }
}

impl Fitted {
    /// Fits the density and scores the ID test windows.
    ///
    /// # Errors
    /// Too few rows.
    pub fn new(
        id: &Rows<'_>,
        protocol: Protocol,
        density: &DensityConfig,
        seed: u64,
    ) -> Result<Self> {
        let groups = id.set.groups();
        let (fit, test) = split(id.set, protocol, seed);
        let fit_rows: Vec<Vec<f64>> = fit.iter().map(|w| id.rows[*w].clone()).collect();
        let fit_groups: Vec<usize> = fit.iter().map(|w| groups[*w]).collect();
        let density = DensityModel::fit(&fit_rows, &fit_groups, &density.clone().with_seed(seed))
            .with_context(|| format!("no density could be fitted on {}", id.set.name))?;
        let scores = test
            .iter()
            .map(|w| density.score(&id.rows[*w]))
            .collect::<Result<_, _>>()?;
        Ok(Self {
            density,
            fit_windows: fit.len(),
            tested: Side::of(id.set, &test, scores),
        })
    }

    /// Windows the density was fitted on.
    pub fn fit_windows(&self) -> usize {
        self.fit_windows
    }

    /// The ID test windows.
    pub fn tested(&self) -> &Side {
        &self.tested
    }

    /// All windows of an OOD set.
    ///
    /// # Errors
    /// Rows that are not those of the density.
    pub fn score(&self, ood: &Rows<'_>) -> Result<Side> {
        Ok(Side {
            scores: self.density.scores(ood.rows)?,
            groups: ood.set.groups(),
        })
    }

    /// Tests against an OOD set.
    ///
    /// # Errors
    /// An empty side.
    pub fn against(&self, id: char, ood: &Rows<'_>, bootstrap: Bootstrap) -> Result<Cell> {
        let side = self.score(ood)?;
        let letters = (id, ood.set.letter);
        cell(letters, self.fit_windows, &self.tested, &side, bootstrap)
    }
}

/// The metrics of one ID side against one OOD side.
///
/// # Errors
/// An empty side.
pub fn cell(
    (id, ood): (char, char),
    fit_windows: usize,
    tested: &Side,
    other: &Side,
    bootstrap: Bootstrap,
) -> Result<Cell> {
    let metrics = [
        Metric::Auroc,
        Metric::AuprIn,
        Metric::AuprOut,
        Metric::FprAt95Tpr,
    ];
    let estimates = estimate_all(&metrics, tested.grouped(), other.grouped(), bootstrap)?;
    let [auroc, aupr_in, aupr_out, fpr_at_95_tpr] = estimates[..] else {
        anyhow::bail!("four metrics were asked for, {} came back", estimates.len());
    };
    Ok(Cell {
        id,
        ood,
        fit_windows,
        id_windows: tested.scores.len(),
        ood_windows: other.scores.len(),
        auroc,
        aupr_in,
        aupr_out,
        fpr_at_95_tpr,
    })
}
