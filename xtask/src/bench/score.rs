//! A whole `score`: reading the log, windows, noise, both networks, statistics, densities, verdict.

use super::network::{parameters, pool};
use super::{Shape, best};
use anyhow::{Context, Result};
use dose3::backend::Backend;
use dose3::model_file::{self, Model, ModelHeader, TrainingRecord};
use dose3::{Computing, Detector, FitOptions};
use dose3_datasets::synthetic::{Platform, suite, trajectory};
use dose3_datasets::{Frame, Representation, write};
use dose3_diffusion::ProcessConfig;
use dose3_diffusion::trainer::TrainConfig;
use dose3_ood::StatisticsSet;
use std::fs::File;
use std::io::BufWriter;
use std::path::{Path, PathBuf};

/// Poses a second of the logs.
const HERTZ: f64 = 20.0;
/// Trusted logs.
const TRUSTED: usize = 6;
/// Poses between the starts of windows.
pub const STRIDE: usize = 32;

/// What a detector spends on a window.
#[derive(Clone, Copy, Debug)]
pub struct Spending {
    /// Diffusion steps visited.
    pub steps: usize,
    /// Noise draws.
    pub draws: usize,
}

/// A synthetic log as a file, removed when this is dropped.
pub struct LogFile {
    _folder: tempfile::TempDir,
    path: PathBuf,
}

impl LogFile {
    /// A vehicle's log of `poses` poses, in TUM format.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn new(poses: usize) -> Result<Self> {
        let folder = tempfile::tempdir()?;
        let path = folder.path().join("log.txt");
        let log = trajectory(Platform::Vehicle, 12, poses, HERTZ);
        write::tum(&mut BufWriter::new(File::create(&path)?), &log)?;
        Ok(Self {
            _folder: folder,
            path,
        })
    }
}

/// A detector over untrained networks: speed does not depend on what they learned.
///
/// # Errors
/// A shape that is no network, settings out of range.
pub fn detector(shape: &Shape, statistics: &str, spending: Spending) -> Result<Detector> {
    let model = Model {
        header: ModelHeader {
            format_version: model_file::VERSION,
            representation: Representation::PAPER,
            window: shape.length,
            rate: HERTZ,
            frame: Frame::BodyFlu,
            process: ProcessConfig::default(),
            training: TrainingRecord {
                config: TrainConfig::default(),
                logs: Vec::new(),
                validation: Vec::new(),
                version: env!("CARGO_PKG_VERSION").to_string(),
                translation_validation: None,
                rotation_validation: None,
            },
        },
        parameters: parameters(shape)?,
        joint: None,
    };
    let options = FitOptions {
        statistics: Some(statistics.parse::<StatisticsSet>()?),
        stride: STRIDE,
        steps: Some(spending.steps),
        draws: Some(spending.draws),
        ..FitOptions::default()
    };
    let trusted = suite(Platform::Vehicle, TRUSTED, 11);
    let builder = Detector::builder().model(model).options(options);
    Ok(builder.fit(&trusted)?)
}

/// Windows of the log, and the shortest time of `rounds` to read and judge it.
///
/// # Errors
/// A backend that cannot be had, a log that cannot be read.
pub fn time(
    detector: &Detector,
    log: &LogFile,
    backend: Backend,
    threads: usize,
    rounds: usize,
) -> Result<(usize, f64)> {
    let mut windows = 0;
    let mut shortest = f64::INFINITY;
    for _ in 0..rounds {
        let mut round = || {
            let fresh = detector.clone().on(Computing { backend, threads });
            windows = fresh.judge(&read(&log.path)?)?.windows.len();
            Ok(())
        };
        let time = pool(threads)?.install(|| best(0.0, &mut round))?;
        shortest = shortest.min(time);
    }
    Ok((windows, shortest))
}

fn read(path: &Path) -> Result<dose3_datasets::Trajectory> {
    let mut logs = dose3::load([path])?;
    logs.pop().context("the log that was written is not there")
}
