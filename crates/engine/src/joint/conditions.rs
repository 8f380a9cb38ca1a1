//! From the conditions of a sequence to the modulation of the blocks, once for all sequences that share them.

use dose3_model::joint::{CONDITIONS, condition_features};

use super::plan::{CONDITION_INPUTS, Linear, Plan};

/// More distinct conditions than a score ever has; beyond them the table starts anew.
const MOST: usize = 256;

/// Modulations of the conditions seen, until the parameters change.
#[derive(Default)]
pub(super) struct Conditions {
    /// `[distinct, 7]`
    known: Vec<f32>,
    /// `[distinct, film]`
    films: Vec<f32>,
    /// Of every sequence of the batch: its row.
    rows: Vec<usize>,
    film_len: usize,
}

impl Conditions {
    pub fn clear(&mut self) {
        self.known.clear();
        self.films.clear();
        self.rows.clear();
    }

    /// Finds or computes the modulation of every sequence of a batch, `[batch, 7]`.
    pub fn look_up(&mut self, plan: &Plan, values: &[f32], conditions: &[f32]) {
        if self.known.len() > MOST * CONDITIONS {
            self.clear();
        }
        self.film_len = plan.film_len();
        self.rows.clear();
        for own in conditions.chunks_exact(CONDITIONS) {
            let mut known = self.known.chunks_exact(CONDITIONS);
            let row = match known.position(|other| other == own) {
                Some(row) => row,
                None => {
                    let row = self.known.len() / CONDITIONS;
                    self.known.extend_from_slice(own);
                    self.films.resize((row + 1) * self.film_len, 0.0);
                    let film = &mut self.films[row * self.film_len..];
                    let inner = Inner::new(plan, values, own);
                    apply(&plan.film, values, &inner.e2, film);
                    row
                }
            };
            self.rows.push(row);
        }
    }

    /// Scale and shift of every block for a sequence of the batch.
    pub fn of(&self, index: usize) -> &[f32] {
        &self.films[self.rows[index] * self.film_len..][..self.film_len]
    }
}

/// The two layers in front of the modulation.
struct Inner {
    features: [f32; CONDITION_INPUTS],
    z1: Vec<f32>,
    e1: Vec<f32>,
    z2: Vec<f32>,
    e2: Vec<f32>,
}

impl Inner {
    fn new(plan: &Plan, values: &[f32], conditions: &[f32]) -> Self {
        let mut features = [0.0; CONDITION_INPUTS];
        condition_features(conditions, &mut features);
        let size = plan.config.embedding;
        let (mut z1, mut z2) = (vec![0.0; size], vec![0.0; size]);
        apply(&plan.linear1, values, &features, &mut z1);
        let e1: Vec<f32> = z1.iter().map(|&z| z * sigmoid(z)).collect();
        apply(&plan.linear2, values, &e1, &mut z2);
        let e2 = z2.iter().map(|&z| z * sigmoid(z)).collect();
        Self {
            features,
            z1,
            e1,
            z2,
            e2,
        }
    }
}

/// Adds to `gradient` what the gradient at the modulation of one sequence makes of the layers that computed it.
pub(super) fn backward(
    plan: &Plan,
    values: &[f32],
    conditions: &[f32],
    film: &[f32],
    gradient: &mut [f32],
) {
    let inner = Inner::new(plan, values, conditions);
    let size = plan.config.embedding;
    let (mut d2, mut d1) = (vec![0.0; size], vec![0.0; size]);
    back(&plan.film, values, &inner.e2, film, &mut d2, gradient);
    (d2.iter_mut().zip(&inner.z2)).for_each(|(d, z)| *d *= slope(*z));
    back(&plan.linear2, values, &inner.e1, &d2, &mut d1, gradient);
    (d1.iter_mut().zip(&inner.z1)).for_each(|(d, z)| *d *= slope(*z));
    let mut nobody = [0.0; CONDITION_INPUTS];
    let features = &inner.features;
    back(&plan.linear1, values, features, &d1, &mut nobody, gradient);
}

fn sigmoid(z: f32) -> f32 {
    1.0 / (1.0 + libm::expf(-z))
}

/// Derivative of SiLU.
fn slope(z: f32) -> f32 {
    let s = sigmoid(z);
    s * (1.0 + z * (1.0 - s))
}

/// `out = weight * x + bias`
fn apply(layer: &Linear, values: &[f32], x: &[f32], out: &mut [f32]) {
    let weight = values[layer.weight.clone()].chunks_exact(x.len());
    let bias = &values[layer.bias.clone()];
    for ((out, row), bias) in out.iter_mut().zip(weight).zip(bias) {
        *out = dot(row, x) + bias;
    }
}

/// `dx += weight^T * d`, and the gradients of weight and bias.
fn back(
    layer: &Linear,
    values: &[f32],
    x: &[f32],
    d: &[f32],
    dx: &mut [f32],
    gradient: &mut [f32],
) {
    let weight = values[layer.weight.clone()].chunks_exact(x.len());
    let to = gradient[layer.weight.clone()].chunks_exact_mut(x.len());
    for ((row, to), d) in weight.zip(to).zip(d) {
        dx.iter_mut().zip(row).for_each(|(dx, w)| *dx += w * d);
        to.iter_mut().zip(x).for_each(|(to, x)| *to += x * d);
    }
    let bias = &mut gradient[layer.bias.clone()];
    bias.iter_mut().zip(d).for_each(|(to, d)| *to += d);
}

/// In eight sums, so that it becomes vector instructions.
fn dot(a: &[f32], b: &[f32]) -> f32 {
    let (a8, a_rest) = a.as_chunks::<8>();
    let (b8, b_rest) = b.as_chunks::<8>();
    let mut sums = [0.0; 8];
    for (a, b) in a8.iter().zip(b8) {
        for ((sum, a), b) in sums.iter_mut().zip(a).zip(b) {
            *sum += a * b;
        }
    }
    let rest: f32 = a_rest.iter().zip(b_rest).map(|(a, b)| a * b).sum();
    sums.iter().sum::<f32>() + rest
}
