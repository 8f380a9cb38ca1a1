use burn::module::Module;
use burn::tensor::Tensor;

use super::GlowConfig;
use super::actnorm::ActNorm;
use super::coupling::Coupling;
use super::mixing::Mixing;
use super::split::{Split, standard_normal};
use crate::Error;
use crate::layers::{squeeze, unsqueeze};
use crate::source::Source;

/// The whole flow: levels of squeeze, steps and split (Glow, figure 2b).
#[derive(Module, Debug)]
pub(super) struct Flow {
    levels: Vec<Level>,
}

#[derive(Module, Debug)]
struct Level {
    steps: Vec<Step>,
    split: Option<Split>,
}

/// One step of flow (Glow, figure 2a).
#[derive(Module, Debug)]
struct Step {
    actnorm: ActNorm,
    mixing: Mixing,
    coupling: Coupling,
}

/// A batch on the far side of the flow.
pub(super) struct Encoded {
    /// What each level's split took out, the rest last: `[batch, length / 2^i, channels_i]`.
    pub(super) latents: Vec<Tensor<3>>,
    /// `ln |det dz/dx|`, `[batch]`.
    pub(super) log_det: Tensor<1>,
    /// Log-density of the latents, `[batch]`.
    pub(super) log_prior: Tensor<1>,
}

impl Flow {
    /// A flow over windows of `channels` numbers per pose.
    pub(super) fn new(
        source: &mut Source,
        config: &GlowConfig,
        channels: usize,
    ) -> Result<Self, Error> {
        let mut levels = Vec::with_capacity(config.levels);
        let mut channels = channels;
        for i in 0..config.levels {
            channels *= 2; // by the squeeze
            let name = format!("levels.{i}");
            let steps = (0..config.steps_per_level)
                .map(|j| {
                    Step::new(
                        source,
                        &format!("{name}.steps.{j}"),
                        channels,
                        config.hidden,
                    )
                })
                .collect::<Result<_, _>>()?;
            let last = i + 1 == config.levels;
            let split = (!last)
                .then(|| Split::new(source, &format!("{name}.split"), channels))
                .transpose()?;
            if !last {
                channels /= 2; // by the split
            }
            levels.push(Level { steps, split });
        }
        Ok(Self { levels })
    }

    /// Sets every actnorm on the way of `x`, a batch on a device without autodiff.
    pub(super) fn initialise(&mut self, x: Tensor<3>) -> Result<(), Error> {
        let mut x = x;
        for level in &mut self.levels {
            x = squeeze(x);
            for step in &mut level.steps {
                step.actnorm.initialise(x.clone())?;
                x = step.forward(x)?.0;
            }
            if let Some(split) = &level.split {
                [x, _] = split.forward(x).0;
            }
        }
        Ok(())
    }

    /// `[batch, length, channels]`; the length is a multiple of `2^levels`.
    pub(super) fn forward(&self, x: Tensor<3>) -> Result<Encoded, Error> {
        let batch = x.dims()[0];
        let mut log_det = Tensor::zeros([batch], &x.device());
        let mut log_prior = Tensor::zeros([batch], &x.device());
        let mut latents = Vec::with_capacity(self.levels.len());
        let mut x = x;
        for level in &self.levels {
            x = squeeze(x); // [batch, length / 2, 2 * channels]
            for step in &level.steps {
                let (y, of_step) = step.forward(x)?;
                x = y;
                log_det = log_det + of_step;
            }
            if let Some(split) = &level.split {
                let ([kept, out], log_density) = split.forward(x);
                x = kept; // [batch, length / 2, channels]
                latents.push(out);
                log_prior = log_prior + log_density;
            }
        }
        log_prior = log_prior + standard_normal(x.clone());
        latents.push(x);
        Ok(Encoded {
            latents,
            log_det,
            log_prior,
        })
    }

    /// From the latents back to `[batch, length, channels]`.
    pub(super) fn inverse(&self, latents: Vec<Tensor<3>>) -> Result<Tensor<3>, Error> {
        let mut latents = latents.into_iter().rev();
        let mut below: Option<Tensor<3>> = None;
        for (level, latent) in self.levels.iter().rev().zip(&mut latents) {
            let mut x = match below {
                Some(kept) => Tensor::cat(vec![kept, latent], 2),
                None => latent,
            };
            for step in level.steps.iter().rev() {
                x = step.inverse(x)?;
            }
            below = Some(unsqueeze(x));
        }
        below.ok_or_else(|| Error::Config("a flow needs a level".to_owned()))
    }
}

impl Step {
    fn new(source: &mut Source, name: &str, channels: usize, hidden: usize) -> Result<Self, Error> {
        Ok(Self {
            actnorm: ActNorm::new(source, &format!("{name}.actnorm"), channels)?,
            mixing: Mixing::new(source, &format!("{name}.mixing"), channels)?,
            coupling: Coupling::new(source, &format!("{name}.coupling"), channels, hidden)?,
        })
    }

    /// `x` one step on, and the log-determinant, `[batch]`.
    fn forward(&self, x: Tensor<3>) -> Result<(Tensor<3>, Tensor<1>), Error> {
        let (x, by_actnorm) = self.actnorm.forward(x);
        let (x, by_mixing) = self.mixing.forward(x)?;
        let (x, by_coupling) = self.coupling.forward(x);
        Ok((x, by_coupling + by_actnorm + by_mixing))
    }

    fn inverse(&self, y: Tensor<3>) -> Result<Tensor<3>, Error> {
        let x = self.coupling.inverse(y);
        Ok(self.actnorm.inverse(self.mixing.inverse(x)?))
    }
}
