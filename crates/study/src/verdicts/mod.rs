//! Verdicts on logs: what a user gets. Faults of the coupling and of the stamps, short faults, short and long logs,
//! few trusted logs (`benchmark --faults --only ...`), and real failures (`benchmark --real`).

mod calibration;
mod contender;
pub(crate) mod defects;
mod few;
pub(crate) mod fold;
mod forest;
mod judge;
mod nearest;
mod parts;
pub(crate) mod pieces;
pub(crate) mod real;
mod reasons;
mod render;
mod run;
mod table;
pub(crate) mod timing;
mod whole;
mod windows;

use crate::data::DataRoot;
use crate::faults::{self as benchmark, FaultOptions, Part, Section};
use crate::options::Options;
use crate::plain;
use crate::provenance::{Provenance, Start, write_document};
use anyhow::Result;
use dose3::atomic;
use dose3_datasets::Trajectory;
use dose3_ood::metrics::Bootstrap;
use run::Run;
use serde::Serialize;

/// Sections that judge without windows.
const WITHOUT_FITS: [Section; 2] = [Section::Timing, Section::Calibration];

/// What the verdicts are told beside [`FaultOptions`].
#[derive(Clone, Debug, Default)]
pub struct VerdictOptions {
    /// Keys of the rows to measure (none: all).
    pub rows: Vec<String>,
    /// Most pieces of logs a set.
    pub pieces: Option<usize>,
    /// Rate at which logs are measured, hertz; none: the model's.
    pub rate: Option<f64>,
    /// Steps of a window; none: the model's.
    pub window: Option<usize>,
    /// Only the test logs are judged, not every group of logs left out in turn.
    pub one_fold: bool,
}

/// Everything that was measured.
#[derive(Default, Serialize)]
pub(crate) struct Record {
    /// Where the numbers come from.
    provenance: Provenance,
    /// No real data.
    synthetic: bool,
    /// Validation or test.
    part: Part,
    /// Steps of a window.
    window: usize,
    /// Density of every block.
    density: String,
    /// Rows, with their columns.
    contenders: Vec<(&'static str, &'static str)>,
    /// [`Section::Couplings`].
    windows: Vec<windows::FaultCell>,
    /// [`Section::Short`], [`Section::Lengths`], [`Section::Throughout`], [`Section::Few`].
    called: Vec<pieces::Called>,
    /// [`Section::Few`], sound logs.
    few: Vec<few::FewAlarms>,
    /// [`Section::Timing`].
    timing: Vec<timing::TimingCell>,
    /// Whole logs of the same.
    timing_alarms: Vec<timing::TimingAlarms>,
    /// [`Section::Whole`].
    whole: Vec<whole::WholeCell>,
    /// [`Section::Calibration`].
    calibration: Vec<calibration::CalibrationCell>,
    /// Sets without stamps.
    without_stamps: Vec<String>,
    /// Real failures, by kind.
    real: Vec<real::RealCell>,
    /// Logs of real failures that cannot be judged, and why.
    not_judged: Vec<String>,
    /// Real failures, log by log.
    judgements: Vec<real::Judgement>,
}

/// Measures the parts named and writes verdicts.json and verdicts.md.
///
/// # Errors
/// Data that cannot be read, a failing network or fit.
pub fn faults(options: &Options, of_faults: &FaultOptions, sections: &[Section]) -> Result<()> {
    let (reasons, sections): (Vec<Section>, Vec<Section>) = sections
        .iter()
        .partition(|section| **section == Section::Reasons);
    if !reasons.is_empty() {
        reasons::run(options, of_faults)?;
    }
    if sections.is_empty() {
        return Ok(());
    }
    let start = Start::now(&options.command);
    let mut run = Run::new(options, of_faults)?;
    let (root, sets) = benchmark::load(options, of_faults.part, run.hertz)?;
    let mut record = run.record(root.is_none());
    for set in &sets {
        if sections.contains(&Section::Timing) {
            let groups = set.groups();
            parts::stamps(&run, set.name, (&set.raw, &groups), &mut record)?;
        }
        if sections.contains(&Section::Calibration) {
            parts::calibration(&run, set, &mut record)?;
        }
        if sections
            .iter()
            .any(|section| !WITHOUT_FITS.contains(section))
        {
            parts::of_set(&mut run, set, &sections, &mut record)?;
        }
    }
    let vio = match root.filter(|_| sections.contains(&Section::Timing)) {
        Some(root) => real::trusted_vio(&root)?,
        None => None,
    };
    if let Some((logs, groups)) = vio {
        parts::stamps(&run, "vio", (&logs, &groups), &mut record)?;
    }
    record.provenance = start.finish();
    let name = match record.synthetic {
        true => "verdicts-synthetic",
        false => "verdicts",
    };
    write(options, &record, name, "Verdicts on injected faults")
}

/// Judges real failures and writes real.json and real.md.
///
/// # Errors
/// No data, a failing network or fit.
pub fn real(options: &Options, of_faults: &FaultOptions) -> Result<()> {
    let start = Start::now(&options.command);
    let mut run = Run::new(options, of_faults)?;
    let root = DataRoot::find(options.data.as_deref())?;
    let mut record = run.record(false);
    let kitti = crate::sets::real_set(&root, 'K')?;
    let reference: Vec<Trajectory> = kitti
        .trajectories
        .iter()
        .map(|log| dose3_datasets::at_rate(log, run.hertz))
        .collect::<Result<_, _>>()?;
    (record.judgements, record.not_judged) = real::vio(&root, &mut run)?;
    let (found, not_judged) = real::kitti(&root, &reference, &mut run)?;
    record.judgements.extend(found);
    record.not_judged.extend(not_judged);
    anyhow::ensure!(
        !record.judgements.is_empty(),
        "neither vio nor kitti-estimates is in the data folder"
    );
    let bootstrap = Bootstrap {
        resamples: options.resamples,
        seed: of_faults.seed,
        ..Bootstrap::default()
    };
    record.real = real::cells(&record.judgements, bootstrap)?;
    record.provenance = start.finish();
    write(options, &record, "real", "Verdicts on real failures")
}

fn write(options: &Options, record: &Record, name: &str, title: &str) -> Result<()> {
    let markdown = render::markdown(record);
    let json = options.out.join(format!("{name}.json"));
    atomic::write(&json, serde_json::to_string_pretty(record)?.as_bytes())?;
    let document = options.out.join(format!("{name}.md"));
    atomic::write(&document, markdown.as_bytes())?;
    plain::print(&markdown);
    say!("wrote {} and {name}.md", json.display());
    if let Some(folder) = &options.render {
        let path = write_document(folder, name, title, &markdown)?;
        say!("updated {}", path.display());
    }
    Ok(())
}
