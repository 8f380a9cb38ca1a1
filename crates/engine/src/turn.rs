//! Chunks that come to a gradient in any order and add to it in theirs.

use std::sync::{Mutex, MutexGuard, PoisonError};

/// Whose turn it is at one gradient, and what has come before its turn.
///
/// Nobody waits here. A chunk that comes too early is laid aside as a value (`T`), and the
/// chunk before it, when it has added its part, is handed it to send it on its way. The lock
/// is held only to look and to note, never while anything is computed.
pub(crate) struct Turn<T> {
    state: Mutex<State<T>>,
}

struct State<T> {
    next: usize,
    early: Vec<(usize, T)>,
}

impl<T> Turn<T> {
    /// Chunk 0 is first.
    pub(crate) fn new() -> Self {
        let (next, early) = (0, Vec::new());
        Self {
            state: Mutex::new(State { next, early }),
        }
    }

    /// Gives `pass` back if it is `chunk`'s turn. Otherwise keeps it until that comes.
    pub(crate) fn arrive(&self, chunk: usize, pass: T) -> Option<T> {
        let mut state = self.state();
        if state.next == chunk {
            return Some(pass);
        }
        state.early.push((chunk, pass));
        None
    }

    /// Ends a chunk's turn. The next chunk, if it has been here already, is to go on now.
    pub(crate) fn end(&self) -> Option<T> {
        let mut state = self.state();
        state.next += 1;
        let next = state.next;
        let at = state.early.iter().position(|(chunk, _)| *chunk == next)?;
        Some(state.early.swap_remove(at).1)
    }

    fn state(&self) -> MutexGuard<'_, State<T>> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use super::Turn;

    #[test]
    fn whoever_comes_early_is_handed_to_the_one_before() {
        let turn = Turn::new();
        assert_eq!(turn.arrive(2, "c"), None);
        assert_eq!(turn.arrive(0, "a"), Some("a"));
        assert_eq!(turn.arrive(1, "b"), None);
        assert_eq!(turn.end(), Some("b"));
        assert_eq!(turn.end(), Some("c"));
        assert_eq!(turn.end(), None);
        assert_eq!(turn.arrive(3, "d"), Some("d"));
    }
}
