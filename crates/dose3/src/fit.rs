//! Fitting: from a model and trusted logs to a detector, without retraining.

use crate::backend::Backend;
use crate::detector_file::{Detector, DetectorHeader, VERSION};
use crate::features::Extractor;
use crate::logs::{Needs, conform};
use crate::model_file::{LogRecord, Model};
use anyhow::{Context, Result, bail};
use dose3_datasets::{Frame, Kind, Trajectory, Window, windows_of_each};
use dose3_diffusion::{NoiseSharing, ProbeConfig, Process};
use dose3_ood::{
    Combination, DensityConfig, DetectorConfig, DetectorStatistics, PoseReference, StatisticsSet,
};
use std::collections::BTreeSet;

/// Settings of [`fit`].
#[derive(Clone, Debug)]
pub struct FitOptions {
    /// The statistics.
    pub statistics: StatisticsSet,
    /// The density over them.
    pub density: DensityConfig,
    /// How the groups (or blocks) of the statistics become one score.
    pub combination: Combination,
    /// Share of trusted logs, and of trusted windows, that may be rejected.
    pub alpha: f64,
    /// Poses between the starts of windows.
    pub stride: usize,
    /// Diffusion steps visited; all of the model's where `None`.
    pub steps: Option<usize>,
    /// Noise draws per window.
    pub draws: usize,
    /// Own noise, common noise, or none.
    pub sharing: NoiseSharing,
    /// Seed of noise and fit.
    pub seed: u64,
    /// Where the networks run.
    pub backend: Backend,
    /// Threads of the engine; 0 for all cores.
    pub threads: usize,
}

/// The statistics of the default detector: kinematics, robust differences and denoising errors, with a
/// density each.
pub const MOTION_STATISTICS: &str = "kinematic,differences,residual+eps-mean";

/// What a model is best used with where the user says nothing; measured by
/// `cargo xtask benchmark --faults --part validation` (docs/METHOD.md).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Defaults {
    /// The statistics.
    pub statistics: &'static str,
    /// Diffusion steps visited; all where `None`.
    pub steps: Option<usize>,
    /// Noise draws per window.
    pub draws: usize,
}

impl Defaults {
    /// The paper's statistics for a `paper` model, [`MOTION_STATISTICS`] for a `motion` model.
    pub fn of(model: &Model) -> Self {
        match model.header.representation.kind {
            Kind::Paper => Self {
                statistics: "paper24",
                steps: None,
                draws: 2,
            },
            Kind::Motion => Self {
                statistics: MOTION_STATISTICS,
                steps: Some(12.min(model.header.process.steps)),
                draws: 1,
            },
        }
    }
}

/// The combination by that name; without one Fisher's for statistics in several blocks, else one
/// joint density.
///
/// # Errors
/// An unknown name.
pub fn combination(name: Option<&str>, statistics: &StatisticsSet) -> Result<Combination> {
    Ok(match name {
        Some(name) => name.parse()?,
        None if statistics.blocks() > 1 => Combination::Fisher,
        None => Combination::Joint,
    })
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
    let probe = probe(options, &process)?;
    let first = trusted.first().context("no trusted log to fit on")?;
    // A motion model fixes the rate; a paper model takes that of the trusted logs.
    let rate = match header.representation.kind {
        Kind::Motion => header.rate,
        Kind::Paper => first.rate.hertz,
    };
    let frame = first.frame;
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
    if header.representation.kind == Kind::Motion && frame == Frame::Sensor {
        notes.insert(
            "the body axes of the trusted logs are not known and taken as they are: logs to be judged \
             must come from the same source (--frame names the axes)"
                .into(),
        );
    }
    let length = header.representation.kind.poses(header.window);
    let windows = windows_of_each(&logs, length, options.stride)?;
    let config = DetectorConfig {
        statistics: options.statistics.clone(),
        density: options.density.clone(),
        combination: options.combination,
        overlap: header.window.div_ceil(options.stride),
        alpha: options.alpha,
        window_alpha: options.alpha,
        draws: probe.draws,
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
    let mut poses = Vec::new();
    let rows = extractor
        .rows_and_poses(
            &logs,
            &windows,
            &options.statistics,
            &mut |_, _, numbers| {
                poses.push(numbers.to_vec());
                Ok(())
            },
            &|done| progress(done, total),
        )
        .context("cannot compute the statistics of the trusted logs")?;
    let poses = PoseReference::fit(&poses)?;
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
            poses: Some(poses),
            version: env!("CARGO_PKG_VERSION").to_string(),
        },
    };
    Ok(Fitted {
        detector,
        windows: total,
        notes: notes.into_iter().collect(),
    })
}

fn probe(options: &FitOptions, process: &Process) -> Result<ProbeConfig> {
    let asked = ProbeConfig {
        steps: steps(options.steps, process.steps())?,
        draws: options.draws,
        seed: options.seed,
        sharing: options.sharing,
    };
    if options.sharing == NoiseSharing::None && options.statistics.needs_noise() {
        bail!(
            "`{}` measures denoising errors, which a path without drawn noise does not have",
            options.statistics
        );
    }
    Ok(ProbeConfig {
        draws: asked.distinct_draws(),
        ..asked
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn without_drawn_noise_there_is_one_draw_and_no_denoising_error() {
        let options = |statistics: &str| FitOptions {
            statistics: statistics.parse().unwrap(),
            density: DensityConfig::default(),
            combination: Combination::Joint,
            alpha: 0.05,
            stride: 32,
            steps: Some(6),
            draws: 3,
            sharing: NoiseSharing::None,
            seed: 0,
            backend: Backend::Engine,
            threads: 1,
        };
        let process = Process::new(dose3_diffusion::ProcessConfig::default()).unwrap();
        let found = probe(&options("diffpath6+diffpath1"), &process).unwrap();
        assert_eq!((found.draws, found.steps), (1, 6));
        let refused = probe(&options("kinematic,residual+eps-mean"), &process).unwrap_err();
        assert!(
            refused.to_string().contains("denoising errors"),
            "{refused}"
        );
        let drawn = FitOptions {
            sharing: NoiseSharing::Common,
            ..options("residual")
        };
        assert_eq!(probe(&drawn, &process).unwrap().draws, 3);
    }
}
