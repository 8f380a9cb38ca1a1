use burn::module::{Module, Param};
use burn::tensor::{Tensor, TensorData};

use crate::Error;
use crate::layers::download;
use crate::source::{Init, Source, device};

/// `(x + shift) * exp(log_scale)` per channel (Glow, section 3.1).
#[derive(Module, Debug)]
pub(super) struct ActNorm {
    shift: Param<Tensor<1>>,     // [channels]
    log_scale: Param<Tensor<1>>, // [channels]
}

impl ActNorm {
    pub(super) fn new(source: &mut Source, name: &str, channels: usize) -> Result<Self, Error> {
        let zeros = Init::Zeros;
        Ok(Self {
            shift: source.param(&format!("{name}.shift"), [channels], zeros)?,
            log_scale: source.param(&format!("{name}.log_scale"), [channels], zeros)?,
        })
    }

    /// Data-dependent start: on `x` every channel gets mean 0 and standard deviation 1.
    pub(super) fn initialise(&mut self, x: Tensor<3>) -> Result<(), Error> {
        let channels = x.dims()[2];
        let values = download(x)?;
        let count = (values.len() / channels) as f64;
        let (mut shift, mut log_scale) = (Vec::new(), Vec::new());
        for channel in 0..channels {
            let of_channel = || {
                values
                    .iter()
                    .skip(channel)
                    .step_by(channels)
                    .map(|&v| f64::from(v))
            };
            let mean = of_channel().sum::<f64>() / count;
            let variance = of_channel().map(|v| (v - mean).powi(2)).sum::<f64>() / count;
            shift.push(-mean as f32);
            log_scale.push(-0.5 * (variance + 1e-12).ln() as f32);
        }
        let param = |values| {
            let data = TensorData::new(values, [channels]);
            Param::from_tensor(Tensor::from_data(data, &device()))
        };
        self.shift = param(shift);
        self.log_scale = param(log_scale);
        Ok(())
    }

    /// The normalised `x` and the log-determinant for one sample, `[1]`.
    pub(super) fn forward(&self, x: Tensor<3>) -> (Tensor<3>, Tensor<1>) {
        let [_, length, channels] = x.dims();
        let log_scale = self.log_scale.val();
        let log_det = log_scale.clone().sum() * length as f64;
        let shift = self.shift.val().reshape([1, 1, channels]);
        let scale = log_scale.exp().reshape([1, 1, channels]);
        ((x + shift) * scale, log_det)
    }

    pub(super) fn inverse(&self, y: Tensor<3>) -> Tensor<3> {
        let channels = y.dims()[2];
        let shift = self.shift.val().reshape([1, 1, channels]);
        let scale = self.log_scale.val().neg().exp();
        y * scale.reshape([1, 1, channels]) - shift
    }
}
