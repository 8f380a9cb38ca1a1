//! Every table and figure of the paper, with honest columns beside it: experiments, their records, and what is made
//! of them.

mod clock;
mod cost;
mod experiment;
mod figures;
mod findings;
mod measure;
mod page;
mod readings;
mod record;
mod report;
mod shortfalls;
mod store;
mod table;
mod tables;
#[cfg(test)]
mod tests;

use crate::cells::columns;
use crate::learned::Weights;
use crate::networks;
use crate::options::Options;
use crate::provenance::Start;
use crate::sets::DataSet;
use anyhow::{Result, bail};
use clock::Clock;
use dose3::Model;
use dose3_datasets::Trajectory;
use dose3_model::Precision;
use dose3_ood::DensityConfig;
use experiment::{Change, Effort, Experiment, Subject, plan};
use findings::{Findings, Outcome};
use measure::{Settings, prepare};
use store::Store;

/// What the reproduction is told beside the [`Options`] of all.
#[derive(Clone, Debug)]
pub struct ReproductionOptions {
    /// Measure everything anew, also what an earlier run measured.
    pub fresh: bool,
    /// Why the learned baselines are left out, where they are.
    pub without_baselines: Option<String>,
}

/// Windows a set in figures.
const FIGURE_WINDOWS: usize = 400;
/// Training steps of learned baselines on the synthetic vehicle, in whole and in quick runs.
const VEHICLE_STEPS: [usize; 2] = [300, 60];

/// Runs all experiments and writes the report.
///
/// # Errors
/// Data that cannot be read, files that cannot be written; after the report is written, experiments that could not
/// run.
pub fn run(options: &Options, of_reproduction: &ReproductionOptions) -> Result<()> {
    let start = Start::now(&options.command);
    let density: DensityConfig = options.density.parse()?;
    let (source, sets) = options.load()?;
    let (effort, vehicle_steps) = match options.quick {
        true => (Effort::Quick, VEHICLE_STEPS[1]),
        false => (Effort::Whole, VEHICLE_STEPS[0]),
    };
    let settings = Settings {
        density: &density,
        resamples: options.resamples,
        effort,
        computing: options.computing,
        learned: match source {
            Some(_) => Weights::Study,
            None => Weights::Vehicle {
                steps: vehicle_steps,
            },
        },
    };
    let plan = plan(effort);
    let mut run = Run {
        sets: &sets,
        settings,
        without_baselines: of_reproduction.without_baselines.as_deref(),
        store: Store::new(
            options.out.join("all"),
            &inputs(options, &sets),
            !of_reproduction.fresh,
        ),
        outcomes: Vec::new(),
        clock: Clock::new(&plan, effort, sets.len())?,
    };
    for experiment in &plan {
        run.experiment(experiment)?;
    }
    let training = run.training_seconds()?;
    let letters: Vec<char> = sets.iter().map(|s| s.letter).collect();
    let findings = Findings {
        outcomes: std::mem::take(&mut run.outcomes),
        columns: columns(&letters),
        real: source.is_some(),
    };
    run.clock.say("figures");
    let (figures, missing) = run.figures(&findings);
    run.clock.finish();
    let report = report::Report {
        source,
        resumed: !of_reproduction.fresh,
        density: options.density.clone(),
        quick: options.quick,
        training,
        missing,
        provenance: start.finish(),
    };
    report.write(options, &findings, figures)?;
    let left_out = |experiment: &Experiment| {
        run.without_baselines.is_some() && matches!(experiment.subject, Subject::Learned(_))
    };
    let failed = findings.outcomes.iter();
    let mut failed: Vec<String> = failed
        .filter(|(experiment, outcome)| {
            // What was left out by request is not a failure.
            matches!(outcome, Outcome::NotRun(_)) && !left_out(experiment)
        })
        .map(|(experiment, _)| experiment.name())
        .collect();
    failed.extend(report.missing);
    if !failed.is_empty() {
        bail!("the report was written, but these could not be run: {failed:?}");
    }
    Ok(())
}

/// What makes a record another one, beside the experiment and its weights.
fn inputs(options: &Options, sets: &[DataSet]) -> Vec<String> {
    let logs = sets.iter().flat_map(|set| &set.trajectories);
    let mut parts: Vec<String> = logs.map(Trajectory::fingerprint).collect();
    parts.push(format!(
        "{} {} {} {}",
        options.density, options.resamples, options.quick, options.computing.backend
    ));
    parts
}

/// A run on its way.
struct Run<'a> {
    sets: &'a [DataSet],
    settings: Settings<'a>,
    /// Why the learned baselines are left out, where they are.
    without_baselines: Option<&'a str>,
    store: Store,
    outcomes: Vec<(Experiment, Outcome)>,
    clock: Clock,
}

impl Run<'_> {
    /// Runs an experiment, or takes up what an earlier run found. One that cannot run does not stop the others.
    fn experiment(&mut self, experiment: &Experiment) -> Result<()> {
        let name = experiment.name();
        self.clock.begin(&name);
        let outcome = self.outcome(experiment)?;
        let work = experiment.work(self.settings.effort, self.sets.len());
        self.clock.end(&name, work, &outcome);
        self.outcomes.push((*experiment, outcome));
        Ok(())
    }

    fn outcome(&self, experiment: &Experiment) -> Result<Outcome> {
        let learned = matches!(experiment.subject, Subject::Learned(_));
        if let Some(reason) = self.without_baselines.filter(|_| learned) {
            return Ok(Outcome::NotRun(reason.into()));
        }
        let model = match experiment.network().load() {
            Ok(model) => model,
            // The outermost words name the command that helps, without the path that was tried.
            Err(error) => return Ok(Outcome::NotRun(error.to_string())),
        };
        let weights = self.weights(experiment, &model)?;
        if let Some(found) = self.store.take_up(experiment, &weights)? {
            return Ok(Outcome::Found(Box::new(found)));
        }
        let tick = |units| self.clock.tick(units);
        match measure::run(experiment, &model, self.sets, &self.settings, &tick) {
            Ok(found) => {
                self.store.keep(experiment, &weights, &found)?;
                Ok(Outcome::Found(Box::new(found)))
            }
            Err(error) => Ok(Outcome::NotRun(format!("{error:#}"))),
        }
    }

    /// The bytes of all weights that an experiment uses, as far as they are there.
    fn weights(&self, experiment: &Experiment, model: &Model) -> Result<Vec<u8>> {
        let mut bytes = model.to_bytes(Precision::F32, &[])?;
        if let (Subject::Learned(kind), Weights::Study) =
            (experiment.subject, self.settings.learned)
        {
            let files = crate::learned::Baseline::ALL.map(|b| b.weights(kind, experiment.seed));
            let files = files.iter().filter_map(|file| std::fs::read(file).ok());
            bytes.extend(files.flatten());
        }
        Ok(bytes)
    }

    /// Seconds of training the shipped network, or none in a quick run.
    fn training_seconds(&self) -> Result<Option<f64>> {
        if self.settings.effort == Effort::Quick {
            return Ok(None);
        }
        self.clock.say("time of a training step");
        cost::training_seconds(self.sets, self.settings.computing.threads).map(Some)
    }

    /// The figures that could be drawn, and the names of those that could not with the reason.
    fn figures(&self, findings: &Findings) -> (Vec<figures::Figure>, Vec<String>) {
        let (mut drawn, mut missing) = (Vec::new(), Vec::new());
        let mut take = |name: &str, result: Result<Vec<figures::Figure>>| match result {
            Ok(figures) => drawn.extend(figures),
            Err(error) => missing.push(format!("figure {name}: {error:#}")),
        };
        let panels = report::roc_panels(findings);
        if !panels.is_empty() {
            let roc = figures::roc(&panels).map(|mut figure| {
                figure.caption += report::ROC_CAPTION;
                vec![figure]
            });
            take("roc", roc);
        }
        match self.figure_models() {
            Ok((kitti, oxford, sets)) => {
                let input = figures::FigureInput {
                    sets: &sets,
                    kitti: &kitti,
                    oxford: oxford.as_ref(),
                    density: self.settings.density,
                    seed: 0,
                    computing: self.settings.computing,
                    max_windows: match self.settings.effort {
                        Effort::Quick => 60,
                        Effort::Whole => FIGURE_WINDOWS,
                    },
                };
                take("epsilon", figures::epsilon(&input));
                take(
                    "trajectories",
                    figures::trajectories(&input).map(|f| vec![f]),
                );
                take(
                    "reverse",
                    figures::reverse_diffusion(&input).map(|f| vec![f]),
                );
            }
            Err(error) => take("networks", Err(error)),
        }
        (drawn, missing)
    }

    fn figure_models(&self) -> Result<(Model, Option<Model>, Vec<DataSet>)> {
        let kitti = networks::KITTI.load()?;
        let oxford = networks::ROBOTCAR_1500.load().ok();
        let (sets, _) = prepare(self.sets, &kitti, usize::MAX, Change::None)?;
        Ok((kitti, oxford, sets))
    }
}
