//! Group normalisation followed by scale, shift and SiLU, for one sample at a time.

use crate::norm_kernels::{Residual, affine_silu, affine_silu_backward, combine, moments};
use crate::simd::Isa;

const EPSILON: f64 = 1e-5;

/// The parameters that act on one sample: gain and offset of the normalisation, and the
/// block's scale and shift where it has them. All `[channels]`.
#[derive(Clone, Copy)]
pub(crate) struct Affine<'a> {
    pub(crate) groups: usize,
    pub(crate) gain: &'a [f32],
    pub(crate) offset: &'a [f32],
    pub(crate) scale_shift: Option<(&'a [f32], &'a [f32])>,
}

impl Affine<'_> {
    fn channels(&self) -> usize {
        self.gain.len()
    }

    /// `1 + scale` and `shift` of a channel.
    fn modulation(&self, c: usize) -> (f32, f32) {
        self.scale_shift
            .map_or((1.0, 0.0), |(scale, shift)| (1.0 + scale[c], shift[c]))
    }
}

/// One number per channel, several times.
#[derive(Clone, Default)]
pub(crate) struct Scratch {
    vectors: [Vec<f32>; 6],
}

impl Scratch {
    /// For up to `channels` channels.
    pub(crate) fn new(channels: usize) -> Self {
        Self {
            vectors: std::array::from_fn(|_| vec![0.0; channels]),
        }
    }
}

/// `out = silu(norm(x) * (1 + scale) + shift) + residual`; writes each group's mean and
/// `1 / sqrt(variance + 1e-5)` to `statistics`, `[groups, 2]`.
pub(crate) fn forward(
    isa: Isa,
    affine: &Affine<'_>,
    x: &[f32],
    residual: Residual<'_>,
    out: &mut [f32],
    statistics: &mut [f32],
    scratch: &mut Scratch,
) {
    let channels = affine.channels();
    let [mean, variance, a, b, ..] = &mut scratch.vectors;
    moments(isa, x, channels, mean, variance);
    let size = channels / affine.groups;
    for g in 0..affine.groups {
        let range = g * size..(g + 1) * size;
        let (mean, variance) = (&mean[range.clone()], &variance[range]);
        let centre = mean.iter().map(|&m| f64::from(m)).sum::<f64>() / size as f64;
        let within = mean.iter().zip(variance).map(|(&m, &v)| {
            let d = f64::from(m) - centre;
            f64::from(v) + d * d
        });
        let spread = within.sum::<f64>() / size as f64;
        statistics[2 * g] = centre as f32;
        statistics[2 * g + 1] = (1.0 / (spread + EPSILON).sqrt()) as f32;
    }
    coefficients(affine, statistics, a, b);
    affine_silu(isa, x, channels, a, b, residual, out);
}

/// `a` and `b` with `x * a + b = norm(x) * (1 + scale) + shift`.
fn coefficients(affine: &Affine<'_>, statistics: &[f32], a: &mut [f32], b: &mut [f32]) {
    let size = affine.channels() / affine.groups;
    for (g, statistics) in statistics
        .as_chunks::<2>()
        .0
        .iter()
        .enumerate()
        .take(affine.groups)
    {
        let [mean, inverse] = *statistics;
        let range = g * size..(g + 1) * size;
        let (a, b) = (&mut a[range.clone()], &mut b[range.clone()]);
        let (gain, offset) = (&affine.gain[range.clone()], &affine.offset[range.clone()]);
        for c in 0..size {
            a[c] = inverse * gain[c];
            b[c] = offset[c] - mean * a[c];
        }
        if let Some((scale, shift)) = affine.scale_shift {
            let (scale, shift) = (&scale[range.clone()], &shift[range]);
            for c in 0..size {
                a[c] += a[c] * scale[c];
                b[c] += b[c] * scale[c] + shift[c];
            }
        }
    }
}

/// Where the gradients of [`Affine`] and of the bias before it go; all `[channels]`.
pub(crate) struct Gradients<'a> {
    /// Added to.
    pub(crate) bias: &'a mut [f32],
    /// Added to.
    pub(crate) gain: &'a mut [f32],
    /// Added to.
    pub(crate) offset: &'a mut [f32],
    /// Overwritten.
    pub(crate) scale_shift: Option<(&'a mut [f32], &'a mut [f32])>,
}

/// From the gradient at the output of [`forward`] (without its residual) to the gradient at
/// `x`. `du` is room for `[rows, channels]` and may not overlap the rest.
#[expect(
    clippy::too_many_arguments,
    reason = "a normalisation: what it is given, what it left, and what it answers"
)]
pub(crate) fn backward(
    isa: Isa,
    affine: &Affine<'_>,
    upstream: &[f32],
    x: &[f32],
    statistics: &[f32],
    du: &mut [f32],
    out: &mut [f32],
    gradients: Gradients<'_>,
    scratch: &mut Scratch,
) {
    let channels = affine.channels();
    let size = channels / affine.groups;
    let [sum, product, a, b, xa, xb] = &mut scratch.vectors;
    coefficients(affine, statistics, a, b);
    for (g, statistics) in statistics.as_chunks::<2>().0.iter().enumerate() {
        let [mean, inverse] = *statistics;
        xa[g * size..(g + 1) * size].fill(inverse);
        xb[g * size..(g + 1) * size].fill(-mean * inverse);
    }
    affine_silu_backward(isa, upstream, x, channels, a, b, xa, xb, du, sum, product);

    for c in 0..channels {
        let (scale, _) = affine.modulation(c);
        gradients.gain[c] += scale * product[c];
        gradients.offset[c] += scale * sum[c];
    }
    if let Some((scale, shift)) = gradients.scale_shift {
        for c in 0..channels {
            scale[c] = affine.gain[c] * product[c] + affine.offset[c] * sum[c];
            shift[c] = sum[c];
        }
    }

    // dx = (g du - mean(g du) - xhat mean(g du xhat)) / deviation, g = gain (1 + scale),
    // written as du p + x q + r.
    let count = (x.len() / channels * size) as f64;
    let (p, q, r) = (a, b, xb);
    for g in 0..affine.groups {
        let (mean, inverse) = (statistics[2 * g], statistics[2 * g + 1]);
        let (mut first, mut second) = (0.0f64, 0.0f64);
        for c in g * size..(g + 1) * size {
            let weight = f64::from(affine.gain[c] * affine.modulation(c).0);
            first += weight * f64::from(sum[c]);
            second += weight * f64::from(product[c]);
        }
        let slope = -f64::from(inverse) * f64::from(inverse) * second / count;
        let level = -f64::from(inverse) * first / count - f64::from(mean) * slope;
        for c in g * size..(g + 1) * size {
            p[c] = inverse * affine.gain[c] * affine.modulation(c).0;
            q[c] = slope as f32;
            r[c] = level as f32;
        }
    }
    combine(isa, du, x, channels, p, q, r, out, gradients.bias);
}
