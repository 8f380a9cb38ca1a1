//! The native half of the Python package `dose3`: classes that hold the library's values, and functions that take and
//! give numpy arrays. What users meet is written in Python on top of it (`python/dose3`).
//!
//! Long work runs in rayon threads without the interpreter's lock while the calling thread looks out for signals
//! ([`work`]); a panic becomes `dose3.InternalError` ([`error`]).

mod arrays;
mod detector;
mod error;
mod faults;
mod many;
mod reading;
mod report;
mod settings;
mod stream;
mod tables;
mod training;
mod trajectory;
mod work;

use pyo3::prelude::*;

#[pymodule]
mod _native {
    #[pymodule_export]
    use crate::detector::Detector;
    #[pymodule_export]
    use crate::error::{Error, InternalError};
    #[pymodule_export]
    use crate::faults::{inject, synthetic};
    #[pymodule_export]
    use crate::many::Judging;
    #[pymodule_export]
    use crate::report::Report;
    #[pymodule_export]
    use crate::stream::Stream;
    #[pymodule_export]
    use crate::training::{Model, train};
    #[pymodule_export]
    use crate::trajectory::{Trajectory, read, read_bytes, read_table};

    use pyo3::prelude::*;

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        module.add("__version__", env!("CARGO_PKG_VERSION"))
    }
}
