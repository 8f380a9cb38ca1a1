//! `cargo xtask benchmark --faults`: faults of pose sensors on logs that nothing was fitted on, and
//! what must not raise an alarm.

mod alarms;
mod cells;
mod controls;
mod locate;
mod logs;
mod measure;
mod methods;
mod near;
mod prober;
pub(crate) mod protocol;
mod report;
mod summary;
mod tables;
mod window_tables;
mod windows;

use crate::benchmark::BenchmarkArgs;
use crate::data::DataRoot;
use crate::provenance::{commit, machine, render_into};
use crate::sets;
use anyhow::{Result, bail};
use clap::{Args, ValueEnum};
use dose3::atomic;
use dose3::model_file::Model;
use dose3_datasets::Kind;
use protocol::{LogSet, Part, faults};
use std::time::Instant;

/// Diffusion steps visited where `--steps` does not say.
const STEPS: usize = 12;
/// Noise draws where `--draws` does not say.
const DRAWS: usize = 1;
/// Most places a set with --quick.
const QUICK_SITES: usize = 40;

/// Arguments of `benchmark --faults`.
#[derive(Debug, Args)]
pub struct FaultArgs {
    /// Measure detection of injected faults, false alarms and near platforms instead of the
    /// paper's table; writes faults.json and faults.md
    #[arg(long)]
    pub faults: bool,
    /// Which logs are tested
    #[arg(long, value_enum, default_value_t, requires = "faults")]
    pub part: Part,
    /// Places a set that faults are injected at (with --quick at most 40)
    #[arg(long, value_name = "N", default_value_t = 150, requires = "faults")]
    pub sites: usize,
    /// Seed of noise, fits and faults
    #[arg(long, default_value_t = 0, requires = "faults")]
    pub seed: u64,
    /// Parts to run (default: all; --quick leaves out near)
    #[arg(long, value_enum, value_delimiter = ',', requires = "faults")]
    pub only: Vec<Section>,
}

/// A part of the run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Section {
    /// Faulty windows against the same places without fault, and where in them the fault is seen.
    Windows,
    /// Faults in logs of realistic length.
    Logs,
    /// Changes that must stay in distribution.
    Controls,
    /// Logs judged by detectors fitted on the others.
    Alarms,
    /// Platform against platform.
    Cells,
    /// Near platforms.
    Near,
}

impl BenchmarkArgs {
    fn wants(&self, section: Section) -> bool {
        if self.faults.only.is_empty() {
            return !(self.quick && section == Section::Near);
        }
        self.faults.only.contains(&section)
    }
}

/// Runs it and writes the results.
///
/// # Errors
/// Data that cannot be read, a model that does not fit, a failing fit.
pub fn run(args: &BenchmarkArgs) -> Result<()> {
    let start = Instant::now();
    // Before the run: the checkout may move on meanwhile.
    let commit = commit();
    let models = models(args)?;
    let header = &models[0].header;
    let (root, sets) = load(args, header.rate)?;
    let synthetic = root.is_none();
    let faults = faults(args.faults.part, args.quick);
    let mut runs = Vec::new();
    for (index, model) in models.iter().enumerate() {
        if model.header.rate != header.rate || model.header.window != header.window {
            bail!("--model: all models must have one rate and one window length");
        }
        println!("model {} of {}", index + 1, models.len());
        runs.push(measure::one_run(
            args,
            (root.as_ref(), &sets),
            &faults,
            model,
            args.faults.seed + index as u64,
        )?);
    }
    let report = report::Report {
        synthetic,
        command: command(),
        commit,
        machine: machine(),
        seconds: start.elapsed().as_secs_f64(),
        part: args.faults.part,
        seed: args.faults.seed,
        rate: header.rate,
        poses: header.representation.kind.poses(header.window),
        stride: args.stride,
        steps: args.steps.unwrap_or(STEPS).min(header.process.steps),
        draws: args.draws.unwrap_or(DRAWS),
        density: args.density.clone(),
        resamples: args.resamples,
        faults: faults.len(),
        sets: sets
            .iter()
            .map(|set| report::SetSummary::new(set, args.faults.part))
            .collect(),
        summaries: summary::summaries(&report::lines(&runs)),
        runs,
    };
    let markdown = report.markdown();
    let json = args.out.join("faults.json");
    atomic::write(&json, serde_json::to_string_pretty(&report)?.as_bytes())?;
    atomic::write(&args.out.join("faults.md"), markdown.as_bytes())?;
    println!("\n{markdown}\nwrote {} and faults.md", json.display());
    if let Some(path) = &args.render {
        // A run without windows has a place of its own: the other one may be of several models.
        let name = match (synthetic, args.wants(Section::Windows)) {
            (true, _) => "faults-synthetic",
            (false, true) => "faults",
            (false, false) => "faults-logs",
        };
        render_into(path, &markdown, name)?;
        println!("updated {}", path.display());
    }
    Ok(())
}

/// The arguments after `cargo xtask`, folders of model files left out.
fn command() -> String {
    let shorten = |word: String| -> String {
        let parts = word.split(',').map(|part| match part.rsplit_once('/') {
            Some((_, file)) if file.ends_with(".dose3") => file,
            _ => part,
        });
        parts.collect::<Vec<_>>().join(",")
    };
    let words = std::env::args().skip(1).map(shorten);
    words.collect::<Vec<_>>().join(" ")
}

fn models(args: &BenchmarkArgs) -> Result<Vec<Model>> {
    if args.model.is_empty() {
        return Ok(vec![dose3::built_in::motion()?]);
    }
    let models: Vec<Model> = args
        .model
        .iter()
        .map(|p| Model::read(p))
        .collect::<dose3::Result<_>>()?;
    for (model, path) in models.iter().zip(&args.model) {
        if model.header.representation.kind != Kind::Motion {
            bail!(
                "{} is no motion model: faults show in the body's motion",
                path.display()
            );
        }
    }
    Ok(models)
}

/// The sets, with the folder of real ones; none where they are synthetic.
fn load(args: &BenchmarkArgs, hertz: f64) -> Result<(Option<DataRoot>, Vec<LogSet>)> {
    let root = match args.synthetic {
        true => None,
        false => DataRoot::find_optional(args.data.as_deref())?,
    };
    let real = match &root {
        Some(root) => sets::real(root)?,
        None => Vec::new(),
    };
    let synthetic = real.is_empty();
    if synthetic {
        if let Some(root) = root.as_ref().filter(|r| r.source != DataRoot::DEFAULT) {
            bail!("{} holds no data set", root.path.display());
        }
        println!("no real data (--data, $DOSE3_DATA, data/): SYNTHETIC data sets, generated here");
    }
    let sets = if synthetic {
        sets::synthetic(0, 8)?
    } else {
        real
    };
    let at_rate = sets
        .into_iter()
        .map(|set| LogSet::new(set.letter, set.name, set.trajectories, hertz));
    let sets = at_rate.collect::<Result<Vec<_>>>()?;
    for set in &sets {
        if set.tested(args.faults.part).is_empty() {
            bail!("{} has too few logs: none is left to test", set.name);
        }
    }
    Ok((root.filter(|_| !synthetic), sets))
}
