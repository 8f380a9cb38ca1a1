//! Progress with an estimate of what is left: a bar on a terminal, a line an experiment elsewhere.

use super::experiment::{Effort, Experiment};
use super::findings::Outcome;
use anyhow::Result;
use indicatif::{ProgressBar, ProgressStyle};
use std::io::IsTerminal;
use std::time::{Duration, Instant};

/// One that took less was taken up from an earlier run, or could not start.
const AT_ONCE: Duration = Duration::from_millis(500);

/// The clock of a run.
pub struct Clock {
    bar: ProgressBar,
    start: Instant,
    current: Instant,
    index: usize,
    count: usize,
    /// Work of all experiments but those that took no time.
    total: u64,
    /// Work of those that are done.
    worked: u64,
}

impl Clock {
    /// For a plan over so many sets.
    ///
    /// # Errors
    /// Never with the template that stands here.
    pub fn new(plan: &[Experiment], effort: Effort, sets: usize) -> Result<Self> {
        let total = plan.iter().map(|one| one.work(effort, sets)).sum();
        let bar = match std::io::stderr().is_terminal() {
            true => ProgressBar::new(total),
            false => ProgressBar::hidden(),
        };
        bar.set_style(
            ProgressStyle::with_template(
                "{prefix:<28} [{bar:30}] {percent}% {elapsed} elapsed, {eta} left",
            )?
            .progress_chars("=> "),
        );
        Ok(Self {
            bar,
            start: Instant::now(),
            current: Instant::now(),
            index: 0,
            count: plan.len(),
            total,
            worked: 0,
        })
    }

    /// Names what goes on beside the experiments.
    pub fn say(&self, what: &str) {
        self.bar.set_prefix(what.to_string());
        self.print(what);
    }

    /// An experiment begins.
    pub fn begin(&mut self, name: &str) {
        self.index += 1;
        self.current = Instant::now();
        self.bar
            .set_prefix(format!("{}/{} {name}", self.index, self.count));
    }

    /// A part of it is done.
    pub fn tick(&self, work: u64) {
        self.bar.inc(work);
    }

    /// It ended, and was to take so much work.
    pub fn end(&mut self, name: &str, work: u64, outcome: &Outcome) {
        let took = self.current.elapsed();
        if took < AT_ONCE {
            self.total -= work;
            self.bar.set_length(self.total);
        } else {
            self.worked += work;
        }
        self.bar.set_position(self.worked);
        let what = match outcome {
            Outcome::Found(_) if took < AT_ONCE => "done by an earlier run".into(),
            Outcome::Found(_) => format!("{:.0} s", took.as_secs_f64()),
            Outcome::NotRun(reason) => format!("NOT RUN: {reason}"),
        };
        let left = match self.left() {
            Some(left) => format!(", about {:.0} min left", (left.as_secs_f64() / 60.0).ceil()),
            None => String::new(),
        };
        self.print(&format!(
            "{}/{} {name}: {what}{left}",
            self.index, self.count
        ));
    }

    fn left(&self) -> Option<Duration> {
        let to_do = self.total.checked_sub(self.worked)? as f64;
        (self.worked > 0).then(|| self.start.elapsed().mul_f64(to_do / self.worked as f64))
    }

    fn print(&self, line: &str) {
        if self.bar.is_hidden() {
            say!("{line}");
        }
    }

    /// The run is over.
    pub fn finish(&self) {
        self.bar.finish_and_clear();
    }
}
