//! Everything that is measured with one model.

use super::locate::{self, Locator};
use super::methods::{FOLLOWED, KINEMATIC, METHODS, NETWORK, Network, all};
use super::prober::{Prober, SetRows, Settings, fit, overlap};
use super::protocol::{LogSet, Part};
use super::record::Run;
use super::{FaultOptions, Section, alarms, cells, controls, logs, near, windows};
use crate::data::DataRoot;
use crate::options::Options;
use crate::progress::progress;
use anyhow::{Context, Result};
use dose3::model_file::{LogRecord, Model};
use dose3_datasets::faults::Fault;
use dose3_datasets::windows as cut_windows;
use dose3_model::Precision;
use dose3_ood::DetectorStatistics;
use dose3_ood::metrics::Bootstrap;

/// What one model's run works with: a detector a row for every set, and pose scores.
struct Fitted {
    rows: Vec<SetRows>,
    detectors: Vec<Vec<DetectorStatistics>>,
    locators: Vec<Locator>,
}

/// Measures all sections that are wanted.
///
/// # Errors
/// A failing network or fit.
pub fn one_run(
    options: &Options,
    of_faults: &FaultOptions,
    (root, sets): (Option<&DataRoot>, &[LogSet]),
    faults: &[Fault],
    model: &Model,
    seed: u64,
) -> Result<Run> {
    let part = of_faults.part;
    let settings = Settings {
        steps: of_faults.steps.unwrap_or(super::STEPS),
        draws: of_faults.draws.unwrap_or(super::DRAWS),
        density: options.density.parse()?,
        seed,
        computing: options.computing,
    };
    let bootstrap = Bootstrap {
        resamples: options.resamples,
        seed,
        ..Bootstrap::default()
    };
    let mut prober = Prober::new(model, &settings)?;
    let overlap = overlap(prober.poses, of_faults.stride);
    let bytes = model.to_bytes(Precision::F32, &[])?;
    let mut run = Run::new(seed, &bytes, trained_on(model, sets, part));
    let fitted = fit_all(of_faults, sets, &settings, &mut prober)?;
    if of_faults.wants(Section::Cells, options.quick) {
        run.cells = cells::run(sets, &fitted.rows, &fitted.detectors, part, bootstrap)?;
    }
    for (i, set) in sets.iter().enumerate() {
        let bar = progress(0, set.name)?;
        let context = windows::Context {
            locator: &fitted.locators[i],
            detectors: &fitted.detectors[i],
            // Other faults than the tested ones, even where there is no severity to change.
            seed: 2 * of_faults.seed + u64::from(part == Part::Validation),
            bootstrap,
            tick: &|| bar.inc(1),
        };
        let tested = set.tested(part);
        if of_faults.wants(Section::Windows, options.quick) {
            let count = if options.quick {
                super::QUICK_SITES
            } else {
                usize::MAX
            };
            let sites = windows::sites(&set.logs, &tested, of_faults.sites.min(count));
            bar.set_length(passes() * (sites.len() * (faults.len() + 1)) as u64);
            run.sites.push((set.letter, sites.len()));
            let (cells, poses) = windows::run(set, &sites, faults, &context, &mut prober)?;
            run.windows.extend(cells);
            run.poses.extend(poses);
            say!(
                "{}: {} faults at {} places",
                set.name,
                faults.len(),
                sites.len()
            );
        }
        if of_faults.wants(Section::Logs, options.quick) {
            let pieces = logs::pieces(&set.logs, &tested);
            say!(
                "{}: {} faults in {} pieces of logs",
                set.name,
                faults.len(),
                pieces.len()
            );
            run.logs.extend(logs::run(
                set,
                &pieces,
                faults,
                &FOLLOWED,
                &context,
                &mut prober,
            )?);
        }
        if of_faults.wants(Section::Controls, options.quick) {
            let rows = &fitted.rows[i];
            run.controls.extend(controls::run(
                set,
                rows,
                part,
                &FOLLOWED,
                of_faults.stride,
                &context,
                &mut prober,
            )?);
        }
        bar.finish_and_clear();
    }
    if of_faults.wants(Section::Alarms, options.quick) {
        let methods = [KINEMATIC, NETWORK];
        for (set, rows) in sets.iter().zip(&fitted.rows) {
            let groups = set.groups().iter().max().map_or(0, |g| g + 1);
            let bar = progress((methods.len() * groups) as u64, "leave one out")?;
            let found = alarms::run(set, rows, &methods, overlap, &settings, &|| bar.inc(1))?;
            run.alarms.extend(found);
            bar.finish_and_clear();
        }
    }
    if of_faults.wants(Section::Near, options.quick) {
        let of = |letter| {
            let at = sets.iter().position(|set| set.letter == letter)?;
            Some((&sets[at], &fitted.rows[at], fitted.detectors[at].as_slice()))
        };
        if let (Some((k, k_rows, k_fit)), Some((o, o_rows, o_fit))) = (of('K'), of('O')) {
            run.near
                .extend(near::at_equal_speed((k, k_rows), (o, o_rows), k_fit, part)?);
            run.near
                .extend(near::at_equal_speed((o, o_rows), (k, k_rows), o_fit, part)?);
        }
        if let Some(root) = root {
            let logs = near::single_logs(root, model.header.rate, &settings, &mut prober)?;
            run.near.extend(near::run(&logs, of('I'), part)?);
        }
    }
    Ok(run)
}

/// The statistics of all logs, and what is fitted to the trusted ones.
fn fit_all(
    of_faults: &FaultOptions,
    sets: &[LogSet],
    settings: &Settings,
    prober: &mut Prober,
) -> Result<Fitted> {
    let overlap = overlap(prober.poses, of_faults.stride);
    let (mut all_rows, mut detectors, mut locators) = (Vec::new(), Vec::new(), Vec::new());
    for set in sets {
        let fitted = set.fitted(of_faults.part);
        let windows = cut_windows(&set.logs, prober.poses, of_faults.stride);
        let bar = progress(passes() * windows.len() as u64, set.name)?;
        let mut poses = Vec::new();
        let trusted =
            |i: usize| i.is_multiple_of(locate::EVERY) && fitted.contains(&windows[i].trajectory);
        let rows = prober.probe(
            &set.logs,
            &windows,
            &all(),
            &trusted,
            &mut |_, numbers| poses.push(numbers),
            &|| bar.inc(1),
        )?;
        bar.finish_and_clear();
        locators.push(Locator::fit(&poses)?);
        let rows = SetRows { windows, rows };
        let bar = progress(METHODS.len() as u64, "densities")?;
        let groups = set.groups();
        let of_set = all().into_iter().map(|m| {
            let trusted = rows.select(m, |_, w| fitted.contains(&w.trajectory));
            let detector = fit(m, &trusted, &groups, overlap, settings);
            bar.inc(1);
            detector.with_context(|| format!("{} cannot be fitted", set.name))
        });
        detectors.push(of_set.collect::<Result<Vec<_>>>()?);
        bar.finish_and_clear();
        say!(
            "{}: {} windows, densities fitted",
            set.name,
            rows.windows.len()
        );
        all_rows.push(rows);
    }
    Ok(Fitted {
        rows: all_rows,
        detectors,
        locators,
    })
}

/// How often the networks' loop goes over the windows: once more for untrained networks.
fn passes() -> u64 {
    1 + u64::from(METHODS.iter().any(|m| m.network == Network::Untrained))
}

/// Tested logs that the networks were trained on, with their sets.
fn trained_on(model: &Model, sets: &[LogSet], part: Part) -> Vec<String> {
    let known = |log| {
        let hash = LogRecord::from(log).sha256;
        model.header.training.logs.iter().any(|l| l.sha256 == hash)
    };
    let mut found = Vec::new();
    for set in sets {
        for log in set.tested(part) {
            if known(&set.raw[log]) || known(&set.logs[log]) {
                found.push(format!("{} {}", set.letter, set.raw[log].name));
            }
        }
    }
    found
}
