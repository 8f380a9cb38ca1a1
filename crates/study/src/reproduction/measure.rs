//! One experiment: windows, numbers, densities, cells.

use super::experiment::{Change, Effort, Experiment, Subject};
use super::record::{
    Cost, Curve, NetworkRecord, Record, RowRecord, SetRecord, SplitRecord, TrainingCost,
};
use crate::cells::{Ranking, cells};
use crate::learned::{self, Weights};
use crate::numbers::evenly;
use crate::passes::{PassSettings, passes};
use crate::rows::{Row, Statistics};
use crate::sets::{DataSet, kitti_held_out};
use crate::split::Split;
use anyhow::{Context, Result, bail};
use dose3::Model;
use dose3::backend::Computing;
use dose3::model_file::LogRecord;
use dose3_datasets::{Kind, Representation, Scaling, Trajectory, at_rate};
use dose3_lie::Rotation;
use dose3_model::PairParameters;
use dose3_ood::DensityConfig;
use dose3_ood::metrics::{Bootstrap, roc};
use std::time::Instant;

/// Most points of a stored ROC curve.
const CURVE: usize = 200;

/// What all experiments of a run share.
pub struct Settings<'a> {
    /// Density of rows without one of their own.
    pub density: &'a DensityConfig,
    /// Bootstrap resamples of detailed experiments; the others take a tenth.
    pub resamples: usize,
    /// How much is measured.
    pub effort: Effort,
    /// Where.
    pub computing: Computing,
    /// Which weights learned baselines have.
    pub learned: Weights,
}

impl Settings<'_> {
    fn bootstrap(&self, experiment: &Experiment) -> Bootstrap {
        let whole = experiment.detailed
            && self.effort == Effort::Whole
            && !matches!(experiment.subject, Subject::Learned(_));
        let resamples = match whole {
            true => self.resamples,
            false => self.resamples.div_ceil(10),
        };
        Bootstrap {
            resamples,
            seed: experiment.seed,
            ..Bootstrap::default()
        }
    }
}

/// The sets cut into windows of a model's length, at its rate where it has one, with their strides.
///
/// # Errors
/// A log that cannot be resampled.
pub fn prepare(
    sets: &[DataSet],
    model: &Model,
    most: usize,
    change: Change,
) -> Result<(Vec<DataSet>, Vec<usize>)> {
    let header = &model.header;
    let kind = header.representation.kind;
    let mut held_out: Vec<String> = sets
        .iter()
        .filter(|set| set.letter == 'K')
        .flat_map(|set| kitti_held_out(&set.trajectories))
        .collect();
    held_out.extend(header.training.validation.iter().map(|r| r.sha256.clone()));
    let trained = header.training.logs.iter().map(|r| r.sha256.clone());
    let trained: Vec<String> = trained.collect();
    let one = |set: &DataSet| {
        let mut set = set.clone();
        // Fingerprints are those of the logs as they were read.
        set.choose_test_logs(&held_out, &trained);
        let logs = std::mem::take(&mut set.trajectories);
        set.trajectories = logs
            .into_iter()
            .map(|log| match kind {
                Kind::Paper => Ok(log),
                Kind::Motion => at_rate(&log, header.rate),
            })
            .collect::<Result<_, _>>()?;
        if change == Change::DegreesTwice && set.letter == 'O' {
            set.trajectories.iter_mut().for_each(degrees_twice);
        }
        let stride = set.cut(kind.poses(header.window), most);
        anyhow::Ok((set, stride))
    };
    let prepared: Vec<(DataSet, usize)> = sets.iter().map(one).collect::<Result<_>>()?;
    Ok(prepared.into_iter().unzip())
}

/// Roll, pitch and yaw times pi / 180, although they are radians.
fn degrees_twice(log: &mut Trajectory) {
    for pose in &mut log.poses {
        let (roll, pitch, yaw) = pose.rotation.euler_angles();
        let again = f64::to_radians;
        pose.rotation = Rotation::from_euler_angles(again(roll), again(pitch), again(yaw));
    }
}

/// Numbers of all windows of one row, with what they cost.
struct Numbers {
    of_row: OfRow,
    cost: Cost,
}

enum OfRow {
    /// `[set][window][column]`, and the density where it is not that of the run.
    Statistics(Vec<Vec<Vec<f64>>>, Option<DensityConfig>),
    /// `[set][window]`.
    Scores(Vec<Vec<f64>>),
}

/// Runs an experiment; `tick` hears of the work done.
///
/// # Errors
/// A window that cannot be represented, a failing network, too few windows for a density.
pub fn run(
    experiment: &Experiment,
    model: &Model,
    sets: &[DataSet],
    settings: &Settings<'_>,
    tick: &dyn Fn(u64),
) -> Result<Record> {
    let start = Instant::now();
    let most = settings.effort.windows(experiment.view.most);
    let (sets, strides) = prepare(sets, model, most, experiment.view.change)?;
    let header = &model.header;
    let (network, numbers) = match experiment.subject {
        Subject::Learned(representation) => {
            (None, learned(experiment, representation, &sets, settings)?)
        }
        Subject::Trained(_) | Subject::Untrained(_) => {
            let mut model = model.clone();
            let config = model.parameters.config();
            if matches!(experiment.subject, Subject::Untrained(_)) {
                model.parameters = PairParameters::init(&config, experiment.seed)?;
            }
            let names = |logs: &[LogRecord]| logs.iter().map(|log| log.name.clone()).collect();
            let record = NetworkRecord {
                parameters: config.parameter_count(),
                window: header.window,
                steps: header.process.steps,
                visited: settings.effort.steps(header.process.steps),
                trained_on: names(&header.training.logs),
            };
            let numbers = statistics(experiment, &model, &sets, settings, tick)?;
            (Some(record), numbers)
        }
    };
    let mut rows = Vec::new();
    for (row, numbers) in experiment.rows.iter().zip(numbers) {
        let splits = experiment.splits.iter().map(|split| {
            split_record(experiment, &numbers.of_row, *split, &sets, settings)
                .with_context(|| format!("row {row:?} of {}", experiment.name()))
        });
        rows.push(RowRecord {
            splits: splits.collect::<Result<_>>()?,
            cost: numbers.cost,
        });
    }
    let sets = sets.iter().zip(strides);
    Ok(Record {
        network,
        sets: sets
            .map(|(set, stride)| SetRecord::new(set, stride))
            .collect(),
        rows,
        seconds: start.elapsed().as_secs_f64(),
    })
}

/// The rows of an experiment with a network.
fn statistics(
    experiment: &Experiment,
    model: &Model,
    sets: &[DataSet],
    settings: &Settings<'_>,
    tick: &dyn Fn(u64),
) -> Result<Vec<Numbers>> {
    let rows = experiment.statistics();
    let windows: usize = sets.iter().map(|set| set.windows.len()).sum();
    let pass_settings = PassSettings {
        steps: settings.effort.steps(model.header.process.steps),
        seed: experiment.seed,
        computing: settings.computing,
    };
    let mut numbers: Vec<Numbers> = rows.iter().map(unmeasured).collect::<Result<_>>()?;
    for pass in passes(&rows) {
        let begin = Instant::now();
        let work = pass.draws() * pass_settings.steps * model.header.window;
        for set in sets {
            let seen = seen(model, set, experiment.view.change)?;
            let tick = || {
                if pass.noise.is_some() {
                    tick(work as u64);
                }
            };
            for (row, found) in pass.run(&seen, set, &rows, &pass_settings, &tick)? {
                if let OfRow::Statistics(of_sets, _) = &mut numbers[row].of_row {
                    of_sets.push(found);
                }
            }
        }
        let seconds = begin.elapsed().as_secs_f64() / (windows * pass.draws()).max(1) as f64;
        let of_pass = rows.iter().zip(&mut numbers);
        for (row, numbers) in of_pass.filter(|(row, _)| pass.serves(row)) {
            let draws = row.noise.map_or(1, |noise| noise.draws);
            numbers.cost.milliseconds = 1e3 * seconds * draws as f64;
            if row.noise.is_some() {
                numbers.cost.parameters = model.parameters.config().parameter_count();
            }
        }
    }
    Ok(numbers)
}

fn unmeasured(row: &Statistics) -> Result<Numbers> {
    let density = row.density.map(str::parse).transpose()?;
    Ok(Numbers {
        of_row: OfRow::Statistics(Vec::new(), density),
        cost: Cost {
            parameters: 0,
            milliseconds: 0.0,
            training: None,
        },
    })
}

/// The model with the scale that it sees a set by.
fn seen(model: &Model, set: &DataSet, change: Change) -> Result<Model> {
    let mut model = model.clone();
    if change == Change::OwnScale {
        model.header.representation = Representation::fit(
            model.header.representation.kind,
            Scaling::PerDataset,
            &set.trajectories,
            &set.windows,
        )?;
    }
    Ok(model)
}

/// The rows of an experiment with learned baselines.
fn learned(
    experiment: &Experiment,
    representation: Kind,
    sets: &[DataSet],
    settings: &Settings<'_>,
) -> Result<Vec<Numbers>> {
    let windows: usize = sets.iter().map(|set| set.windows.len()).sum();
    let one = |row: &Row| {
        let Row::Learned(baseline) = row else {
            bail!("{row:?} is no learned baseline")
        };
        let found = learned::scores(
            *baseline,
            representation,
            experiment.seed,
            sets,
            settings.learned,
        )?;
        Ok(Numbers {
            cost: Cost {
                parameters: found.parameters,
                milliseconds: 1e3 * found.score_seconds / windows.max(1) as f64,
                training: Some(TrainingCost {
                    seconds: found.train_seconds,
                    outcome: found.outcome,
                }),
            },
            of_row: OfRow::Scores(found.scores),
        })
    };
    experiment.rows.iter().map(one).collect()
}

fn split_record(
    experiment: &Experiment,
    numbers: &OfRow,
    split: Split,
    sets: &[DataSet],
    settings: &Settings<'_>,
) -> Result<SplitRecord> {
    let ranking = match numbers {
        OfRow::Statistics(rows, density) => Ranking::Statistics {
            density: density.as_ref().unwrap_or(settings.density),
            rows,
        },
        OfRow::Scores(scores) => Ranking::Scores(scores),
    };
    let (mut found, mut curves) = (Vec::new(), Vec::new());
    let bootstrap = settings.bootstrap(experiment);
    cells(sets, &ranking, split, bootstrap, &mut |cell, id, ood| {
        if experiment.detailed && split == Split::HeldOut {
            curves.push(Curve {
                label: format!("{}/{}", cell.id, cell.ood),
                points: evenly(&roc(&id.scores, &ood.scores)?, CURVE),
            });
        }
        found.push(cell);
        Ok(())
    })?;
    Ok(SplitRecord {
        split,
        cells: found,
        curves,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_own_scale_of_a_set_is_the_largest_displacement_of_its_windows() {
        let model = dose3::built_in::paper().unwrap();
        let mut set = crate::sets::synthetic(0, 3).unwrap().remove(0);
        set.cut(128, 30);
        let stored = seen(&model, &set, Change::None).unwrap();
        assert_eq!(stored.header, model.header);
        let own = seen(&model, &set, Change::OwnScale).unwrap();
        let largest = |window: &dose3_datasets::Window| {
            let poses = window.poses(&set.trajectories).unwrap();
            let from_first = |p: &dose3_lie::Pose| (p.translation - poses[0].translation).amax();
            poses.iter().map(from_first).fold(0.0, f64::max)
        };
        let expected = set.windows.iter().map(largest).fold(0.0, f64::max);
        let scaling = own.header.representation.scaling;
        let Some((translation, _)) = scaling.stored() else {
            panic!("{scaling:?} has no stored scale")
        };
        assert_eq!(translation, [expected; 3]);
    }

    #[test]
    fn converting_radians_again_shrinks_every_angle() {
        let angles = (0.2, -0.1, 3.0_f64);
        let rotation = Rotation::from_euler_angles(angles.0, angles.1, angles.2);
        let mut log =
            dose3_datasets::synthetic::suite(dose3_datasets::synthetic::Platform::Vehicle, 1, 0)
                .remove(0);
        log.poses.truncate(1);
        log.poses[0].rotation = rotation;
        degrees_twice(&mut log);
        let (roll, pitch, yaw) = log.poses[0].rotation.euler_angles();
        for (found, was) in [(roll, angles.0), (pitch, angles.1), (yaw, angles.2)] {
            assert!((found - was * std::f64::consts::PI / 180.0).abs() < 1e-12);
        }
    }

    #[test]
    fn prepared_sets_have_few_windows_and_test_logs() {
        let sets = crate::sets::synthetic(0, 4).unwrap();
        let model = dose3::built_in::paper().unwrap();
        let (prepared, strides) = prepare(&sets, &model, 20, Change::None).unwrap();
        assert_eq!(prepared.len(), 3);
        for (set, stride) in prepared.iter().zip(strides) {
            assert!(set.windows.len() <= 20 && stride % crate::sets::STRIDE == 0);
            assert!(!set.test_logs.is_empty());
        }
    }
}
