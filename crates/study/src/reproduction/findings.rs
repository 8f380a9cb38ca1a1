//! Everything the experiments found, as the tables ask for it.

use super::experiment::Experiment;
use super::record::{Cost, Record, SplitRecord};
use super::table::{Entry, Line};
use crate::cells::Cell;
use crate::numbers::spread;
use crate::paper::printed;
use crate::rows::Row;
use crate::split::Split;

/// What became of an experiment.
#[derive(Clone, Debug)]
pub enum Outcome {
    /// It ran.
    Found(Box<Record>),
    /// It did not, for this reason.
    NotRun(String),
}

/// All outcomes.
pub struct Findings {
    /// In the order in which they ran.
    pub outcomes: Vec<(Experiment, Outcome)>,
    /// Pairs of sets in the order of the paper's columns, ID first.
    pub columns: Vec<(char, char)>,
    /// Whether the paper's numbers may stand beside these.
    pub real: bool,
}

/// A row of some experiments (one a seed) under a split.
#[derive(Clone, Copy, Debug)]
pub struct Query<'a> {
    /// The experiments.
    pub of: &'a [Experiment],
    /// The row.
    pub row: Row,
    /// How ID test windows were chosen.
    pub split: Split,
}

impl Findings {
    fn outcome(&self, experiment: &Experiment) -> Option<&Outcome> {
        let mut outcomes = self.outcomes.iter();
        outcomes.find_map(|(e, outcome)| (e == experiment).then_some(outcome))
    }

    /// What an experiment found.
    pub fn found(&self, experiment: &Experiment) -> Option<&Record> {
        match self.outcome(experiment)? {
            Outcome::Found(found) => Some(found),
            Outcome::NotRun(_) => None,
        }
    }

    /// Those of some experiments that were to run (`--quick` has one seed), or all where none was.
    pub fn present(&self, experiments: &[Experiment]) -> Vec<Experiment> {
        let all = experiments.iter().copied();
        let known: Vec<Experiment> = all.filter(|e| self.outcome(e).is_some()).collect();
        match known.is_empty() {
            true => experiments.to_vec(),
            false => known,
        }
    }

    /// A row of an experiment.
    pub fn row(&self, experiment: &Experiment, row: &Row, split: Split) -> Option<&SplitRecord> {
        let at = experiment.rows.iter().position(|r| r == row)?;
        let splits = &self.found(experiment)?.rows.get(at)?.splits;
        splits.iter().find(|s| s.split == split)
    }

    /// One cell of a row.
    pub fn cell(
        &self,
        experiment: &Experiment,
        row: &Row,
        split: Split,
        at: (char, char),
    ) -> Option<&Cell> {
        let cells = &self.row(experiment, row, split)?.cells;
        cells.iter().find(|c| (c.id, c.ood) == at)
    }

    /// The AUROC of a cell for each experiment that has it.
    pub fn values(&self, query: Query<'_>, at: (char, char)) -> Vec<f64> {
        let cells = query.of.iter();
        cells
            .filter_map(|experiment| self.cell(experiment, &query.row, query.split, at))
            .map(|c| c.auroc.value)
            .collect()
    }

    /// The mean over experiments of one cell.
    pub fn mean(&self, query: Query<'_>, at: (char, char)) -> Option<f64> {
        let values = self.values(query, at);
        (!values.is_empty()).then(|| spread(&values).0)
    }

    /// The mean over experiments and columns.
    pub fn overall(&self, query: Query<'_>) -> Option<f64> {
        let means = self.columns.iter().map(|at| self.mean(query, *at));
        let means: Vec<f64> = means.collect::<Option<_>>()?;
        (!means.is_empty()).then(|| spread(&means).0)
    }

    /// A line of all columns and their mean; where no experiment ran, the reason.
    pub fn line(&self, label: &str, query: Query<'_>) -> Line {
        if query
            .of
            .iter()
            .all(|experiment| self.row(experiment, &query.row, query.split).is_none())
        {
            let reason = Entry::from(format!("not run: {}", self.reason(query.of)));
            return Line::new(label, vec![reason]);
        }
        let mut cells: Vec<Entry> = self
            .columns
            .iter()
            .map(|at| auroc(&self.values(query, *at)))
            .collect();
        cells.push(auroc(&self.overall(query).into_iter().collect::<Vec<_>>()));
        Line::new(label, cells)
    }

    fn reason(&self, experiments: &[Experiment]) -> String {
        let mut outcomes = experiments.iter().filter_map(|e| self.outcome(e));
        match outcomes.next() {
            Some(Outcome::NotRun(reason)) => reason.clone(),
            _ => "not among the experiments of this run".into(),
        }
    }

    /// A line that the paper prints, by the name that it has in [`crate::paper`], where real data was used.
    pub fn printed_line(&self, name: &str) -> Option<Line> {
        let values: Vec<Option<f64>> = self
            .columns
            .iter()
            .map(|(id, ood)| printed(name, *id, *ood))
            .collect();
        let known: Vec<f64> = values.iter().copied().flatten().collect();
        if !self.real || known.is_empty() {
            return None;
        }
        let text = |v: Option<f64>| Entry::from(v.map_or("–".into(), |v| format!("{v:.3}")));
        let mut cells: Vec<Entry> = values.into_iter().map(text).collect();
        cells.push(text(Some(spread(&known).0)));
        let mut line = Line::new("paper, as printed", cells);
        line.printed = true;
        Some(line)
    }

    /// Heads of a table of all columns.
    pub fn heads(&self, first: &str) -> Vec<String> {
        let pairs = self.columns.iter().map(|(a, b)| format!("{a}/{b}"));
        std::iter::once(first.to_string())
            .chain(pairs)
            .chain(["mean".to_string()])
            .collect()
    }

    /// What a row of an experiment costs.
    pub fn cost(&self, experiment: &Experiment, row: &Row) -> Option<&Cost> {
        let at = experiment.rows.iter().position(|r| r == row)?;
        Some(&self.found(experiment)?.rows.get(at)?.cost)
    }
}

/// Mean, and spread where there are several.
pub fn auroc(values: &[f64]) -> Entry {
    let (mean, deviation) = spread(values);
    let text = match values.len() {
        0 => "–".into(),
        1 => format!("{mean:.3}"),
        _ => format!("{mean:.3} ± {deviation:.3}"),
    };
    Entry {
        text,
        auroc: (!values.is_empty()).then_some(mean),
    }
}

#[cfg(test)]
pub mod tests {
    use super::super::record::{NetworkRecord, RowRecord};
    use super::*;
    use crate::cells::columns;
    use crate::rows::{KINEMATIC, R3, printed_name};
    use dose3_ood::metrics::Estimate;

    /// A record whose rows have the same AUROC in every cell of every split; rows that are not named have .5.
    pub fn record(experiment: &Experiment, rows: &[(Row, f64)]) -> Record {
        let estimate = |value| Estimate {
            value,
            interval: None,
            id_logs: 1,
            ood_logs: 1,
        };
        let cells = |value| -> Vec<Cell> {
            columns(&['O', 'K', 'I'])
                .into_iter()
                .map(|(id, ood)| Cell {
                    id,
                    ood,
                    fit_windows: 10,
                    id_windows: 5,
                    ood_windows: 7,
                    auroc: estimate(value),
                    aupr_in: estimate(value),
                    aupr_out: estimate(value),
                    fpr_at_95_tpr: estimate(1.0 - value),
                })
                .collect()
        };
        let of_row = |row: &Row| {
            let given = rows.iter().find(|(r, _)| r == row);
            let value = given.map_or(0.5, |(_, value)| *value);
            let splits = experiment.splits.iter().map(|split| SplitRecord {
                split: *split,
                cells: cells(value),
                curves: Vec::new(),
            });
            RowRecord {
                cost: Cost {
                    parameters: 10,
                    milliseconds: 2.0,
                    training: None,
                },
                splits: splits.collect(),
            }
        };
        Record {
            network: Some(NetworkRecord {
                parameters: 10,
                window: 128,
                steps: 30,
                visited: 30,
                trained_on: vec!["00".into()],
            }),
            sets: Vec::new(),
            rows: experiment.rows.iter().map(of_row).collect(),
            seconds: 1.0,
        }
    }

    /// The outcome of an experiment that found such a [`record`].
    pub fn found(experiment: Experiment, rows: &[(Row, f64)]) -> (Experiment, Outcome) {
        let record = record(&experiment, rows);
        (experiment, Outcome::Found(Box::new(record)))
    }

    /// Findings on the paper's sets.
    pub fn findings(outcomes: impl IntoIterator<Item = (Experiment, Outcome)>) -> Findings {
        Findings {
            outcomes: outcomes.into_iter().collect(),
            columns: columns(&['O', 'K', 'I']),
            real: true,
        }
    }

    #[test]
    fn a_line_shows_mean_and_spread_of_seeds_or_why_there_is_none() {
        let [a, b, c] = Experiment::main()[..] else {
            panic!("three seeds")
        };
        let findings = findings([
            found(a, &[(R3, 0.5)]),
            found(b, &[(R3, 0.7)]),
            (c, Outcome::NotRun("no weights".into())),
        ]);
        fn query(of: &[Experiment]) -> Query<'_> {
            Query {
                of,
                row: R3,
                split: Split::HeldOut,
            }
        }
        let line = findings.line("R^3", query(&[a, b]));
        assert_eq!(line.cells.len(), 7);
        assert_eq!(line.cells[0].text, "0.600 ± 0.141");
        assert_eq!(line.cells[6].text, "0.600");
        assert_eq!(
            findings.line("x", query(&[c])).cells[0].text,
            "not run: no weights"
        );
        let name = printed_name(&R3).unwrap();
        assert_eq!(findings.printed_line(name).unwrap().cells[0].text, "0.362");
        assert!(printed_name(&KINEMATIC).is_none());
    }
}
