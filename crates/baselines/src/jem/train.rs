use burn::module::Module;
use burn::tensor::{Tensor, TensorData};
use serde::{Deserialize, Serialize};

use super::JemConfig;
use super::classifier::{Classifier, cross_entropy, log_sum_exp};
use super::langevin::Langevin;
use crate::layers::{download, upload};
use crate::optimise::Optimiser;
use crate::random::{self, Stream};
use crate::source::{Source, device};
use crate::{Error, Progress, Sequences, Standardizer, store};

/// How training ended.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Outcome {
    /// All steps were done.
    Completed {
        /// How many.
        steps: usize,
    },
    /// Training was stopped; the weights are those of the last sound snapshot.
    Diverged {
        /// The step, from 0, that was not sound.
        step: usize,
        /// Steps that the kept weights were trained for; 0 for weights as drawn.
        snapshot: usize,
        /// What was seen.
        sign: Divergence,
    },
}

/// How a divergence shows.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Divergence {
    /// The loss, or a weight after the step, is NaN or infinite.
    NotFinite,
    /// The mean energies of windows and samples are too far apart.
    EnergyGap {
        /// Mean energy of the windows minus mean energy of the samples.
        gap: f64,
        /// The configured bound.
        bound: f64,
    },
}

/// What training showed, as means over the last tenth of the steps done (0 if none was).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TrainReport {
    /// How training ended.
    pub outcome: Outcome,
    /// Share of training windows (with noise) that were put into their class.
    pub accuracy: f64,
    /// Mean energy of the windows minus mean energy of the samples.
    pub energy_gap: f64,
}

/// Trains on `ln p(y|x) + ln p(x)`: cross-entropy plus the energy gap, whose gradient is that of
/// the negative log-likelihood (JEM, equations 6 and 8).
pub(super) fn train(
    data: Sequences<'_>,
    labels: &[usize],
    classes: usize,
    config: &JemConfig,
    seed: u64,
    progress: &mut dyn FnMut(Progress),
) -> Result<(Classifier, Standardizer, TrainReport), Error> {
    let standardizer = Standardizer::fit(&data)?;
    let shape = [config.batch, data.length, data.channels];
    let mut source = Source::drawn(random::generator(seed, Stream::Weights));
    let mut network = Classifier::new(&mut source, config, data.channels, classes)?.train();
    let mut langevin = Langevin::new(
        config,
        data.length,
        data.channels,
        random::generator(seed, Stream::Langevin),
    );
    let mut rng = random::generator(seed, Stream::Batches);
    let mut optimiser = Optimiser::new(config.learning_rate, config.steps);
    let mut snapshot = (0, network.clone());
    let mut history: Vec<[f64; 2]> = Vec::with_capacity(config.steps);
    let mut outcome = Outcome::Completed {
        steps: config.steps,
    };
    for step in 0..config.steps {
        let (indices, mut x) = random::batch(&data, &standardizer, config.batch, &mut rng);
        random::jitter(&mut x, config.noise, &mut rng);
        let of_batch: Vec<usize> = indices.iter().map(|&index| labels[index]).collect();
        let samples = langevin.sample(&network)?;

        let logits = network.forward(upload(x, shape)); // [batch, classes]
        let accuracy = hit_rate(&download(logits.clone())?, &of_batch);
        let fit = cross_entropy(logits.clone(), one_hot(&of_batch, classes));
        let of_samples = log_sum_exp(network.forward(upload(samples, shape)));
        let gap = (of_samples - log_sum_exp(logits)).mean(); // [1]
        let gap_value = f64::from(download(gap.clone())?[0]);
        let loss = fit + gap;
        let value = f64::from(download(loss.clone())?[0]);

        if let Some(sign) = divergence(value, gap_value, config.energy_gap_bound) {
            outcome = Outcome::Diverged {
                step,
                snapshot: snapshot.0,
                sign,
            };
            network = snapshot.1.clone();
            break;
        }
        // The loss just seen is finite, so the weights before this step are sound.
        if step.is_multiple_of(config.snapshot_every) {
            snapshot = (step, network.clone());
        }
        network = optimiser.step(step, network, &loss);
        history.push([accuracy, gap_value]);
        progress(Progress {
            stage: "jem",
            step: step + 1,
            steps: config.steps,
            loss: value,
        });
    }
    // The last step's weights have not been seen in a loss.
    if matches!(outcome, Outcome::Completed { .. }) && !store::is_finite(&network)? {
        outcome = Outcome::Diverged {
            step: config.steps,
            snapshot: snapshot.0,
            sign: Divergence::NotFinite,
        };
        network = snapshot.1.clone();
    }
    let last = &history[history.len() - history.len().div_ceil(10)..];
    let mean =
        |column: usize| last.iter().map(|row| row[column]).sum::<f64>() / last.len().max(1) as f64;
    let report = TrainReport {
        outcome,
        accuracy: mean(0),
        energy_gap: mean(1),
    };
    Ok((network.valid(), standardizer, report))
}

fn divergence(loss: f64, gap: f64, bound: f64) -> Option<Divergence> {
    if !(loss.is_finite() && gap.is_finite()) {
        Some(Divergence::NotFinite)
    } else if gap.abs() > bound {
        Some(Divergence::EnergyGap { gap, bound })
    } else {
        None
    }
}

fn one_hot(labels: &[usize], classes: usize) -> Tensor<2> {
    let mut values = vec![0.0_f32; labels.len() * classes];
    for (row, &label) in labels.iter().enumerate() {
        values[row * classes + label] = 1.0;
    }
    let data = TensorData::new(values, [labels.len(), classes]);
    Tensor::from_data(data, &device())
}

fn hit_rate(logits: &[f32], labels: &[usize]) -> f64 {
    let classes = logits.len() / labels.len();
    let hits = logits
        .chunks_exact(classes)
        .zip(labels)
        .filter(|(row, label)| row.iter().all(|logit| *logit <= row[**label]))
        .count();
    hits as f64 / labels.len() as f64
}
