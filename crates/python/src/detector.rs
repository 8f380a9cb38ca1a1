//! `Detector`: fitted to trusted logs, judges others.

use crate::error::{Error, guarded};
use crate::many::Judging;
use crate::reading::reading;
use crate::report::Report;
use crate::settings::{Settings, parsed};
use crate::stream::Stream;
use crate::training::Model;
use crate::trajectory::Trajectory;
use crate::work;
use dose3::atomic::Unfinished;
use dose3::datasets::make_unique;
use dose3::diffusion::NoiseSharing;
use dose3::logs::{ReadOptions, find_each};
use dose3::table::{Row, TableWriter, Versions};
use dose3::{FitOptions, JudgeOptions};
use dose3_datasets::GroupBy;
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};
use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError};

/// A detector. Threads that judge at once each have a copy, because one copy judges one log after another.
#[pyclass(frozen, module = "dose3._native")]
pub struct Detector {
    pub detector: Arc<dose3::Detector>,
    idle: Mutex<Vec<dose3::Detector>>,
}

impl Detector {
    fn new(detector: dose3::Detector) -> Self {
        Self {
            detector: Arc::new(detector),
            idle: Mutex::default(),
        }
    }

    fn take(&self) -> dose3::Detector {
        let mut idle = self.idle.lock().unwrap_or_else(PoisonError::into_inner);
        idle.pop().unwrap_or_else(|| (*self.detector).clone())
    }

    fn give_back(&self, detector: dose3::Detector) {
        let mut idle = self.idle.lock().unwrap_or_else(PoisonError::into_inner);
        idle.push(detector);
    }
}

#[pymethods]
impl Detector {
    /// A detector and what there is to know beside it, in sentences.
    #[staticmethod]
    #[pyo3(signature = (logs, model, group, settings, progress))]
    fn fit(
        py: Python<'_>,
        logs: &Bound<'_, PyAny>,
        model: &Bound<'_, PyAny>,
        group: &Bound<'_, PyAny>,
        settings: &Bound<'_, PyDict>,
        progress: Option<Py<PyAny>>,
    ) -> PyResult<(Self, Vec<String>)> {
        let settings = Settings::of("fit", settings)?;
        let threads = settings.take("threads")?.unwrap_or(0);
        let mut builder = dose3::Detector::builder().options(fit_options(&settings)?);
        if let Some(model) = Model::of(py, model)? {
            builder = builder.model(model);
        }
        let reading = reading(&settings)?;
        settings.finish()?;
        let builder = builder.leave_out(!reading.load.strict);
        let (sources, group) = (sources(logs)?, grouping(group)?);
        let (fitted, notes) = work::run(py, threads, progress.as_ref(), |listener| {
            let (mut trusted, mut notes) = gather(sources, &reading)?;
            group.apply(&mut trusted)?;
            let fitted = builder.run(&trusted, listener)?;
            let left_out = fitted.left_out.iter();
            notes.extend(
                left_out
                    .map(|left| format!("left out {}: {}", trusted[left.index].name, left.reason)),
            );
            notes.extend(fitted.notes.iter().map(ToString::to_string));
            Ok((fitted, notes))
        })?;
        Ok((Self::new(fitted.detector), notes))
    }

    /// From a file.
    #[staticmethod]
    fn load(py: Python<'_>, path: PathBuf) -> PyResult<Self> {
        let detector = py.detach(|| guarded(|| dose3::Detector::load(&path)))?;
        Ok(Self::new(detector))
    }

    /// From the bytes of a file.
    #[staticmethod]
    fn from_bytes(py: Python<'_>, bytes: &Bound<'_, PyBytes>) -> PyResult<Self> {
        let bytes = bytes.as_bytes();
        let detector = py.detach(|| guarded(|| dose3::Detector::from_bytes(bytes)))?;
        Ok(Self::new(detector))
    }

    /// Writes a file, whole or not at all.
    fn save(&self, py: Python<'_>, path: PathBuf) -> PyResult<()> {
        py.detach(|| guarded(|| self.detector.save(&path)))
    }

    /// The bytes of a file.
    fn to_bytes<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        let bytes = py.detach(|| guarded(|| self.detector.to_bytes()))?;
        Ok(PyBytes::new(py, &bytes))
    }

    fn judge(
        &self,
        py: Python<'_>,
        log: &Trajectory,
        alpha: Option<f64>,
        threads: usize,
    ) -> PyResult<Report> {
        let options = JudgeOptions { alpha };
        let detector = self.take();
        let judged = work::run(py, threads, None, |listener| {
            detector.judge_with(&log.log, &options, listener)
        });
        self.give_back(detector);
        Ok(Report {
            report: judged?,
            judged: Some((Arc::clone(&self.detector), Arc::clone(&log.log))),
        })
    }

    /// An iterator over what is said of each item, a path or a log, of a list or an iterable.
    fn judge_many(
        &self,
        items: &Bound<'_, PyAny>,
        alpha: Option<f64>,
        threads: usize,
        settings: &Bound<'_, PyDict>,
    ) -> PyResult<Judging> {
        let settings = Settings::of("judge_many", settings)?;
        let reading = reading(&settings)?;
        settings.finish()?;
        Judging::new(
            items,
            &self.detector,
            JudgeOptions { alpha },
            reading,
            threads,
        )
    }

    /// Judges items as `judge_many` does and writes a row for each log to a Parquet file, whole or not at all. Answers
    /// how many could be judged, differ, and could not be judged.
    fn write_table(
        &self,
        py: Python<'_>,
        path: PathBuf,
        items: &Bound<'_, PyAny>,
        alpha: Option<f64>,
        threads: usize,
        settings: &Bound<'_, PyDict>,
    ) -> PyResult<(usize, usize, usize)> {
        let versions = Versions::of(&self.detector);
        let mut table = guarded(|| TableWriter::new(Unfinished::begin(&path)?))?;
        let judging = self.judge_many(items, alpha, threads, settings)?;
        let (mut judged, mut differ, mut failed) = (0, 0, 0);
        judging.each(py, |path, outcome| {
            let row = match outcome {
                Ok(report) => {
                    judged += 1;
                    differ += usize::from(report.is_ood());
                    Row::of(path, report, &versions)
                }
                Err(error) => {
                    failed += 1;
                    Row::failed(path, error, &versions)
                }
            };
            guarded(|| table.push(row))
        })?;
        guarded(|| table.end()?.end())?;
        Ok((judged, differ, failed))
    }

    /// Judges poses of a body with these axes as they come.
    fn stream(&self, frame: &str, settings: &Bound<'_, PyDict>) -> PyResult<Stream> {
        Stream::new(&self.detector, frame, settings)
    }

    /// The row of a table for a log, as JSON.
    fn row(&self, path: &str, report: Option<&Report>, error: Option<&str>) -> PyResult<String> {
        let versions = Versions::of(&self.detector);
        let row = match report {
            Some(report) => Row::of(path, &report.report, &versions),
            None => Row::failed(path, error.unwrap_or("no report"), &versions),
        };
        serde_json::to_string(&row).map_err(|e| Error::new_err(e.to_string()))
    }

    /// Share of trusted logs that may be rejected.
    #[getter]
    fn alpha(&self) -> f64 {
        self.detector.header().statistics.config().alpha
    }

    /// The statistics, as they are written.
    #[getter]
    fn statistics(&self) -> String {
        let config = self.detector.header().statistics.config();
        config.statistics.to_string()
    }

    /// Rate at which logs are measured, hertz.
    #[getter]
    fn rate(&self) -> f64 {
        self.detector.header().rate
    }

    /// Body frame of the trusted logs.
    #[getter]
    fn frame(&self) -> &'static str {
        self.detector.header().frame.name()
    }

    /// Names of the trusted logs.
    #[getter]
    fn trusted(&self) -> Vec<String> {
        let trusted = self.detector.header().trusted.iter();
        trusted.map(|log| log.name.clone()).collect()
    }

    /// Version of dose3 that fitted it.
    #[getter]
    fn version(&self) -> &str {
        &self.detector.header().version
    }
}

/// One thing to read, or a log that is there.
pub enum Source {
    Path(PathBuf),
    Log(Arc<dose3::Trajectory>),
}

impl Source {
    pub fn of(item: &Bound<'_, PyAny>) -> PyResult<Self> {
        if let Ok(log) = item.cast::<Trajectory>() {
            return Ok(Self::Log(Arc::clone(&log.get().log)));
        }
        item.extract().map(Self::Path).map_err(|_| {
            let found = item.get_type().to_string();
            PyTypeError::new_err(format!("expected a path or a log, found {found}"))
        })
    }
}

fn sources(logs: &Bound<'_, PyAny>) -> PyResult<Vec<Source>> {
    logs.try_iter()?.map(|item| Source::of(&item?)).collect()
}

/// The logs, and what was left out. Paths in a row are read as the program reads its arguments.
fn gather(
    sources: Vec<Source>,
    reading: &ReadOptions,
) -> dose3::Result<(Vec<dose3::Trajectory>, Vec<String>)> {
    let (mut logs, mut notes, mut paths) = (Vec::new(), Vec::new(), Vec::new());
    for source in sources {
        match source {
            Source::Path(path) => paths.push(path),
            Source::Log(log) => {
                read(&mut paths, reading, &mut logs, &mut notes)?;
                logs.push((*log).clone());
            }
        }
    }
    read(&mut paths, reading, &mut logs, &mut notes)?;
    make_unique(&mut logs);
    Ok((logs, notes))
}

fn read(
    paths: &mut Vec<PathBuf>,
    reading: &ReadOptions,
    logs: &mut Vec<dose3::Trajectory>,
    notes: &mut Vec<String>,
) -> dose3::Result<()> {
    let found = find_each(&std::mem::take(paths), reading)?;
    let skipped = found.skipped.iter();
    notes.extend(skipped.map(|(path, why)| format!("skipped {}: {why}", path.display())));
    for (path, log) in found.logs {
        match log {
            Ok(log) => logs.push(log),
            Err(error) if reading.load.strict => return Err(error),
            Err(error) => notes.push(format!("left out {}: {error}", path.display())),
        }
    }
    Ok(())
}

/// Which logs count as one.
enum Grouping {
    Own,
    By(GroupBy),
    Named(Vec<String>),
}

fn grouping(group: &Bound<'_, PyAny>) -> PyResult<Grouping> {
    if group.is_none() {
        return Ok(Grouping::Own);
    }
    if let Ok(text) = group.extract::<String>() {
        return parsed("group", &text).map(Grouping::By);
    }
    group.extract().map(Grouping::Named).map_err(|_| {
        PyTypeError::new_err("group: expected 'folder', a pattern with {}, or a name for each log")
    })
}

impl Grouping {
    fn apply(self, logs: &mut [dose3::Trajectory]) -> dose3::Result<()> {
        match self {
            Self::Own => {}
            Self::By(by) => by.apply(logs)?,
            Self::Named(names) => {
                if names.len() != logs.len() {
                    return Err(dose3::datasets::Error::Parameter {
                        what: "number of groups",
                        expected: "that of the logs that can be read",
                        found: format!("{} groups for {} logs", names.len(), logs.len()),
                    }
                    .into());
                }
                for (log, name) in logs.iter_mut().zip(names) {
                    log.group = name;
                }
            }
        }
        Ok(())
    }
}

fn fit_options(settings: &Settings<'_>) -> PyResult<FitOptions> {
    let usual = FitOptions::default();
    let noise: Option<String> = settings.take("noise")?;
    let noise = match noise.as_deref() {
        None => usual.noise,
        Some("shared") => NoiseSharing::Shared,
        Some("own") => NoiseSharing::Own,
        Some(other) => {
            let found = format!("noise is {other:?}, expected 'shared' or 'own'");
            return Err(PyValueError::new_err(found));
        }
    };
    Ok(FitOptions {
        statistics: settings.parse("statistics")?,
        density: settings.parse("density")?.unwrap_or(usual.density),
        combination: settings.parse("combination")?,
        shares: settings.take("shares")?,
        join_overlapping: settings.take("overlap")?.unwrap_or(usual.join_overlapping),
        timing: settings.take("timing")?.unwrap_or(usual.timing),
        calibration: settings.take("calibration")?.unwrap_or(usual.calibration),
        keep_all: settings.take("keep_all")?.unwrap_or(usual.keep_all),
        alpha: settings.take("alpha")?.unwrap_or(usual.alpha),
        rate: settings.take("resample")?,
        window: settings.take("window")?,
        stride: settings.take("stride")?.unwrap_or(usual.stride),
        steps: settings.take("steps")?,
        draws: settings.take("draws")?,
        noise,
        seed: settings.take("seed")?.unwrap_or(usual.seed),
    })
}
