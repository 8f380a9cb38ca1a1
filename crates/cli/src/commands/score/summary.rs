//! What is said of all logs together: little of each is kept, however many there are.

use super::judge::Judged;
use crate::terminal::{count, say};
use dose3::ood::fdr::benjamini_hochberg;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::PathBuf;

/// Share of false alarms among the called logs where none is asked for.
const USUAL_FDR: f64 = 0.05;
/// Names of called logs that are said.
const NAMED: usize = 10;
/// Notes that are said.
const NOTES: usize = 12;

/// A path that is no log or cannot be judged, and why.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Failure {
    /// The path.
    pub path: String,
    /// What is wrong.
    pub error: String,
}

/// Counts over all logs of a call.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Counts {
    /// Logs judged.
    pub judged: usize,
    /// Those out of distribution, each at its alpha.
    pub out_of_distribution: usize,
    /// Those unlike the one trusted log, where a detector knows only one.
    pub unlike: usize,
    /// Logs that could not be read or judged.
    pub errors: usize,
    /// The logs called if of all called at most a share may be false alarms.
    pub fdr: Fdr,
}

/// Logs called by Benjamini and Hochberg's procedure over all logs of a call.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Fdr {
    /// The share of the called logs that may be false alarms.
    pub level: f64,
    /// Names of the called logs, in the order of the logs.
    pub called: Vec<String>,
}

/// Hears of every log.
#[derive(Debug)]
pub struct Summary {
    /// Counts, whole after [`Summary::end`].
    pub counts: Counts,
    /// Logs that could not be read or judged.
    pub errors: Vec<Failure>,
    /// Files in folders that are no logs.
    pub skipped: Vec<Failure>,
    /// Whether the call goes by the share of false alarms.
    by_fdr: bool,
    /// Which of the judged logs are called with all others.
    called: Vec<bool>,
    chances: Vec<f64>,
    names: Vec<String>,
    /// Notes by their text without numbers: the first such note, its log, and how many logs have one.
    notes: BTreeMap<String, Noted>,
    alpha: Option<f64>,
    many: bool,
}

#[derive(Debug)]
struct Noted {
    order: usize,
    text: String,
    log: String,
    logs: usize,
}

impl Summary {
    pub fn new(skipped: &[(PathBuf, String)]) -> Self {
        let skipped = skipped.iter().map(|(path, error)| Failure {
            path: path.display().to_string(),
            error: error.clone(),
        });
        Self {
            counts: Counts::default(),
            errors: Vec::new(),
            skipped: skipped.collect(),
            by_fdr: false,
            called: Vec::new(),
            chances: Vec::new(),
            names: Vec::new(),
            notes: BTreeMap::new(),
            alpha: None,
            many: false,
        }
    }

    /// The next log.
    pub fn add(&mut self, judged: &Judged, many: bool) {
        self.many |= many;
        match &judged.outcome {
            Ok((_, report)) => {
                self.counts.judged += 1;
                self.counts.out_of_distribution += usize::from(report.is_ood());
                self.counts.unlike += usize::from(report.verdict.differs() && !report.is_ood());
                self.alpha = Some(report.evidence.alpha);
                self.chances.push(report.evidence.p_value);
                self.names.push(report.log.name.clone());
                report
                    .notes
                    .iter()
                    .for_each(|note| self.note(note, &report.log.name));
            }
            Err(error) => {
                self.counts.errors += 1;
                self.errors.push(Failure {
                    path: judged.path.display().to_string(),
                    error: error.clone(),
                });
            }
        }
    }

    fn note(&mut self, text: &str, log: &str) {
        let order = self.notes.len();
        let noted = self
            .notes
            .entry(without_numbers(text))
            .or_insert_with(|| Noted {
                order,
                text: text.to_owned(),
                log: log.to_owned(),
                logs: 0,
            });
        noted.logs += 1;
    }

    /// All logs are there: which are called at the level asked for.
    pub fn end(&mut self, level: Option<f64>) {
        self.by_fdr = level.is_some();
        let level = level.unwrap_or(USUAL_FDR);
        self.called = benjamini_hochberg(&self.chances, level);
        let called = self.names.iter().zip(&self.called);
        let names = called.filter(|(_, called)| **called);
        self.counts.fdr = Fdr {
            level,
            called: names.map(|(name, _)| name.clone()).collect(),
        };
    }

    /// Whether the judged log of that number is called: by its own verdict, `ood`, or with all others where a share of false
    /// alarms was asked for.
    pub fn calls(&self, index: usize, ood: bool) -> bool {
        match self.by_fdr {
            true => self.called[index],
            false => ood,
        }
    }

    /// 2 where a log could not be judged, else 1 where one is out of distribution, else 0.
    pub fn exit_code(&self) -> u8 {
        let called = match self.by_fdr {
            true => self.counts.fdr.called.len(),
            false => self.counts.out_of_distribution,
        };
        match (self.counts.errors, called) {
            (0, 0) => 0,
            (0, _) => 1,
            _ => 2,
        }
    }

    /// Notes, each kind once, and the counts; nothing where there is only one log.
    pub fn say(&self, notes: bool) {
        if !self.many {
            return;
        }
        if notes {
            self.say_notes();
        }
        let counts = &self.counts;
        let alpha = self
            .alpha
            .map_or(String::new(), |alpha| format!(" at alpha {alpha}"));
        let unlike = match counts.unlike {
            0 => String::new(),
            unlike => format!(", {unlike} unlike the one trusted log"),
        };
        let errors = match counts.errors {
            0 => String::new(),
            errors => format!(", {errors} could not be judged"),
        };
        say(&format!(
            "{} of {} out of distribution{alpha}, {} at FDR {} %{unlike}{errors}",
            counts.out_of_distribution,
            count(counts.judged, "log"),
            counts.fdr.called.len(),
            rounded(100.0 * counts.fdr.level)
        ));
        if self.by_fdr && !counts.fdr.called.is_empty() {
            say(&format!("called: {}", some_of(&counts.fdr.called)));
        }
    }

    fn say_notes(&self) {
        let mut notes: Vec<&Noted> = self.notes.values().collect();
        notes.sort_by_key(|noted| noted.order);
        for noted in notes.iter().take(NOTES) {
            let of = match noted.logs {
                1 => noted.log.clone(),
                logs if logs == self.counts.judged => "every log".to_owned(),
                logs => format!("{} and {} like it", noted.log, count(logs - 1, "log")),
            };
            say(&format!("note: {of}: {}", noted.text));
        }
        if notes.len() > NOTES {
            let more = notes.len() - NOTES;
            say(&format!(
                "note: and {more} more kinds of notes (-v shows them with their logs)"
            ));
        }
    }
}

/// A text with `#` for every number: notes that differ in numbers alone are one kind.
fn without_numbers(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c.is_ascii_digit() {
            true if out.ends_with('#') => {}
            true => out.push('#'),
            false => out.push(c),
        }
    }
    out
}

/// The first names.
fn some_of(names: &[String]) -> String {
    let first = names[..names.len().min(NAMED)].join(", ");
    match names.len().saturating_sub(NAMED) {
        0 => first,
        more => format!("{first} and {more} more"),
    }
}

/// A number with at most two digits behind the point.
fn rounded(x: f64) -> f64 {
    (100.0 * x).round() / 100.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn notes_that_differ_in_numbers_are_one_kind() {
        assert_eq!(
            without_numbers("interpolated from 99.9812 Hz down to 10 Hz"),
            "interpolated from #.# Hz down to # Hz"
        );
    }

    #[test]
    fn many_names_are_cut_short() {
        let names: Vec<String> = (0..12).map(|i| i.to_string()).collect();
        assert_eq!(some_of(&names[..2]), "0, 1");
        assert_eq!(some_of(&names), "0, 1, 2, 3, 4, 5, 6, 7, 8, 9 and 2 more");
        assert_eq!(rounded(100.0 * 0.07), 7.0);
    }
}
