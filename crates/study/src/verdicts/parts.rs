//! The sections of a run on injected faults.

use super::fold::{self, Measured};
use super::pieces::{self, Plan};
use super::run::Run;
use super::{Record, calibration as of_calibration, few, timing, whole, windows};
use crate::faults::Section;
use crate::faults::protocol::LogSet;
use crate::faults::windows::sites;
use anyhow::Result;
use dose3_datasets::Trajectory;
use dose3_datasets::faults::Fault;

/// Faults of the stamps.
///
/// # Errors
/// A fault that cannot be injected.
pub fn stamps(
    run: &Run<'_>,
    name: &str,
    (logs, groups): (&[Trajectory], &[usize]),
    record: &mut Record,
) -> Result<()> {
    let faults = run.severities(Fault::timing());
    let of = (faults.as_slice(), run.most_pieces());
    match timing::run(name, logs, groups, of, run.seed())? {
        None => record.without_stamps.push(name.to_owned()),
        Some((cells, alarms)) => {
            record.timing.extend(cells);
            record.timing_alarms.push(alarms);
        }
    }
    Ok(())
}

/// Faults of the calibration: of the tested logs, and unless one fold is enough of every group of logs.
///
/// # Errors
/// A fault that cannot be injected.
pub fn calibration(run: &Run<'_>, set: &LogSet, record: &mut Record) -> Result<()> {
    let groups = set.groups();
    let mut protocols = vec![("tested", fold::of_set(set, run.part(), true))];
    if !run.one_fold() {
        protocols.push(("every group", fold::by_group(&groups, usize::MAX)));
    }
    let faults = of_calibration::faults(run.severities(Fault::couplings()));
    let of = (set.logs.as_slice(), groups.as_slice());
    let cells = of_calibration::run(set.letter, of, &protocols, &faults, run.seed())?;
    record.calibration.extend(cells);
    say!("{}: calibration with {} faults", set.name, faults.len());
    Ok(())
}

/// All sections of one set that need fits.
///
/// # Errors
/// A failing network or fit.
pub fn of_set(
    run: &mut Run<'_>,
    set: &LogSet,
    sections: &[Section],
    record: &mut Record,
) -> Result<()> {
    let groups = set.groups();
    run.measurer.scale_by(&set.logs)?;
    let cut = run.measurer.windows(&set.logs);
    let measured = Measured {
        table: run.measurer.measure(&set.logs, &cut)?,
        logs: &set.logs,
        groups: &groups,
    };
    say!("{}: {} windows", set.name, cut.len());
    if sections.contains(&Section::Couplings) {
        couplings(run, set, &measured, record)?;
    }
    let mut plans = Vec::new();
    if sections.contains(&Section::Short) {
        plans.extend([100, 30, 10].map(|faulty| run.plan(1000, faulty)));
    }
    if sections.contains(&Section::Lengths) {
        plans.extend([300, 5000].map(|length| run.plan(length, 100)));
    }
    if sections.contains(&Section::Throughout) {
        plans.push(run.plan(1000, 1000));
    }
    if !plans.is_empty() {
        called(run, set, &measured, &plans, record)?;
    }
    if sections.contains(&Section::Few) {
        few::faults(run, set, &measured, record)?;
        few::alarms(run, set, &measured, record)?;
    }
    if sections.contains(&Section::Whole) {
        let cells = whole::run(set.letter, &set.raw, &measured, run)?;
        record.whole.extend(cells);
        say!("{}: whole logs", set.name);
    }
    Ok(())
}

/// The faults of both lists.
pub fn faults(run: &Run<'_>) -> Vec<(&'static str, Fault)> {
    let lists = [("suite", Fault::suite()), ("couplings", Fault::couplings())];
    let named = lists.into_iter().flat_map(|(name, list)| {
        let faults = run.severities(list).into_iter();
        faults.map(move |fault| (name, fault))
    });
    named.collect()
}

fn couplings(
    run: &mut Run<'_>,
    set: &LogSet,
    measured: &Measured<'_>,
    record: &mut Record,
) -> Result<()> {
    let fold = &fold::of_set(set, run.part(), true)[0];
    let fit = fold::fit(measured, &fold.fitted, run)?;
    let places = sites(&set.logs, &fold.tested, run.most_sites());
    let (faults, seed) = (faults(run), run.seed());
    let at = (set.logs.as_slice(), places.as_slice());
    let found = windows::run(set.letter, at, &faults, &fit, seed, &mut run.measurer)?;
    record.windows.extend(found);
    say!("{}: windows with {} faults", set.name, faults.len());
    Ok(())
}

fn called(
    run: &mut Run<'_>,
    set: &LogSet,
    measured: &Measured<'_>,
    plans: &[Plan],
    record: &mut Record,
) -> Result<()> {
    let faults: Vec<Fault> = faults(run).into_iter().map(|(_, fault)| fault).collect();
    let folds = fold::of_set(set, run.part(), run.one_fold());
    let most = run.most_pieces().div_ceil(folds.len());
    for fold in &folds {
        let fit = fold::fit(measured, &fold.fitted, run)?;
        for plan in plans {
            let pieces = pieces::of_logs(&set.logs, &fold.tested, plan.length, most);
            if pieces.is_empty() {
                continue;
            }
            let (what, seed) = ((*plan, None), run.seed());
            let measurer = &mut run.measurer;
            let found = pieces::run(set.letter, &pieces, what, &faults, &fit, seed, measurer)?;
            pieces::add(&mut record.called, found);
        }
        say!("{}: one of {} folds judged", set.name, folds.len());
    }
    Ok(())
}
