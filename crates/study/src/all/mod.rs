//! `cargo xtask benchmark --all`: every table and figure of the paper, with honest columns beside it.

mod clock;
mod cost;
mod figures;
mod findings;
mod jobs;
mod learned;
mod measure;
mod page;
mod readings;
mod report;
mod rows;
mod shortfalls;
mod store;
mod table;
mod tables;
#[cfg(test)]
mod tests;

use crate::benchmark::{self, BenchmarkArgs};
use crate::cells::columns;
use crate::learned::Request;
use crate::networks;
use crate::provenance::{commit, machine};
use crate::sets::DataSet;
use anyhow::{Result, bail};
use clap::Args;
use clock::Clock;
use dose3::model_file::Model;
use dose3_datasets::Trajectory;
use dose3_model::Precision;
use dose3_ood::DensityConfig;
use findings::{Findings, Outcome};
use jobs::{Change, Job};
use measure::{Found, Settings, prepare};
use std::collections::BTreeMap;
use std::time::Instant;
use store::Store;

/// Arguments of `--all`.
#[derive(Debug, Args)]
pub struct AllArgs {
    /// All tables and figures of the paper, with every baseline: all.html, all.json and all.md
    #[arg(
        long,
        conflicts_with_all = ["faults", "model", "retrain", "seeds", "stride", "steps", "draws"]
    )]
    pub all: bool,
    /// Do every job anew, also those that an earlier run of the same program finished
    #[arg(long, requires = "all")]
    pub fresh: bool,
    /// Leave out JEM and Glow, which are built with burn the first time (about eight minutes)
    #[arg(long, requires = "all")]
    pub without_baselines: bool,
}

/// Windows a set in figures.
const FIGURE_WINDOWS: usize = 400;

/// Runs all jobs and writes the report.
///
/// # Errors
/// Data that cannot be read, files that cannot be written; after the report is written, jobs that could not
/// run.
pub fn run(args: &BenchmarkArgs) -> Result<()> {
    let start = Instant::now();
    // Before the run: the checkout may move on meanwhile.
    let commit = commit();
    let density: DensityConfig = args.density.parse()?;
    let (source, sets) = benchmark::load(args)?;
    let settings = Settings {
        density: &density,
        resamples: args.resamples,
        quick: args.quick,
        backend: args.backend,
        threads: args.threads,
    };
    let store = Store::new(
        args.out.join("all"),
        &identity(args, &sets),
        !args.all.fresh,
    )?;
    let plan = jobs::plan(args.quick);
    let mut run = Run {
        sets: &sets,
        settings,
        store,
        outcomes: BTreeMap::new(),
        clock: Clock::new(&plan, args.quick, sets.len())?,
    };
    for job in &plan {
        run.job(job)?;
    }
    run.learned(args, source.is_none())?;
    let training = run.training_seconds()?;
    let letters: Vec<char> = sets.iter().map(|s| s.letter).collect();
    let findings = Findings {
        outcomes: std::mem::take(&mut run.outcomes),
        columns: columns(&letters),
        real: source.is_some(),
    };
    run.clock.say("figures");
    let (figures, missing) = run.figures(&findings);
    run.clock.finish();
    let report = report::Report {
        source,
        command: std::env::args().skip(1).collect::<Vec<_>>().join(" "),
        commit,
        machine: machine(),
        seconds: start.elapsed().as_secs_f64(),
        density: args.density.clone(),
        quick: args.quick,
        training,
        missing,
    };
    report.write(args, &findings, figures)?;
    let failed: Vec<&String> = findings
        .outcomes
        .iter()
        .filter(|(_, outcome)| matches!(outcome, Outcome::NotRun(_)))
        .map(|(key, _)| key)
        // What was left out by request is not a failure.
        .filter(|key| !(args.all.without_baselines && key.starts_with("learned-")))
        .chain(&report.missing)
        .collect();
    if !failed.is_empty() {
        bail!("the report was written, but these could not be run: {failed:?}");
    }
    Ok(())
}

/// What makes the outcome of a job another one, beside program, job and weights.
fn identity(args: &BenchmarkArgs, sets: &[DataSet]) -> Vec<String> {
    let logs = sets.iter().flat_map(|set| &set.trajectories);
    let mut parts: Vec<String> = logs.map(Trajectory::fingerprint).collect();
    parts.push(format!(
        "{} {} {} {:?}",
        args.density, args.resamples, args.quick, args.backend
    ));
    parts
}

/// A run on its way.
struct Run<'a> {
    sets: &'a [DataSet],
    settings: Settings<'a>,
    store: Store,
    outcomes: BTreeMap<String, Outcome>,
    clock: Clock,
}

impl Run<'_> {
    /// Runs a job, or takes up what an earlier run found. A job that cannot run does not stop the others.
    fn job(&mut self, job: &Job) -> Result<()> {
        self.clock.begin(&job.key);
        let outcome = match networks::load(job.network) {
            Ok(model) => self.with_model(job, &model)?,
            // The outermost words name the command that helps, without the path that was tried.
            Err(error) => Outcome::NotRun(error.to_string()),
        };
        let work = job.work(self.settings.quick, self.sets.len());
        self.clock.end(&job.key, work, &outcome);
        self.outcomes.insert(job.key.clone(), outcome);
        Ok(())
    }

    fn with_model(&self, job: &Job, model: &Model) -> Result<Outcome> {
        let (text, bytes) = (
            serde_json::to_string(job)?,
            model.to_bytes(Precision::F32, &[])?,
        );
        if let Some(found) = self.store.take_up(&job.key, &text, &bytes) {
            return Ok(Outcome::Found(Box::new(found)));
        }
        let tick = |units| self.clock.tick(units);
        let found = measure::run(job, model, self.sets, &self.settings, &tick);
        self.kept(&job.key, &text, &bytes, found)
    }

    fn kept(&self, key: &str, job: &str, bytes: &[u8], found: Result<Found>) -> Result<Outcome> {
        Ok(match found {
            Ok(found) => {
                self.store.keep(key, job, bytes, &found)?;
                Outcome::Found(Box::new(found))
            }
            Err(error) => Outcome::NotRun(format!("{error:#}")),
        })
    }

    /// The learned baselines on the windows of the main table.
    fn learned(&mut self, args: &BenchmarkArgs, synthetic: bool) -> Result<()> {
        for job in learned::plan(args.quick) {
            self.clock.begin(&job.key);
            let outcome = if args.all.without_baselines {
                Outcome::NotRun("left out (--without-baselines)".into())
            } else {
                self.learned_job(&job, args, synthetic)?
            };
            self.clock.end(&job.key, 0, &outcome);
            self.outcomes.insert(job.key, outcome);
        }
        Ok(())
    }

    fn learned_job(
        &self,
        job: &learned::LearnedJob,
        args: &BenchmarkArgs,
        synthetic: bool,
    ) -> Result<Outcome> {
        let network = match job.representation {
            dose3_datasets::Kind::Paper => networks::KITTI,
            dose3_datasets::Kind::Motion => "kitti-motion",
        };
        let model = match networks::load(network) {
            Ok(model) => model,
            Err(error) => return Ok(Outcome::NotRun(error.to_string())),
        };
        let asked = Request {
            representation: job.representation,
            seed: job.seed,
            most: self.settings.most(jobs::MAIN),
            data: args.data.clone(),
            synthetic,
            quick: args.quick,
            train_steps: None,
            threads: args.threads,
        };
        let (text, bytes) = (format!("{asked:?}"), learned::weights(job));
        if let Some(found) = self.store.take_up(&job.key, &text, &bytes) {
            return Ok(Outcome::Found(Box::new(found)));
        }
        let sets = prepare(self.sets, &model, asked.most, Change::None)?;
        let found = learned::run(job, &asked, &sets, &self.settings);
        self.kept(&job.key, &text, &bytes, found)
    }

    /// Seconds of training the shipped network, or none with `--quick`.
    fn training_seconds(&self) -> Result<Option<f64>> {
        if self.settings.quick {
            return Ok(None);
        }
        self.clock.say("time of a training step");
        cost::training_seconds(self.sets, self.settings.threads).map(Some)
    }

    /// The figures that could be drawn, and the names of those that could not with the reason.
    fn figures(&self, findings: &Findings) -> (Vec<figures::Figure>, Vec<String>) {
        let (mut drawn, mut missing) = (Vec::new(), Vec::new());
        let mut take = |name: &str, result: Result<Vec<figures::Figure>>| match result {
            Ok(figures) => drawn.extend(figures),
            Err(error) => missing.push(format!("figure {name}: {error:#}")),
        };
        let panels = report::roc_panels(findings);
        if !panels.is_empty() {
            let roc = figures::roc(&panels).map(|mut figure| {
                figure.caption += report::ROC_CAPTION;
                vec![figure]
            });
            take("roc", roc);
        }
        match self.figure_models() {
            Ok((kitti, oxford, sets)) => {
                let input = figures::FigureInput {
                    sets: &sets,
                    kitti: &kitti,
                    oxford: oxford.as_ref(),
                    density: self.settings.density,
                    seed: 0,
                    backend: self.settings.backend,
                    threads: self.settings.threads,
                    max_windows: if self.settings.quick {
                        60
                    } else {
                        FIGURE_WINDOWS
                    },
                };
                take("epsilon", figures::epsilon(&input));
                take(
                    "trajectories",
                    figures::trajectories(&input).map(|f| vec![f]),
                );
                take(
                    "reverse",
                    figures::reverse_diffusion(&input).map(|f| vec![f]),
                );
            }
            Err(error) => take("networks", Err(error)),
        }
        (drawn, missing)
    }

    fn figure_models(&self) -> Result<(Model, Option<Model>, Vec<DataSet>)> {
        let kitti = networks::load(networks::KITTI)?;
        let oxford = networks::load(jobs::TRAINED_ON[0].1).ok();
        let sets = prepare(self.sets, &kitti, usize::MAX, Change::None)?;
        Ok((
            kitti,
            oxford,
            sets.into_iter().map(|(set, _)| set).collect(),
        ))
    }
}
