use burn::module::Module;
use burn::tensor::Tensor;
use serde::{Deserialize, Serialize};

use super::GlowConfig;
use super::flow::{Encoded, Flow};
use super::train;
use crate::layers::{download, upload};
use crate::source::{Source, Stored};
use crate::{Error, Progress, Sequences, Standardizer, store};

/// Windows per forward pass when scoring.
const CHUNK: usize = 256;

/// A normalising flow over windows of poses (Kingma and Dhariwal 2018, "Glow: generative flow
/// with invertible 1x1 convolutions"), with its exact log-density.
///
/// The density is that of windows with Gaussian noise of [`GlowConfig::noise`] added.
#[derive(Debug)]
pub struct Glow {
    pub(super) header: Header,
    pub(super) flow: Flow,
}

/// What beside the weights makes a flow.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Header {
    pub(super) config: GlowConfig,
    pub(super) length: usize,
    pub(super) channels: usize,
    pub(super) standardizer: Standardizer,
}

/// Windows on the far side of a flow.
#[derive(Clone, Debug, PartialEq)]
pub struct Latents {
    /// `[windows, length * channels]`, under the model Gaussian.
    pub values: Vec<f32>,
    /// Per window `ln |det dz/dx|`, x in the caller's units.
    pub log_det: Vec<f64>,
}

impl Glow {
    /// Trains a flow by maximum likelihood; the same arguments give the same weights.
    ///
    /// # Errors
    /// Windows or a configuration that do not fit, or a likelihood that is no longer a number.
    pub fn train(
        data: Sequences<'_>,
        config: &GlowConfig,
        seed: u64,
        progress: &mut dyn FnMut(Progress),
    ) -> Result<Self, Error> {
        train::train(data, config, seed, train::Role::Foreground, progress)
    }

    /// Natural logarithm of the density at each window, in the caller's units;
    /// negative infinity where f32 overflows on the way.
    ///
    /// # Errors
    /// Windows of another shape than those trained on, or not finite.
    pub fn log_density(&self, data: Sequences<'_>) -> Result<Vec<f64>, Error> {
        let mut out = Vec::with_capacity(data.windows());
        self.each_chunk(data, |encoded, volume| {
            let log_density = download(encoded.log_det + encoded.log_prior)?;
            let in_units = log_density
                .into_iter()
                .map(|value| f64::from(value) - volume);
            out.extend(in_units.map(|v| if v.is_finite() { v } else { f64::NEG_INFINITY }));
            Ok(())
        })?;
        Ok(out)
    }

    /// The latents of each window and the log-determinant of the way there.
    ///
    /// # Errors
    /// As [`log_density`](Self::log_density).
    pub fn encode(&self, data: Sequences<'_>) -> Result<Latents, Error> {
        let mut latents = Latents {
            values: Vec::with_capacity(data.data.len()),
            log_det: Vec::with_capacity(data.windows()),
        };
        self.each_chunk(data, |encoded, volume| {
            let rows = encoded.latents.into_iter().map(|z| {
                let [batch, length, channels] = z.dims();
                z.reshape([batch, length * channels])
            });
            latents
                .values
                .extend(download(Tensor::cat(rows.collect(), 1))?);
            let log_det = download(encoded.log_det)?;
            latents
                .log_det
                .extend(log_det.into_iter().map(|v| f64::from(v) - volume));
            Ok(())
        })?;
        Ok(latents)
    }

    /// The inverse of [`encode`](Self::encode): latents `[windows, length * channels]` to windows
    /// `[windows, length, channels]` in the caller's units.
    ///
    /// # Errors
    /// Latents of another shape, or not finite.
    pub fn decode(&self, latents: &[f32]) -> Result<Vec<f32>, Error> {
        let Header {
            length, channels, ..
        } = self.header;
        let as_windows = Sequences {
            length,
            channels,
            data: latents,
        };
        as_windows.check()?;
        let windows = as_windows.windows();
        if windows == 0 {
            return Ok(Vec::new());
        }
        let all: Tensor<2> = upload(latents.to_vec(), [1, windows, length * channels])
            .reshape([windows, length * channels]);
        let (mut parts, mut start) = (Vec::new(), 0);
        let (mut length, mut channels) = (length, channels);
        for level in 0..self.header.config.levels {
            length /= 2;
            channels *= 2;
            if level + 1 < self.header.config.levels {
                channels /= 2;
            }
            let size = length * channels;
            let part = all.clone().narrow(1, start, size);
            parts.push(part.reshape([windows, length, channels]));
            start += size;
        }
        let mut out = download(self.flow.inverse(parts)?)?;
        self.header.standardizer.restore(&mut out);
        Ok(out)
    }

    /// How many numbers were trained.
    pub fn parameters(&self) -> usize {
        self.flow.num_params()
    }

    /// The configuration trained with.
    pub fn config(&self) -> &GlowConfig {
        &self.header.config
    }

    pub(super) fn load(header: Header, tensors: Stored) -> Result<Self, Error> {
        header.config.validate(header.length)?;
        header.standardizer.check(header.channels)?;
        let mut source = Source::stored(tensors);
        let flow = Flow::new(&mut source, &header.config, header.channels)?;
        source.finish()?;
        Ok(Self { header, flow })
    }

    pub(super) fn store(&self, prefix: &str, tensors: &mut Stored) -> Result<(), Error> {
        store::collect(prefix, &self.flow, tensors)
    }

    /// Hands each chunk's encoding to `take`, with the log-volume of the standardisation.
    fn each_chunk(
        &self,
        data: Sequences<'_>,
        mut take: impl FnMut(Encoded, f64) -> Result<(), Error>,
    ) -> Result<(), Error> {
        let Header {
            length, channels, ..
        } = self.header;
        data.check_against(length, channels)?;
        let standardizer = &self.header.standardizer;
        let volume = standardizer.log_volume() * length as f64;
        for chunk in data.data.chunks(CHUNK * data.dimension()) {
            let mut values = Vec::with_capacity(chunk.len());
            standardizer.extend(&mut values, chunk);
            let windows = chunk.len() / data.dimension();
            take(
                self.flow
                    .forward(upload(values, [windows, length, channels]))?,
                volume,
            )?;
        }
        Ok(())
    }
}
