//! Where parameters lie, and their packed matrices.

use dose3_model::ParameterLayout;
use dose3_model::joint::{FEATURES, JOINT_AXES, JointConfig};
use std::ops::Range;

use crate::buffer::Buffer;
use crate::matmul::{PANEL, packed_len, panel_width};

/// Taps of every convolution.
pub(super) const TAPS: usize = 3;

/// A weight and its bias in the flat vector.
#[derive(Clone, Debug)]
pub(super) struct Linear {
    pub weight: Range<usize>,
    pub bias: Range<usize>,
}

/// One residual block.
#[derive(Clone, Debug)]
pub(super) struct Block {
    pub dilation: usize,
    /// `[width, width, 3]`
    pub conv: Range<usize>,
    /// `[width, width]`
    pub out: Linear,
}

/// Names, sizes and places of everything.
pub(super) struct Plan {
    pub config: JointConfig,
    pub layout: ParameterLayout,
    pub linear1: Linear,
    pub linear2: Linear,
    pub film: Linear,
    pub stem: Linear,
    pub blocks: Vec<Block>,
    pub last: Linear,
    /// Zero rows before and after a sequence: the largest dilation.
    pub halo: usize,
}

impl Plan {
    /// Of a valid configuration.
    pub fn new(config: &JointConfig) -> Self {
        let layout = config.layout();
        let range = |name: String| layout.find(&name).map_or(0..0, |spec| spec.range());
        let linear = |name: &str| Linear {
            weight: range(format!("{name}.weight")),
            bias: range(format!("{name}.bias")),
        };
        let block = |(i, &dilation): (usize, &usize)| Block {
            dilation,
            conv: range(format!("blocks.{i}.conv.weight")),
            out: linear(&format!("blocks.{i}.out")),
        };
        Self {
            linear1: linear("condition.linear1"),
            linear2: linear("condition.linear2"),
            film: linear("film"),
            stem: linear("stem"),
            blocks: config.dilations.iter().enumerate().map(block).collect(),
            last: linear("last"),
            halo: config.dilations.iter().copied().max().unwrap_or(1),
            config: config.clone(),
            layout,
        }
    }

    pub fn width(&self) -> usize {
        self.config.width
    }

    /// Numbers that modulate the blocks: scale and shift of each.
    pub fn film_len(&self) -> usize {
        2 * self.width() * self.blocks.len()
    }

    pub fn flops(&self, length: usize) -> u64 {
        let (width, blocks) = (self.width() as u64, self.blocks.len() as u64);
        let ends = (TAPS as u64 + 1) * JOINT_AXES as u64 * width;
        let block = (TAPS as u64 + 1) * width * width;
        2 * length as u64 * (ends + blocks * block)
    }

    /// Gradients of matrices `[taps, in, out]` turned into those of the stored weights `[out, in, taps]`.
    pub fn unpack(&self, matrices: &[f32], gradient: &mut [f32]) {
        gradient.copy_from_slice(matrices);
        let width = self.width();
        let mut turn = |range: &Range<usize>, inputs: usize, outputs: usize, taps: usize| {
            let (from, to) = (&matrices[range.clone()], &mut gradient[range.clone()]);
            for tap in 0..taps {
                for i in 0..inputs {
                    let row = &from[(tap * inputs + i) * outputs..][..outputs];
                    for (o, value) in row.iter().enumerate() {
                        to[(o * inputs + i) * taps + tap] = *value;
                    }
                }
            }
        };
        turn(&self.stem.weight, JOINT_AXES, width, TAPS);
        for block in &self.blocks {
            turn(&block.conv, width, width, TAPS);
            turn(&block.out.weight, width, width, 1);
        }
        turn(&self.last.weight, width, JOINT_AXES, 1);
    }
}

/// Matrices of one block.
pub(super) struct BlockWeights {
    pub conv: [Buffer; TAPS],
    /// Of the gradient at the input.
    pub conv_back: [Buffer; TAPS],
    pub out: Buffer,
    pub out_back: Buffer,
}

/// Packed matrices of a parameter set.
pub(super) struct Weights {
    /// All taps in one.
    pub stem: Buffer,
    pub blocks: Vec<BlockWeights>,
    pub last: Buffer,
    pub last_back: Buffer,
}

impl Weights {
    pub fn new(plan: &Plan) -> Self {
        let width = plan.width();
        let square = || Buffer::zeros(packed_len(width, width));
        let block = |_: &Block| BlockWeights {
            conv: std::array::from_fn(|_| square()),
            conv_back: std::array::from_fn(|_| square()),
            out: square(),
            out_back: square(),
        };
        Self {
            stem: Buffer::zeros(packed_len(TAPS * JOINT_AXES, width)),
            blocks: plan.blocks.iter().map(block).collect(),
            last: Buffer::zeros(packed_len(width, JOINT_AXES)),
            last_back: Buffer::zeros(packed_len(JOINT_AXES, width)),
        }
    }

    pub fn pack(&mut self, plan: &Plan, values: &[f32]) {
        let width = plan.width();
        let stem = &values[plan.stem.weight.clone()];
        pack(TAPS * JOINT_AXES, width, &mut self.stem, |k, o| {
            stem[(o * JOINT_AXES + k % JOINT_AXES) * TAPS + k / JOINT_AXES]
        });
        for (block, packed) in plan.blocks.iter().zip(&mut self.blocks) {
            let conv = &values[block.conv.clone()];
            for tap in 0..TAPS {
                let at = |i: usize, o: usize| conv[(o * width + i) * TAPS + tap];
                pack(width, width, &mut packed.conv[tap], at);
                pack(width, width, &mut packed.conv_back[tap], |o, i| at(i, o));
            }
            let out = &values[block.out.weight.clone()];
            pack(width, width, &mut packed.out, |i, o| out[o * width + i]);
            pack(width, width, &mut packed.out_back, |o, i| {
                out[o * width + i]
            });
        }
        let last = &values[plan.last.weight.clone()];
        pack(width, JOINT_AXES, &mut self.last, |i, o| {
            last[o * width + i]
        });
        pack(JOINT_AXES, width, &mut self.last_back, |o, i| {
            last[o * width + i]
        });
    }
}

/// Lays a `[k, n]` matrix out in panels of columns.
fn pack(k: usize, n: usize, packed: &mut [f32], at: impl Fn(usize, usize) -> f32) {
    let mut first = 0;
    while first < n {
        let width = panel_width(n, first);
        let panel = packed[first * k..][..width * k].chunks_exact_mut(width);
        for (row, to) in panel.enumerate() {
            for (column, to) in to.iter_mut().enumerate().take(n - first) {
                *to = at(row, first + column);
            }
        }
        first += PANEL;
    }
}

/// The rows of `FEATURES` that the first layer of the conditions takes.
pub(super) const CONDITION_INPUTS: usize = FEATURES;
