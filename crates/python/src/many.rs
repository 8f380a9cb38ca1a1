//! Judging many logs: a log a thread, results in the order of the paths, a few logs in memory at a time.

use crate::detector::Source;
use crate::error::{Error, InternalError, guarded, panic_text};
use crate::report::Report;
use crate::work::{self, Listener, POLL, Watch};
use dose3::logs::{LogFile, ReadOptions, list};
use dose3::{JudgeOptions, Result, Trajectory};
use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyIterator, PyList};
use rayon::ThreadPool;
use std::collections::{HashMap, VecDeque};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::PathBuf;
use std::sync::mpsc::{self, Receiver, RecvTimeoutError, Sender};
use std::sync::{Arc, Mutex, PoisonError};

/// Logs under way for each thread: enough that none waits, few enough that memory stays flat.
const AHEAD: usize = 4;

/// What one thread takes at a time.
enum Task {
    File(LogFile),
    Log(Arc<Trajectory>),
}

type Job = (usize, Task);
type Done = (usize, Vec<Outcome>);

/// What came of one log.
struct Outcome {
    path: String,
    judged: std::result::Result<Box<dose3::Report>, Failure>,
}

enum Failure {
    /// What the library refused.
    Refused(String),
    /// A fault of this package or the library.
    Internal(String),
}

/// Judges one item after another; an iterator of `(path, report, error)`.
#[pyclass(frozen, module = "dose3._native")]
pub struct Judging(Mutex<State>);

struct State {
    items: Option<Py<PyIterator>>,
    /// Files that were found and are still to be judged.
    files: VecDeque<LogFile>,
    reading: Arc<ReadOptions>,
    jobs: Sender<Job>,
    done: Mutex<Receiver<Done>>,
    watch: Arc<Watch>,
    /// Results that came before their turn.
    early: HashMap<usize, Vec<Outcome>>,
    ready: VecDeque<Outcome>,
    sent: usize,
    given: usize,
    most: usize,
    /// Their threads end when the last job is done or the watch says so.
    _pools: Vec<ThreadPool>,
}

impl Judging {
    /// `items` as a list of paths are searched and named together, as the program does; others one by one.
    pub fn new(
        items: &Bound<'_, PyAny>,
        detector: &dose3::Detector,
        options: JudgeOptions,
        reading: ReadOptions,
        threads: usize,
    ) -> PyResult<Self> {
        if let Some(alpha) = options.alpha.filter(|a| !(*a > 0.0 && *a < 1.0)) {
            let found = format!("alpha is {alpha}, expected a share between 0 and 1");
            return Err(PyValueError::new_err(found));
        }
        let threads = work::threads(threads)?;
        let py = items.py();
        let paths: Option<Vec<PathBuf>> = match items.cast::<PyList>() {
            Ok(all) => all.extract().ok(),
            Err(_) => None,
        };
        let files = match &paths {
            Some(paths) => py.detach(|| find(paths, &reading))?,
            None => VecDeque::new(),
        };
        let all = match &paths {
            Some(_) => Some(files.len()),
            None => items.len().ok(),
        };
        let items = match paths {
            Some(_) => None,
            None => Some(items.try_iter()?.unbind()),
        };
        // Few logs and many cores: several threads share a log.
        let workers = all.map_or(threads, |n| n.clamp(1, threads));
        let (jobs, waiting) = mpsc::channel();
        let (sender, done) = mpsc::channel();
        let waiting = Arc::new(Mutex::new(waiting));
        let (watch, reading) = (Arc::new(Watch::default()), Arc::new(reading));
        let mut pools = Vec::with_capacity(workers);
        for _ in 0..workers {
            let worker = Worker {
                detector: detector.clone(),
                options,
                reading: Arc::clone(&reading),
                watch: Arc::clone(&watch),
                jobs: Arc::clone(&waiting),
                done: sender.clone(),
            };
            let pool = work::new_pool(threads / workers)?;
            pool.spawn(move || worker.run());
            pools.push(pool);
        }
        Ok(Self(Mutex::new(State {
            items,
            files,
            reading,
            jobs,
            done: Mutex::new(done),
            watch,
            early: HashMap::new(),
            ready: VecDeque::new(),
            sent: 0,
            given: 0,
            most: AHEAD * workers,
            _pools: pools,
        })))
    }
}

/// One of the threads that judge.
struct Worker {
    detector: dose3::Detector,
    options: JudgeOptions,
    reading: Arc<ReadOptions>,
    watch: Arc<Watch>,
    jobs: Arc<Mutex<Receiver<Job>>>,
    done: Sender<Done>,
}

impl Worker {
    fn run(self) {
        loop {
            // Held while waiting: whoever has it takes the next job.
            let jobs = self.jobs.lock().unwrap_or_else(PoisonError::into_inner);
            let next = jobs.recv();
            drop(jobs);
            let Ok((index, task)) = next else { return };
            if self.watch.ended() {
                return;
            }
            let shown = match &task {
                Task::File(file) => file.path.display().to_string(),
                Task::Log(log) => log.path.display().to_string(),
            };
            let outcomes = catch_unwind(AssertUnwindSafe(|| self.judge(&task, &shown)));
            let outcomes = outcomes.unwrap_or_else(|payload| {
                vec![Outcome {
                    path: shown,
                    judged: Err(Failure::Internal(panic_text(payload.as_ref()))),
                }]
            });
            if self.done.send((index, outcomes)).is_err() {
                return;
            }
        }
    }

    fn judge(&self, task: &Task, shown: &str) -> Vec<Outcome> {
        match task {
            Task::Log(log) => vec![outcome(shown, self.judge_log(log))],
            Task::File(file) => file
                .read(&self.reading)
                .into_iter()
                .map(|log| outcome(shown, log.and_then(|log| self.judge_log(&log))))
                .collect(),
        }
    }

    fn judge_log(&self, log: &Trajectory) -> Result<dose3::Report> {
        let listener = &mut Listener(&self.watch);
        self.detector.judge_with(log, &self.options, listener)
    }
}

fn outcome(path: &str, judged: Result<dose3::Report>) -> Outcome {
    Outcome {
        path: path.to_owned(),
        judged: judged
            .map(Box::new)
            .map_err(|error| Failure::Refused(error.to_string())),
    }
}

impl State {
    /// Keeps the threads busy; pulls no more from Python than that takes.
    fn fill(&mut self, py: Python<'_>) -> PyResult<()> {
        while self.sent - self.given < self.most {
            let Some(task) = self.next_task(py)? else {
                return Ok(());
            };
            let sent = self.jobs.send((self.sent, task));
            sent.map_err(|_| PyRuntimeError::new_err("the threads that judge are gone"))?;
            self.sent += 1;
        }
        Ok(())
    }

    fn next_task(&mut self, py: Python<'_>) -> PyResult<Option<Task>> {
        loop {
            if let Some(file) = self.files.pop_front() {
                return Ok(Some(Task::File(file)));
            }
            let Some(items) = &self.items else {
                return Ok(None);
            };
            let Some(item) = items.bind(py).clone().next() else {
                self.items = None;
                return Ok(None);
            };
            match Source::of(&item?)? {
                Source::Log(log) => return Ok(Some(Task::Log(log))),
                Source::Path(path) => {
                    let reading = Arc::clone(&self.reading);
                    self.files = py.detach(|| find(&[path], &reading))?;
                }
            }
        }
    }

    /// What came of the next log; none after the last.
    fn next(&mut self, py: Python<'_>) -> PyResult<Option<Outcome>> {
        loop {
            if let Some(outcome) = self.ready.pop_front() {
                return Ok(Some(outcome));
            }
            self.fill(py)?;
            if self.given == self.sent {
                return Ok(None);
            }
            let outcomes = loop {
                if let Some(outcomes) = self.early.remove(&self.given) {
                    break outcomes;
                }
                let done = &self.done;
                let wait = || done.lock().map(|done| done.recv_timeout(POLL));
                let arrived = py.detach(|| wait().unwrap_or(Err(RecvTimeoutError::Disconnected)));
                match arrived {
                    Ok((index, outcomes)) => {
                        self.early.insert(index, outcomes);
                    }
                    Err(RecvTimeoutError::Timeout) => py.check_signals()?,
                    Err(RecvTimeoutError::Disconnected) => {
                        return Err(PyRuntimeError::new_err("the threads that judge are gone"));
                    }
                }
            };
            self.given += 1;
            self.ready.extend(outcomes);
        }
    }
}

/// The files with logs under some paths.
fn find(paths: &[PathBuf], reading: &ReadOptions) -> PyResult<VecDeque<LogFile>> {
    guarded(|| Ok(list(paths, reading)?.files.into()))
}

#[pymethods]
impl Judging {
    fn __iter__(this: PyRef<'_, Self>) -> PyRef<'_, Self> {
        this
    }

    #[allow(clippy::type_complexity)]
    fn __next__(
        &self,
        py: Python<'_>,
    ) -> PyResult<Option<(String, Option<Report>, Option<PyErr>)>> {
        // As for generators: whoever waits for the lock would hold the interpreter's.
        let mut state = self
            .0
            .try_lock()
            .map_err(|_| PyValueError::new_err("another thread is waiting for the next report"))?;
        let Some(outcome) = state.next(py)? else {
            return Ok(None);
        };
        let (report, error) = match outcome.judged {
            Ok(report) => (Some(Report::alone(*report)), None),
            Err(Failure::Refused(text)) => (None, Some(Error::new_err(text))),
            Err(Failure::Internal(text)) => (None, Some(InternalError::new_err(text))),
        };
        Ok(Some((outcome.path, report, error)))
    }
}

impl Judging {
    /// Takes all that is left, one after the other.
    pub fn each(
        &self,
        py: Python<'_>,
        mut take: impl FnMut(&str, std::result::Result<&dose3::Report, &str>) -> PyResult<()>,
    ) -> PyResult<()> {
        let mut state = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        while let Some(outcome) = state.next(py)? {
            match &outcome.judged {
                Ok(report) => take(&outcome.path, Ok(report))?,
                Err(Failure::Refused(text) | Failure::Internal(text)) => {
                    take(&outcome.path, Err(text))?;
                }
            }
        }
        Ok(())
    }
}

impl Drop for Judging {
    fn drop(&mut self) {
        let state = self.0.get_mut().unwrap_or_else(PoisonError::into_inner);
        state.watch.end();
    }
}
