//! Verdicts on logs: what a user gets. Faults of the coupling and of the stamps, short faults, short and long logs,
//! few trusted logs (`benchmark --faults --only ...`), and real failures (`benchmark --real`).

mod contender;
mod defects;
mod fold;
mod forest;
mod judge;
mod nearest;
mod pieces;
mod real;
mod render;
mod table;
mod timing;
mod windows;

use crate::benchmark::BenchmarkArgs;
use crate::data::DataRoot;
use crate::faults::Section;
use crate::faults::protocol::{LogSet, Part};
use crate::faults::windows as places;
use crate::provenance::{commit, machine, render_into};
use anyhow::Result;
use clap::Args;
use contender::{CONTENDERS, Contender};
use dose3::atomic;
use dose3::backend::Computing;
use dose3_datasets::faults::Fault;
use dose3_ood::StatisticsSet;
use dose3_ood::metrics::Bootstrap;
use fold::Measured;
use pieces::Plan;
use serde::Serialize;
use std::time::Instant;
use table::Measurer;

/// Severities of the validation part over those that are tested.
const BETWEEN: f64 = 1.4;
/// Most pieces of a set with --quick.
const QUICK_PIECES: usize = 6;
/// Every so many faults with --quick.
const QUICK_FAULTS: usize = 6;
/// Trusted logs of [`Section::Few`].
const FEW: [usize; 4] = [1, 2, 3, 5];
/// Most choices of so few logs.
const CHOICES: usize = 4;

/// Arguments of the verdicts.
#[derive(Debug, Args)]
pub struct VerdictArgs {
    /// Judge real failures of odometries (vio, kitti-estimates) instead; writes real.json and real.md
    #[arg(long, conflicts_with_all = ["faults", "synthetic"])]
    pub real: bool,
    /// Rows to measure (default: all)
    #[arg(long, value_delimiter = ',', value_name = "KEY")]
    pub rows: Vec<String>,
    /// Most pieces of logs a set (with --quick at most 6)
    #[arg(long, value_name = "N", default_value_t = usize::MAX, hide_default_value = true)]
    pub pieces: usize,
    /// Test only the test logs, not every group of logs left out in turn
    #[arg(long)]
    pub one_fold: bool,
}

/// Everything that was measured.
#[derive(Default, Serialize)]
pub struct Record {
    /// The command, without folders.
    pub command: String,
    /// Of the checkout.
    pub commit: String,
    /// What it ran on.
    pub machine: String,
    /// How long it took.
    pub seconds: f64,
    /// No real data.
    pub synthetic: bool,
    /// Validation or test.
    pub part: Part,
    /// Density of every block.
    pub density: String,
    /// Rows, with their columns.
    pub contenders: Vec<(&'static str, &'static str)>,
    /// [`Section::Couplings`].
    pub windows: Vec<windows::FaultCell>,
    /// [`Section::Short`], [`Section::Lengths`], [`Section::Few`].
    pub called: Vec<pieces::Called>,
    /// [`Section::Timing`].
    pub timing: Vec<timing::TimingCell>,
    /// Whole logs of the same.
    pub timing_alarms: Vec<timing::TimingAlarms>,
    /// Sets without stamps.
    pub without_stamps: Vec<String>,
    /// Real failures, by kind.
    pub real: Vec<real::RealCell>,
    /// Logs of real failures that cannot be judged, and why.
    pub not_judged: Vec<String>,
    /// Real failures, log by log.
    pub judgements: Vec<real::Judgement>,
}

/// What all parts share.
struct Run<'a> {
    args: &'a BenchmarkArgs,
    contenders: Vec<Contender>,
    settings: judge::Settings,
    measurer: Measurer,
    hertz: f64,
}

impl<'a> Run<'a> {
    fn new(args: &'a BenchmarkArgs) -> Result<Self> {
        let model = crate::faults::models(args)?.swap_remove(0);
        let chosen = |contender: &Contender| {
            let rows = &args.verdicts.rows;
            rows.is_empty() || rows.iter().any(|row| row == contender.key)
        };
        let contenders: Vec<Contender> = CONTENDERS.into_iter().filter(chosen).collect();
        anyhow::ensure!(!contenders.is_empty(), "--rows: no such row");
        let sets = contenders.iter().map(Contender::set);
        let sets: Vec<StatisticsSet> = sets.collect::<Result<_>>()?;
        let (steps, draws) = (args.steps.unwrap_or(12), args.draws.unwrap_or(1));
        let computing = Computing {
            backend: args.backend,
            threads: args.threads,
        };
        let plan = (steps, draws, args.faults.seed);
        let measurer = Measurer::new(&model, &sets, plan, args.stride, computing)?;
        Ok(Self {
            args,
            settings: judge::Settings {
                density: args.density.parse()?,
                overlap: measurer.poses.div_ceil(args.stride),
                draws,
                seed: args.faults.seed,
            },
            contenders,
            measurer,
            hertz: model.header.rate,
        })
    }

    fn record(&self, command: String, synthetic: bool) -> Record {
        Record {
            command,
            commit: commit(),
            machine: machine(),
            synthetic,
            part: self.args.faults.part,
            density: self.args.density.clone(),
            contenders: self
                .contenders
                .iter()
                .map(|c| (c.key, c.statistics))
                .collect(),
            ..Record::default()
        }
    }
}

/// Measures the parts named and writes verdicts.json and verdicts.md.
///
/// # Errors
/// Data that cannot be read, a failing network or fit.
pub fn faults(args: &BenchmarkArgs, sections: &[Section]) -> Result<()> {
    let start = Instant::now();
    let mut run = Run::new(args)?;
    let (root, sets) = crate::faults::load(args, run.hertz)?;
    let mut record = run.record(crate::faults::command(), root.is_none());
    for set in &sets {
        if sections.contains(&Section::Timing) {
            timing_of(&mut record, args, set.name, &set.raw, &set.groups())?;
        }
        if sections.iter().any(|section| *section != Section::Timing) {
            of_set(&mut run, set, sections, &mut record)?;
        }
    }
    if let Some(root) = root.filter(|_| sections.contains(&Section::Timing)) {
        if let Some((logs, groups)) = real::trusted_vio(&root)? {
            timing_of(&mut record, args, "vio", &logs, &groups)?;
        }
    }
    record.seconds = start.elapsed().as_secs_f64();
    write(args, &record, "verdicts")
}

/// Judges real failures and writes real.json and real.md.
///
/// # Errors
/// No data, a failing network or fit.
pub fn real(args: &BenchmarkArgs) -> Result<()> {
    let start = Instant::now();
    let mut run = Run::new(args)?;
    let root = DataRoot::find(args.data.as_deref())?;
    let mut record = run.record(crate::faults::command(), false);
    let one = args.quick || args.verdicts.one_fold;
    let kitti = crate::sets::real_set(&root, 'K')?;
    let reference: Vec<_> = kitti
        .trajectories
        .iter()
        .map(|log| dose3_datasets::at_rate(log, run.hertz))
        .collect::<Result<_, _>>()?;
    let (contenders, settings) = (&run.contenders, &run.settings);
    let measurer = &mut run.measurer;
    (record.judgements, record.not_judged) =
        real::vio(&root, run.hertz, contenders, one, settings, measurer)?;
    let of_kitti = (reference.as_slice(), run.hertz);
    let found = real::kitti(&root, of_kitti, contenders, one, settings, measurer)?;
    record.judgements.extend(found);
    anyhow::ensure!(
        !record.judgements.is_empty(),
        "neither vio nor kitti-estimates is in the data folder"
    );
    let bootstrap = Bootstrap {
        resamples: args.resamples,
        seed: args.faults.seed,
        ..Bootstrap::default()
    };
    record.real = real::cells(&record.judgements, bootstrap)?;
    record.seconds = start.elapsed().as_secs_f64();
    write(args, &record, "real")
}

fn write(args: &BenchmarkArgs, record: &Record, name: &str) -> Result<()> {
    let markdown = render::markdown(record);
    let json = args.out.join(format!("{name}.json"));
    atomic::write(&json, serde_json::to_string_pretty(record)?.as_bytes())?;
    atomic::write(&args.out.join(format!("{name}.md")), markdown.as_bytes())?;
    println!("\n{markdown}\nwrote {} and {name}.md", json.display());
    if let Some(path) = &args.render {
        render_into(path, &markdown, name)?;
        println!("updated {}", path.display());
    }
    Ok(())
}

fn timing_of(
    record: &mut Record,
    args: &BenchmarkArgs,
    name: &str,
    logs: &[dose3_datasets::Trajectory],
    groups: &[usize],
) -> Result<()> {
    let faults: Vec<Fault> = severities(args, Fault::timing()).collect();
    let most = most_pieces(args);
    match timing::run(name, logs, groups, (&faults, most), seed(args))? {
        None => record.without_stamps.push(name.to_owned()),
        Some((cells, alarms)) => {
            record.timing.extend(cells);
            record.timing_alarms.push(alarms);
        }
    }
    Ok(())
}

/// All parts of one set that need fits.
fn of_set(
    run: &mut Run<'_>,
    set: &LogSet,
    sections: &[Section],
    record: &mut Record,
) -> Result<()> {
    let args = run.args;
    let part = args.faults.part;
    let groups = set.groups();
    let windows = run.measurer.windows(&set.logs);
    let measured = Measured {
        table: run.measurer.measure(&set.logs, &windows)?,
        logs: &set.logs,
        groups: &groups,
    };
    println!("{}: {} windows", set.name, windows.len());
    let most = most_pieces(args);
    let one = args.quick || args.verdicts.one_fold;
    if sections.contains(&Section::Couplings) {
        let fold = &fold::of_set(set, part, true)[0];
        let fit = fold::fit(
            &measured,
            &fold.fitted,
            &run.contenders,
            &run.measurer,
            &run.settings,
        )?;
        let sites = args
            .faults
            .sites
            .min(if args.quick { 20 } else { usize::MAX });
        let sites = places::sites(&set.logs, &fold.tested, sites);
        let faults: Vec<(&'static str, Fault)> = severities(args, Fault::suite())
            .map(|fault| ("suite", fault))
            .chain(severities(args, Fault::couplings()).map(|fault| ("couplings", fault)))
            .collect();
        let at = (set.logs.as_slice(), sites.as_slice());
        let found = windows::run(set.letter, at, &faults, &fit, seed(args), &mut run.measurer)?;
        record.windows.extend(found);
        println!("{}: windows with {} faults", set.name, faults.len());
    }
    let mut plans = Vec::new();
    if sections.contains(&Section::Short) {
        plans.extend([100, 30, 10].map(|faulty| Plan {
            length: 1000,
            faulty,
        }));
    }
    if sections.contains(&Section::Lengths) {
        plans.extend([300, 5000].map(|length| Plan {
            length,
            faulty: 100,
        }));
    }
    let faults: Vec<Fault> = severities(args, Fault::suite())
        .chain(severities(args, Fault::couplings()))
        .collect();
    if !plans.is_empty() {
        let folds = fold::of_set(set, part, one);
        for fold in &folds {
            let fit = fold::fit(
                &measured,
                &fold.fitted,
                &run.contenders,
                &run.measurer,
                &run.settings,
            )?;
            for plan in &plans {
                let most = most.div_ceil(folds.len());
                let pieces = pieces::of_logs(&set.logs, &fold.tested, plan.length, most);
                if pieces.is_empty() {
                    continue;
                }
                let what = (*plan, None);
                let measurer = &mut run.measurer;
                let found = pieces::run(
                    set.letter,
                    &pieces,
                    what,
                    &faults,
                    &fit,
                    seed(args),
                    measurer,
                )?;
                pieces::add(&mut record.called, found);
            }
            println!("{}: a fold of {} judged", set.name, folds.len());
        }
    }
    if sections.contains(&Section::Few) {
        few(run, set, &measured, &faults, record)?;
    }
    Ok(())
}

/// Few trusted logs: all that can be chosen one after the other, up to four choices; the others are judged.
fn few(
    run: &mut Run<'_>,
    set: &LogSet,
    measured: &Measured<'_>,
    faults: &[Fault],
    record: &mut Record,
) -> Result<()> {
    let plan = Plan {
        length: 1000,
        faulty: 100,
    };
    let count = measured.groups.iter().max().map_or(0, |last| last + 1);
    for trusted in FEW.into_iter().filter(|trusted| *trusted < count) {
        let choices = CHOICES.min(count);
        for choice in 0..choices {
            let first = choice * count / choices;
            let chosen: Vec<usize> = (0..trusted).map(|i| (first + i) % count).collect();
            // One log of each group.
            let fitted: Vec<usize> = chosen
                .iter()
                .filter_map(|group| measured.groups.iter().position(|of| of == group))
                .collect();
            let tested: Vec<usize> = (0..set.logs.len())
                .filter(|log| !chosen.contains(&measured.groups[*log]))
                .collect();
            let fit = fold::fit(
                measured,
                &fitted,
                &run.contenders,
                &run.measurer,
                &run.settings,
            )?;
            let most = most_pieces(run.args).min(24).div_ceil(choices);
            let pieces = pieces::of_logs(&set.logs, &tested, plan.length, most);
            // Every fault in turn would say the same at greater length.
            let some: Vec<Fault> = faults.iter().copied().step_by(5).collect();
            let (letter, seed) = (set.letter, seed(run.args));
            let what = (plan, Some(trusted));
            let measurer = &mut run.measurer;
            let found = pieces::run(letter, &pieces, what, &some, &fit, seed, measurer)?;
            pieces::add(&mut record.called, found);
        }
    }
    println!("{}: few trusted logs", set.name);
    Ok(())
}

/// The faults of a list: for validation stronger ones, with --quick some of them.
fn severities(
    args: &BenchmarkArgs,
    list: Vec<(&'static str, String, Fault)>,
) -> impl Iterator<Item = Fault> {
    let factor = match args.faults.part {
        Part::Validation => BETWEEN,
        Part::Test => 1.0,
    };
    let step = if args.quick { QUICK_FAULTS } else { 1 };
    let faults = list
        .into_iter()
        .map(move |(.., fault)| fault.stronger(factor));
    faults.step_by(step)
}

fn most_pieces(args: &BenchmarkArgs) -> usize {
    let most = if args.quick { QUICK_PIECES } else { usize::MAX };
    args.verdicts.pieces.min(most)
}

/// Other faults for validation, even where there is no severity to change.
fn seed(args: &BenchmarkArgs) -> u64 {
    2 * args.faults.seed + u64::from(args.faults.part == Part::Validation)
}
