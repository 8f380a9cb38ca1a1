//! `cargo xtask benchmark --faults`: faults of pose sensors on logs that nothing was fitted on, and
//! what must not raise an alarm.

mod alarms;
mod cells;
mod controls;
mod locate;
mod logs;
mod methods;
mod near;
mod prober;
pub(crate) mod protocol;
mod report;
mod summary;
mod tables;
mod windows;

use super::{BenchmarkArgs, progress, sets};
use crate::data::DataRoot;
use crate::provenance::{commit, machine, render_into};
use anyhow::{Context, Result, bail};
use clap::{Args, ValueEnum};
use dose3::atomic;
use dose3::model_file::{LogRecord, Model};
use dose3_datasets::faults::Fault;
use dose3_datasets::{Kind, windows as cut_windows};
use dose3_model::Precision;
use dose3_ood::DetectorStatistics;
use dose3_ood::metrics::Bootstrap;
use locate::Locator;
use methods::{DEFAULT, KINEMATIC, METHODS, Network, all};
use prober::{Prober, SetRows, Settings, fit};
use protocol::{LogSet, Part, faults};
use std::time::Instant;
use tables::FOLLOWED;

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
        runs.push(one_run(
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
        let name = if synthetic {
            "faults-synthetic"
        } else {
            "faults"
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
        bail!("--faults needs --model FILE[,FILE...]: motion models, one for each training seed");
    }
    let models: Vec<Model> = args
        .model
        .iter()
        .map(|p| Model::read(p))
        .collect::<Result<_>>()?;
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

/// What one model's run works with: a detector a row for every set, and pose scores.
struct Fitted {
    rows: Vec<SetRows>,
    detectors: Vec<Vec<DetectorStatistics>>,
    locators: Vec<Locator>,
}

fn one_run(
    args: &BenchmarkArgs,
    (root, sets): (Option<&DataRoot>, &[LogSet]),
    faults: &[Fault],
    model: &Model,
    seed: u64,
) -> Result<report::Run> {
    let part = args.faults.part;
    let settings = Settings {
        steps: args.steps.unwrap_or(STEPS),
        draws: args.draws.unwrap_or(DRAWS),
        density: args.density.parse()?,
        seed,
        backend: args.backend,
        threads: args.threads,
    };
    let bootstrap = Bootstrap {
        resamples: args.resamples,
        seed,
        ..Bootstrap::default()
    };
    let mut prober = Prober::new(model, &settings)?;
    let overlap = prober.poses.div_ceil(args.stride);
    let bytes = model.to_bytes(Precision::F32, &[])?;
    let mut run = report::Run::new(seed, &bytes, trained_on(model, sets, part));
    let fitted = fit_all(args, sets, &settings, &mut prober)?;
    if args.wants(Section::Cells) {
        run.cells = cells::run(sets, &fitted.rows, &fitted.detectors, part, bootstrap)?;
    }
    for (i, set) in sets.iter().enumerate() {
        let bar = progress(0, set.name)?;
        let context = windows::Context {
            locator: &fitted.locators[i],
            detectors: &fitted.detectors[i],
            // Other faults than the tested ones, even where there is no severity to change.
            seed: 2 * args.faults.seed + u64::from(part == Part::Validation),
            bootstrap,
            tick: &|| bar.inc(1),
        };
        let tested = set.tested(part);
        if args.wants(Section::Windows) {
            let count = if args.quick { QUICK_SITES } else { usize::MAX };
            let sites = windows::sites(&set.logs, &tested, args.faults.sites.min(count));
            bar.set_length(passes() * (sites.len() * (faults.len() + 1)) as u64);
            run.sites.push((set.letter, sites.len()));
            let (cells, poses) = windows::run(set, &sites, faults, &context, &mut prober)?;
            run.windows.extend(cells);
            run.poses.extend(poses);
            println!(
                "{}: {} faults at {} places",
                set.name,
                faults.len(),
                sites.len()
            );
        }
        if args.wants(Section::Logs) {
            let pieces = logs::pieces(&set.logs, &tested);
            println!(
                "{}: {} faults in {} pieces of logs",
                set.name,
                faults.len(),
                pieces.len()
            );
            run.logs.extend(logs::run(
                set,
                &pieces,
                faults,
                &FOLLOWED,
                &context,
                &mut prober,
            )?);
        }
        if args.wants(Section::Controls) {
            let rows = &fitted.rows[i];
            run.controls.extend(controls::run(
                set,
                rows,
                part,
                &FOLLOWED,
                args.stride,
                &context,
                &mut prober,
            )?);
        }
        bar.finish_and_clear();
    }
    if args.wants(Section::Alarms) {
        let methods = [KINEMATIC, DEFAULT];
        for (set, rows) in sets.iter().zip(&fitted.rows) {
            let groups = set.groups().iter().max().map_or(0, |g| g + 1);
            let bar = progress((methods.len() * groups) as u64, "leave one out")?;
            let found = alarms::run(set, rows, &methods, overlap, &settings, &|| bar.inc(1))?;
            run.alarms.extend(found);
            bar.finish_and_clear();
        }
    }
    if args.wants(Section::Near) {
        let of = |letter| {
            let at = sets.iter().position(|set| set.letter == letter)?;
            Some((&sets[at], &fitted.rows[at], fitted.detectors[at].as_slice()))
        };
        if let (Some((k, k_rows, k_fit)), Some((o, o_rows, o_fit))) = (of('K'), of('O')) {
            run.near
                .extend(near::at_equal_speed((k, k_rows), (o, o_rows), k_fit, part)?);
            run.near
                .extend(near::at_equal_speed((o, o_rows), (k, k_rows), o_fit, part)?);
        }
        if let Some(root) = root {
            let logs = near::single_logs(root, model.header.rate, &settings, &mut prober)?;
            run.near.extend(near::run(&logs, of('I'), part)?);
        }
    }
    Ok(run)
}

/// The statistics of all logs, and what is fitted to the trusted ones.
fn fit_all(
    args: &BenchmarkArgs,
    sets: &[LogSet],
    settings: &Settings,
    prober: &mut Prober,
) -> Result<Fitted> {
    let overlap = prober.poses.div_ceil(args.stride);
    let (mut all_rows, mut detectors, mut locators) = (Vec::new(), Vec::new(), Vec::new());
    for set in sets {
        let fitted = set.fitted(args.faults.part);
        let windows = cut_windows(&set.logs, prober.poses, args.stride);
        let bar = progress(passes() * windows.len() as u64, set.name)?;
        let mut poses = Vec::new();
        let trusted =
            |i: usize| i.is_multiple_of(locate::EVERY) && fitted.contains(&windows[i].trajectory);
        let rows = prober.probe(
            &set.logs,
            &windows,
            &all(),
            &trusted,
            &mut |_, numbers| poses.push(numbers),
            &|| bar.inc(1),
        )?;
        bar.finish_and_clear();
        locators.push(Locator::fit(&poses)?);
        let rows = SetRows { windows, rows };
        let bar = progress(METHODS.len() as u64, "densities")?;
        let groups = set.groups();
        let of_set = all().into_iter().map(|m| {
            let trusted = rows.select(m, |_, w| fitted.contains(&w.trajectory));
            let detector = fit(m, &trusted, &groups, overlap, settings);
            bar.inc(1);
            detector.with_context(|| format!("{} cannot be fitted", set.name))
        });
        detectors.push(of_set.collect::<Result<Vec<_>>>()?);
        bar.finish_and_clear();
        println!(
            "{}: {} windows, densities fitted",
            set.name,
            rows.windows.len()
        );
        all_rows.push(rows);
    }
    Ok(Fitted {
        rows: all_rows,
        detectors,
        locators,
    })
}

/// How often the networks' loop goes over the windows: once more for untrained networks.
fn passes() -> u64 {
    1 + u64::from(METHODS.iter().any(|m| m.network == Network::Untrained))
}

/// Tested logs that the networks were trained on, with their sets.
fn trained_on(model: &Model, sets: &[LogSet], part: Part) -> Vec<String> {
    let known = |log| {
        let hash = LogRecord::from(log).sha256;
        model.header.training.logs.iter().any(|l| l.sha256 == hash)
    };
    let mut found = Vec::new();
    for set in sets {
        for log in set.tested(part) {
            if known(&set.raw[log]) || known(&set.logs[log]) {
                found.push(format!("{} {}", set.letter, set.raw[log].name));
            }
        }
    }
    found
}
