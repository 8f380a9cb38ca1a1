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
pub(crate) mod prober;
pub(crate) mod protocol;
mod record;
mod render;
mod summary;
mod tables;
mod window_tables;
pub(crate) mod windows;

pub use protocol::Part;

use crate::data::DataRoot;
use crate::options::Options;
use crate::plain;
use crate::provenance::{Start, write_document};
use crate::sets;
use crate::verdicts::VerdictOptions;
use anyhow::{Error, Result, bail};
use dose3::Model;
use dose3::atomic;
use dose3_datasets::Kind;
use protocol::{LogSet, faults};
use std::path::PathBuf;
use std::str::FromStr;

/// Diffusion steps visited where `--steps` does not say.
pub(crate) const STEPS: usize = 12;
/// Noise draws where `--draws` does not say.
pub(crate) const DRAWS: usize = 1;
/// Most places a set with --quick.
const QUICK_SITES: usize = 40;

/// What `benchmark --faults` is told beside the [`Options`] of all.
#[derive(Clone, Debug)]
pub struct FaultOptions {
    /// Models, one a training seed (none: the shipped one).
    pub models: Vec<PathBuf>,
    /// Which logs are tested.
    pub part: Part,
    /// Places a set that faults are injected at.
    pub sites: usize,
    /// Seed of noise, fits and faults.
    pub seed: u64,
    /// Sections to run (none: all; a quick run leaves out near platforms and verdicts).
    pub only: Vec<Section>,
    /// Poses between the starts of windows that fit densities.
    pub stride: usize,
    /// Diffusion steps visited.
    pub steps: Option<usize>,
    /// Noise draws.
    pub draws: Option<usize>,
    /// What the sections of [`Section::VERDICTS`] are told beside this.
    pub verdicts: VerdictOptions,
}

/// A section of the run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
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
    /// Windows with faults of the coupling, and of the suite, against the same places without.
    Couplings,
    /// Faults of the stamps.
    Timing,
    /// Verdicts on pieces of 1000 poses with faults of 10, 30 and 100.
    Short,
    /// Verdicts on pieces of 300 and 5000 poses.
    Lengths,
    /// Verdicts on pieces of 1000 poses with faults from end to end.
    Throughout,
    /// Verdicts by one, two, three and five trusted logs.
    Few,
    /// Whole sound logs, each judged by the other groups of logs.
    Whole,
    /// Faults of the calibration all over a log.
    Calibration,
    /// Whether the sentences about bad stretches name the fault.
    Reasons,
}

impl Section {
    /// The sections that [`crate::verdicts`] measures.
    pub const VERDICTS: [Self; 9] = [
        Self::Couplings,
        Self::Timing,
        Self::Short,
        Self::Lengths,
        Self::Throughout,
        Self::Few,
        Self::Whole,
        Self::Calibration,
        Self::Reasons,
    ];

    const ALL: [(Self, &str); 15] = [
        (Self::Windows, "windows"),
        (Self::Logs, "logs"),
        (Self::Controls, "controls"),
        (Self::Alarms, "alarms"),
        (Self::Cells, "cells"),
        (Self::Near, "near"),
        (Self::Couplings, "couplings"),
        (Self::Timing, "timing"),
        (Self::Short, "short"),
        (Self::Lengths, "lengths"),
        (Self::Throughout, "throughout"),
        (Self::Few, "few"),
        (Self::Whole, "whole"),
        (Self::Calibration, "calibration"),
        (Self::Reasons, "reasons"),
    ];
}

impl FromStr for Section {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        match Self::ALL.iter().find(|(_, name)| *name == text) {
            Some((section, _)) => Ok(*section),
            None => {
                let known = Self::ALL.map(|(_, name)| name).join(", ");
                bail!("no section is named {text:?}, expected one of {known}")
            }
        }
    }
}

impl FaultOptions {
    fn wants(&self, section: Section, quick: bool) -> bool {
        if self.only.is_empty() {
            let long = section == Section::Near || Section::VERDICTS.contains(&section);
            return !(quick && long);
        }
        self.only.contains(&section)
    }
}

/// Runs it and writes the results.
///
/// # Errors
/// Data that cannot be read, a model that does not fit, a failing fit.
pub fn run(options: &Options, of_faults: &FaultOptions) -> Result<()> {
    let (verdicts, others): (Vec<Section>, Vec<Section>) = Section::ALL
        .into_iter()
        .map(|(section, _)| section)
        .filter(|section| of_faults.wants(*section, options.quick))
        .partition(|section| Section::VERDICTS.contains(section));
    if !verdicts.is_empty() {
        crate::verdicts::faults(options, of_faults, &verdicts)?;
    }
    if others.is_empty() {
        return Ok(());
    }
    let start = Start::now(&options.command);
    let models = models(&of_faults.models)?;
    let header = &models[0].header;
    let (root, sets) = load(options, of_faults.part, header.rate)?;
    let synthetic = root.is_none();
    let faults = faults(of_faults.part, options.quick);
    let mut runs = Vec::new();
    for (index, model) in models.iter().enumerate() {
        if model.header.rate != header.rate || model.header.window != header.window {
            bail!("all models must have one rate and one window length");
        }
        say!("model {} of {}", index + 1, models.len());
        runs.push(measure::one_run(
            options,
            of_faults,
            (root.as_ref(), &sets),
            &faults,
            model,
            of_faults.seed + index as u64,
        )?);
    }
    let report = record::Report {
        synthetic,
        part: of_faults.part,
        seed: of_faults.seed,
        rate: header.rate,
        poses: header.representation.kind.poses(header.window),
        stride: of_faults.stride,
        steps: of_faults.steps.unwrap_or(STEPS).min(header.process.steps),
        draws: of_faults.draws.unwrap_or(DRAWS),
        density: options.density.clone(),
        resamples: options.resamples,
        faults: faults.len(),
        sets: sets
            .iter()
            .map(|set| record::SetSummary::new(set, of_faults.part))
            .collect(),
        summaries: summary::summaries(&record::lines(&runs)),
        runs,
        provenance: start.finish(),
    };
    let markdown = render::markdown(&report);
    let json = options.out.join("faults.json");
    atomic::write(&json, serde_json::to_string_pretty(&report)?.as_bytes())?;
    atomic::write(&options.out.join("faults.md"), markdown.as_bytes())?;
    plain::print(&markdown);
    say!("wrote {} and faults.md", json.display());
    if let Some(folder) = &options.render {
        // A run without windows has a place of its own: the other one may be of several models.
        let windows = of_faults.wants(Section::Windows, options.quick);
        let (name, title) = match (synthetic, windows) {
            (true, _) => ("faults-synthetic", "Injected faults, synthetic data"),
            (false, true) => ("faults", "Injected faults"),
            (false, false) => ("faults-logs", "Injected faults in logs, and false alarms"),
        };
        let path = write_document(folder, name, title, &markdown)?;
        say!("updated {}", path.display());
    }
    Ok(())
}

pub(crate) fn models(paths: &[PathBuf]) -> Result<Vec<Model>> {
    if paths.is_empty() {
        return Ok(vec![dose3::built_in::motion()?]);
    }
    let models: Vec<Model> = paths
        .iter()
        .map(|path| Model::read(path))
        .collect::<dose3::Result<_>>()?;
    for (model, path) in models.iter().zip(paths) {
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
pub(crate) fn load(
    options: &Options,
    part: Part,
    hertz: f64,
) -> Result<(Option<DataRoot>, Vec<LogSet>)> {
    let root = match options.synthetic {
        true => None,
        false => DataRoot::find_optional(options.data.as_deref())?,
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
        say!("no real data (--data, $DOSE3_DATA, data/): SYNTHETIC data sets, generated here");
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
        if set.tested(part).is_empty() {
            bail!("{} has too few logs: none is left to test", set.name);
        }
    }
    Ok((root.filter(|_| !synthetic), sets))
}
