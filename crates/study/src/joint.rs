//! What the joint network is trained on: the logs that train networks, at several rates, and synthetic platforms.

use crate::data::DataRoot;
use crate::roles::{Role, role};
use crate::sets;
use anyhow::{Context, Result};
use dose3::backend::Computing;
use dose3::joint::{JointHeader, JointModel, JointSetRecord, VERSION, steps};
use dose3::model_file::LogRecord;
use dose3_datasets::synthetic::{Platform, trajectory};
use dose3_datasets::{Trajectory, at_rate};
use dose3_diffusion::joint::{JointSet, JointTrainConfig, JointTrainRow};
use dose3_model::joint::{JointConfig, JointParameters};
use dose3_ood::statistics::axis_scale;

/// Rates of each real set, hertz, with how often each is drawn.
const RATES: [(char, &[(f64, f64)]); 3] = [
    ('O', &[(10.0, 0.25), (20.0, 0.05), (5.0, 0.05), (2.0, 0.02)]),
    ('K', &[(10.0, 0.18), (5.0, 0.05), (2.0, 0.02)]),
    ('I', &[(10.0, 0.15), (5.0, 0.03)]),
];
/// Synthetic logs: rate and share of each platform.
const SYNTHETIC: [(f64, f64); 2] = [(10.0, 0.05), (25.0, 0.02)];
const SYNTHETIC_LOGS: u64 = 12;
const SYNTHETIC_POSES: usize = 3000;

/// Sequences of a training, with what they were made from.
pub struct JointData {
    /// To train on.
    pub training: Vec<JointSet>,
    /// Of logs that choose settings.
    pub validation: Vec<JointSet>,
    /// What the former are.
    pub records: Vec<JointSetRecord>,
}

impl JointData {
    /// Reads and cuts everything; `synthetic` logs may be left out.
    ///
    /// # Errors
    /// Data that is missing or cannot be read.
    pub fn read(root: &DataRoot, longest: usize, synthetic: bool) -> Result<Self> {
        let mut data = Self {
            training: Vec::new(),
            validation: Vec::new(),
            records: Vec::new(),
        };
        let sets = sets::real(root)?;
        for (letter, rates) in RATES {
            let set = sets.iter().find(|set| set.letter == letter);
            let set =
                set.with_context(|| format!("data set {letter} is missing in {}", root.source))?;
            let of = |wanted: Role| -> Vec<&Trajectory> {
                let logs = set.trajectories.iter().enumerate();
                logs.filter(|(i, log)| role(letter, *i, &log.name) == wanted)
                    .map(|(_, log)| log)
                    .collect()
            };
            for &(rate, weight) in rates {
                let slow = |logs: Vec<&Trajectory>| -> Result<Vec<Trajectory>> {
                    let logs = logs.into_iter();
                    Ok(logs
                        .map(|log| at_rate(log, rate))
                        .collect::<Result<_, _>>()?)
                };
                let logs = slow(of(Role::Network))?;
                data.add(set.name, &logs, (rate, weight), longest)?;
                if rate == rates[0].0 {
                    let scale = data.training.last().map(|set| set.scale);
                    let held = slow(of(Role::Validation))?;
                    let held = joint_set(&held, rate, weight, scale)?;
                    data.validation.extend(long(held, longest));
                }
            }
        }
        for platform in Platform::ALL.into_iter().filter(|_| synthetic) {
            for (rate, weight) in SYNTHETIC {
                let log = |seed| trajectory(platform, 1000 + seed, SYNTHETIC_POSES, rate);
                let logs: Vec<Trajectory> = (0..SYNTHETIC_LOGS).map(log).collect();
                data.add(
                    &format!("synthetic {platform}"),
                    &logs,
                    (rate, weight),
                    longest,
                )?;
            }
        }
        Ok(data)
    }

    fn add(
        &mut self,
        name: &str,
        logs: &[Trajectory],
        (rate, weight): (f64, f64),
        longest: usize,
    ) -> Result<()> {
        let Some(set) = long(joint_set(logs, rate, weight, None)?, longest) else {
            return Ok(());
        };
        self.training.push(set);
        self.records.push(JointSetRecord {
            name: name.to_owned(),
            rate,
            weight,
            logs: logs.iter().map(LogRecord::from).collect(),
        });
        Ok(())
    }
}

fn joint_set(
    logs: &[Trajectory],
    rate: f64,
    weight: f64,
    scale: Option<[f64; 6]>,
) -> Result<JointSet> {
    let mut sequences = Vec::new();
    for log in logs {
        sequences.extend(steps(log)?);
    }
    Ok(JointSet {
        scale: scale.unwrap_or_else(|| axis_scale(&sequences)),
        sequences,
        step: 1.0 / rate,
        weight,
    })
}

/// The set, where it has a sequence as long as the longest that is drawn.
fn long(set: JointSet, longest: usize) -> Option<JointSet> {
    set.sequences
        .iter()
        .any(|s| s.len() >= longest)
        .then_some(set)
}

/// Steps from one validation to the next, and the sequences of each set that it takes.
const VALIDATED: (usize, usize) = (2000, 256);

/// Trains a joint network at the place `computing`; `heard` is told of every step, and from time to time of the error on the validation logs of
/// each set.
///
/// # Errors
/// A backend that cannot be had, settings out of range, divergence.
pub fn train(
    network: &JointConfig,
    config: &JointTrainConfig,
    data: JointData,
    computing: Computing,
    heard: &mut dyn FnMut(&JointTrainRow, Option<&[f64]>),
) -> Result<JointModel> {
    let mut trainer = computing.joint_trainer(config.clone(), network, &data.training)?;
    let (every, count) = VALIDATED;
    while trainer.step() < config.steps {
        let row = trainer.advance()?;
        if row.step.is_multiple_of(every) {
            let each = data.validation.chunks(1);
            let errors = each.map(|set| Ok(trainer.validate(set, count)?));
            heard(&row, Some(&errors.collect::<Result<Vec<_>>>()?));
        } else {
            heard(&row, None);
        }
    }
    let validation = match data.validation.is_empty() {
        true => None,
        false => Some(trainer.validate(&data.validation, 2 * count)?),
    };
    Ok(JointModel {
        parameters: trainer.averaged()?,
        header: JointHeader {
            format_version: VERSION,
            network: network.clone(),
            training: config.clone(),
            sets: data.records,
            validation,
            version: env!("CARGO_PKG_VERSION").to_owned(),
        },
    })
}

/// The same network before training: the control that every table needs.
///
/// # Errors
/// A network that cannot be.
pub fn untrained(network: &JointConfig, config: &JointTrainConfig) -> Result<JointModel> {
    Ok(JointModel {
        parameters: JointParameters::init(network, config.seed)?,
        header: JointHeader {
            format_version: VERSION,
            network: network.clone(),
            training: config.clone(),
            sets: Vec::new(),
            validation: None,
            version: env!("CARGO_PKG_VERSION").to_owned(),
        },
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use dose3::backend::Backend;

    /// Synthetic logs alone.
    fn data() -> JointData {
        let mut data = JointData {
            training: Vec::new(),
            validation: Vec::new(),
            records: Vec::new(),
        };
        let log = |seed| trajectory(Platform::Vehicle, seed, 200, 10.0);
        data.add("vehicles", &[log(1), log(2)], (10.0, 1.0), 32)
            .unwrap();
        let held = joint_set(&[log(3)], 10.0, 1.0, Some(data.training[0].scale)).unwrap();
        data.validation.push(held);
        data
    }

    fn trained(backend: Backend) -> (Vec<JointTrainRow>, JointModel) {
        let config = JointTrainConfig {
            steps: 4,
            batch: 4,
            lengths: vec![16, 32],
            ..JointTrainConfig::default()
        };
        let network = JointConfig::new(8, &[1, 2]);
        let computing = Computing {
            backend,
            threads: 1,
        };
        let mut rows = Vec::new();
        let model = train(&network, &config, data(), computing, &mut |row, _| {
            rows.push(*row);
        });
        (rows, model.unwrap())
    }

    #[test]
    fn burn_trains_the_network_of_the_engine() {
        let (rows, engine) = trained(Backend::Engine);
        let (other, burn) = trained(Backend::BurnFlex);
        assert_eq!((rows.len(), other.len()), (4, 4));
        assert!((rows[0].loss - other[0].loss).abs() < 1e-5 * rows[0].loss);
        let loss = |model: &JointModel| model.header.validation.unwrap();
        let (a, b) = (loss(&engine), loss(&burn));
        assert!((a - b).abs() < 1e-4 * a, "{a} {b}");
        assert_eq!(engine.header.sets, burn.header.sets);
        let initial = untrained(&engine.header.network, &engine.header.training).unwrap();
        let apart = |a: &JointModel, b: &JointModel| {
            let pairs = a.parameters.values.iter().zip(&b.parameters.values);
            pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f32::max)
        };
        let (off, way) = (apart(&engine, &burn), apart(&engine, &initial));
        assert!(way > 1e-3 && off < 0.1 * way, "{off} of {way}");
    }
}
