//! Fitting: from a model and trusted logs to a detector, without retraining.

use crate::backend::Backend;
use crate::detector_file::{Detector, DetectorHeader, VERSION};
use crate::features::Extractor;
use crate::logs::{Needs, conform};
use crate::model_file::{LogRecord, Model};
use anyhow::{Context, Result, bail};
use dose3_datasets::{Kind, Trajectory, Window, windows_of_each};
use dose3_diffusion::{NoiseSharing, ProbeConfig, Process};
use dose3_ood::{DensityConfig, DetectorConfig, DetectorStatistics, StatisticsSet};
use std::collections::BTreeSet;

/// Settings of [`fit`].
#[derive(Clone, Debug)]
pub struct FitOptions {
    /// The statistics.
    pub statistics: StatisticsSet,
    /// The density over them.
    pub density: DensityConfig,
    /// Share of trusted logs, and of trusted windows, that may be rejected.
    pub alpha: f64,
    /// Poses between the starts of windows.
    pub stride: usize,
    /// Diffusion steps visited; all of the model's where `None`.
    pub steps: Option<usize>,
    /// Noise draws per window.
    pub draws: usize,
    /// Own or common noise.
    pub sharing: NoiseSharing,
    /// Seed of noise and fit.
    pub seed: u64,
    /// Where the networks run.
    pub backend: Backend,
    /// Threads of the engine; 0 for all cores.
    pub threads: usize,
}

/// A fitted detector with what the user should know.
pub struct Fitted {
    /// The detector.
    pub detector: Detector,
    /// Number of trusted windows.
    pub windows: usize,
    /// Sentences for the user, one a log at most.
    pub notes: Vec<String>,
}

/// Fits a detector; `progress` hears `(windows done, windows in all)`.
///
/// # Errors
/// A trusted log that does not fit the model or is shorter than a window, settings out of range,
/// too few windows.
pub fn fit(
    model: &Model,
    trusted: Vec<Trajectory>,
    options: &FitOptions,
    progress: &dyn Fn(usize, usize),
) -> Result<Fitted> {
    let header = &model.header;
    let process = Process::new(header.process)?;
    let probe = ProbeConfig {
        steps: steps(options.steps, process.steps())?,
        draws: options.draws,
        seed: options.seed,
        sharing: options.sharing,
    };
    let first = trusted.first().context("no trusted log to fit on")?;
    // A motion model fixes rate and axes; a paper model takes those of the trusted logs.
    let (rate, frame) = match header.representation.kind {
        Kind::Motion => (header.rate, header.frame),
        Kind::Paper => (first.rate.hertz, first.frame),
    };
    let needs = Needs {
        representation: header.representation,
        metric: options.statistics.needs_increments(),
        rate,
        frame,
    };
    let (mut logs, mut notes) = (Vec::new(), BTreeSet::new());
    for t in trusted {
        let (t, said) = conform(t, &needs)?;
        logs.push(t);
        notes.extend(said);
    }
    let poses = header.representation.kind.poses(header.window);
    let windows = windows_of_each(&logs, poses, options.stride)?;
    let config = DetectorConfig {
        statistics: options.statistics.clone(),
        density: options.density.clone(),
        overlap: header.window.div_ceil(options.stride),
        alpha: options.alpha,
        window_alpha: options.alpha,
        draws: options.draws,
        seed: options.seed,
        ..DetectorConfig::default()
    };
    config.check()?;

    let mut models = options.backend.load(&model.parameters, options.threads)?;
    let mut extractor = Extractor {
        models: &mut models,
        process: &process,
        probe,
        representation: header.representation,
    };
    let total = windows.len();
    let rows = extractor
        .rows(&logs, &windows, &options.statistics, &|done| {
            progress(done, total)
        })
        .context("cannot compute the statistics of the trusted logs")?;
    let (groups, names) = groups(&logs, &windows);
    let statistics = DetectorStatistics::fit(config, &rows, &groups, &names)?;
    let detector = Detector {
        model: model.clone(),
        header: DetectorHeader {
            format_version: VERSION,
            needs,
            probe,
            stride: options.stride,
            trusted: logs.iter().map(LogRecord::from).collect(),
            statistics,
            version: env!("CARGO_PKG_VERSION").to_string(),
        },
    };
    Ok(Fitted {
        detector,
        windows: total,
        notes: notes.into_iter().collect(),
    })
}

fn steps(asked: Option<usize>, of_model: usize) -> Result<usize> {
    match asked {
        None => Ok(of_model),
        Some(n) if n >= 1 && n <= of_model => Ok(n),
        Some(n) => bail!("--steps {n}: the model has {of_model} diffusion steps"),
    }
}

/// Per window the index of its group of logs, and the groups' names. Logs of one group (the same
/// recording) count as one log. Windows must be in order of their logs.
fn groups(logs: &[Trajectory], windows: &[Window]) -> (Vec<usize>, Vec<String>) {
    let mut names: Vec<String> = Vec::new();
    let of_log: Vec<usize> = logs
        .iter()
        .map(|t| {
            names.iter().position(|n| *n == t.group).unwrap_or_else(|| {
                names.push(t.group.clone());
                names.len() - 1
            })
        })
        .collect();
    (
        windows.iter().map(|w| of_log[w.trajectory]).collect(),
        names,
    )
}
