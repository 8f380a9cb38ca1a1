//! The way back of one sequence.

use dose3_model::joint::JOINT_AXES;
use std::ops::Range;

use super::forward::{Forward, rows, rows_mut};
use super::plan::TAPS;
use super::space::Space;
use crate::matmul::{Add, multiply, outer};
use crate::norm_kernels::{add_column_sums, affine_silu_backward};

/// A pass back through what a [`Forward`] left in its space.
pub(super) struct Backward<'a> {
    pub pass: Forward<'a>,
}

impl Backward<'_> {
    /// Adds to `gradient`, whose matrices are `[taps, in, out]`; the gradient at the modulation is left in
    /// `space.film`.
    pub fn run(&self, film: &[f32], upstream: &[f32], space: &mut Space, gradient: &mut [f32]) {
        let Forward {
            isa, plan, weights, ..
        } = self.pass;
        let (width, halo) = (plan.width(), plan.halo);
        let length = upstream.len() / JOINT_AXES;
        let plain = length * width;
        let bias = |gradient: &mut [f32], range: Range<usize>, x: &[f32], channels: usize| {
            add_column_sums(isa, x, channels, &mut gradient[range]);
        };

        bias(gradient, plan.last.bias.clone(), upstream, JOINT_AXES);
        outer(
            isa,
            1,
            length,
            width,
            JOINT_AXES,
            rows(&space.s, 0, width),
            rows(upstream, 0, JOINT_AXES),
            &mut space.scratch,
            true,
            &mut gradient[plan.last.weight.clone()],
        );
        multiply(
            isa,
            1,
            length,
            JOINT_AXES,
            width,
            rows(upstream, 0, JOINT_AXES),
            &weights.last_back,
            None,
            Add::Nothing,
            rows_mut(&mut space.dv, 0, width),
        );
        let h = &space.h[plan.blocks.len()][halo * width..][..plain];
        let (one, zero) = (&space.one, &space.zero);
        affine_silu_backward(
            isa,
            &space.dv[..plain],
            h,
            width,
            one,
            zero,
            one,
            zero,
            &mut space.dh,
            &mut space.sum,
            &mut space.scale,
        );
        for (i, block) in plan.blocks.iter().enumerate().rev() {
            let packed = &weights.blocks[i];
            bias(gradient, block.out.bias.clone(), &space.dh[..plain], width);
            outer(
                isa,
                1,
                length,
                width,
                width,
                rows(&space.v[i], 0, width),
                rows(&space.dh, 0, width),
                &mut space.scratch,
                true,
                &mut gradient[block.out.weight.clone()],
            );
            let (dh, dv) = (rows(&space.dh, 0, width), rows_mut(&mut space.dv, 0, width));
            let back = &packed.out_back;
            multiply(
                isa,
                1,
                length,
                width,
                width,
                dh,
                back,
                None,
                Add::Nothing,
                dv,
            );
            let (scale, shift) = film[2 * width * i..][..2 * width].split_at(width);
            (space.scale.iter_mut().zip(scale)).for_each(|(a, g)| *a = 1.0 + g);
            // Gradient at the shift: the sum; at the scale: the sum of the product with u.
            let (by_scale, by_shift) = space.film[2 * width * i..][..2 * width].split_at_mut(width);
            let du = &mut space.du[halo * width..][..plain];
            affine_silu_backward(
                isa,
                &space.dv[..plain],
                &space.u[i][..plain],
                width,
                &space.scale,
                shift,
                &space.one,
                &space.zero,
                du,
                by_shift,
                by_scale,
            );
            for row in du.chunks_exact_mut(width) {
                row.iter_mut().zip(&space.scale).for_each(|(d, a)| *d *= a);
            }
            let size = width * width;
            for tap in 0..TAPS {
                let offset = tap * block.dilation;
                let to = block.conv.start + tap * size;
                let h = rows(&space.h[i], halo + offset - block.dilation, width);
                let du = rows(&space.du, halo, width);
                let matrix = &mut gradient[to..to + size];
                outer(
                    isa,
                    1,
                    length,
                    width,
                    width,
                    h,
                    du,
                    &mut space.scratch,
                    true,
                    matrix,
                );
                // What step t gave to t - offset comes back from there.
                let du = rows(&space.du, halo + block.dilation - offset, width);
                let dh = rows_mut(&mut space.dh, 0, width);
                let back = &packed.conv_back[tap];
                multiply(
                    isa,
                    1,
                    length,
                    width,
                    width,
                    du,
                    back,
                    None,
                    Add::Target,
                    dh,
                );
            }
        }
        bias(gradient, plan.stem.bias.clone(), &space.dh[..plain], width);
        for tap in 0..TAPS {
            let size = JOINT_AXES * width;
            let to = plan.stem.weight.start + tap * size;
            outer(
                isa,
                1,
                length,
                JOINT_AXES,
                width,
                rows(&space.x, tap, JOINT_AXES),
                rows(&space.dh, 0, width),
                &mut space.scratch,
                true,
                &mut gradient[to..to + size],
            );
        }
    }
}
