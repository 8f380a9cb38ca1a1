//! What all parts share.

use super::Record;
use super::contender::{CONTENDERS, Contender, OF_JOINT};
use super::judge::Settings;
use super::pieces::Plan;
use super::table::Measurer;
use crate::faults::prober::overlap;
use crate::faults::{self as benchmark, FaultOptions, Part};
use crate::options::Options;
use anyhow::Result;
use dose3_datasets::faults::Fault;
use dose3_ood::StatisticsSet;

/// Severities of the validation part over those that are tested.
const BETWEEN: f64 = 1.4;
/// Most pieces of a set in a quick run.
const QUICK_PIECES: usize = 6;
/// Every so many faults in a quick run.
const QUICK_FAULTS: usize = 6;
/// Most places of a set in a quick run.
const QUICK_SITES: usize = 20;

/// A run with its rows, its settings and what measures windows.
pub struct Run<'a> {
    options: &'a Options,
    of_faults: &'a FaultOptions,
    /// The rows.
    pub contenders: Vec<Contender>,
    /// Of the fits.
    pub settings: Settings,
    /// Of windows.
    pub measurer: Measurer,
    /// The rate at which logs are measured.
    pub hertz: f64,
    /// The model's.
    usual: f64,
}

impl<'a> Run<'a> {
    /// Loads the model, and chooses the rows.
    ///
    /// # Errors
    /// A model that cannot be read, rows that are not known.
    pub fn new(options: &'a Options, of_faults: &'a FaultOptions) -> Result<Self> {
        let model = benchmark::models(&of_faults.models)?.swap_remove(0);
        let rows = &of_faults.verdicts.rows;
        let joint = OF_JOINT.into_iter().filter(|_| model.joint.is_some());
        let all: Vec<Contender> = CONTENDERS.into_iter().chain(joint).collect();
        let known: Vec<&str> = all.iter().map(|contender| contender.key).collect();
        if let Some(unknown) = rows.iter().find(|row| !known.contains(&row.as_str())) {
            anyhow::bail!(
                "no row is named {unknown:?}, expected one of {}",
                known.join(", ")
            );
        }
        let chosen =
            |contender: &Contender| rows.is_empty() || rows.iter().any(|row| row == contender.key);
        let contenders: Vec<Contender> = all.into_iter().filter(chosen).collect();
        let sets = contenders.iter().map(Contender::set);
        let sets: Vec<StatisticsSet> = sets.collect::<Result<_>>()?;
        let steps = of_faults.steps.unwrap_or(benchmark::STEPS);
        let draws = of_faults.draws.unwrap_or(benchmark::DRAWS);
        let plan = (steps, draws, of_faults.seed);
        let mut measurer = Measurer::new(&model, &sets, plan, of_faults.stride, options.computing)?;
        if let Some(steps) = of_faults.verdicts.window {
            measurer.set_window(steps);
        }
        Ok(Self {
            settings: Settings {
                density: options.density.parse()?,
                overlap: overlap(measurer.poses, measurer.stride),
                draws,
                seed: of_faults.seed,
            },
            options,
            of_faults,
            contenders,
            measurer,
            hertz: of_faults.verdicts.rate.unwrap_or(model.header.rate),
            usual: model.header.rate,
        })
    }

    /// A record with nothing in it yet.
    pub fn record(&self, synthetic: bool) -> Record {
        let rows = self.contenders.iter();
        Record {
            synthetic,
            part: self.of_faults.part,
            window: self.measurer.poses - 1,
            density: self.options.density.clone(),
            contenders: rows.map(|row| (row.key, row.statistics)).collect(),
            ..Record::default()
        }
    }

    /// Pieces of so many poses with so many faulty ones at the model's rate; at another rate they span the same time.
    pub fn plan(&self, length: usize, faulty: usize) -> Plan {
        let poses = |n: usize| (n as f64 * self.hertz / self.usual).round().max(1.0) as usize;
        Plan {
            length: poses(length),
            faulty: poses(faulty),
        }
    }

    /// Validation or test.
    pub fn part(&self) -> Part {
        self.of_faults.part
    }

    /// Whether only one choice of trusted logs is judged by.
    pub fn one_fold(&self) -> bool {
        self.options.quick || self.of_faults.verdicts.one_fold
    }

    /// Most pieces of a set.
    pub fn most_pieces(&self) -> usize {
        let most = self.unless_quick(QUICK_PIECES);
        self.of_faults.verdicts.pieces.unwrap_or(most).min(most)
    }

    /// Most places of a set.
    pub fn most_sites(&self) -> usize {
        self.of_faults.sites.min(self.unless_quick(QUICK_SITES))
    }

    /// Of the faults: others for validation, even where there is no severity to change.
    pub fn seed(&self) -> u64 {
        2 * self.of_faults.seed + u64::from(self.part() == Part::Validation)
    }

    /// The faults of a list: for validation stronger ones, of a quick run some of them.
    pub fn severities(&self, list: Vec<(&'static str, String, Fault)>) -> Vec<Fault> {
        let factor = match self.part() {
            Part::Validation => BETWEEN,
            Part::Test => 1.0,
        };
        let step = if self.options.quick { QUICK_FAULTS } else { 1 };
        let faults = list.into_iter().map(|(.., fault)| fault.stronger(factor));
        faults.step_by(step).collect()
    }

    fn unless_quick(&self, most: usize) -> usize {
        if self.options.quick { most } else { usize::MAX }
    }
}
