//! The losses of Algorithm 1 ([`crate::loss`]) on a device: the same closed forms, in f32.

use burn::tensor::{Device, Tensor, TensorData};
use nalgebra::UnitQuaternion;
use rayon::prelude::*;

use super::network::{Loss, sum};
use super::so3::{Logarithm, Quaternions, Tangent, Vectors, geodesic};
use crate::process::RotationProcess;
use crate::trainer::{BranchBatch, Objective, Target};
use crate::window::read_rotation;

/// Takes a batch to the device; answers its loss as a function of the output there, `[batch, length, 3]`.
pub(super) fn of<'a>(
    objective: &'a Objective<'a>,
    batch: &'a BranchBatch<'a>,
    device: &'a Device,
) -> Box<dyn FnOnce(Tensor<3>) -> Loss + 'a> {
    let (samples, length) = (batch.input.batch, batch.input.length);
    let noise = upload(batch.noise.to_vec(), [samples, length, 3], device);
    match batch.target {
        Target::Translation => Box::new(move |output| translation(objective, batch, output, noise)),
        Target::Rotation { clean } => {
            let shape = [samples, length, 4];
            let places = Places {
                noised: Quaternions::of(&upload(quaternions(batch.input.x), shape, device)),
                clean: Quaternions::of(&upload(quaternions(clean), shape, device)),
            };
            Box::new(move |output| rotation(objective, batch, &output, &noise, &places))
        }
    }
}

/// Mean L1 error of the noise, times what Algorithm 1's x0 term adds.
fn translation(
    objective: &Objective<'_>,
    batch: &BranchBatch<'_>,
    output: Tensor<3>,
    noise: Tensor<3>,
) -> Loss {
    let Objective { process, loss } = *objective;
    let [samples, length, axes] = output.dims();
    let factor = |t| process.translation_x0_factor(loss, t);
    let x0 = per_sample(batch, &output.device(), factor); // [batch, 1]
    let error = output - noise;
    let eps = error
        .clone()
        .abs()
        .reshape([samples, length * axes])
        .mean_dim(1); // [batch, 1]
    let slope = (x0.clone() + loss.eps_weight) / (samples * length * axes) as f64;
    Loss {
        terms: Tensor::cat(vec![mean(eps.clone()), mean(eps * x0)], 0),
        gradient: error.sign() * slope.unsqueeze_dim::<3>(2),
    }
}

/// Rotations of a batch.
struct Places {
    noised: Quaternions,
    clean: Quaternions,
}

/// Mean squared angle between the noises, and between the clean rotations.
fn rotation(
    objective: &Objective<'_>,
    batch: &BranchBatch<'_>,
    output: &Tensor<3>,
    noise: &Tensor<3>,
    places: &Places,
) -> Loss {
    let Objective { process, loss } = *objective;
    let [samples, length, _] = output.dims();
    let device = output.device();
    let estimate = Vectors::of(output);
    let wanted = Tangent::new(Vectors::of(noise)).exp();
    let (eps, gradient) = geodesic(&Tangent::new(estimate.clone()), &wanted);
    let mut gradient = gradient.scaled(loss.eps_weight);
    let mut terms = vec![mean(eps)];
    if loss.x0_weight > 0.0 {
        let weight = |t| loss.x0_weight * process.rotation_x0_damping(loss, t);
        let weight = per_sample(batch, &device, weight); // [batch, 1]
        let signal = per_sample(batch, &device, |t| process.rotation.signal(t));
        let noise = per_sample(batch, &device, |t| process.rotation.noise(t));
        let (value, own) = match process.config().rotation_process {
            RotationProcess::Group => {
                let back = Tangent::new(estimate.times(&noise.clone().neg()));
                let log = Logarithm::of(&places.noised.times(&back.exp()));
                let scaled = Tangent::new(log.vector.times(&signal.clone().recip()));
                let (value, at_scaled) = geodesic(&scaled, &places.clean);
                let at_log = at_scaled.times(&signal.recip());
                let at_back = back.pull_back(&log.pull_back(&at_log));
                (value, at_back.times(&noise.neg()))
            }
            RotationProcess::Tangent => {
                let log = Logarithm::of(&places.noised).vector;
                let scaled = log.plus(estimate.times(&noise.clone().neg()));
                let scaled = Tangent::new(scaled.times(&signal.clone().recip()));
                let (value, at_scaled) = geodesic(&scaled, &places.clean);
                (value, at_scaled.times(&(noise.neg() / signal)))
            }
        };
        terms.push(mean(value * weight.clone()));
        gradient = gradient.plus(own.times(&weight));
    } else {
        terms.push(Tensor::zeros([1], &device));
    }
    Loss {
        terms: Tensor::cat(terms, 0),
        gradient: gradient.stack() / (samples * length) as f64,
    }
}

/// A number for each sample, by its step: `[batch, 1]`.
fn per_sample(batch: &BranchBatch<'_>, device: &Device, of: impl Fn(usize) -> f64) -> Tensor<2> {
    let values: Vec<f32> = batch.steps.iter().map(|t| of(*t) as f32).collect();
    let shape = [values.len(), 1];
    Tensor::from_data(TensorData::new(values, shape), device)
}

fn mean(values: Tensor<2>) -> Tensor<1> {
    let count = values.shape().num_elements() as f64;
    sum(values) / count
}

pub(super) fn upload(values: Vec<f32>, shape: [usize; 3], device: &Device) -> Tensor<3> {
    Tensor::from_data(TensorData::new(values, shape), device)
}

/// Of `[.., 9]` rotation matrices, `[.., 4]`, real part first.
fn quaternions(matrices: &[f32]) -> Vec<f32> {
    let mut out = vec![0.0; matrices.len() / 9 * 4];
    out.par_chunks_exact_mut(4)
        .zip(matrices.par_chunks_exact(9))
        .for_each(|(out, matrix)| {
            let q = UnitQuaternion::from_rotation_matrix(&read_rotation(matrix, 0));
            out.copy_from_slice(&[q.w, q.i, q.j, q.k].map(|x| x as f32));
        });
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::loss::LossConfig;
    use crate::process::{Process, ProcessConfig};
    use crate::window::{normals, write_rotation};
    use dose3_lie::{Vector, so3};
    use dose3_model::Input;
    use dose3_model::burn_unet::{Backend, download};
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    const SAMPLES: usize = 10;
    const LENGTH: usize = 24;

    /// `[samples, length, 9]` rotations by angles from 0 to pi.
    fn rotations(seed: u64) -> Vec<f32> {
        let axes = normals(&mut ChaCha8Rng::seed_from_u64(seed), SAMPLES * LENGTH * 3);
        let mut out = vec![0.0; SAMPLES * LENGTH * 9];
        for (i, (axis, out)) in axes.chunks(3).zip(out.chunks_mut(9)).enumerate() {
            let axis = Vector::new(axis[0].into(), axis[1].into(), axis[2].into()).normalize();
            let angle = [0.0, 1e-4, 0.1, 0.9, 1.1, 2.5, 3.1][i % 7];
            write_rotation(&so3::exp(&(axis * angle)), out);
        }
        out
    }

    /// Every number of the closed forms on the device is that of the host, relative to the largest of its sample.
    fn hold(process: ProcessConfig, config: LossConfig, rotation: bool) {
        let process = Process::new(process).unwrap();
        let count = SAMPLES * LENGTH * 3;
        let noise = normals(&mut ChaCha8Rng::seed_from_u64(1), count);
        let mut output = normals(&mut ChaCha8Rng::seed_from_u64(2), count);
        // Some estimates are right, some nearly, some nothing at all, some far out.
        for (i, (out, noise)) in output.chunks_mut(3).zip(noise.chunks(3)).enumerate() {
            match i % 6 {
                0 => out.copy_from_slice(noise),
                1 => out
                    .iter_mut()
                    .zip(noise)
                    .for_each(|(o, n)| *o = n + 1e-3 * *o),
                2 => out.fill(0.0),
                3 => out.iter_mut().for_each(|o| *o *= 4.0),
                _ => {}
            }
        }
        let (noised, clean) = (rotations(3), rotations(4));
        let steps: Vec<usize> = (0..SAMPLES).collect();
        let times: Vec<f32> = steps.iter().map(|t| *t as f32).collect();
        let input = Input {
            x: &noised,
            steps: &times,
            batch: SAMPLES,
            length: LENGTH,
        };
        let target = match rotation {
            true => Target::Rotation { clean: &clean },
            false => Target::Translation,
        };
        let batch = BranchBatch {
            input,
            steps: &steps,
            noise: &noise,
            target,
        };
        let objective = Objective {
            process: &process,
            loss: &config,
        };
        let device = Backend::Flex.device().unwrap();
        let on_device = upload(output.clone(), [SAMPLES, LENGTH, 3], &device);
        let loss = of(&objective, &batch, &device)(on_device);
        let found = download(loss.gradient).unwrap();
        let terms = download(loss.terms).unwrap();

        let (mut eps, mut x0) = (0.0, 0.0);
        let mut expected = vec![0.0; LENGTH * 3];
        for sample in 0..SAMPLES {
            let own = sample * LENGTH * 3..(sample + 1) * LENGTH * 3;
            let loss = batch.loss(&objective, sample, &output[own.clone()], &mut expected);
            eps += loss.eps / SAMPLES as f64;
            x0 += loss.x0 / SAMPLES as f64;
            let size = expected.iter().fold(0_f32, |most, g| most.max(g.abs()));
            for (i, (a, b)) in found[own].iter().zip(&expected).enumerate() {
                let what = format!(
                    "{:?} {rotation} {sample} {i}",
                    process.config().rotation_process
                );
                assert!(
                    (a - b).abs() <= 2e-5 * size,
                    "{what}: {a} and {b} of {size}"
                );
            }
        }
        for (found, expected) in terms.iter().zip([eps, x0]) {
            let error = (f64::from(*found) - expected).abs();
            assert!(error <= 1e-5 * expected, "{found} and {expected}");
        }
    }

    #[test]
    fn losses_are_those_of_the_host() {
        let weights = LossConfig {
            eps_weight: 0.7,
            x0_weight: 1.3,
            x0_ceiling: 0.9,
        };
        let none = LossConfig {
            x0_weight: 0.0,
            ..weights
        };
        for rotation_process in [RotationProcess::Group, RotationProcess::Tangent] {
            let process = ProcessConfig {
                steps: SAMPLES,
                rotation_process,
                ..ProcessConfig::default()
            };
            for config in [weights, none] {
                hold(process, config, true);
            }
            hold(process, weights, false);
        }
    }
}
