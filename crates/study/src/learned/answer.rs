//! Scores with the windows they belong to.

use super::Baseline;
use crate::sets::DataSet;
use anyhow::{Context, Result, ensure};
use dose3::model_file::LogRecord;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// What one baseline says of all windows.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LearnedScores {
    /// Scores `[set][window]`, windows as in the sets; higher = more out of distribution.
    pub scores: Vec<Vec<f64>>,
    /// Numbers that were trained.
    pub parameters: usize,
    /// Seconds that training took, on the machine that trained, where they are known.
    pub train_seconds: Option<f64>,
    /// Seconds that scoring took.
    pub score_seconds: f64,
    /// How training ended, and on what.
    pub outcome: String,
}

/// Where a window lies.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct WindowName {
    /// Name of the log.
    pub log: String,
    /// Index of the first pose.
    pub start: usize,
    /// Number of poses.
    pub length: usize,
}

/// Logs and windows of one set.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SetWindows {
    /// The letter of the set in tables.
    pub letter: char,
    /// Its logs, with their hashes.
    pub logs: Vec<LogRecord>,
    /// Its windows.
    pub windows: Vec<WindowName>,
}

/// Scores of the baselines for the windows of some sets: what `baseline-scores` writes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Answer {
    /// What was scored.
    pub sets: Vec<SetWindows>,
    /// The scores.
    pub baselines: BTreeMap<Baseline, LearnedScores>,
}

impl SetWindows {
    /// Logs and windows of `set`.
    pub fn new(set: &DataSet) -> Self {
        let name = |trajectory: usize| set.trajectories[trajectory].name.clone();
        let windows = set.windows.iter().map(|w| WindowName {
            log: name(w.trajectory),
            start: w.start,
            length: w.length,
        });
        Self {
            letter: set.letter,
            logs: set.trajectories.iter().map(LogRecord::from).collect(),
            windows: windows.collect(),
        }
    }

    /// Fails where `scored` are other logs or windows.
    fn check(&self, scored: &Self) -> Result<()> {
        ensure!(
            self.letter == scored.letter,
            "the baselines scored set {}",
            scored.letter
        );
        for (own, other) in self.logs.iter().zip(&scored.logs) {
            ensure!(
                own == other,
                "log {} is not the log {} that the baselines scored",
                own.name,
                other.name
            );
        }
        for (i, (own, other)) in self.windows.iter().zip(&scored.windows).enumerate() {
            ensure!(
                own == other,
                "window {i} is {own:?}, the baselines scored {other:?}"
            );
        }
        let counts = |set: &Self| (set.logs.len(), set.windows.len());
        ensure!(
            counts(self) == counts(scored),
            "(logs, windows) are {:?}, the baselines scored {:?}",
            counts(self),
            counts(scored)
        );
        Ok(())
    }
}

impl Answer {
    /// The scores, after a check that they are those of the windows of `sets`.
    ///
    /// # Errors
    /// Other sets, logs or windows, or a score too many or too few.
    pub fn for_sets(self, sets: &[DataSet]) -> Result<BTreeMap<Baseline, LearnedScores>> {
        ensure!(
            sets.len() == self.sets.len(),
            "{} sets, the baselines scored {}",
            sets.len(),
            self.sets.len()
        );
        for (set, scored) in sets.iter().zip(&self.sets) {
            let check = SetWindows::new(set).check(scored);
            check.with_context(|| format!("set {}", set.letter))?;
        }
        for (baseline, scores) in &self.baselines {
            let found: Vec<usize> = scores.scores.iter().map(Vec::len).collect();
            let expected: Vec<usize> = sets.iter().map(|set| set.windows.len()).collect();
            ensure!(
                found == expected,
                "{}: {found:?} scores for {expected:?} windows",
                baseline.name()
            );
        }
        Ok(self.baselines)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sets;

    fn prepared(stride: usize) -> Vec<DataSet> {
        let mut sets = sets::synthetic(0, 2).unwrap();
        sets.iter_mut()
            .for_each(|set| set.prepare(128, stride, &[], &[]));
        sets
    }

    fn answer(sets: &[DataSet]) -> Answer {
        let scores = LearnedScores {
            scores: sets.iter().map(|s| vec![0.5; s.windows.len()]).collect(),
            parameters: 1,
            train_seconds: None,
            score_seconds: 0.0,
            outcome: String::new(),
        };
        Answer {
            sets: sets.iter().map(SetWindows::new).collect(),
            baselines: BTreeMap::from([(Baseline::Jem, scores)]),
        }
    }

    #[test]
    fn scores_of_the_same_windows_pass() {
        let sets = prepared(64);
        let text = serde_json::to_string(&answer(&sets)).unwrap();
        let read: Answer = serde_json::from_str(&text).unwrap();
        assert_eq!(read, answer(&sets));
        assert_eq!(
            read.for_sets(&sets).unwrap()[&Baseline::Jem].scores.len(),
            3
        );
    }

    #[test]
    fn scores_of_other_windows_are_refused() {
        let sets = prepared(64);
        let refusal = |answer: Answer| format!("{:#}", answer.for_sets(&sets).unwrap_err());

        assert!(refusal(answer(&prepared(65))).contains("set V: window 1"));
        assert!(refusal(answer(&sets[..2])).contains("3 sets"));

        let mut shorter = prepared(64);
        shorter[1].windows.pop();
        assert!(refusal(answer(&shorter)).contains("set H: (logs, windows)"));

        let mut moved = prepared(64);
        moved[2].trajectories[0].poses[9].translation.x += 1e-9;
        assert!(refusal(answer(&moved)).contains("set D: log synthetic-drone-00 is not"));

        let mut lost = answer(&sets);
        lost.baselines.get_mut(&Baseline::Jem).unwrap().scores[0].pop();
        assert!(refusal(lost).contains("jem"));
    }
}
