use burn::module::Module;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::flow::Flow;
use super::model::Header;
use super::{Glow, GlowConfig};
use crate::layers::{download, upload};
use crate::optimise::Optimiser;
use crate::random::{self, Stream};
use crate::source::Source;
use crate::{Error, Progress, Sequences, Standardizer, store};

/// The windows of the first batch, which also sets the actnorms.
const INITIAL_WINDOWS: usize = 256;

/// Which of the two models is trained.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Role {
    Foreground,
    Background,
}

impl Role {
    fn stage(self) -> &'static str {
        match self {
            Self::Foreground => "glow",
            Self::Background => "background",
        }
    }

    fn streams(self) -> [Stream; 2] {
        match self {
            Self::Foreground => [Stream::Weights, Stream::Batches],
            Self::Background => [Stream::BackgroundWeights, Stream::BackgroundBatches],
        }
    }
}

pub(super) fn train(
    data: Sequences<'_>,
    config: &GlowConfig,
    seed: u64,
    role: Role,
    progress: &mut dyn FnMut(Progress),
) -> Result<Glow, Error> {
    config.validate(data.length)?;
    let header = Header {
        config: config.clone(),
        length: data.length,
        channels: data.channels,
        standardizer: Standardizer::fit(&data)?,
    };
    let [weights, batches] = role.streams().map(|stream| random::generator(seed, stream));
    let mut batches = Batches {
        data,
        standardizer: &header.standardizer,
        config,
        role,
        rng: batches,
    };
    let mut flow = Flow::new(&mut Source::drawn(weights), config, data.channels)?;
    let shape = |windows| [windows, data.length, data.channels];
    let first = batches.draw(INITIAL_WINDOWS);
    flow.initialise(upload(first, shape(INITIAL_WINDOWS)))?;

    let mut flow = flow.train();
    let mut optimiser = Optimiser::new(config.learning_rate, config.steps);
    let stage = role.stage();
    for step in 0..config.steps {
        let x = upload(batches.draw(config.batch), shape(config.batch));
        let encoded = flow.forward(x)?;
        let per_dimension = -1.0 / data.dimension() as f64;
        let loss = (encoded.log_det + encoded.log_prior).mean() * per_dimension; // [1]
        let value = f64::from(download(loss.clone())?[0]);
        if !value.is_finite() {
            return Err(Error::Diverged { stage, step });
        }
        flow = optimiser.step(step, flow, &loss);
        progress(Progress {
            stage,
            step: step + 1,
            steps: config.steps,
            loss: value,
        });
    }
    let flow = flow.valid();
    if !store::is_finite(&flow)? {
        let step = config.steps;
        return Err(Error::Diverged { stage, step });
    }
    Ok(Glow { header, flow })
}

struct Batches<'a> {
    data: Sequences<'a>,
    standardizer: &'a Standardizer,
    config: &'a GlowConfig,
    role: Role,
    rng: ChaCha8Rng,
}

impl Batches<'_> {
    /// Standardised, for the background perturbed, with the dequantisation noise.
    fn draw(&mut self, windows: usize) -> Vec<f32> {
        let (_, mut values) = random::batch(&self.data, self.standardizer, windows, &mut self.rng);
        if self.role == Role::Background {
            self.mutate(&mut values);
        }
        random::jitter(&mut values, self.config.noise, &mut self.rng);
        values
    }

    /// Replaces poses by poses of the training windows, whichever window and place they are from.
    fn mutate(&mut self, values: &mut [f32]) {
        let channels = self.data.channels;
        let poses = self.data.data.len() / channels;
        let mut other = Vec::with_capacity(channels);
        for pose in values.chunks_exact_mut(channels) {
            if self.rng.random::<f64>() < self.config.mutation_rate {
                let from = self.rng.random_range(0..poses) * channels;
                other.clear();
                self.standardizer
                    .extend(&mut other, &self.data.data[from..from + channels]);
                pose.copy_from_slice(&other);
            }
        }
    }
}
