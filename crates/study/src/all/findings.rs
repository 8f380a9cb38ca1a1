//! Everything the jobs found, as the tables ask for it.

use super::measure::{Cost, Found, RowFound};
use super::table::{Entry, Line};
use crate::cells::{Cell, Protocol};
use crate::paper::printed;
use crate::report::spread;
use std::collections::BTreeMap;

/// What became of a job.
#[derive(Clone, Debug)]
pub enum Outcome {
    /// It ran.
    Found(Box<Found>),
    /// It did not, for this reason.
    NotRun(String),
}

/// All outcomes.
pub struct Findings {
    /// By key of the job.
    pub outcomes: BTreeMap<String, Outcome>,
    /// Pairs of sets in the order of the paper's columns, ID first.
    pub columns: Vec<(char, char)>,
    /// Whether the paper's numbers may stand beside these.
    pub real: bool,
}

/// A row of some jobs (one a seed) under a protocol.
#[derive(Clone, Copy, Debug)]
pub struct Query<'a> {
    /// Keys of the jobs.
    pub jobs: &'a [&'a str],
    /// Key of the row.
    pub row: &'a str,
    /// How ID test windows were chosen.
    pub protocol: Protocol,
}

impl Findings {
    /// A job that ran.
    pub fn found(&self, job: &str) -> Option<&Found> {
        match self.outcomes.get(job)? {
            Outcome::Found(found) => Some(found),
            Outcome::NotRun(_) => None,
        }
    }

    /// A row of a job.
    pub fn row(&self, job: &str, row: &str, protocol: Protocol) -> Option<&RowFound> {
        let rows = &self.found(job)?.rows;
        rows.iter().find(|r| r.row == row && r.protocol == protocol)
    }

    /// One cell of a row.
    pub fn cell(
        &self,
        job: &str,
        row: &str,
        protocol: Protocol,
        at: (char, char),
    ) -> Option<&Cell> {
        let cells = &self.row(job, row, protocol)?.cells;
        cells.iter().find(|c| (c.id, c.ood) == at)
    }

    /// The AUROC of a cell for each job that has it.
    pub fn values(&self, query: Query<'_>, at: (char, char)) -> Vec<f64> {
        let cells = query.jobs.iter();
        cells
            .filter_map(|job| self.cell(job, query.row, query.protocol, at))
            .map(|c| c.auroc.value)
            .collect()
    }

    /// The mean over jobs of one cell.
    pub fn mean(&self, query: Query<'_>, at: (char, char)) -> Option<f64> {
        let values = self.values(query, at);
        (!values.is_empty()).then(|| spread(&values).0)
    }

    /// The mean over jobs and columns.
    pub fn overall(&self, query: Query<'_>) -> Option<f64> {
        let means = self.columns.iter().map(|at| self.mean(query, *at));
        let means: Vec<f64> = means.collect::<Option<_>>()?;
        (!means.is_empty()).then(|| spread(&means).0)
    }

    /// A line of all columns and their mean; where no job ran, the reason.
    pub fn line(&self, label: &str, query: Query<'_>) -> Line {
        if query
            .jobs
            .iter()
            .all(|job| self.row(job, query.row, query.protocol).is_none())
        {
            let reason = Entry::from(format!("not run: {}", self.reason(query.jobs)));
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

    fn reason(&self, jobs: &[&str]) -> String {
        let mut outcomes = jobs.iter().filter_map(|job| self.outcomes.get(*job));
        match outcomes.next() {
            Some(Outcome::NotRun(reason)) => reason.clone(),
            _ => "not among the jobs of this run".into(),
        }
    }

    /// The paper's line for a row, where it prints one and real data was used.
    pub fn printed_line(&self, row: &str) -> Option<Line> {
        let values: Vec<Option<f64>> = self
            .columns
            .iter()
            .map(|(id, ood)| printed(row, *id, *ood))
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

    /// What a row of a job costs.
    pub fn cost(&self, job: &str, row: &str) -> Option<&Cost> {
        self.found(job)?.costs.iter().find(|c| c.row == row)
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
    use super::*;
    use crate::cells::columns;
    use dose3_ood::metrics::Estimate;

    /// A job whose rows have the same AUROC in every cell, given per row and protocol.
    pub fn job(key: &str, rows: &[(&str, Protocol, f64)]) -> (String, Outcome) {
        let estimate = |value| Estimate {
            value,
            interval: None,
            id_logs: 1,
            ood_logs: 1,
        };
        let cells = |value| {
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
        let found = Found {
            key: key.into(),
            network: "kitti".into(),
            parameters: 10,
            window: 128,
            steps: (30, 30),
            trained_on: vec!["00".into()],
            sets: Vec::new(),
            costs: Vec::new(),
            seconds: 1.0,
            rows: rows
                .iter()
                .map(|(row, protocol, value)| RowFound {
                    row: (*row).into(),
                    protocol: *protocol,
                    cells: cells(*value),
                    curves: Vec::new(),
                })
                .collect(),
        };
        (key.into(), Outcome::Found(Box::new(found)))
    }

    /// Findings of some jobs on the paper's sets.
    pub fn findings(jobs: impl IntoIterator<Item = (String, Outcome)>) -> Findings {
        Findings {
            outcomes: jobs.into_iter().collect(),
            columns: columns(&['O', 'K', 'I']),
            real: true,
        }
    }

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
    fn a_line_shows_mean_and_spread_of_seeds_or_why_there_is_none() {
        let jobs = [
            job("a", &[("r3", Protocol::Paper, 0.5)]),
            job("b", &[("r3", Protocol::Paper, 0.7)]),
            ("c".into(), Outcome::NotRun("no weights".into())),
        ];
        let findings = findings(jobs);
        let query = |jobs| Query {
            jobs,
            row: "r3",
            protocol: Protocol::Paper,
        };
        let line = findings.line("R^3", query(&["a", "b"]));
        assert_eq!(line.cells.len(), 7);
        assert_eq!(line.cells[0].text, "0.600 ± 0.141");
        assert_eq!(line.cells[6].text, "0.600");
        assert_eq!(
            findings.line("x", query(&["c"])).cells[0].text,
            "not run: no weights"
        );
        assert_eq!(findings.printed_line("r3").unwrap().cells[0].text, "0.362");
        assert!(findings.printed_line("kinematic").is_none());
    }
}
