use burn::module::Module;
use serde::{Deserialize, Serialize};

use super::classifier::Classifier;
use super::train::{self, TrainReport};
use super::{JemConfig, Outcome};
use crate::layers::{download, upload};
use crate::source::{Source, Stored};
use crate::{Error, FAR, Precision, Progress, Sequences, Standardizer, store};

const FORMAT: u32 = 1;
const KIND: &str = "jem";
/// Windows per forward pass when scoring.
const CHUNK: usize = 256;

/// A joint energy model: a classifier of windows whose logits are also an energy.
#[derive(Debug)]
pub struct Jem {
    header: Header,
    network: Classifier,
}

#[derive(Clone, Debug, Serialize, Deserialize)]
struct Header {
    kind: String,
    format: u32,
    config: JemConfig,
    length: usize,
    channels: usize,
    classes: usize,
    standardizer: Standardizer,
    report: TrainReport,
}

impl Jem {
    /// Trains on windows and one label each, below `classes` (see
    /// [`Manoeuvres`](super::Manoeuvres)); the same arguments give the same bytes.
    ///
    /// A run that diverges is no error: it ends early with the last sound weights, and
    /// [`report`](Self::report) says so.
    ///
    /// # Errors
    /// Windows, labels or a configuration that do not fit.
    pub fn train(
        data: Sequences<'_>,
        labels: &[usize],
        classes: usize,
        config: &JemConfig,
        seed: u64,
        progress: &mut dyn FnMut(Progress),
    ) -> Result<Self, Error> {
        config.validate(data.length)?;
        data.check_training()?;
        check_labels(labels, classes, data.windows())?;
        let (network, standardizer, report) =
            train::train(data, labels, classes, config, seed, progress)?;
        let header = Header {
            kind: KIND.to_owned(),
            format: FORMAT,
            config: config.clone(),
            length: data.length,
            channels: data.channels,
            classes,
            standardizer,
            report,
        };
        Ok(Self { header, network })
    }

    /// The energy `-logsumexp f(x)` of each window, higher = more out of distribution.
    /// [`FAR`] where f32 overflows.
    ///
    /// # Errors
    /// Windows of another shape than those trained on, or not finite.
    pub fn score(&self, data: Sequences<'_>) -> Result<Vec<f64>, Error> {
        let logits = self.logits(data)?;
        Ok(logits
            .chunks_exact(self.header.classes)
            .map(energy)
            .collect())
    }

    /// The logits `f(x)`: `[windows, classes]`, whose softmax is `p(y|x)`.
    ///
    /// # Errors
    /// As [`score`](Self::score).
    pub fn logits(&self, data: Sequences<'_>) -> Result<Vec<f32>, Error> {
        let Header {
            length, channels, ..
        } = self.header;
        data.check_against(length, channels)?;
        let mut out = Vec::with_capacity(data.windows() * self.header.classes);
        for chunk in data.data.chunks(CHUNK * data.dimension()) {
            let mut values = Vec::with_capacity(chunk.len());
            self.header.standardizer.extend(&mut values, chunk);
            let windows = chunk.len() / data.dimension();
            let logits = self
                .network
                .forward(upload(values, [windows, length, channels]));
            out.extend(download(logits)?);
        }
        Ok(out)
    }

    /// What training showed.
    pub fn report(&self) -> &TrainReport {
        &self.header.report
    }

    /// How training ended.
    pub fn outcome(&self) -> &Outcome {
        &self.header.report.outcome
    }

    /// How many classes there are.
    pub fn classes(&self) -> usize {
        self.header.classes
    }

    /// The configuration trained with.
    pub fn config(&self) -> &JemConfig {
        &self.header.config
    }

    /// How many numbers were trained.
    pub fn parameters(&self) -> usize {
        self.network.num_params()
    }

    /// A safetensors file, the configuration and the training report in its metadata.
    ///
    /// # Errors
    /// Weights that are not finite.
    pub fn to_bytes(&self) -> Result<Vec<u8>, Error> {
        let mut tensors = Stored::new();
        store::collect("", &self.network, &mut tensors)?;
        store::write(&self.header, &tensors, Precision::F32)
    }

    /// Reads what [`to_bytes`](Self::to_bytes) wrote.
    ///
    /// # Errors
    /// Another kind or version, or tensors that are missing, unknown, misshapen or not finite.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, Error> {
        let (header, tensors): (Header, _) = store::read(bytes)?;
        if (header.kind.as_str(), header.format) != (KIND, FORMAT) {
            let Header { kind, format, .. } = header;
            return Err(Error::Header(format!("kind `{kind}`, format {format}")));
        }
        header.config.validate(header.length)?;
        header.standardizer.check(header.channels)?;
        let mut source = Source::stored(tensors);
        let network =
            Classifier::new(&mut source, &header.config, header.channels, header.classes)?;
        source.finish()?;
        Ok(Self { header, network })
    }
}

fn check_labels(labels: &[usize], classes: usize, windows: usize) -> Result<(), Error> {
    let bad = |reason: String| Err(Error::Labels(reason));
    if classes < 2 {
        return bad(format!("{classes} classes, at least 2 are needed"));
    }
    if labels.len() != windows {
        return bad(format!("{} labels for {windows} windows", labels.len()));
    }
    match labels.iter().position(|&label| label >= classes) {
        Some(index) => bad(format!(
            "label {} of window {index} is no class of {classes}",
            labels[index]
        )),
        None => Ok(()),
    }
}

/// `-logsumexp`, in f64.
fn energy(logits: &[f32]) -> f64 {
    let largest = logits.iter().fold(f32::NEG_INFINITY, |a, &b| a.max(b));
    let sum: f64 = logits
        .iter()
        .map(|&logit| f64::from(logit - largest).exp())
        .sum();
    let energy = -(sum.ln() + f64::from(largest));
    if energy.is_finite() { energy } else { FAR }
}
