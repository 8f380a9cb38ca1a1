//! Work on many things on several threads, with the results in order and few of them in memory.

use anyhow::Result;
use std::collections::BTreeMap;
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};

/// Finished results that wait for an earlier one, for each worker.
const AHEAD: usize = 4;

/// What the threads share.
struct State<T> {
    /// The next to begin.
    begun: usize,
    /// The next to be taken.
    taken: usize,
    done: BTreeMap<usize, T>,
    /// Whether the taker has left, or a worker has panicked.
    over: bool,
}

struct Shared<T> {
    state: Mutex<State<T>>,
    changed: Condvar,
}

impl<T> Shared<T> {
    fn lock(&self) -> MutexGuard<'_, State<T>> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn wait<'a>(&self, state: MutexGuard<'a, State<T>>) -> MutexGuard<'a, State<T>> {
        self.changed
            .wait(state)
            .unwrap_or_else(PoisonError::into_inner)
    }
}

/// Ends the work of all threads when one leaves early.
struct Leaving<'a, T>(&'a Shared<T>, bool);

impl<T> Drop for Leaving<'_, T> {
    fn drop(&mut self) {
        if self.1 || std::thread::panicking() {
            self.0.lock().over = true;
            self.0.changed.notify_all();
        }
    }
}

/// Calls `work` for 0 to `n` on `workers` threads, each with a tool of its own, and `take` in order on this one. The
/// threads are no tasks of rayon's pool: they may wait for one another while the pool works for them.
///
/// # Errors
/// The first error of `take`, which ends the work.
pub fn ordered<T: Send, W>(
    n: usize,
    workers: usize,
    tool: impl Fn() -> W + Sync,
    work: impl Fn(&mut W, usize) -> T + Sync,
    mut take: impl FnMut(T) -> Result<()>,
) -> Result<()> {
    let workers = workers.clamp(1, n.max(1));
    let state = State {
        begun: 0,
        taken: 0,
        done: BTreeMap::new(),
        over: false,
    };
    let shared = Shared {
        state: Mutex::new(state),
        changed: Condvar::new(),
    };
    let run = || {
        let _leaving = Leaving(&shared, false);
        let mut tool = tool();
        loop {
            let mut state = shared.lock();
            while !state.over && state.begun < n && state.begun >= state.taken + AHEAD * workers {
                state = shared.wait(state);
            }
            if state.over || state.begun >= n {
                return;
            }
            let index = state.begun;
            state.begun += 1;
            drop(state);
            let result = work(&mut tool, index);
            shared.lock().done.insert(index, result);
            shared.changed.notify_all();
        }
    };
    std::thread::scope(|scope| {
        for _ in 0..workers {
            scope.spawn(run);
        }
        // Wherever this thread leaves, the others stop.
        let _leaving = Leaving(&shared, true);
        for index in 0..n {
            let mut state = shared.lock();
            let result = loop {
                if let Some(result) = state.done.remove(&index) {
                    break result;
                }
                if state.over {
                    // The scope passes the worker's panic on.
                    return Ok(());
                }
                state = shared.wait(state);
            };
            state.taken = index + 1;
            drop(state);
            shared.changed.notify_all();
            take(result)?;
        }
        Ok(())
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::{AtomicUsize, Ordering::SeqCst};

    #[test]
    fn results_come_in_order_and_few_wait() {
        for workers in [1, 2, 5] {
            let (begun, mut taken) = (AtomicUsize::new(0), Vec::new());
            let work = |_: &mut (), index: usize| {
                begun.fetch_add(1, SeqCst);
                // The first of every seven takes longest.
                std::thread::sleep(std::time::Duration::from_micros(
                    if index.is_multiple_of(7) { 500 } else { 10 },
                ));
                index
            };
            let take = |index: usize| {
                assert!(begun.load(SeqCst) <= taken.len() + 1 + AHEAD * workers + workers);
                taken.push(index);
                Ok(())
            };
            ordered(100, workers, || (), work, take).unwrap();
            assert_eq!(taken, (0..100).collect::<Vec<_>>());
        }
        ordered(0, 3, || (), |_, i| i, |_| panic!("nothing to take")).unwrap();
    }

    #[test]
    fn an_error_of_the_taker_ends_the_work() {
        let begun = AtomicUsize::new(0);
        let work = |_: &mut (), _| begun.fetch_add(1, SeqCst);
        let error = ordered(1000, 2, || (), work, |_| anyhow::bail!("full")).unwrap_err();
        assert_eq!(error.to_string(), "full");
        assert!(begun.load(SeqCst) <= 2 * AHEAD + 4);
    }

    #[test]
    #[should_panic(expected = "a scoped thread panicked")]
    fn a_panic_of_a_worker_is_passed_on() {
        let work = |_: &mut (), index: usize| assert!(index != 3, "three");
        let _ = ordered(10, 2, || (), work, |()| Ok(()));
    }
}
