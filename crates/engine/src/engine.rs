use std::sync::atomic::{AtomicBool, Ordering};

use dose3_model::{
    Input, LossGradient, ModelError, NoiseModel, Parameters, UNetConfig, check_count, check_values,
};

use crate::forward::{Chunk, Network};
use crate::gradient::SharedGradient;
use crate::ops::Op;
use crate::plan::Plan;
use crate::simd::{Instructions, Isa};
use crate::time::TimeTable;
use crate::training::Training;
use crate::weights::{Weights, unpack_gradient};
use crate::workers::{self, Kept, Pieces, Workers};
use crate::workspace::Workspace;

/// Settings of an [`Engine`]; none of them but `instructions` changes a single bit of its results.
#[derive(Clone, Debug, Default)]
pub struct EngineOptions {
    /// How many threads of rayon's current pool may work at once; 0 for all of them. With 1 the
    /// engine works on the caller's thread and needs no pool.
    pub threads: usize,
    /// Vector instructions; the widest that the machine has if not given.
    pub instructions: Option<Instructions>,
}

impl EngineOptions {
    pub(crate) fn isa(&self) -> Result<Isa, ModelError> {
        let set = self.instructions.unwrap_or_else(Instructions::detect);
        Isa::new(set).ok_or_else(|| ModelError::Backend {
            backend: format!("engine with {set:?} instructions"),
            reason: "this machine does not have them".to_owned(),
        })
    }
}

/// One UNet on the CPU: packed weights, and buffers for every worker.
///
/// It has no threads of its own but works in rayon's current pool (`ThreadPool::install` makes
/// one current; otherwise that is the global pool), which any number of engines may share.
pub struct Engine {
    plan: Plan,
    isa: Isa,
    workers: Workers,
    values: Vec<f32>,
    weights: Weights,
    /// Whether the backward matrices belong to `values`.
    backward_ready: bool,
    time: TimeTable,
    workspaces: Kept<Workspace>,
    gradients: Vec<SharedGradient>,
    /// Gradient at every sample's scales and shifts.
    time_gradient: Vec<f32>,
}

impl Engine {
    /// Builds the network with its parameters.
    ///
    /// # Errors
    /// A configuration or parameters that are not valid, or instructions that this machine does
    /// not have.
    pub fn new(parameters: &Parameters, options: EngineOptions) -> Result<Self, ModelError> {
        parameters.config.validate()?;
        let isa = options.isa()?;
        let plan = Plan::new(&parameters.config);
        let mut engine = Self {
            workspaces: Kept::new(),
            weights: Weights::new(&plan),
            plan,
            isa,
            workers: Workers::new(options.threads),
            values: Vec::new(),
            backward_ready: false,
            time: TimeTable::default(),
            gradients: Vec::new(),
            time_gradient: Vec::new(),
        };
        engine.set_parameters(&parameters.values)?;
        Ok(engine)
    }

    /// The vector instructions in use.
    pub fn instructions(&self) -> Instructions {
        self.isa.set()
    }

    /// Floating-point operations of the matrix products of a forward pass, per window of
    /// `length`: a multiplication and an addition each. A backward pass has about twice as many.
    pub fn flops(&self, length: usize) -> u64 {
        self.plan.flops(length)
    }

    fn network(&self, length: usize) -> Network<'_> {
        Network {
            isa: self.isa,
            plan: &self.plan,
            values: &self.values,
            forward: &self.weights.forward,
            backward: &self.weights.backward,
            time: self.time.table(),
            length,
        }
    }

    fn look_up(&mut self, steps: &[f32]) {
        let (plan, packed) = (&self.plan, &self.weights.forward);
        self.time
            .look_up(self.isa, plan, &self.values, packed, steps);
    }

    /// Makes ready what only a backward pass needs.
    fn prepare_backward(&mut self, batch: usize) {
        if !self.backward_ready {
            self.weights
                .pack_backward(self.workers, self.isa, &self.plan, &self.values);
            self.backward_ready = true;
        }
        if self.gradients.is_empty() {
            self.gradients = self.plan.maps.iter().map(SharedGradient::new).collect();
        }
        self.gradients.iter_mut().for_each(SharedGradient::restart);
        self.time_gradient.clear();
        self.time_gradient
            .resize(batch * self.plan.time.columns, 0.0);
    }

    /// Collects the flat gradient from those of the maps.
    fn collect(&mut self, gradient: &mut [f32]) {
        let Self {
            plan,
            values,
            gradients,
            workers,
            isa,
            ..
        } = self;
        let mut sums: Vec<_> = gradients.iter_mut().map(SharedGradient::get).collect();
        // The heads of an attention share a weight, whose gain lies before it.
        let mut tasks = Vec::new();
        let (mut rest, mut at) = (&mut *gradient, 0);
        for group in plan.maps_by_weight() {
            let map = &plan.maps[group[0]];
            let first = map.gain.unwrap_or(map.weight);
            let end = map.weight + map.weight_len;
            let (_, after) = rest.split_at_mut(first - at);
            let (own, after) = after.split_at_mut(end - first);
            tasks.push((group, first, own));
            (rest, at) = (after, end);
        }
        let shared: &[_] = &sums;
        workers.for_each(tasks, |(group, base, flat)| {
            if let Some(gain) = plan.maps[group[0]].gain {
                flat[gain - base..][..plan.maps[group[0]].inputs].fill(0.0);
            }
            for &id in group {
                unpack_gradient(
                    *isa,
                    &plan.maps[id],
                    values,
                    &shared[id].matrices,
                    base,
                    flat,
                );
            }
        });
        for (map, sum) in plan.maps.iter().zip(&mut sums) {
            if let Some(at) = map.bias {
                gradient[at..at + map.outputs].copy_from_slice(&sum.bias);
            }
        }
        for op in &plan.ops {
            let Op::Block(block) = op else { continue };
            for (conv, norm) in [(block.conv1, block.norm1), (block.conv2, block.norm2)] {
                let (gain, offset) = (&sums[conv].gain, &sums[conv].offset);
                gradient[norm.gain..norm.gain + gain.len()].copy_from_slice(gain);
                gradient[norm.offset..norm.offset + offset.len()].copy_from_slice(offset);
            }
        }
    }
}

/// Parameters that are copied together.
const BLOCK: usize = 1 << 16;

/// Most windows that a worker takes at once when scoring.
const SCORED: usize = 16;

/// Windows whose gradients are added up before they join the others'. It fixes the order of
/// summation, so it may not depend on the threads.
fn training_chunk(batch: usize) -> usize {
    (batch / 8).clamp(1, 8)
}

impl NoiseModel for Engine {
    fn config(&self) -> &UNetConfig {
        &self.plan.config
    }

    fn set_parameters(&mut self, values: &[f32]) -> Result<(), ModelError> {
        check_count(&self.plan.layout, "the parameter vector", values)?;
        let finite = AtomicBool::new(true);
        self.workers
            .for_each(values.chunks(BLOCK).collect(), |block| {
                if !block
                    .iter()
                    .fold(true, |all, value| all & value.is_finite())
                {
                    finite.store(false, Ordering::Relaxed);
                }
            });
        if !finite.into_inner() {
            // Says which.
            return check_values(&self.plan.layout, values);
        }
        self.values.resize(values.len(), 0.0);
        let blocks = self.values.chunks_mut(BLOCK).zip(values.chunks(BLOCK));
        let copy = |(own, new): (&mut [f32], &[f32])| own.copy_from_slice(new);
        self.workers.for_each(blocks.collect(), copy);
        self.weights
            .pack_forward(self.workers, self.isa, &self.plan, &self.values);
        self.backward_ready = false;
        self.time.clear();
        Ok(())
    }

    fn forward(&mut self, input: Input<'_>, output: &mut [f32]) -> Result<(), ModelError> {
        input.check(&self.plan.config)?;
        input.check_output(&self.plan.config, output)?;
        self.look_up(input.steps);
        // A window's result does not depend on its chunk, so threads may decide its size.
        let chunk = input
            .batch
            .div_ceil(2 * self.workers.count())
            .clamp(1, SCORED);
        let sample = input.length * self.plan.config.in_channels;
        let size = chunk * input.length * self.plan.config.out_channels;
        let pieces = Pieces::new(input.batch.div_ceil(chunk), [(output, size)]);
        let count = self.workers.count();
        let mut workspaces = self
            .workspaces
            .take(false, count, || Workspace::new(&self.plan, false));
        let network = self.network(input.length);
        workers::run(&mut workspaces[..count], &|ws| {
            while let Some((index, [output])) = pieces.take() {
                let first = index * chunk;
                let steps = &self.time.steps()[first..input.batch.min(first + chunk)];
                ws.size(&self.plan, input.length, chunk);
                let x = &input.x[first * sample..];
                network.forward(Chunk { x, steps }, ws);
                network.copy_output(steps.len(), ws, output);
            }
        });
        self.workspaces.scoring = workspaces;
        Ok(())
    }

    fn forward_backward(
        &mut self,
        input: Input<'_>,
        loss: &LossGradient<'_>,
        gradient: &mut [f32],
    ) -> Result<(), ModelError> {
        input.check(&self.plan.config)?;
        check_count(&self.plan.layout, "the gradient", gradient)?;
        // The order of the steps is an order of summation: it may not depend on earlier calls.
        self.time.clear();
        self.look_up(input.steps);
        self.prepare_backward(input.batch);
        let size = training_chunk(input.batch);
        let mut time_gradient = std::mem::take(&mut self.time_gradient);
        let count = self.workers.count().min(input.batch.div_ceil(size));
        let mut workspaces = self
            .workspaces
            .take(true, count, || Workspace::new(&self.plan, true));
        Training::new(
            self.network(input.length),
            (input, loss),
            size,
            self.time.steps(),
            &mut time_gradient,
            &self.gradients,
        )
        .run(&mut workspaces[..count]);
        self.workspaces.training = workspaces;
        self.time_gradient = time_gradient;
        let packed = &self.weights.backward;
        let samples = &self.time_gradient;
        self.time
            .backward(self.isa, &self.plan, packed, samples, &mut self.gradients);
        self.collect(gradient);
        Ok(())
    }
}
