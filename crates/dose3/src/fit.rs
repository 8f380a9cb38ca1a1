//! Fitting: from a model and trusted logs to a detector, without retraining.

use crate::backend::{Backend, Computing};
use crate::detector_file::{Detector, DetectorHeader, VERSION};
use crate::error::{Error, Result};
use crate::logs::{Needs, conform};
use crate::model_file::{LogRecord, Model};
use crate::probe::{Probe, ProbePlan, checked};
use dose3_datasets::{
    Frame, Kind, LogGroups, Trajectory, Window, stretch_numbers, windows_of_each,
};
use dose3_diffusion::{NoiseSharing, Process};
use dose3_ood::{
    Combination, DensityConfig, DetectorConfig, DetectorStatistics, Place, PoseReference,
    StatisticsSet,
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
    let plan = ProbePlan {
        steps: options.steps.unwrap_or(process.steps()),
        draws: options.draws,
        seed: options.seed,
        sharing: options.sharing,
    };
    let plan = checked(&plan, &process, &options.statistics)?;
    let first = trusted.first().ok_or(Error::NoLog { purpose: "fit on" })?;
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
             must come from the same source"
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
        draws: plan.draws,
        seed: options.seed,
        ..DetectorConfig::default()
    };
    config.check()?;

    let computing = Computing {
        backend: options.backend,
        threads: options.threads,
    };
    let mut probe = Probe::for_sets(model, &plan, [&options.statistics], computing)?;
    let total = windows.len();
    let (mut rows, mut poses) = (Vec::with_capacity(total), Vec::new());
    probe.measure(&logs, &windows, |window| {
        rows.push(window.row(&options.statistics)?);
        poses.extend(window.poses()?.into_iter().map(|(_, numbers)| numbers));
        progress(window.index + 1, total);
        Ok::<(), Error>(())
    })?;
    let poses = PoseReference::fit(&poses)?;
    let groups = LogGroups::of(&logs);
    let stretches = stretch_numbers(&windows, options.stride);
    let place = |(window, stretch): (&Window, usize)| Place {
        group: groups.of_log[window.trajectory],
        log: window.trajectory,
        stretch,
    };
    let places: Vec<Place> = windows.iter().zip(stretches).map(place).collect();
    let statistics = DetectorStatistics::fit(config, &rows, &places, &groups.names)?;
    for found in &statistics.calibration().audit {
        let (first, last) = (&windows[found.first], &windows[found.last]);
        notes.insert(format!(
            "{} is unlike the other trusted logs (chance {:.1e}): poses {} to {} of {}; {}",
            found.group,
            found.p_value,
            first.start,
            last.start + last.length - 1,
            logs[found.log].name,
            if found.left_out {
                "it is left out of what new logs are compared with"
            } else {
                "it is kept among what new logs are compared with"
            }
        ));
    }
    let detector = Detector {
        model: model.clone(),
        header: DetectorHeader {
            format_version: VERSION,
            needs,
            probe: plan,
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
