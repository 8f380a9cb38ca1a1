//! `Model`, and training one.

use crate::error::{Error, guarded};
use crate::settings::Settings;
use crate::trajectory::Trajectory;
use crate::work;
use dose3::Computing;
use dose3::diffusion::trainer::LogRow;
use dose3::model::{PairConfig, Precision};
use dose3::train::{HoldOut, TrainOptions};
use dose3_datasets::{Kind, resample, same_rate};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Two networks that estimate noise on poses.
#[pyclass(frozen, module = "dose3._native")]
pub struct Model {
    model: Arc<dose3::Model>,
}

impl Model {
    /// The model that a user names: one in memory, the name of a built-in one, or a file; none for the usual one.
    pub fn of(py: Python<'_>, named: &Bound<'_, PyAny>) -> PyResult<Option<dose3::Model>> {
        if named.is_none() {
            return Ok(None);
        }
        if let Ok(model) = named.cast::<Self>() {
            return Ok(Some((*model.get().model).clone()));
        }
        let path: PathBuf = named.extract()?;
        py.detach(|| guarded(|| read(&path))).map(Some)
    }
}

fn read(path: &Path) -> dose3::Result<dose3::Model> {
    match path.to_str() {
        Some("motion") => dose3::built_in::motion(),
        Some("paper") => dose3::built_in::paper(),
        _ => dose3::Model::read(path),
    }
}

#[pymethods]
impl Model {
    /// A built-in model by its name, else from a file.
    #[staticmethod]
    fn load(py: Python<'_>, path: PathBuf) -> PyResult<Self> {
        let model = Arc::new(py.detach(|| guarded(|| read(&path)))?);
        Ok(Self { model })
    }

    #[staticmethod]
    fn from_bytes(bytes: &Bound<'_, PyBytes>) -> PyResult<Self> {
        let (model, _) = guarded(|| dose3::Model::from_bytes(bytes.as_bytes()))?;
        Ok(Self {
            model: Arc::new(model),
        })
    }

    fn save(&self, py: Python<'_>, path: PathBuf, half: bool) -> PyResult<()> {
        py.detach(|| guarded(|| self.model.write(&path, precision(half))))
    }

    fn to_bytes<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        let bytes = guarded(|| self.model.to_bytes(Precision::F32, &[]))?;
        Ok(PyBytes::new(py, &bytes))
    }

    /// What the file says about itself, as JSON.
    fn header(&self) -> PyResult<String> {
        serde_json::to_string(&self.model.header).map_err(|e| Error::new_err(e.to_string()))
    }
}

fn precision(half: bool) -> Precision {
    match half {
        true => Precision::F16,
        false => Precision::F32,
    }
}

/// A trained model, and its training log as JSON: one object a row.
#[pyfunction]
pub fn train(
    py: Python<'_>,
    logs: Vec<PyRef<'_, Trajectory>>,
    settings: &Bound<'_, PyDict>,
    progress: Option<Py<PyAny>>,
) -> PyResult<(Model, String)> {
    let settings = Settings::of("train", settings)?;
    let threads = settings.take("threads")?.unwrap_or(0);
    let rate: Option<f64> = settings.take("resample")?;
    let options = options(&settings)?;
    settings.finish()?;
    let logs: Vec<_> = logs.iter().map(|log| Arc::clone(&log.log)).collect();
    let trained = work::run(py, threads, progress.as_ref(), |listener| {
        let logs = logs.iter().map(|log| at_rate(log, rate));
        let logs = logs.collect::<dose3::Result<Vec<_>>>()?;
        dose3::train::train(&logs, &options, listener)
    })?;
    let rows: Vec<_> = trained.log.iter().map(row).collect();
    let log = serde_json::Value::from(rows).to_string();
    let model = Model {
        model: Arc::new(trained.model),
    };
    Ok((model, log))
}

fn row(row: &LogRow) -> serde_json::Value {
    serde_json::json!({
        "step": row.step,
        "learning_rate": row.learning_rate,
        "translation_eps": row.translation_eps,
        "translation_x0": row.translation_x0,
        "rotation_eps": row.rotation_eps,
        "rotation_x0": row.rotation_x0,
        "translation_validation": row.translation_validation,
        "rotation_validation": row.rotation_validation,
    })
}

fn at_rate(log: &dose3::Trajectory, rate: Option<f64>) -> dose3::Result<dose3::Trajectory> {
    Ok(match rate {
        Some(rate) if log.rate.hertz > rate && !same_rate(log.rate.hertz, rate) => {
            resample(log, rate)?
        }
        _ => log.clone(),
    })
}

fn options(settings: &Settings<'_>) -> PyResult<TrainOptions> {
    let kind: Kind = settings.parse("representation")?.unwrap_or(Kind::Motion);
    let mut options = TrainOptions::of(kind);
    if let Some(window) = settings.take("window")? {
        options.window = window;
    }
    let width = settings.take("width")?;
    let multipliers: Option<Vec<usize>> = settings.take("multipliers")?;
    if width.is_some() || multipliers.is_some() {
        let multipliers = multipliers.unwrap_or_else(|| vec![1, 2, 4]);
        options.network = PairConfig::new(width.unwrap_or(16), &multipliers);
    }
    if let Some(steps) = settings.take("diffusion_steps")? {
        options.process.steps = steps;
    }
    let config = &mut options.config;
    config.steps = settings.take("steps")?.unwrap_or(config.steps);
    config.batch = settings.take("batch")?.unwrap_or(config.batch);
    let learning_rate = settings.take("learning_rate")?;
    config.learning_rate = learning_rate.unwrap_or(config.learning_rate);
    config.seed = settings.take("seed")?.unwrap_or(config.seed);
    if let Some(hold_out) = settings.any("hold_out")? {
        options.hold_out = match hold_out.extract::<f64>() {
            Ok(share) => HoldOut::Fraction(share),
            Err(_) => HoldOut::Names(hold_out.extract()?),
        };
    }
    options.checkpoint = settings.take("checkpoint")?;
    options.computing = Computing::default();
    Ok(options)
}
