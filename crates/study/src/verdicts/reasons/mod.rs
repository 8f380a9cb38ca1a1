//! Do the reasons name the fault: pieces of logs with one fault each, judged by the default detector; of those that it
//! calls for the fault, the share in which a sentence names what was injected ([`mapping`]).

mod mapping;
mod render;

use super::fold;
use super::pieces::{self, Piece, Plan};
use super::run::Run;
use crate::faults::FaultOptions;
use crate::faults::protocol::LogSet;
use crate::faults::{self as benchmark, Part};
use crate::options::Options;
use crate::provenance::{Provenance, Start, write_document};
use anyhow::Result;
use dose3::atomic;
use dose3::report::{Reason, Segment};
use dose3::{Detector, Report};
use dose3_datasets::Trajectory;
use dose3_datasets::faults::Fault;
use rayon::prelude::*;
use serde::Serialize;
use std::ops::Range;

/// Poses of pieces, and of the faults in them.
const PLAN: Plan = Plan {
    length: 1000,
    faulty: 100,
};

/// One fault in one piece that was called for it.
#[derive(Clone, Debug, Serialize)]
struct Case {
    set: char,
    list: &'static str,
    fault: String,
    /// Fault without its severity.
    kind: String,
    log: String,
    /// The number, from 1, of the first sentence of the stretch that names the fault.
    named_by: Option<usize>,
    /// The sentences of the stretch.
    reasons: Vec<Reason>,
}

/// Everything that was measured.
#[derive(Default, Serialize)]
struct Record {
    provenance: Provenance,
    synthetic: bool,
    part: Part,
    /// Pieces judged with each fault.
    pieces: usize,
    /// List, fault and how it must be named.
    faults: Vec<(&'static str, String, String)>,
    cases: Vec<Case>,
}

/// Measures, and writes reasons.json and reasons.md.
///
/// # Errors
/// Data that cannot be read, a failing fit.
pub fn run(options: &Options, of_faults: &FaultOptions) -> Result<()> {
    let start = Start::now(&options.command);
    let run = Run::new(options, of_faults)?;
    let (root, sets) = benchmark::load(options, of_faults.part, run.hertz)?;
    let lists = [("suite", Fault::suite()), ("couplings", Fault::couplings())];
    let faults: Vec<(&'static str, Fault)> = lists
        .into_iter()
        .flat_map(|(name, list)| run.severities(list).into_iter().map(move |f| (name, f)))
        .collect();
    let mut record = Record {
        synthetic: root.is_none(),
        part: of_faults.part,
        faults: faults
            .iter()
            .map(|(list, fault)| (*list, fault.label(), mapping::text(fault)))
            .collect(),
        ..Record::default()
    };
    for set in &sets {
        of_set(&run, set, &faults, options, &mut record)?;
    }
    record.provenance = start.finish();
    write(options, &record)
}

fn of_set(
    run: &Run<'_>,
    set: &LogSet,
    faults: &[(&'static str, Fault)],
    options: &Options,
    record: &mut Record,
) -> Result<()> {
    let folds = fold::of_set(set, run.part(), run.one_fold());
    let most = run.most_pieces().div_ceil(folds.len());
    for fold in folds {
        let trusted: Vec<Trajectory> = fold
            .fitted
            .iter()
            .map(|&log| set.logs[log].clone())
            .collect();
        let builder = Detector::builder().seed(run.settings.seed);
        let detector = builder.computing(options.computing).fit(&trusted)?;
        let chosen = pieces::of_logs(&set.logs, &fold.tested, PLAN.length, most);
        let sound: Vec<Report> = chosen
            .iter()
            .map(|piece| detector.judge(&piece.trajectory))
            .collect::<dose3::Result<_>>()?;
        record.pieces += chosen.len();
        let of_faults = run.seed().wrapping_mul(1_000_033);
        for (list, fault) in faults {
            // A detector each: its probe is locked while it computes in the same pool.
            let own = || detector.clone();
            let cases: Vec<Option<Case>> = chosen
                .par_iter()
                .zip(&sound)
                .enumerate()
                .map_init(own, |detector, (i, (piece, sound))| {
                    let seed = of_faults.wrapping_add(i as u64);
                    case(detector, (set.letter, list), fault, piece, sound, seed)
                })
                .collect::<Result<_>>()?;
            record.cases.extend(cases.into_iter().flatten());
        }
        say!("{}: {} pieces", set.name, chosen.len());
    }
    Ok(())
}

/// None where the fault is not called, or the sound piece is too.
fn case(
    detector: &Detector,
    (set, list): (char, &'static str),
    fault: &Fault,
    piece: &Piece,
    sound: &Report,
    seed: u64,
) -> Result<Option<Case>> {
    let range = pieces::fault_range(piece.trajectory.len(), PLAN.faulty);
    let injection = fault.inject(&piece.trajectory, range, seed)?;
    let Ok(report) = detector.judge(&injection.trajectory) else {
        return Ok(None);
    };
    if sound.verdict.differs() || !report.verdict.differs() {
        return Ok(None);
    }
    let Some(segment) = of_fault(&report, &injection.affected) else {
        return Ok(None);
    };
    let forward = piece.trajectory.frame.has_forward();
    let named = segment.reasons.iter();
    let named_by = named
        .map(|reason| mapping::named(fault, reason, forward))
        .position(|n| n);
    Ok(Some(Case {
        set,
        list,
        fault: fault.label(),
        kind: fault.name().to_owned(),
        log: piece.log.clone(),
        named_by: named_by.map(|at| at + 1),
        reasons: segment.reasons.clone(),
    }))
}

/// The stretch with the highest score that holds poses of the fault.
fn of_fault<'a>(report: &'a Report, affected: &Range<usize>) -> Option<&'a Segment> {
    let holds = |segment: &&Segment| {
        segment.place.first_pose < affected.end && affected.start <= segment.place.last_pose
    };
    let segments = report.segments.iter().filter(holds);
    segments.max_by_key(|segment| segment.worst_score)
}

fn write(options: &Options, record: &Record) -> Result<()> {
    let markdown = render::markdown(record);
    let name = match record.synthetic {
        true => "reasons-synthetic",
        false => "reasons",
    };
    let json = options.out.join(format!("{name}.json"));
    atomic::write(&json, serde_json::to_string_pretty(record)?.as_bytes())?;
    atomic::write(&options.out.join(format!("{name}.md")), markdown.as_bytes())?;
    say!("\n{markdown}\nwrote {} and {name}.md", json.display());
    if let Some(folder) = &options.render {
        let path = write_document(folder, name, "Reasons on injected faults", &markdown)?;
        say!("updated {}", path.display());
    }
    Ok(())
}
