//! The joint network ([`dose3_model::joint`]) as a static CPU plan.
//!
//! Sequences are worked on one by one, because all of one fits a core's cache: 128 steps of 48 channels are 25 kB. A
//! dilated convolution is three products on rows that lie `dilation` apart, with zero rows around the sequence; the
//! modulation, its SiLU and the sum after it are one pass each. A forward pass allocates nothing once its sizes are
//! known, and no result depends on the number of threads.

mod backward;
mod conditions;
mod forward;
mod plan;
mod space;

use dose3_model::joint::{CONDITIONS, JOINT_AXES};
use dose3_model::joint::{JointConfig, JointInput, JointNoiseModel, JointParameters};
use dose3_model::{LossGradient, ModelError, check_count, check_values};

use crate::EngineOptions;
use crate::simd::{Instructions, Isa};
use crate::workers::{self, Kept, Pieces, Workers};
use backward::Backward;
use conditions::Conditions;
use forward::Forward;
use plan::{Plan, Weights};
use space::Space;

/// Chunks whose gradients are added up before they join the others'. It fixes the order of summation, so it may not
/// depend on the threads.
const CHUNKS: usize = 8;

/// A joint network on the CPU. It has no threads of its own but works in rayon's current pool.
pub struct JointEngine {
    plan: Plan,
    isa: Isa,
    workers: Workers,
    values: Vec<f32>,
    weights: Weights,
    conditions: Conditions,
    spaces: Kept<Space>,
    /// `[chunks, parameters]`
    gradients: Vec<f32>,
}

impl JointEngine {
    /// Builds the network with its parameters.
    ///
    /// # Errors
    /// A configuration or parameters that are not valid, or instructions that this machine does not have.
    pub fn new(parameters: &JointParameters, options: EngineOptions) -> Result<Self, ModelError> {
        parameters.config.validate()?;
        let isa = options.isa()?;
        let plan = Plan::new(&parameters.config);
        let mut engine = Self {
            weights: Weights::new(&plan),
            conditions: Conditions::default(),
            plan,
            isa,
            workers: Workers::new(options.threads),
            values: Vec::new(),
            spaces: Kept::new(),
            gradients: Vec::new(),
        };
        engine.set_parameters(&parameters.values)?;
        Ok(engine)
    }

    /// The vector instructions in use.
    pub fn instructions(&self) -> Instructions {
        self.isa.set()
    }

    /// Floating-point operations of the matrix products of a forward pass, per sequence of `length`: a
    /// multiplication and an addition each. A backward pass has about twice as many.
    pub fn flops(&self, length: usize) -> u64 {
        self.plan.flops(length)
    }

    fn forward_pass(&self) -> Forward<'_> {
        Forward {
            isa: self.isa,
            plan: &self.plan,
            values: &self.values,
            weights: &self.weights,
        }
    }
}

impl JointNoiseModel for JointEngine {
    fn config(&self) -> &JointConfig {
        &self.plan.config
    }

    fn set_parameters(&mut self, values: &[f32]) -> Result<(), ModelError> {
        check_values(&self.plan.layout, values)?;
        self.values.clear();
        self.values.extend_from_slice(values);
        self.weights.pack(&self.plan, values);
        self.conditions.clear();
        Ok(())
    }

    fn forward(&mut self, input: JointInput<'_>, output: &mut [f32]) -> Result<(), ModelError> {
        input.check()?;
        input.check_output(output)?;
        self.conditions
            .look_up(&self.plan, &self.values, input.conditions);
        let size = input.length * JOINT_AXES;
        let count = self.workers.count().min(input.batch);
        let mut spaces = self
            .spaces
            .take(false, count, || Space::new(&self.plan, false));
        let pieces = Pieces::new(input.batch, [(output, size)]);
        let pass = self.forward_pass();
        workers::run(&mut spaces[..count], &|space| {
            while let Some((index, [output])) = pieces.take() {
                space.size(&self.plan, input.length);
                let x = &input.x[index * size..][..size];
                pass.run(x, self.conditions.of(index), space, output);
            }
        });
        self.spaces.scoring = spaces;
        Ok(())
    }

    fn forward_backward(
        &mut self,
        input: JointInput<'_>,
        loss: &LossGradient<'_>,
        gradient: &mut [f32],
    ) -> Result<(), ModelError> {
        input.check()?;
        check_count(&self.plan.layout, "the gradient", gradient)?;
        let conditions = input.conditions;
        self.conditions.clear();
        self.conditions
            .look_up(&self.plan, &self.values, conditions);
        let parameters = self.plan.layout.len();
        let in_chunk = input.batch.div_ceil(CHUNKS);
        let chunks = input.batch.div_ceil(in_chunk);
        let count = self.workers.count().min(chunks);
        let mut spaces = self
            .spaces
            .take(true, count, || Space::new(&self.plan, true));
        let mut gradients = std::mem::take(&mut self.gradients);
        gradients.clear();
        gradients.resize(chunks * parameters, 0.0);
        let pieces = Pieces::new(chunks, [(&mut gradients[..], parameters)]);
        let size = input.length * JOINT_AXES;
        let pass = self.forward_pass();
        let backward = Backward { pass };
        workers::run(&mut spaces[..count], &|space| {
            while let Some((chunk, [gradient])) = pieces.take() {
                let first = chunk * in_chunk;
                for index in first..input.batch.min(first + in_chunk) {
                    space.size(&self.plan, input.length);
                    let x = &input.x[index * size..][..size];
                    let film = self.conditions.of(index);
                    let mut output = std::mem::take(&mut space.output);
                    pass.run(x, film, space, &mut output[..size]);
                    let mut upstream = std::mem::take(&mut space.upstream);
                    upstream[..size].fill(0.0);
                    loss(index, &output[..size], &mut upstream[..size]);
                    backward.run(film, &upstream[..size], space, gradient);
                    let own = &conditions[index * CONDITIONS..][..CONDITIONS];
                    conditions::backward(&self.plan, &self.values, own, &space.film, gradient);
                    (space.output, space.upstream) = (output, upstream);
                }
            }
        });
        self.spaces.training = spaces;
        let (first, others) = gradients.split_at_mut(parameters);
        for other in others.chunks_exact(parameters) {
            first.iter_mut().zip(other).for_each(|(sum, g)| *sum += g);
        }
        self.plan.unpack(first, gradient);
        self.gradients = gradients;
        Ok(())
    }
}
