//! Long work beside Python: without the interpreter's lock, in rayon threads, ended by Ctrl-C.

use crate::error::{panicked, raise};
use dose3::Progress;
use dose3::diffusion::trainer::LogRow;
use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};
use std::collections::HashMap;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc::{self, RecvTimeoutError};
use std::sync::{Arc, LazyLock, Mutex, PoisonError};
use std::time::Duration;

/// How often the waiting thread looks for signals and tells of progress.
pub const POLL: Duration = Duration::from_millis(50);
/// More threads than any machine that this runs on has cores.
const MOST_THREADS: usize = 256;

type Pools = HashMap<(u32, usize), Arc<ThreadPool>>;

/// One pool for each number of threads, and for each process: the threads of a parent are not there in its forks.
static POOLS: LazyLock<Mutex<Pools>> = LazyLock::new(Mutex::default);

/// `threads`, or one for each core where it is 0.
///
/// # Errors
/// `ValueError` for more than any machine has.
pub fn threads(threads: usize) -> PyResult<usize> {
    match threads {
        0 => Ok(std::thread::available_parallelism().map_or(1, usize::from)),
        n if n > MOST_THREADS => Err(PyValueError::new_err(format!(
            "threads is {n}, expected at most {MOST_THREADS} (0: one a core)"
        ))),
        n => Ok(n),
    }
}

fn pool(wanted: usize) -> PyResult<Arc<ThreadPool>> {
    let threads = threads(wanted)?;
    let mut pools = POOLS.lock().unwrap_or_else(PoisonError::into_inner);
    let key = (std::process::id(), threads);
    if let Some(pool) = pools.get(&key) {
        return Ok(Arc::clone(pool));
    }
    let pool = Arc::new(new_pool(threads)?);
    pools.insert(key, Arc::clone(&pool));
    Ok(pool)
}

/// # Errors
/// `RuntimeError` where the system has no more threads.
pub fn new_pool(threads: usize) -> PyResult<ThreadPool> {
    let built = ThreadPoolBuilder::new()
        .num_threads(threads)
        .thread_name(|i| format!("dose3-{i}"))
        .build();
    built.map_err(|e| PyRuntimeError::new_err(format!("cannot start {threads} threads: {e}")))
}

/// What work hears of and tells to the thread that waits for it.
#[derive(Default)]
pub struct Watch {
    stop: AtomicBool,
    done: AtomicUsize,
    total: AtomicUsize,
}

impl Watch {
    /// Asks the work to end at its next window or step.
    pub fn end(&self) {
        self.stop.store(true, Ordering::Relaxed);
    }

    /// Whether it was asked to end.
    pub fn ended(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }
}

/// A [`Watch`] as the library's listener.
pub struct Listener<'w>(pub &'w Watch);

impl Progress for Listener<'_> {
    fn windows(&mut self, done: usize, total: usize) {
        self.0.done.store(done, Ordering::Relaxed);
        self.0.total.store(total, Ordering::Relaxed);
    }

    fn step(&mut self, row: &LogRow) {
        self.0.done.store(row.step, Ordering::Relaxed);
    }

    fn stop(&mut self) -> bool {
        self.0.ended()
    }
}

/// Runs `work` in a pool of so many threads (0: one a core), while this thread waits without the interpreter's lock,
/// runs signal handlers and calls `progress(done, total)`. Where either of them raises, the work is ended and the
/// exception is the answer.
///
/// # Errors
/// What `work` answers; `dose3.InternalError` where it panics; what a signal handler or `progress` raises.
pub fn run<T: Send>(
    py: Python<'_>,
    threads: usize,
    progress: Option<&Py<PyAny>>,
    work: impl FnOnce(&mut dyn Progress) -> dose3::Result<T> + Send,
) -> PyResult<T> {
    let pool = pool(threads)?;
    let watch = &Watch::default();
    let (sender, receiver) = mpsc::channel();
    let answer = move |_: &rayon::Scope<'_>| {
        let result = catch_unwind(AssertUnwindSafe(|| work(&mut Listener(watch))));
        // The receiver outlives this scope.
        let _ = sender.send(result);
    };
    let (result, raised) = py.detach(move || {
        pool.in_place_scope(move |scope| {
            scope.spawn(answer);
            let mut raised = None;
            loop {
                match receiver.recv_timeout(POLL) {
                    Ok(result) => return (Some(result), raised),
                    Err(RecvTimeoutError::Disconnected) => return (None, raised),
                    Err(RecvTimeoutError::Timeout) if raised.is_none() => {
                        raised = Python::attach(|py| look_out(py, watch, progress)).err();
                        if raised.is_some() {
                            watch.end();
                        }
                    }
                    Err(RecvTimeoutError::Timeout) => {}
                }
            }
        })
    });
    match (raised, result) {
        (Some(raised), _) => Err(raised),
        (None, Some(Ok(result))) => result.map_err(raise),
        (None, Some(Err(payload))) => Err(panicked(payload.as_ref())),
        (None, None) => Err(PyRuntimeError::new_err("the work ended without an answer")),
    }
}

fn look_out(py: Python<'_>, watch: &Watch, progress: Option<&Py<PyAny>>) -> PyResult<()> {
    py.check_signals()?;
    let done = watch.done.load(Ordering::Relaxed);
    if let Some(progress) = progress.filter(|_| done > 0) {
        progress.call1(py, (done, watch.total.load(Ordering::Relaxed)))?;
    }
    Ok(())
}
