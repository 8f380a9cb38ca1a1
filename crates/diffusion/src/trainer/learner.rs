//! A network with its optimiser, wherever both are.

use super::host::HostLearner;
use crate::error::Error;
use crate::loss::{LossConfig, SampleLoss};
use crate::probe::ModelPair;
use crate::process::Process;
use dose3_model::{Input, PairParameters, UNetConfig};

/// What is minimised.
#[derive(Clone, Copy)]
pub struct Objective<'a> {
    /// The process that noised the windows.
    pub process: &'a Process,
    /// Weights of the loss.
    pub loss: &'a LossConfig,
}

/// What a step of one branch is made on.
#[derive(Clone, Copy)]
pub struct BranchBatch<'a> {
    /// Noised windows.
    pub input: Input<'a>,
    /// Diffusion step of each window.
    pub steps: &'a [usize],
    /// The noise: `[batch, length, 3]`.
    pub noise: &'a [f32],
    /// Whose noise it is.
    pub target: Target<'a>,
}

/// A branch.
#[derive(Clone, Copy)]
pub enum Target<'a> {
    /// Translations.
    Translation,
    /// Rotations.
    Rotation {
        /// Rotations before they were noised: `[batch, length, 9]`.
        clean: &'a [f32],
    },
}

impl BranchBatch<'_> {
    /// The loss of one sample, and its gradient divided by the batch: `out` and `gradient` are `[length, 3]`.
    pub(crate) fn loss(
        &self,
        objective: &Objective<'_>,
        sample: usize,
        out: &[f32],
        gradient: &mut [f32],
    ) -> SampleLoss {
        let Objective { process, loss } = *objective;
        let length = self.input.length;
        let noise = &self.noise[sample * length * 3..][..length * 3];
        let t = self.steps[sample];
        let loss = match self.target {
            Target::Translation => process.translation_loss(loss, t, out, noise, gradient),
            Target::Rotation { clean } => {
                let rows = sample * length * 9..(sample + 1) * length * 9;
                let (noised, clean) = (&self.input.x[rows.clone()], &clean[rows]);
                process.rotation_loss(loss, t, out, noise, noised, clean, gradient)
            }
        };
        let samples = self.input.batch as f32;
        gradient.iter_mut().for_each(|v| *v /= samples);
        loss
    }
}

/// How far a step goes.
#[derive(Clone, Copy, Debug)]
pub struct Rates {
    /// Learning rate.
    pub learning_rate: f64,
    /// Decay of the averaged weights.
    pub ema_decay: f64,
}

/// Sums over steps, of which the log's means are made.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Losses {
    /// Steps.
    pub steps: usize,
    /// Of the mean loss on the noise.
    pub eps: f64,
    /// Of the mean loss on the clean window.
    pub x0: f64,
    /// Of the gradient's norm before clipping.
    pub gradient: f64,
}

/// Everything that a step changes; all of the parameters' length, in layout order.
#[derive(Clone, Debug, PartialEq)]
pub struct LearnerState {
    /// Parameters.
    pub values: Vec<f32>,
    /// Adam's first moment.
    pub m: Vec<f32>,
    /// Adam's second moment.
    pub v: Vec<f32>,
    /// Averaged weights.
    pub ema: Vec<f32>,
}

/// One network with its optimiser.
pub trait Learner: Send {
    /// The network.
    fn network(&self) -> &UNetConfig;

    /// Forward, loss, backward, Adam. Where `tell` is set it answers with the losses since it answered last; it may
    /// do so at any other step, if they are at hand.
    ///
    /// # Errors
    /// A network's refusal, or a failing backend.
    fn step(
        &mut self,
        objective: &Objective<'_>,
        batch: &BranchBatch<'_>,
        rates: Rates,
        tell: bool,
    ) -> Result<Option<Losses>, Error>;

    /// Estimates with the averaged weights: fills `output`, `[batch, length, 3]`.
    ///
    /// # Errors
    /// As [`Self::step`].
    fn forward_averaged(&mut self, input: Input<'_>, output: &mut [f32]) -> Result<(), Error>;

    /// The averaged weights.
    ///
    /// # Errors
    /// A failing backend.
    fn averaged(&self) -> Result<Vec<f32>, Error>;

    /// A copy of everything.
    ///
    /// # Errors
    /// A failing backend.
    fn state(&self) -> Result<LearnerState, Error>;

    /// Goes on from a state after so many steps.
    ///
    /// # Errors
    /// A state of another network, or a failing backend.
    fn restore(&mut self, step: u64, state: &LearnerState) -> Result<(), Error>;
}

/// Both networks of a run.
pub struct LearnerPair {
    /// The translation branch.
    pub translation: Box<dyn Learner>,
    /// The rotation branch.
    pub rotation: Box<dyn Learner>,
}

impl LearnerPair {
    /// Networks that compute where `models` do, which must have the shape of `initial`; the optimiser, with gradients
    /// clipped to a norm of `clip`, is on the host.
    pub fn on_host(models: ModelPair, initial: PairParameters, clip: f64) -> Self {
        let one = |model, values| Box::new(HostLearner::new(model, values, clip));
        Self {
            translation: one(models.translation, initial.translation.values),
            rotation: one(models.rotation, initial.rotation.values),
        }
    }

    /// Networks with their optimiser on a device of burn.
    ///
    /// # Errors
    /// Parameters that do not fit their configuration, or a backend that is not available.
    #[cfg(feature = "burn")]
    pub fn on_device(
        backend: dose3_model::burn_unet::Backend,
        initial: &PairParameters,
        clip: f64,
    ) -> Result<Self, Error> {
        use crate::device::DeviceLearner;
        let one = |parameters| -> Result<Box<dyn Learner>, Error> {
            Ok(Box::new(DeviceLearner::new(parameters, clip, backend)?))
        };
        Ok(Self {
            translation: one(&initial.translation)?,
            rotation: one(&initial.rotation)?,
        })
    }
}
