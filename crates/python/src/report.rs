//! `Report`: what is said of a log.

use crate::error::{Error, guarded};
use dose3_page::{Page, Told};
use numpy::PyArray1;
use pyo3::prelude::*;
use std::sync::Arc;

/// What is said of one log.
#[pyclass(frozen, module = "dose3._native")]
pub struct Report {
    pub report: dose3::Report,
    /// What a page shows beside the report. Kept for single logs only: thousands of reports stay small.
    pub judged: Option<(Arc<dose3::Detector>, Arc<dose3::Trajectory>)>,
}

impl Report {
    /// Without its log.
    pub fn alone(report: dose3::Report) -> Self {
        Self {
            report,
            judged: None,
        }
    }
}

#[pymethods]
impl Report {
    /// From the JSON that the program or `to_json` wrote.
    #[staticmethod]
    fn from_json(text: &str) -> PyResult<Self> {
        Ok(Self::alone(guarded(|| dose3::Report::from_json(text))?))
    }

    /// As the program writes it.
    fn to_json(&self, pretty: bool) -> PyResult<String> {
        let json = match pretty {
            true => serde_json::to_string_pretty(&self.report),
            false => serde_json::to_string(&self.report),
        };
        json.map_err(|e| Error::new_err(e.to_string()))
    }

    /// The page that `dose3 score --html` writes; none where the log is not there any more.
    fn to_html(&self, py: Python<'_>) -> PyResult<Option<String>> {
        let Some((detector, log)) = &self.judged else {
            return Ok(None);
        };
        let page = || Ok(Page::new(detector, log, &self.report, Told::default())?.html());
        py.detach(|| guarded(page)).map(Some)
    }

    /// The summary that the program prints.
    fn __str__(&self) -> PyResult<String> {
        guarded(|| Ok(self.report.to_string()))
    }

    #[getter]
    fn name(&self) -> &str {
        &self.report.log.name
    }

    #[getter]
    fn path(&self) -> &str {
        &self.report.log.path
    }

    #[getter]
    fn is_ood(&self) -> bool {
        self.report.is_ood()
    }

    #[getter]
    fn chance(&self) -> f64 {
        self.report.evidence.p_value
    }

    #[getter]
    fn score(&self) -> f64 {
        self.report.evidence.mean_score.value()
    }

    #[getter]
    fn notes(&self) -> Vec<String> {
        self.report.notes.clone()
    }

    /// One number a pose as judged; NaN where no window reaches.
    #[getter]
    fn pose_scores<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        let scores = self.report.poses.scores.iter();
        let scores = scores.map(|score| score.map_or(f64::NAN, |s| s.value()));
        PyArray1::from_iter(py, scores)
    }
}
