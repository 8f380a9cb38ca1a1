//! Cells of tables: trust one set, and test it against another.

use crate::sets::DataSet;
use crate::split::Split;
use anyhow::{Context, Result, bail};
use dose3_ood::metrics::{Bootstrap, Estimate, Grouped, Metric, estimate_all};
use dose3_ood::{DensityConfig, DensityModel, Score};
use serde::{Deserialize, Serialize};

/// The metrics of one cell.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Cell {
    /// Letter of the ID set.
    pub id: char,
    /// Letter of the OOD set.
    pub ood: char,
    /// Windows the density was fitted on; none for scores that no density is fitted to.
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

/// What one row of a table says of all windows, set by set.
pub enum Ranking<'a> {
    /// Statistics `[set][window][column]`, to be ranked by a density over those of trusted windows.
    Statistics {
        /// The density.
        density: &'a DensityConfig,
        /// The statistics.
        rows: &'a [Vec<Vec<f64>>],
    },
    /// Scores `[set][window]` that need no density, higher = more OOD.
    Scores(&'a [Vec<f64>]),
}

/// Scores with the group of logs that each window was cut from.
pub struct Side {
    /// One score a window.
    pub scores: Vec<Score>,
    groups: Vec<usize>,
}

impl Side {
    fn grouped(&self) -> Grouped<'_> {
        Grouped {
            scores: &self.scores,
            logs: &self.groups,
        }
    }
}

/// All ordered pairs of `sets` under a split; `visit` is given each cell with the scores of its two sides.
///
/// # Errors
/// Too few windows for a density, an empty side, `visit`'s own error.
pub fn cells(
    sets: &[DataSet],
    ranking: &Ranking<'_>,
    split: Split,
    bootstrap: Bootstrap,
    visit: &mut dyn FnMut(Cell, &Side, &Side) -> Result<()>,
) -> Result<()> {
    for (i, id) in sets.iter().enumerate() {
        let (fit, test) = split.of(id, bootstrap.seed);
        let trusted = Trusted::new(sets, ranking, i, &fit, bootstrap.seed)?;
        let groups = id.groups();
        let tested = Side {
            scores: trusted.scores(i, &test)?,
            groups: test.iter().map(|w| groups[*w]).collect(),
        };
        for (o, ood) in sets.iter().enumerate().filter(|(o, _)| *o != i) {
            let all: Vec<usize> = (0..ood.windows.len()).collect();
            let other = Side {
                scores: trusted.scores(o, &all)?,
                groups: ood.groups(),
            };
            let found = cell(
                (id.letter, ood.letter),
                trusted.fit_windows,
                &tested,
                &other,
                bootstrap,
            )?;
            visit(found, &tested, &other)?;
        }
    }
    Ok(())
}

/// A ranking once a set is trusted.
struct Trusted<'a> {
    ranking: &'a Ranking<'a>,
    density: Option<DensityModel>,
    fit_windows: usize,
}

impl<'a> Trusted<'a> {
    fn new(
        sets: &[DataSet],
        ranking: &'a Ranking<'a>,
        id: usize,
        fit: &[usize],
        seed: u64,
    ) -> Result<Self> {
        let Ranking::Statistics { density, rows } = ranking else {
            return Ok(Self {
                ranking,
                density: None,
                fit_windows: 0,
            });
        };
        let groups = sets[id].groups();
        let rows: Vec<Vec<f64>> = fit.iter().map(|w| rows[id][*w].clone()).collect();
        let groups: Vec<usize> = fit.iter().map(|w| groups[*w]).collect();
        let config = (*density).clone().with_seed(seed);
        let density = DensityModel::fit(&rows, &groups, &config)
            .with_context(|| format!("no density could be fitted on {}", sets[id].name))?;
        Ok(Self {
            ranking,
            density: Some(density),
            fit_windows: fit.len(),
        })
    }

    fn scores(&self, set: usize, windows: &[usize]) -> Result<Vec<Score>> {
        match (self.ranking, &self.density) {
            (Ranking::Statistics { rows, .. }, Some(density)) => {
                let rows = windows.iter().map(|w| density.score(&rows[set][*w]));
                Ok(rows.collect::<Result<_, _>>()?)
            }
            (Ranking::Scores(scores), _) => {
                let scores = windows.iter().map(|w| Score::new(scores[set][*w]));
                Ok(scores.collect())
            }
            (Ranking::Statistics { .. }, None) => bail!("no density was fitted"),
        }
    }
}

fn cell(
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
        bail!("four metrics were asked for, {} came back", estimates.len());
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sets;

    #[test]
    fn columns_are_in_the_order_of_the_paper() {
        let pairs = [
            ('O', 'K'),
            ('K', 'O'),
            ('O', 'I'),
            ('I', 'O'),
            ('K', 'I'),
            ('I', 'K'),
        ];
        assert_eq!(columns(&['O', 'K', 'I']), pairs);
    }

    #[test]
    fn cells_come_from_the_scores_of_test_windows_and_of_the_other_set() {
        let mut sets = sets::synthetic(0, 3).unwrap();
        for set in &mut sets {
            set.choose_test_logs(&[], &[]);
            set.cut(128, 30);
        }
        // Set number as the score: a later set is always more OOD than an earlier one.
        let scores: Vec<Vec<f64>> = sets
            .iter()
            .enumerate()
            .map(|(s, set)| vec![s as f64; set.windows.len()])
            .collect();
        let bootstrap = Bootstrap {
            resamples: 2,
            ..Bootstrap::default()
        };
        let mut found = Vec::new();
        cells(
            &sets,
            &Ranking::Scores(&scores),
            Split::HeldOut,
            bootstrap,
            &mut |cell, _, _| {
                found.push(cell);
                Ok(())
            },
        )
        .unwrap();
        assert_eq!(found.len(), 6);
        for cell in &found {
            let order = |letter| sets.iter().position(|s| s.letter == letter);
            let expected = f64::from(u8::from(order(cell.ood) > order(cell.id)));
            assert_eq!(cell.auroc.value, expected);
            let id = sets.iter().find(|s| s.letter == cell.id).unwrap();
            let tested = id
                .windows
                .iter()
                .filter(|w| id.test_logs.contains(&w.trajectory));
            assert_eq!(cell.id_windows, tested.count());
            assert_eq!(cell.fit_windows, 0);
        }
    }
}
