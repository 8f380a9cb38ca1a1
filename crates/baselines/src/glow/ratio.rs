use serde::{Deserialize, Serialize};

use super::model::Header;
use super::train::{self, Role};
use super::{Glow, GlowConfig};
use crate::source::Stored;
use crate::{Error, FAR, Precision, Progress, Sequences, store};

const FORMAT: u32 = 1;
const FOREGROUND: &str = "foreground.";
const BACKGROUND: &str = "background.";

/// Likelihood ratio of two flows (Ren et al. 2019, "Likelihood ratios for out-of-distribution
/// detection"): one trained on the windows, one on perturbed windows.
///
/// The perturbation: each pose of a training window is replaced, with probability
/// [`GlowConfig::mutation_rate`], by a pose drawn from all training windows.
#[derive(Debug)]
pub struct GlowRatio {
    foreground: Glow,
    background: Glow,
}

#[derive(Serialize, Deserialize)]
struct FileHeader {
    kind: String,
    format: u32,
    glow: Header,
}

impl GlowRatio {
    /// Trains both flows; the same arguments give the same bytes.
    ///
    /// # Errors
    /// Windows or a configuration that do not fit, or a likelihood that is no longer a number.
    pub fn train(
        data: Sequences<'_>,
        config: &GlowConfig,
        seed: u64,
        progress: &mut dyn FnMut(Progress),
    ) -> Result<Self, Error> {
        Ok(Self {
            foreground: train::train(data, config, seed, Role::Foreground, progress)?,
            background: train::train(data, config, seed, Role::Background, progress)?,
        })
    }

    /// `-(ln p(x) - ln p_background(x)) / (length * channels)` of each window, higher = more out
    /// of distribution. [`FAR`] where a density cannot be computed in f32.
    ///
    /// # Errors
    /// Windows of another shape than those trained on, or not finite.
    pub fn score(&self, data: Sequences<'_>) -> Result<Vec<f64>, Error> {
        let foreground = self.foreground.log_density(data)?;
        let background = self.background.log_density(data)?;
        let dimension = data.dimension() as f64;
        let ratio = |(p, q): (f64, f64)| {
            if p.is_finite() && q.is_finite() {
                (q - p) / dimension
            } else {
                FAR
            }
        };
        Ok(foreground.into_iter().zip(background).map(ratio).collect())
    }

    /// The model of the windows; its log-density alone is a score, too.
    pub fn foreground(&self) -> &Glow {
        &self.foreground
    }

    /// The model of the perturbed windows.
    pub fn background(&self) -> &Glow {
        &self.background
    }

    /// How many numbers were trained, in both models together.
    pub fn parameters(&self) -> usize {
        self.foreground.parameters() + self.background.parameters()
    }

    /// A safetensors file, the configuration in its metadata.
    ///
    /// # Errors
    /// Weights that are not finite.
    pub fn to_bytes(&self) -> Result<Vec<u8>, Error> {
        let mut tensors = Stored::new();
        self.foreground.store(FOREGROUND, &mut tensors)?;
        self.background.store(BACKGROUND, &mut tensors)?;
        let header = FileHeader {
            kind: "glow-ratio".to_owned(),
            format: FORMAT,
            glow: self.foreground.header.clone(),
        };
        store::write(&header, &tensors, Precision::F32)
    }

    /// Reads what [`to_bytes`](Self::to_bytes) wrote.
    ///
    /// # Errors
    /// Another kind or version, or tensors that are missing, unknown, misshapen or not finite.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, Error> {
        let (header, tensors): (FileHeader, _) = store::read(bytes)?;
        if (header.kind.as_str(), header.format) != ("glow-ratio", FORMAT) {
            let FileHeader { kind, format, .. } = header;
            return Err(Error::Header(format!("kind `{kind}`, format {format}")));
        }
        let (mut foreground, mut background) = (Stored::new(), Stored::new());
        for (name, tensor) in tensors {
            if let Some(rest) = name.strip_prefix(FOREGROUND) {
                foreground.insert(rest.to_owned(), tensor);
            } else if let Some(rest) = name.strip_prefix(BACKGROUND) {
                background.insert(rest.to_owned(), tensor);
            } else {
                let reason = "unknown".to_owned();
                return Err(Error::Tensor { name, reason });
            }
        }
        Ok(Self {
            foreground: Glow::load(header.glow.clone(), foreground)?,
            background: Glow::load(header.glow, background)?,
        })
    }
}
