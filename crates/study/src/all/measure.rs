//! One job: statistics of all windows, densities, cells.

use super::figures::{Curve, spread};
use super::jobs::{Change, Job};
use super::rows::Row;
use crate::cells::{Cell, Fitted, Protocol, Rows, cell};
use crate::sets::{DataSet, kitti_held_out};
use anyhow::{Context, Result};
use dose3::backend::Backend;
use dose3::features::Extractor;
use dose3::model_file::{LogRecord, Model};
use dose3_datasets::{Kind, Representation, Scaling, Trajectory, at_rate};
use dose3_diffusion::{Branches, ModelPair, NoiseSharing, ProbeConfig, Process};
use dose3_lie::Rotation;
use dose3_model::PairParameters;
use dose3_ood::metrics::{Bootstrap, roc};
use dose3_ood::{DensityConfig, StatisticsSet};
use serde::{Deserialize, Serialize};
use std::time::Instant;

/// Most points of a stored ROC curve.
const CURVE: usize = 200;

/// What all jobs of a run share.
pub struct Settings<'a> {
    /// Density of rows without one of their own.
    pub density: &'a DensityConfig,
    /// Bootstrap resamples of the main table; the others take a tenth.
    pub resamples: usize,
    /// Fewer windows and steps.
    pub quick: bool,
    /// Where the networks run.
    pub backend: Backend,
    /// Threads.
    pub threads: usize,
}

/// What a job found.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Found {
    /// The job.
    pub key: String,
    /// The network.
    pub network: String,
    /// Its parameters, both branches.
    pub parameters: usize,
    /// Elements of a window.
    pub window: usize,
    /// Diffusion steps of the network, and those visited.
    pub steps: (usize, usize),
    /// Logs it was trained on.
    pub trained_on: Vec<String>,
    /// The sets.
    pub sets: Vec<SetFound>,
    /// Wall time.
    pub seconds: f64,
    /// Rows under each protocol.
    pub rows: Vec<RowFound>,
    /// What each row costs.
    pub costs: Vec<Cost>,
}

/// What a row costs.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Cost {
    /// Key of the row.
    pub row: String,
    /// Numbers that were trained.
    pub parameters: usize,
    /// Scoring time of a window.
    pub milliseconds: f64,
    /// Seconds of training, where they were recorded then.
    pub training_seconds: Option<f64>,
    /// How training ended, where that needs to be said.
    pub remark: String,
}

/// One set as a job saw it.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct SetFound {
    /// Letter in tables.
    pub letter: char,
    /// Full name.
    pub name: String,
    /// Number of windows.
    pub windows: usize,
    /// Poses between their starts.
    pub stride: usize,
    /// Logs that fit the density in protocol `paper`.
    pub fit_logs: Vec<String>,
    /// Logs that are its in-distribution test.
    pub test_logs: Vec<String>,
}

/// A row under a protocol.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct RowFound {
    /// Key of the row.
    pub row: String,
    /// How ID test windows were chosen.
    pub protocol: Protocol,
    /// All pairs of sets.
    pub cells: Vec<Cell>,
    /// The ROC curve of each cell, in main jobs under protocol `paper`.
    pub curves: Vec<Curve>,
}

/// Most windows a set and diffusion steps visited: `quick` takes a fifth and a third.
pub fn reduced(quick: bool, most: usize, steps: usize) -> (usize, usize) {
    match quick {
        true => (most / 5, steps.div_ceil(3)),
        false => (most, steps),
    }
}

impl Settings<'_> {
    /// Most windows a set.
    pub fn most(&self, of_job: usize) -> usize {
        reduced(self.quick, of_job, 0).0
    }

    /// Diffusion steps visited of `of_model`.
    pub fn visited(&self, of_model: usize) -> usize {
        reduced(self.quick, 0, of_model).1
    }

    fn bootstrap(&self, job: &Job) -> Bootstrap {
        let resamples = if job.main && !self.quick {
            self.resamples
        } else {
            self.resamples.div_ceil(10)
        };
        Bootstrap {
            resamples,
            seed: job.seed,
            ..Bootstrap::default()
        }
    }
}

/// The sets cut into windows of a model's length, at its rate where it has one, with their strides.
///
/// # Errors
/// A log that cannot be resampled.
pub fn prepare(
    sets: &[DataSet],
    model: &Model,
    most: usize,
    change: Change,
) -> Result<Vec<(DataSet, usize)>> {
    let header = &model.header;
    let kind = header.representation.kind;
    let mut held_out: Vec<String> = sets
        .iter()
        .filter(|set| set.letter == 'K')
        .flat_map(|set| kitti_held_out(&set.trajectories))
        .collect();
    held_out.extend(header.training.validation.iter().map(|r| r.sha256.clone()));
    let trained: Vec<String> = header
        .training
        .logs
        .iter()
        .map(|r| r.sha256.clone())
        .collect();
    sets.iter()
        .map(|set| {
            let mut set = set.clone();
            // Fingerprints are those of the logs as they were read.
            set.choose_test_logs(&held_out, &trained);
            for log in &mut set.trajectories {
                if kind == Kind::Motion {
                    *log = at_rate(log, header.rate)?;
                }
                if change == Change::DegreesTwice && set.letter == 'O' {
                    degrees_twice(log);
                }
            }
            let stride = set.cut(kind.poses(header.window), most);
            Ok((set, stride))
        })
        .collect()
}

/// Roll, pitch and yaw times pi / 180, although they are radians.
fn degrees_twice(log: &mut Trajectory) {
    for pose in &mut log.poses {
        let (roll, pitch, yaw) = pose.rotation.euler_angles();
        let again = f64::to_radians;
        pose.rotation = Rotation::from_euler_angles(again(roll), again(pitch), again(yaw));
    }
}

/// Runs a job; `tick` hears of every window and pass done.
///
/// # Errors
/// A window that cannot be represented, a failing network, too few windows for a density.
pub fn run(
    job: &Job,
    model: &Model,
    sets: &[DataSet],
    settings: &Settings<'_>,
    tick: &dyn Fn(u64),
) -> Result<Found> {
    let start = Instant::now();
    let prepared = prepare(sets, model, settings.most(job.most), job.change)?;
    let process = Process::new(model.header.process)?;
    let parameters = match job.untrained {
        true => PairParameters::init(&model.parameters.config(), job.seed)?,
        false => model.parameters.clone(),
    };
    let mut models = settings.backend.load(&parameters, settings.threads)?;
    let windows: usize = prepared.iter().map(|(set, _)| set.windows.len()).sum();
    let mut costs = Vec::new();
    let mut rows = vec![vec![Vec::new(); prepared.len()]; job.rows.len()];
    for (noise, draws) in job.passes() {
        let begin = Instant::now();
        let probe = ProbeConfig {
            steps: settings.visited(process.steps()),
            draws,
            seed: job.seed,
            sharing: noise.unwrap_or_default(),
        };
        for (s, (set, _)) in prepared.iter().enumerate() {
            let representation = representation(model, set, job.change)?;
            let of_set = statistics(
                (&mut models, &process, probe, representation),
                set,
                (&job.rows, noise),
                tick,
            )?;
            for (r, found) in of_set {
                rows[r][s] = found;
            }
        }
        let seconds = begin.elapsed().as_secs_f64() / (windows * draws).max(1) as f64;
        let of_pass = job.rows.iter().filter(|row| row.noise == noise);
        costs.extend(of_pass.map(|row| Cost {
            row: row.key.into(),
            parameters: match noise {
                Some(_) => parameters.config().parameter_count(),
                None => 0,
            },
            milliseconds: 1e3 * seconds * row.draws as f64,
            training_seconds: None,
            remark: String::new(),
        }));
    }
    let mut found = Vec::new();
    for (row, rows) in job.rows.iter().zip(&rows) {
        for protocol in Protocol::ALL {
            found.push(
                row_found(job, row, protocol, &prepared, rows, settings)
                    .with_context(|| format!("row {} of {}", row.key, job.key))?,
            );
        }
    }
    let header = &model.header;
    let names = |logs: &[LogRecord]| logs.iter().map(|log| log.name.clone()).collect();
    Ok(Found {
        key: job.key.clone(),
        network: job.network.to_string(),
        parameters: parameters.config().parameter_count(),
        window: header.window,
        steps: (process.steps(), settings.visited(process.steps())),
        trained_on: names(&header.training.logs),
        sets: prepared
            .iter()
            .map(|(set, stride)| SetFound::new(set, *stride))
            .collect(),
        costs,
        seconds: start.elapsed().as_secs_f64(),
        rows: found,
    })
}

impl SetFound {
    /// Summarises a prepared set.
    pub fn new(set: &DataSet, stride: usize) -> Self {
        Self {
            letter: set.letter,
            name: set.name.to_string(),
            windows: set.windows.len(),
            stride,
            fit_logs: set.fit_names(),
            test_logs: set.test_names(),
        }
    }
}

fn representation(model: &Model, set: &DataSet, change: Change) -> Result<Representation> {
    if change != Change::OwnScale {
        return Ok(model.header.representation);
    }
    Ok(Representation::fit(
        model.header.representation.kind,
        Scaling::PerDataset,
        &set.trajectories,
        &set.windows,
    )?)
}

type Probe<'a> = (&'a mut ModelPair, &'a Process, ProbeConfig, Representation);

/// The rows that take this pass's noise, by index.
fn statistics(
    (models, process, probe, representation): Probe<'_>,
    set: &DataSet,
    (rows, noise): (&[Row], Option<NoiseSharing>),
    tick: &dyn Fn(u64),
) -> Result<Vec<(usize, Vec<Vec<f64>>)>> {
    let mut of_pass: Vec<(usize, StatisticsSet, Vec<Vec<f64>>)> = Vec::new();
    for (index, row) in rows.iter().enumerate().filter(|(_, r)| r.noise == noise) {
        of_pass.push((index, row.statistics.parse()?, Vec::new()));
    }
    let mut extractor = Extractor {
        models,
        process,
        probe,
        representation,
    };
    let networks = noise.map(|_| Branches::Both);
    extractor.for_each(&set.trajectories, &set.windows, networks, &mut |_, data| {
        for (index, statistics, found) in &mut of_pass {
            found.push(rows[*index].evaluate(statistics, &data)?);
        }
        if noise.is_some() {
            tick((probe.draws * probe.steps * data.tensor.length) as u64);
        }
        Ok(())
    })?;
    Ok(of_pass
        .into_iter()
        .map(|(i, _, found)| (i, found))
        .collect())
}

fn row_found(
    job: &Job,
    row: &Row,
    protocol: Protocol,
    sets: &[(DataSet, usize)],
    rows: &[Vec<Vec<f64>>],
    settings: &Settings<'_>,
) -> Result<RowFound> {
    let density = match row.density {
        Some(text) => text.parse()?,
        None => settings.density.clone(),
    };
    let side = |i: usize| Rows {
        set: &sets[i].0,
        rows: &rows[i],
    };
    let (mut cells, mut curves) = (Vec::new(), Vec::new());
    for i in 0..sets.len() {
        let fitted = Fitted::new(&side(i), protocol, &density, job.seed)?;
        for o in (0..sets.len()).filter(|o| *o != i) {
            let other = fitted.score(&side(o))?;
            let (id, ood) = (sets[i].0.letter, sets[o].0.letter);
            let bootstrap = settings.bootstrap(job);
            cells.push(cell(
                (id, ood),
                fitted.fit_windows(),
                fitted.tested(),
                &other,
                bootstrap,
            )?);
            if job.main && protocol == Protocol::Paper {
                let points = roc(&fitted.tested().scores, &other.scores)?;
                curves.push(Curve {
                    label: format!("{id}/{ood}"),
                    points: thinned(&points),
                });
            }
        }
    }
    Ok(RowFound {
        row: row.key.to_string(),
        protocol,
        cells,
        curves,
    })
}

/// At most [`CURVE`] points, both ends among them.
pub fn thinned(points: &[(f64, f64)]) -> Vec<(f64, f64)> {
    spread(points, CURVE)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_thinned_curve_keeps_its_ends() {
        let points: Vec<(f64, f64)> = (0..=1000).map(|i| (f64::from(i), 0.0)).collect();
        let kept = thinned(&points);
        assert_eq!(
            (kept.len(), kept[0].0, kept[CURVE - 1].0),
            (CURVE, 0.0, 1000.0)
        );
        assert_eq!(thinned(&points[..2]), points[..2]);
        assert!(thinned(&[]).is_empty());
    }

    #[test]
    fn the_own_scale_of_a_set_is_the_largest_displacement_of_its_windows() {
        let model = dose3::built_in::paper().unwrap();
        let mut set = crate::sets::synthetic(0, 3).unwrap().remove(0);
        set.cut(128, 30);
        let stored = representation(&model, &set, Change::None).unwrap();
        assert_eq!(stored, model.header.representation);
        let own = representation(&model, &set, Change::OwnScale).unwrap();
        let largest = |window: &dose3_datasets::Window| {
            let poses = window.poses(&set.trajectories).unwrap();
            let from_first = |p: &dose3_lie::Pose| (p.translation - poses[0].translation).amax();
            poses.iter().map(from_first).fold(0.0, f64::max)
        };
        let expected = set.windows.iter().map(largest).fold(0.0, f64::max);
        let Some((translation, _)) = own.scaling.stored() else {
            panic!("{own:?} has no stored scale")
        };
        assert_eq!(translation, [expected; 3]);
    }

    #[test]
    fn converting_radians_again_shrinks_every_angle() {
        let angles = (0.2, -0.1, 3.0_f64);
        let rotation = Rotation::from_euler_angles(angles.0, angles.1, angles.2);
        let mut log =
            dose3_datasets::synthetic::suite(dose3_datasets::synthetic::Platform::Vehicle, 1, 0)
                .remove(0);
        log.poses.truncate(1);
        log.poses[0].rotation = rotation;
        degrees_twice(&mut log);
        let (roll, pitch, yaw) = log.poses[0].rotation.euler_angles();
        for (found, was) in [(roll, angles.0), (pitch, angles.1), (yaw, angles.2)] {
            assert!((found - was * std::f64::consts::PI / 180.0).abs() < 1e-12);
        }
    }
}
