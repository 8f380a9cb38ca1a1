//! Reading logs with a user's overrides.

use anyhow::{Context, Result, bail};
use dose3_datasets::{
    Format, Frame, Kind, LoadOptions, RateSource, Representation, Scaling, Trajectory, load_all,
    resample,
};
use std::path::PathBuf;

/// What a user may say about logs whose files do not.
#[derive(Clone, Debug)]
pub struct ReadOptions {
    /// Format, where content should not decide.
    pub format: Option<Format>,
    /// Body frame, where the format's is wrong.
    pub frame: Option<Frame>,
    /// Rate of logs without stamps, hertz.
    pub nominal_rate: Option<f64>,
    /// Metres in one unit of position.
    pub unit: f64,
    /// Stamps of a KITTI log.
    pub times: Option<PathBuf>,
    /// Longest step that is not a gap, seconds.
    pub max_gap: Option<f64>,
}

impl Default for ReadOptions {
    fn default() -> Self {
        Self {
            format: None,
            frame: None,
            nominal_rate: None,
            unit: 1.0,
            times: None,
            max_gap: None,
        }
    }
}

/// Reads every log under `paths`.
///
/// # Errors
/// The first log that cannot be read; options out of range.
pub fn read(paths: &[PathBuf], options: &ReadOptions) -> Result<Vec<Trajectory>> {
    if !(options.unit.is_finite() && options.unit > 0.0) {
        bail!(
            "--unit {}: expected a positive number of metres",
            options.unit
        );
    }
    if let Some(rate) = options
        .nominal_rate
        .filter(|r| !(r.is_finite() && *r > 0.0))
    {
        bail!("--nominal-rate {rate}: expected a positive number of hertz");
    }
    let load = LoadOptions {
        format: options.format,
        times: options.times.clone(),
        max_gap: options.max_gap,
        ..LoadOptions::default()
    };
    let mut trajectories = load_all(paths, &load)?;
    for t in &mut trajectories {
        apply(t, options)?;
    }
    Ok(trajectories)
}

fn apply(t: &mut Trajectory, options: &ReadOptions) -> Result<()> {
    if let Some(frame) = options.frame {
        t.frame = frame;
    }
    if options.unit != 1.0 {
        t.poses
            .iter_mut()
            .for_each(|p| p.translation *= options.unit);
    }
    if let (Some(hertz), RateSource::Nominal) = (options.nominal_rate, t.rate.source) {
        let step = 1e9 / hertz;
        for (i, stamp) in t.stamps.iter_mut().enumerate() {
            *stamp = (i as f64 * step).round() as i64;
        }
        t.rate.hertz = hertz;
    }
    Ok(())
}

/// A log that steps this many times farther than the model's data is in another unit. The other
/// way round proves nothing: logs may stand still.
const UNIT_FACTOR: f64 = 100.0;

/// Median distance between consecutive poses, metres.
fn median_step(t: &Trajectory) -> f64 {
    let mut steps: Vec<f64> = t
        .poses
        .windows(2)
        .map(|pair| (pair[1].translation - pair[0].translation).norm())
        .collect();
    steps.sort_by(f64::total_cmp);
    steps.get(steps.len() / 2).copied().unwrap_or_default()
}

/// Fits logs to what a model was trained on. A `paper` model counts poses, so a different rate is
/// only noted; a `motion` model depends on time and axes, so a faster log is interpolated down
/// and a slower one, or one in another kind of frame, is refused with the flag that resolves it.
/// Answers the notes for the user.
///
/// # Errors
/// A log that does not fit.
pub fn conform(
    trajectory: Trajectory,
    representation: Representation,
    rate: f64,
    frame: Frame,
) -> Result<(Trajectory, Vec<String>)> {
    let mut notes = Vec::new();
    let ratio = trajectory.rate.hertz / rate;
    if trajectory.rate.source == RateSource::Nominal {
        notes.push(format!(
            "no stamps in the file: {:.4} Hz is the data set's nominal rate (--nominal-rate changes it)",
            trajectory.rate.hertz
        ));
    }
    if representation.kind == Kind::Paper {
        if (ratio - 1.0).abs() > 0.05 {
            notes.push(format!(
                "the log has {:.4} Hz, the model's data {rate:.4} Hz; a paper model counts poses, so \
                 a window spans another time",
                trajectory.rate.hertz
            ));
        }
        return Ok((trajectory, notes));
    }
    if trajectory.frame != frame && trajectory.frame.has_forward() != frame.has_forward() {
        bail!(
            "log {} is in frame {}, the model was trained in {frame}: name the log's body axes \
             with --frame camera-rdf, body-frd or body-flu",
            trajectory.name,
            trajectory.frame
        );
    }
    if let Scaling::Stored { translation, .. } = representation.scaling {
        let step = median_step(&trajectory) * ratio;
        if step > translation * UNIT_FACTOR {
            bail!(
                "log {} moves {step:.3} m a step, the model's data {translation:.3} m: its positions \
                 are hardly metres; name their unit with --unit (0.001 for millimetres)",
                trajectory.name
            );
        }
    }
    if ratio < 0.95 {
        bail!(
            "log {} has {:.4} Hz, the model needs {rate:.4} Hz and cannot invent poses in between; \
             if the log's rate is wrong, set it with --nominal-rate, else fit with a model \
             trained at its rate (train --rate {:.4})",
            trajectory.name,
            trajectory.rate.hertz,
            trajectory.rate.hertz
        );
    }
    if ratio > 1.05 {
        let slower = resample(&trajectory, rate)
            .with_context(|| format!("log {} cannot be resampled", trajectory.name))?;
        notes.push(format!(
            "interpolated from {:.4} Hz down to the model's {rate:.4} Hz",
            trajectory.rate.hertz
        ));
        return Ok((slower, notes));
    }
    Ok((trajectory, notes))
}
