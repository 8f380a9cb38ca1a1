//! `cargo xtask benchmark --live`: how soon a stream raises its hand after a fault has begun, beside the verdict on the
//! whole log, and how often it does on sound logs.

mod faults;
mod real;
mod render;
pub mod soak;
mod sound;
mod stamps;

use crate::data::DataRoot;
use crate::faults::protocol::LogSet;
use crate::faults::{self as benchmark, Part};
use crate::options::Options;
use crate::provenance::{Provenance, Start, write_document};
use crate::verdicts::fold::{self, Fold};
use crate::verdicts::timing::has_stamps;
use anyhow::Result;
use dose3::stream::{Alarm, AlarmKind, Monitor, Said, StreamOptions};
use dose3::{Detector, atomic};
use dose3_datasets::Trajectory;
use dose3_ood::alarm::LevelBasis;
use serde::Serialize;
use std::sync::Arc;

/// What the benchmark is told beside [`Options`].
#[derive(Clone, Debug)]
pub struct LiveOptions {
    /// Validation or test.
    pub part: Part,
    /// Most pieces of logs a set.
    pub pieces: Option<usize>,
    /// Only one choice of trusted logs.
    pub one_fold: bool,
    /// Only faults of these names; all where empty.
    pub kinds: Vec<String>,
    /// Of the faults.
    pub seed: u64,
    /// False alarms an hour that are allowed.
    pub alarms_per_hour: f64,
    /// Poses from window to window.
    pub every: Option<usize>,
}

/// Most pieces of a set in a quick run.
const QUICK_PIECES: usize = 4;
/// Every so many faults in a quick run.
const QUICK_FAULTS: usize = 6;
/// Folds of the logs of `vio`.
const VIO_FOLDS: usize = 10;
/// Folds of the logs of one rig.
const RIG_FOLDS: usize = 5;
/// Fewest recordings of a rig whose alarms say something.
const RIG_RECORDINGS: usize = 4;

/// Everything that was measured.
#[derive(Serialize)]
struct Record {
    provenance: Provenance,
    synthetic: bool,
    part: Part,
    alarms_per_hour: f64,
    /// Seconds from window to window.
    every: f64,
    /// Levels of every detector.
    levels: Vec<Levels>,
    faults: Vec<faults::Delays>,
    sound: Vec<sound::Sound>,
    stamps: Vec<stamps::Stamps>,
    real: Vec<real::Diverged>,
}

/// The levels of one detector's alarm.
#[derive(Clone, Debug, Serialize)]
struct Levels {
    set: &'static str,
    /// Seconds of a window.
    window: f64,
    groups: usize,
    hours: f64,
    runs: Vec<LevelBasis>,
    summed: LevelBasis,
}

/// A detector with what its streams share.
struct Fitted {
    detector: Detector,
    monitor: Arc<Monitor>,
}

/// An alarm with what became of it.
#[derive(Clone, Debug)]
struct Heard {
    raised: Alarm,
    ended_ns: Option<i64>,
}

/// Measures, and writes live.json and live.md.
///
/// # Errors
/// Data that cannot be read, a failing fit.
pub fn run(options: &Options, of_live: &LiveOptions) -> Result<()> {
    let start = Start::now(&options.command);
    let hertz = dose3::built_in::motion()?.header.rate;
    let (root, sets) = benchmark::load(options, of_live.part, hertz)?;
    let mut record = Record {
        provenance: Provenance::default(),
        synthetic: root.is_none(),
        part: of_live.part,
        alarms_per_hour: of_live.alarms_per_hour,
        every: 0.0,
        levels: Vec::new(),
        faults: Vec::new(),
        sound: Vec::new(),
        stamps: Vec::new(),
        real: Vec::new(),
    };
    let one = options.quick || of_live.one_fold;
    let quick = if options.quick {
        QUICK_PIECES
    } else {
        usize::MAX
    };
    let most = of_live.pieces.unwrap_or(quick).min(quick);
    for set in &sets {
        let folds = fold::of_set(set, of_live.part, one);
        for fold in &folds {
            let fitted = Fitted::new(options, of_live, &set.logs, &fold.fitted)?;
            record.note(set.name, &fitted);
            let tested = (set.letter, set.logs.as_slice(), fold.tested.as_slice());
            record.sound.extend(sound::run(set.name, tested, &fitted)?);
            let step = if options.quick { QUICK_FAULTS } else { 1 };
            let found = faults::run(
                tested,
                &fitted,
                &faults::Plan {
                    part: of_live.part,
                    most: most.div_ceil(folds.len()),
                    seed: 2 * of_live.seed + u64::from(of_live.part == Part::Validation),
                    step,
                    kinds: &of_live.kinds,
                },
            )?;
            faults::add(&mut record.faults, found);
            let of_stamps = (of_live.part, most.div_ceil(folds.len()), of_live.seed);
            record.of_stamps(options, of_live, set, fold, of_stamps)?;
        }
        say!("{}: {} folds", set.name, folds.len());
    }
    if let Some(root) = &root {
        vio(options, of_live, (root, hertz), &mut record)?;
    }
    record.provenance = start.finish();
    write(options, &record)
}

/// Sound and diverged estimates of odometries, by every recording left out in turn.
fn vio(
    options: &Options,
    of_live: &LiveOptions,
    (root, hertz): (&DataRoot, f64),
    record: &mut Record,
) -> Result<()> {
    let Some(vio) = real::Vio::read(root, hertz)? else {
        return Ok(());
    };
    let folds = fold::by_group(&vio.groups, VIO_FOLDS);
    let folds = if options.quick { &folds[..1] } else { &folds };
    for fold in folds {
        let fitted = Fitted::new(options, of_live, &vio.trusted, &fold.fitted)?;
        record.note("vio", &fitted);
        let tested = ('V', vio.trusted.as_slice(), fold.tested.as_slice());
        record.sound.extend(sound::run("vio", tested, &fitted)?);
        record.real.extend(vio.diverged(&fold.tested, &fitted)?);
    }
    say!("vio: {} folds", folds.len());
    // The same of one rig at a time: what is trusted and what is watched are alike.
    for rig in &vio.rigs() {
        let groups: Vec<usize> = rig.iter().map(|log| vio.groups[*log]).collect();
        let groups = real::numbered(&groups);
        if groups
            .iter()
            .max()
            .is_none_or(|last| *last + 1 < RIG_RECORDINGS)
        {
            continue;
        }
        for fold in fold::by_group(&groups, RIG_FOLDS) {
            let of = |logs: &[usize]| -> Vec<usize> { logs.iter().map(|l| rig[*l]).collect() };
            let (fitted, tested) = (of(&fold.fitted), of(&fold.tested));
            let fitted = Fitted::new(options, of_live, &vio.trusted, &fitted)?;
            let tested = ('V', vio.trusted.as_slice(), tested.as_slice());
            record
                .sound
                .extend(sound::run("vio, one rig", tested, &fitted)?);
        }
    }
    Ok(())
}

impl Record {
    /// Stamps are looked at as they were recorded, by a detector of logs that are.
    fn of_stamps(
        &mut self,
        options: &Options,
        of_live: &LiveOptions,
        set: &LogSet,
        fold: &Fold,
        settings: (Part, usize, u64),
    ) -> Result<()> {
        if !set.raw.iter().all(has_stamps) {
            return Ok(());
        }
        let fitted = Fitted::new(options, of_live, &set.raw, &fold.fitted)?;
        let tested = (set.raw.as_slice(), fold.tested.as_slice());
        let found = stamps::run(set.name, tested, &fitted, settings)?;
        stamps::add(&mut self.stamps, found);
        Ok(())
    }

    fn note(&mut self, set: &'static str, fitted: &Fitted) {
        self.every = fitted.every();
        for alarm in fitted.monitor.alarms() {
            let (basis, config) = (alarm.basis(), alarm.config());
            self.levels.push(Levels {
                set,
                window: config.overlap as f64 * fitted.every(),
                groups: basis.groups,
                hours: basis.hours,
                runs: basis.runs.clone(),
                summed: basis.summed,
            });
        }
    }
}

impl Fitted {
    fn new(
        options: &Options,
        of_live: &LiveOptions,
        logs: &[Trajectory],
        trusted: &[usize],
    ) -> Result<Self> {
        let trusted: Vec<Trajectory> = trusted.iter().map(|&log| logs[log].clone()).collect();
        let builder = Detector::builder().computing(options.computing);
        let detector = builder.fit(&trusted)?;
        let monitor = detector.monitor(&StreamOptions {
            alarms_per_hour: of_live.alarms_per_hour,
            every: of_live.every,
            windows: false,
            ..StreamOptions::default()
        })?;
        Ok(Self { detector, monitor })
    }

    /// Seconds from window to window.
    fn every(&self) -> f64 {
        self.monitor.every() as f64 / self.monitor.rate()
    }

    /// The alarms of a log, and its windows.
    fn listen(&self, log: &Trajectory) -> Result<(Vec<Heard>, u64)> {
        let mut stream = self.monitor.stream(log.frame)?;
        let mut heard: Vec<Heard> = Vec::new();
        for (stamp, pose) in log.stamps.iter().zip(&log.poses) {
            for said in stream.push(*stamp, *pose)? {
                let Said::Alarm(alarm) = said else {
                    continue;
                };
                match (alarm.alarm, heard.last_mut()) {
                    (AlarmKind::Ended, Some(last)) => last.ended_ns = Some(alarm.at_ns),
                    _ => heard.push(Heard {
                        raised: alarm.clone(),
                        ended_ns: None,
                    }),
                }
            }
        }
        stream.finish()?;
        Ok((heard, stream.windows()))
    }
}

fn write(options: &Options, record: &Record) -> Result<()> {
    let markdown = render::markdown(record);
    let name = match record.synthetic {
        true => "live-synthetic",
        false => "live",
    };
    let json = options.out.join(format!("{name}.json"));
    atomic::write(&json, serde_json::to_string_pretty(record)?.as_bytes())?;
    let document = options.out.join(format!("{name}.md"));
    atomic::write(&document, markdown.as_bytes())?;
    say!("\n{markdown}\nwrote {} and {name}.md", json.display());
    if let Some(folder) = &options.render {
        let path = write_document(folder, name, "Alarms of streams", &markdown)?;
        say!("updated {}", path.display());
    }
    Ok(())
}
