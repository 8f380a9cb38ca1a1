//! Which windows a figure shows, and the words for them.

use crate::numbers::evenly;
use crate::sets::DataSet;
use anyhow::{Result, bail};
use dose3::model_file::{LogRecord, Model};
use dose3_datasets::{Kind, Trajectory, Window};
use std::collections::BTreeSet;

/// Some windows of a set.
pub struct Selection<'a> {
    /// The set.
    pub set: &'a DataSet,
    /// Position of the set among all, which gives its colour.
    pub index: usize,
    /// The windows, in order.
    pub windows: Vec<Window>,
    /// Whether the network was not trained on their logs.
    pub unseen: bool,
}

impl<'a> Selection<'a> {
    /// At most `limit` windows of the `index`-th set, of logs that `model` was not trained on; where it was
    /// trained on all, of all.
    ///
    /// # Errors
    /// A set without windows.
    pub fn new(sets: &'a [DataSet], index: usize, model: &Model, limit: usize) -> Result<Self> {
        let set = &sets[index];
        let trained = hashes(&model.header.training.logs);
        let fresh = |t: &Trajectory| !trained.contains(t.fingerprint().as_str());
        let fresh: Vec<bool> = set.trajectories.iter().map(fresh).collect();
        let of_fresh = |w: &&Window| fresh[w.trajectory];
        let unseen = set.windows.iter().any(|w| of_fresh(&w));
        let windows: Vec<Window> = set
            .windows
            .iter()
            .filter(|w| !unseen || of_fresh(w))
            .copied()
            .collect();
        if windows.is_empty() || limit == 0 {
            bail!("{} has no window for a figure", set.name);
        }
        Ok(Self {
            set,
            index,
            windows: evenly(&windows, limit),
            unseen,
        })
    }

    /// `115 windows of KITTI (3 logs, unseen by the network)`.
    pub fn describe(&self) -> String {
        let logs: BTreeSet<usize> = self.windows.iter().map(|w| w.trajectory).collect();
        let seen = match self.unseen {
            true => "unseen by the network",
            false => "the network was trained on them",
        };
        let plural = if logs.len() == 1 { "log" } else { "logs" };
        format!(
            "{} windows of {} ({} {plural}, {seen})",
            self.windows.len(),
            self.set.name,
            logs.len()
        )
    }
}

/// Fails for a model or sets that no figure can be made of.
///
/// # Errors
/// No set, another representation than the paper's, sets prepared for another window length.
pub fn check(sets: &[DataSet], model: &Model) -> Result<()> {
    if sets.is_empty() {
        bail!("figures need a data set");
    }
    if model.header.representation.kind != Kind::Paper {
        bail!(
            "the figures show models of representation paper, not {}",
            model.header.representation.kind
        );
    }
    let lengths = sets.iter().flat_map(|s| &s.windows).map(|w| w.length);
    if let Some(length) = lengths.into_iter().find(|l| *l != model.header.window) {
        bail!(
            "the windows have {length} poses, the model takes {}",
            model.header.window
        );
    }
    Ok(())
}

/// `network trained on KITTI` where a set holds all its training logs, else their names.
pub fn network(sets: &[DataSet], model: &Model) -> String {
    let logs = &model.header.training.logs;
    match trained_on(sets, model) {
        Some(set) => format!("network trained on {} of {}", count(logs), sets[set].name),
        None => {
            let names: Vec<&str> = logs.iter().map(|l| l.name.as_str()).collect();
            format!("network trained on other logs ({})", names.join(", "))
        }
    }
}

/// Position of the set that holds all logs the network was trained on.
pub fn trained_on(sets: &[DataSet], model: &Model) -> Option<usize> {
    let trained = hashes(&model.header.training.logs);
    sets.iter().position(|set| {
        let of_set: Vec<String> = set
            .trajectories
            .iter()
            .map(Trajectory::fingerprint)
            .collect();
        let held: BTreeSet<&str> = of_set.iter().map(String::as_str).collect();
        !trained.is_empty() && trained.is_subset(&held)
    })
}

fn hashes(logs: &[LogRecord]) -> BTreeSet<&str> {
    logs.iter().map(|l| l.sha256.as_str()).collect()
}

fn count(logs: &[LogRecord]) -> String {
    match logs.len() {
        1 => "1 log".into(),
        n => format!("{n} logs"),
    }
}
