//! A worker's memory: the activations of one sequence.

use dose3_model::joint::JOINT_AXES;

use super::plan::Plan;
use crate::buffer::Buffer;
use crate::matmul::PANEL;

/// Activations are `[rows, channels]`; those that a convolution reads have zero rows on both sides.
pub(super) struct Space {
    training: bool,
    length: usize,
    /// The input, one zero row on both sides.
    pub x: Buffer,
    /// Input of each block, then of the last layer; one for all where nothing goes back.
    pub h: Vec<Buffer>,
    /// What each block's convolution gives, before modulation and after.
    pub u: Vec<Buffer>,
    pub v: Vec<Buffer>,
    /// What the last layer sees.
    pub s: Buffer,
    /// Ones and zeros: the modulation of the last SiLU.
    pub one: Vec<f32>,
    pub zero: Vec<f32>,
    /// Scale of a block.
    pub scale: Vec<f32>,
    /// Gradients at `h`, `v` and `u`; the last one with zero rows.
    pub dh: Buffer,
    pub dv: Buffer,
    pub du: Buffer,
    /// Gradient at the modulation of all blocks.
    pub film: Vec<f32>,
    pub sum: Vec<f32>,
    pub output: Vec<f32>,
    pub upstream: Vec<f32>,
    pub scratch: Buffer,
}

impl Space {
    pub fn new(plan: &Plan, training: bool) -> Self {
        let width = plan.width();
        let (blocks, film) = match training {
            true => (plan.blocks.len(), plan.film_len()),
            false => (1, 0),
        };
        let empty = |count: usize| vec![Buffer::default(); count];
        Self {
            training,
            length: 0,
            x: Buffer::default(),
            h: empty(if training { blocks + 1 } else { 1 }),
            u: empty(blocks),
            v: empty(blocks),
            s: Buffer::default(),
            one: vec![1.0; width],
            zero: vec![0.0; width],
            scale: vec![0.0; width],
            dh: Buffer::default(),
            dv: Buffer::default(),
            du: Buffer::default(),
            film: vec![0.0; film],
            sum: vec![0.0; width],
            output: Vec::new(),
            upstream: Vec::new(),
            scratch: Buffer::default(),
        }
    }

    /// Makes room for sequences of `length`, with zero rows around them.
    pub fn size(&mut self, plan: &Plan, length: usize) {
        if self.length == length {
            return;
        }
        self.length = length;
        let width = plan.width();
        let plain = length * width;
        let padded = (length + 2 * plan.halo) * width;
        let clear = |buffer: &mut Buffer, len: usize| {
            buffer.grow(len);
            buffer.fill(0.0);
        };
        clear(&mut self.x, (length + 2) * JOINT_AXES);
        self.h.iter_mut().for_each(|h| clear(h, padded));
        let inner = self.u.iter_mut().chain(&mut self.v);
        inner.for_each(|buffer| buffer.grow(plain));
        self.s.grow(plain);
        if self.training {
            self.dh.grow(plain);
            self.dv.grow(plain);
            clear(&mut self.du, padded);
            self.output.resize(length * JOINT_AXES, 0.0);
            self.upstream.resize(length * JOINT_AXES, 0.0);
            self.scratch.grow(length * PANEL);
        }
    }
}
