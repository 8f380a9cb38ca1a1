//! The forward pass of one sequence.

use dose3_model::joint::JOINT_AXES;

use super::plan::{Plan, TAPS, Weights};
use super::space::Space;
use crate::matmul::{Add, Operand, Target, multiply};
use crate::norm_kernels::{Residual, affine_silu};
use crate::simd::Isa;

/// What a pass reads.
#[derive(Clone, Copy)]
pub(super) struct Forward<'a> {
    pub isa: Isa,
    pub plan: &'a Plan,
    pub values: &'a [f32],
    pub weights: &'a Weights,
}

/// Rows of `channels` from row `first` on.
pub(super) fn rows(data: &[f32], first: usize, channels: usize) -> Operand<'_> {
    Operand {
        data,
        start: first * channels,
        sample: 0,
        row: channels,
    }
}

/// As [`rows`], to be written.
pub(super) fn rows_mut(data: &mut [f32], first: usize, channels: usize) -> Target<'_> {
    Target {
        data,
        start: first * channels,
        sample: 0,
        row: channels,
    }
}

impl Forward<'_> {
    /// `film` holds scale and shift of every block. Activations stay in `space`, all of them where it is for training.
    pub fn run(&self, x: &[f32], film: &[f32], space: &mut Space, output: &mut [f32]) {
        let Self {
            isa,
            plan,
            values,
            weights,
        } = *self;
        let (width, halo) = (plan.width(), plan.halo);
        let length = x.len() / JOINT_AXES;
        space.x[JOINT_AXES..][..x.len()].copy_from_slice(x);
        multiply(
            isa,
            1,
            length,
            TAPS * JOINT_AXES,
            width,
            rows(&space.x, 0, JOINT_AXES),
            &weights.stem,
            Some(&values[plan.stem.bias.clone()]),
            Add::Nothing,
            rows_mut(&mut space.h[0], halo, width),
        );
        for (i, block) in plan.blocks.iter().enumerate() {
            let packed = &weights.blocks[i];
            // Without a way back every block uses the same memory.
            let at = if space.u.len() > 1 { i } else { 0 };
            for (tap, conv) in packed.conv.iter().enumerate() {
                let add = if tap == 0 { Add::Nothing } else { Add::Target };
                let first = halo + tap * block.dilation - block.dilation;
                let h = rows(&space.h[at], first, width);
                let u = rows_mut(&mut space.u[at], 0, width);
                multiply(isa, 1, length, width, width, h, conv, None, add, u);
            }
            let (scale, shift) = film[2 * width * i..][..2 * width].split_at(width);
            (space.scale.iter_mut().zip(scale)).for_each(|(a, g)| *a = 1.0 + g);
            let u = &space.u[at][..length * width];
            let v = &mut space.v[at];
            affine_silu(isa, u, width, &space.scale, shift, Residual::Nothing, v);
            let v = rows(&space.v[at], 0, width);
            let bias = Some(&values[block.out.bias.clone()]);
            let out = &packed.out;
            match space.h.len() {
                1 => {
                    let h = rows_mut(&mut space.h[0], halo, width);
                    multiply(isa, 1, length, width, width, v, out, bias, Add::Target, h);
                }
                _ => {
                    let (before, after) = space.h.split_at_mut(i + 1);
                    let add = Add::Other(rows(&before[i], halo, width));
                    let h = rows_mut(&mut after[0], halo, width);
                    multiply(isa, 1, length, width, width, v, out, bias, add, h);
                }
            }
        }
        let last = space.h.len() - 1;
        let h = &space.h[last][halo * width..][..length * width];
        let (one, zero) = (&space.one, &space.zero);
        affine_silu(isa, h, width, one, zero, Residual::Nothing, &mut space.s);
        multiply(
            isa,
            1,
            length,
            width,
            JOINT_AXES,
            rows(&space.s, 0, width),
            &weights.last,
            Some(&values[plan.last.bias.clone()]),
            Add::Nothing,
            rows_mut(output, 0, JOINT_AXES),
        );
    }
}
