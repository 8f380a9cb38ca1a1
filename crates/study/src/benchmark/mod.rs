//! The AUROC table of the paper by one network, with honest columns beside it: the quick benchmark.

mod report;

use crate::cells::{Ranking, cells};
use crate::options::Options;
use crate::passes::{PassSettings, passes};
use crate::plain;
use crate::progress::progress;
use crate::provenance::{Start, write_document};
use crate::roles::KITTI_TESTED;
use crate::rows::Statistics;
use crate::sets::DataSet;
use crate::split::Split;
use crate::training::{Training, shipped_shape};
use anyhow::{Context, Result, bail};
use dose3::Model;
use dose3::atomic;
use dose3::diffusion::trainer::LogRow;
use dose3::model_file::LogRecord;
use dose3::progress::OnStep;
use dose3::train::{HoldOut, train};
use dose3_datasets::{Trajectory, hex};
use dose3_model::Precision;
use dose3_ood::DensityConfig;
use dose3_ood::metrics::Bootstrap;
use sha2::{Digest, Sha256};
use std::path::PathBuf;
use std::time::Instant;

/// What the benchmark is told beside the [`Options`] of all.
#[derive(Clone, Debug)]
pub struct TableOptions {
    /// Where the network comes from.
    pub network: Source,
    /// Repetitions with other seeds: of noise and density, and of training where there is one.
    pub seeds: u64,
    /// Poses between the starts of windows.
    pub stride: usize,
    /// Diffusion steps visited (none: all of the model's).
    pub steps: Option<usize>,
    /// Noise draws of the row with shared noise.
    pub draws: usize,
}

/// Where the network of a benchmark comes from.
#[derive(Clone, Debug)]
pub enum Source {
    /// The built-in model of `paper` windows.
    BuiltIn,
    /// A model file.
    File(PathBuf),
    /// Trained now, once a seed, for so many steps (none: those of the built-in model).
    Trained(Option<usize>),
}

/// The rows of the table, with their labels.
fn rows(draws: usize) -> [(Statistics, String); 6] {
    let label = str::to_string;
    let shared = match draws {
        1 => "one noise draw shared by all windows".into(),
        n => format!("{n} noise draws shared by all windows"),
    };
    [
        (
            Statistics::own("paper24", 1),
            label("SE(3), rotation split (24 statistics)"),
        ),
        (
            Statistics::shared("paper24", draws),
            format!("SE(3), rotation split (24), {shared}"),
        ),
        (Statistics::own("paper12", 1), label("SE(3), no split (12)")),
        (
            Statistics::own("r3", 1),
            label("R^3, translation alone (6)"),
        ),
        (
            Statistics::without_network("moments24"),
            label("no network: raw moments of the poses (24)"),
        ),
        (
            Statistics::without_network("kinematic"),
            label("no network: body-frame kinematics"),
        ),
    ]
}

/// Runs the benchmark and writes its results.
///
/// # Errors
/// Data that cannot be read, a model that does not fit, a failing fit.
pub fn run(options: &Options, of_table: &TableOptions) -> Result<()> {
    let start = Start::now(&options.command);
    let density: DensityConfig = options.density.parse()?;
    let (source, mut data) = options.load()?;
    let synthetic = source.is_none();
    let mut runs = Vec::new();
    let mut header = None;
    for seed in 0..of_table.seeds {
        let model = model(options, of_table, &data, seed)?;
        runs.push(one_run(
            options, of_table, &mut data, &model, &density, seed,
        )?);
        header.get_or_insert(model.header);
    }
    let header = header.context("at least one seed is needed")?;
    let report = report::Report {
        synthetic,
        source,
        retrained: matches!(of_table.network, Source::Trained(_)),
        stride: stride(options, of_table),
        steps: steps(options, of_table, header.process.steps),
        density: options.density.clone(),
        resamples: options.resamples,
        window: header.window,
        network_logs: names(&header.training.logs),
        network_held_out: names(&header.training.validation),
        sets: data.iter().map(report::SetSummary::new).collect(),
        runs,
        provenance: start.finish(),
    };
    let markdown = report.markdown();
    let json = options.out.join("benchmark.json");
    atomic::write(&json, serde_json::to_string_pretty(&report)?.as_bytes())?;
    atomic::write(&options.out.join("benchmark.md"), markdown.as_bytes())?;
    plain::print(&markdown);
    say!("wrote {} and benchmark.md", json.display());
    if let Some(folder) = &options.render {
        let name = match synthetic {
            true => "six-pairs-synthetic",
            false => "six-pairs",
        };
        let path = write_document(folder, name, "AUROC of the shipped network", &markdown)?;
        say!("updated {}", path.display());
    }
    Ok(())
}

fn one_run(
    options: &Options,
    of_table: &TableOptions,
    data: &mut [DataSet],
    model: &Model,
    density: &DensityConfig,
    seed: u64,
) -> Result<report::Run> {
    let start = Instant::now();
    let poses = model.header.representation.kind.poses(model.header.window);
    let hashes = |records: &[LogRecord]| -> Vec<String> {
        records.iter().map(|r| r.sha256.clone()).collect()
    };
    let held_out = hashes(&model.header.training.validation);
    let trained = hashes(&model.header.training.logs);
    let stride = stride(options, of_table);
    data.iter_mut()
        .for_each(|set| set.prepare(poses, stride, &held_out, &trained));
    let rows = rows(of_table.draws);
    let statistics: Vec<Statistics> = rows.iter().map(|(row, _)| *row).collect();
    let settings = PassSettings {
        steps: steps(options, of_table, model.header.process.steps),
        seed,
        computing: options.computing,
    };
    let mut numbers = vec![Vec::with_capacity(data.len()); rows.len()];
    for set in data.iter() {
        for (row, found) in measured(set, model, &statistics, &settings)? {
            numbers[row].push(found);
        }
    }
    let windows: usize = data.iter().map(|s| s.windows.len()).sum();
    let scoring_seconds = start.elapsed().as_secs_f64();

    let bootstrap = Bootstrap {
        resamples: options.resamples,
        seed,
        ..Bootstrap::default()
    };
    let bar = progress((Split::ALL.len() * rows.len()) as u64, "densities")?;
    let mut tables = Vec::new();
    for split in Split::ALL {
        for ((row, label), rows) in rows.iter().zip(&numbers) {
            let mut found = Vec::new();
            let ranking = Ranking::Statistics { density, rows };
            cells(data, &ranking, split, bootstrap, &mut |cell, _, _| {
                found.push(cell);
                Ok(())
            })?;
            bar.inc(1);
            tables.push(report::Table {
                split,
                row: *row,
                label: label.clone(),
                cells: found,
            });
        }
    }
    bar.finish_and_clear();
    Ok(report::Run {
        seed,
        model_sha256: hex(Sha256::digest(model.to_bytes(Precision::F32, &[])?)),
        windows,
        scoring_seconds,
        tables,
    })
}

/// The statistics of every row for every window of a set: `(row, [window][column])`.
fn measured(
    set: &DataSet,
    model: &Model,
    rows: &[Statistics],
    settings: &PassSettings,
) -> Result<Vec<(usize, Vec<Vec<f64>>)>> {
    let passes = passes(rows);
    let bar = progress((passes.len() * set.windows.len()) as u64, set.name)?;
    let mut all = Vec::new();
    for pass in passes {
        all.extend(pass.run(model, set, rows, settings, &|| bar.inc(1))?);
    }
    bar.finish_and_clear();
    say!(
        "{}: {} logs, {} windows",
        set.name,
        set.trajectories.len(),
        set.windows.len()
    );
    Ok(all)
}

/// The network; one that is trained now is kept under the results folder, and taken up again where it is finished
/// or was interrupted.
fn model(options: &Options, of_table: &TableOptions, data: &[DataSet], seed: u64) -> Result<Model> {
    let train_steps = match &of_table.network {
        Source::BuiltIn => return Ok(dose3::built_in::paper()?),
        Source::File(path) => return Ok(Model::read(path)?),
        Source::Trained(steps) => steps.unwrap_or(Training::PAPER.steps),
    };
    let set = data
        .iter()
        .find(|s| matches!(s.letter, 'K' | 'V'))
        .context("the set to train on is missing")?;
    let (kind, hold_out) = match set.letter {
        'K' => (
            "kitti",
            HoldOut::Names(KITTI_TESTED.map(String::from).into()),
        ),
        _ => ("synthetic-vehicle", HoldOut::Fraction(0.25)),
    };
    let training = Training {
        seed,
        steps: train_steps,
        ..Training::PAPER
    };
    let name = format!("{kind}-{train_steps}-seed{seed}.dose3");
    let out = options.out.join("models").join(name);
    let mut settings = training.options(shipped_shape(), hold_out);
    settings.computing = options.computing;
    settings.checkpoint = Some(out.with_extension("checkpoint"));
    if out.exists() {
        let old = Model::read(&out)?;
        let (training, validation) =
            dose3::train::split(&set.trajectories, &settings.hold_out, seed)?;
        let records = |logs: &[Trajectory]| logs.iter().map(LogRecord::from).collect::<Vec<_>>();
        if old.header.training.config == settings.config
            && old.header.process == settings.process
            && old.parameters.config() == settings.network
            && old.header.training.logs == records(&training)
            && old.header.training.validation == records(&validation)
        {
            say!("taking up {}, trained by an earlier run", out.display());
            return Ok(old);
        }
        bail!(
            "{} was trained with other settings or data; remove it to train anew",
            out.display()
        );
    }
    let bar = progress(train_steps as u64, "training")?;
    let hear = &mut OnStep(|row: &LogRow| bar.set_position(row.step as u64));
    let trained = train(&set.trajectories, &settings, hear)?;
    bar.finish_and_clear();
    trained.model.write(&out, Precision::F32)?;
    Ok(trained.model)
}

fn stride(options: &Options, of_table: &TableOptions) -> usize {
    match options.quick {
        true => of_table.stride.saturating_mul(3),
        false => of_table.stride,
    }
}

fn steps(options: &Options, of_table: &TableOptions, of_model: usize) -> usize {
    let steps = of_table.steps.unwrap_or(of_model).clamp(1, of_model);
    match options.quick {
        true => steps.div_ceil(3),
        false => steps,
    }
}

fn names(records: &[LogRecord]) -> Vec<String> {
    records.iter().map(|r| r.name.clone()).collect()
}
