//! `Stream`: a log judged while it grows.

use crate::error::{Error, guarded};
use crate::settings::{Settings, parsed};
use dose3::lie::{Matrix, Pose, Rotation, Vector};
use dose3::stream::{Said, StreamOptions};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::sync::{Mutex, MutexGuard, PoisonError};

/// A log that is judged while it grows. What it says is JSON, one document for each thing.
#[pyclass(frozen, module = "dose3._native")]
pub struct Stream(Mutex<dose3::stream::Stream>);

impl Stream {
    pub fn new(
        detector: &dose3::Detector,
        frame: &str,
        settings: &Bound<'_, PyDict>,
    ) -> PyResult<Self> {
        let settings = Settings::of("stream", settings)?;
        let usual = StreamOptions::default();
        let options = StreamOptions {
            alarms_per_hour: settings
                .take("alarms_per_hour")?
                .unwrap_or(usual.alarms_per_hour),
            every: settings.take("every")?,
            rate_hz: settings.take("rate")?,
            max_gap_s: settings.take("max_gap")?,
            reset_m: settings.take("reset")?,
            windows: settings.take("windows")?.unwrap_or(usual.windows),
        };
        settings.finish()?;
        let frame = parsed("frame", frame)?;
        let stream = guarded(|| detector.stream(frame, &options))?;
        Ok(Self(Mutex::new(stream)))
    }

    fn stream(&self) -> MutexGuard<'_, dose3::stream::Stream> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

fn json(said: &[Said]) -> PyResult<Vec<String>> {
    let texts = said.iter().map(serde_json::to_string);
    let texts: Result<_, _> = texts.collect();
    texts.map_err(|e| Error::new_err(e.to_string()))
}

#[pymethods]
impl Stream {
    /// A position and a quaternion, x, y, z, w.
    fn push(
        &self,
        py: Python<'_>,
        stamp_ns: i64,
        position: [f64; 3],
        quaternion: [f64; 4],
    ) -> PyResult<Vec<String>> {
        py.detach(|| {
            let mut stream = self.stream();
            let said = guarded(|| {
                let said = stream.push_quaternion(stamp_ns, position, quaternion)?;
                Ok(said.to_vec())
            })?;
            json(&said)
        })
    }

    /// A position and a rotation matrix, row after row.
    fn push_matrix(
        &self,
        py: Python<'_>,
        stamp_ns: i64,
        position: [f64; 3],
        matrix: [f64; 9],
    ) -> PyResult<Vec<String>> {
        let rotation = Rotation::from_matrix_unchecked(Matrix::from_row_slice(&matrix));
        let pose = Pose::new(rotation, Vector::from(position));
        py.detach(|| {
            let mut stream = self.stream();
            let said = guarded(|| Ok(stream.push(stamp_ns, pose)?.to_vec()))?;
            json(&said)
        })
    }

    /// No pose is to come for now.
    fn finish(&self, py: Python<'_>) -> PyResult<Vec<String>> {
        py.detach(|| {
            let mut stream = self.stream();
            let said = guarded(|| Ok(stream.finish()?.to_vec()))?;
            json(&said)
        })
    }

    fn reset(&self) -> PyResult<()> {
        guarded(|| {
            self.stream().reset();
            Ok(())
        })
    }

    /// The alarm that is raised.
    #[getter]
    fn alarm(&self) -> PyResult<Option<String>> {
        let alarm = guarded(|| Ok(self.stream().alarm()))?;
        let text = alarm.map(|alarm| serde_json::to_string(&alarm)).transpose();
        text.map_err(|e| Error::new_err(e.to_string()))
    }

    #[getter]
    fn windows(&self) -> u64 {
        self.stream().windows()
    }

    #[getter]
    fn pushed(&self) -> u64 {
        self.stream().pushed()
    }
}
