//! Where a network's parameters come from: drawn, or read from a file.

use std::collections::BTreeMap;

use burn::module::Param;
use burn::tensor::{Device, Tensor, TensorData};
use nalgebra::DMatrix;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use crate::Error;
use crate::random::normal;

/// Starting values of one parameter.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Init {
    Zeros,
    /// Uniform in plus or minus `1 / sqrt(fan_in)`, as PyTorch draws convolutions.
    FanIn(usize),
    /// A random rotation or reflection (square matrices only).
    Orthogonal,
}

/// Stored tensors by name: shape and values.
pub(crate) type Stored = BTreeMap<String, (Vec<usize>, Vec<f32>)>;

enum Origin {
    Drawn(Box<ChaCha8Rng>),
    Stored(Stored),
}

/// Hands out parameters by name, in the order in which a network is built.
pub(crate) struct Source {
    origin: Origin,
    device: Device,
}

impl Source {
    pub(crate) fn drawn(rng: ChaCha8Rng) -> Self {
        Self {
            origin: Origin::Drawn(Box::new(rng)),
            device: device(),
        }
    }

    pub(crate) fn stored(tensors: Stored) -> Self {
        Self {
            origin: Origin::Stored(tensors),
            device: device(),
        }
    }

    pub(crate) fn param<const D: usize>(
        &mut self,
        name: &str,
        shape: [usize; D],
        init: Init,
    ) -> Result<Param<Tensor<D>>, Error> {
        let values = match &mut self.origin {
            Origin::Drawn(rng) => draw(&shape, init, rng),
            Origin::Stored(tensors) => {
                let wrong = |reason: String| Error::Tensor {
                    name: name.to_owned(),
                    reason,
                };
                let (found, values) = tensors
                    .remove(name)
                    .ok_or_else(|| wrong("missing".to_owned()))?;
                if found != shape {
                    return Err(wrong(format!("shape {found:?}, expected {shape:?}")));
                }
                values
            }
        };
        let data = TensorData::new(values, shape);
        Ok(Param::from_tensor(Tensor::from_data(data, &self.device)))
    }

    /// Every stored tensor must have been asked for.
    pub(crate) fn finish(self) -> Result<(), Error> {
        match self.origin {
            Origin::Stored(tensors) => match tensors.into_keys().next() {
                Some(name) => Err(Error::Tensor {
                    name,
                    reason: "unknown".to_owned(),
                }),
                None => Ok(()),
            },
            Origin::Drawn(_) => Ok(()),
        }
    }
}

/// Where the baselines are computed: burn-flex on the CPU, without autodiff.
pub(crate) fn device() -> Device {
    Device::flex()
}

fn draw(shape: &[usize], init: Init, rng: &mut ChaCha8Rng) -> Vec<f32> {
    let count = shape.iter().product();
    match init {
        Init::Zeros => vec![0.0; count],
        Init::FanIn(fan_in) => {
            let bound = 1.0 / (fan_in as f32).sqrt();
            (0..count)
                .map(|_| rng.random_range(-bound..bound))
                .collect()
        }
        Init::Orthogonal => {
            let side = shape[0];
            let gaussian = DMatrix::from_fn(side, side, |_, _| f64::from(normal(rng)));
            let q = gaussian.qr().q();
            q.transpose().iter().map(|&value| value as f32).collect() // row-major
        }
    }
}
