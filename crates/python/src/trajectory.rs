//! `Trajectory`: a log in memory.

use crate::arrays::{self, Rotations};
use crate::error::guarded;
use crate::reading::reading;
use crate::settings::Settings;
use crate::{tables, work};
use dose3::logs::{self, ReadOptions};
use dose3_datasets::{LoadOptions, Rate, RateSource, load_several_bytes};
use numpy::ndarray::Array3;
use numpy::{PyArray1, PyArray2, PyArray3, PyReadonlyArray1, PyReadonlyArray2, PyReadonlyArray3};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};
use std::path::PathBuf;
use std::sync::{Arc, OnceLock};

/// Poses of a body with their stamps.
#[pyclass(frozen, module = "dose3._native")]
pub struct Trajectory {
    pub log: Arc<dose3::Trajectory>,
    matrices: OnceLock<Array3<f64>>,
}

impl Trajectory {
    pub fn new(log: dose3::Trajectory) -> Self {
        Self {
            log: Arc::new(log),
            matrices: OnceLock::new(),
        }
    }
}

#[pymethods]
impl Trajectory {
    /// From stamps in nanoseconds, positions `(n, 3)` and quaternions `(n, 4)` (x, y, z, w) or matrices `(n, 3, 3)`.
    /// With `rate` the stamps are not the log's own but put in for it.
    #[new]
    #[pyo3(signature = (name, group, frame, stamps, positions, rotations, rate))]
    fn from_arrays(
        name: &str,
        group: Option<String>,
        frame: &str,
        stamps: PyReadonlyArray1<'_, i64>,
        positions: PyReadonlyArray2<'_, f64>,
        rotations: &Bound<'_, PyAny>,
        rate: Option<f64>,
    ) -> PyResult<Self> {
        let frame = crate::settings::parsed("frame", frame)?;
        let quaternions: Option<PyReadonlyArray2<'_, f64>> = rotations.extract().ok();
        let matrices: Option<PyReadonlyArray3<'_, f64>> = rotations.extract().ok();
        let rotations = match (&quaternions, &matrices) {
            (Some(all), _) => Rotations::Quaternions(all.as_array()),
            (None, Some(all)) => Rotations::Matrices(all.as_array()),
            (None, None) => {
                let expected = "rotations: expected float64 of shape (n, 4) or (n, 3, 3)";
                return Err(PyTypeError::new_err(expected));
            }
        };
        let (stamps, positions) = (stamps.as_array().to_vec(), positions.as_array());
        let log = guarded(|| {
            let poses = arrays::poses(name, positions, &rotations)?;
            let mut log = dose3::Trajectory::from_poses(name, frame, stamps, poses)?;
            if let Some(group) = group {
                log.group = group;
            }
            if let Some(hertz) = rate {
                log.rate = Rate {
                    hertz,
                    source: RateSource::Given,
                };
                log.stamp_unit = None;
            }
            Ok(log)
        })?;
        Ok(Self::new(log))
    }

    fn __len__(&self) -> usize {
        self.log.len()
    }

    #[getter]
    fn name(&self) -> &str {
        &self.log.name
    }

    #[getter]
    fn group(&self) -> &str {
        &self.log.group
    }

    #[getter]
    fn path(&self) -> String {
        self.log.path.display().to_string()
    }

    #[getter]
    fn format(&self) -> &'static str {
        self.log.format.name()
    }

    #[getter]
    fn frame(&self) -> &'static str {
        self.log.frame.name()
    }

    /// Hertz.
    #[getter]
    fn rate(&self) -> f64 {
        self.log.rate.hertz
    }

    /// Whether the stamps are the log's own.
    #[getter]
    fn has_stamps(&self) -> bool {
        self.log.rate.source == RateSource::Stamps
    }

    /// Seconds.
    #[getter]
    fn duration(&self) -> f64 {
        self.log.duration()
    }

    /// Metres.
    #[getter]
    fn distance(&self) -> f64 {
        self.log.distance()
    }

    /// What was repaired and assumed while reading, in sentences.
    #[getter]
    fn notes(&self) -> Vec<String> {
        let report = &self.log.report;
        let remarks = report.remarks.iter().map(ToString::to_string);
        report.lines().into_iter().chain(remarks).collect()
    }

    /// SHA-256 over stamps and poses.
    #[getter]
    fn fingerprint(&self) -> String {
        self.log.fingerprint()
    }

    #[getter]
    fn stamps<'py>(this: Bound<'py, Self>) -> Bound<'py, PyArray1<i64>> {
        let log = Arc::clone(&this.get().log);
        // SAFETY: the log is never changed, and `this` keeps it.
        unsafe { arrays::stamps_of(&log.stamps, this.into_any()) }
    }

    #[getter]
    fn positions<'py>(this: Bound<'py, Self>) -> Bound<'py, PyArray2<f64>> {
        let log = Arc::clone(&this.get().log);
        // SAFETY: as for the stamps.
        unsafe { arrays::positions_of(&log.poses, this.into_any()) }
    }

    #[getter]
    fn rotations<'py>(this: Bound<'py, Self>) -> Bound<'py, PyArray3<f64>> {
        let log = Arc::clone(&this.get().log);
        // SAFETY: as for the stamps.
        unsafe { arrays::rotations_of(&log.poses, this.into_any()) }
    }

    #[getter]
    fn poses<'py>(this: Bound<'py, Self>) -> Bound<'py, PyArray3<f64>> {
        let inner = this.get();
        let matrices: *const Array3<f64> = inner
            .matrices
            .get_or_init(|| arrays::matrices(&inner.log.poses));
        // SAFETY: made once, never changed, and `this` keeps it.
        unsafe { arrays::matrices_of(&*matrices, this.into_any()) }
    }

    /// Quaternions `(n, 4)`, x, y, z, w.
    #[getter]
    fn quaternions<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f64>> {
        PyArray2::from_owned_array(py, arrays::quaternions(&self.log.poses))
    }
}

/// Reads logs under paths: files, or folders that are searched.
#[pyfunction]
pub fn read(
    py: Python<'_>,
    paths: Vec<PathBuf>,
    settings: &Bound<'_, PyDict>,
) -> PyResult<Vec<Trajectory>> {
    let settings = Settings::of("load", settings)?;
    let options = reading(&settings)?;
    settings.finish()?;
    let logs = work::run(py, 1, None, |_| logs::read(&paths, &options))?;
    Ok(logs.into_iter().map(Trajectory::new).collect())
}

/// Reads the logs in the bytes of a file; `name` stands for its path.
#[pyfunction]
pub fn read_bytes(
    py: Python<'_>,
    name: &str,
    bytes: &Bound<'_, PyBytes>,
    settings: &Bound<'_, PyDict>,
) -> PyResult<Vec<Trajectory>> {
    let settings = Settings::of("load_bytes", settings)?;
    let options = reading(&settings)?;
    settings.finish()?;
    let bytes = bytes.as_bytes();
    let logs = work::run(py, 1, None, |_| {
        read_from(name, bytes, &options.load, &options)
    })?;
    Ok(logs.into_iter().map(Trajectory::new).collect())
}

/// Reads the logs in an Arrow table: any object with `__arrow_c_stream__`.
#[pyfunction]
pub fn read_table(
    py: Python<'_>,
    name: &str,
    table: &Bound<'_, PyAny>,
    settings: &Bound<'_, PyDict>,
) -> PyResult<Vec<Trajectory>> {
    let settings = Settings::of("load", settings)?;
    let options = reading(&settings)?;
    settings.finish()?;
    let batches = tables::batches(table)?;
    let (text, load) = py.detach(|| tables::text(&batches, &options.load))?;
    let logs = work::run(py, 1, None, |_| {
        read_from(name, text.as_bytes(), &load, &options)
    })?;
    Ok(logs.into_iter().map(Trajectory::new).collect())
}

fn read_from(
    name: &str,
    bytes: &[u8],
    load: &LoadOptions,
    options: &ReadOptions,
) -> dose3::Result<Vec<dose3::Trajectory>> {
    let mut logs = load_several_bytes(name, bytes, load)?;
    logs.iter_mut()
        .try_for_each(|log| logs::apply(log, options))?;
    Ok(logs)
}
