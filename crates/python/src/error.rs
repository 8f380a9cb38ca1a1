//! Errors and panics as Python exceptions.

use pyo3::PyErr;
use pyo3::create_exception;
use pyo3::exceptions::PyException;
use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind};

create_exception!(
    dose3,
    Error,
    PyException,
    "What dose3 refuses: a file that holds no log, a log that does not fit, a setting out of range. The text names \
     what was found and what was expected."
);
create_exception!(
    dose3,
    InternalError,
    Error,
    "A fault of dose3 itself. Please report it with the text."
);

/// An error of the library as an exception with the library's text.
pub fn raise(error: impl Into<dose3::Error>) -> PyErr {
    Error::new_err(error.into().to_string())
}

/// What a panic said, as an exception.
pub fn panicked(payload: &(dyn Any + Send)) -> PyErr {
    InternalError::new_err(panic_text(payload))
}

/// What a panic said.
pub fn panic_text(payload: &(dyn Any + Send)) -> String {
    let said = payload
        .downcast_ref::<String>()
        .map(String::as_str)
        .or_else(|| payload.downcast_ref::<&str>().copied())
        .unwrap_or("no text");
    format!("dose3 has a fault of its own: {said}; please report it")
}

/// Runs short work; no panic gets past it.
pub fn guarded<T>(work: impl FnOnce() -> dose3::Result<T>) -> Result<T, PyErr> {
    match catch_unwind(AssertUnwindSafe(work)) {
        Ok(result) => result.map_err(raise),
        Err(payload) => Err(panicked(payload.as_ref())),
    }
}
