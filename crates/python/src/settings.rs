//! Keyword arguments from Python, each taken once; what is left over is an error.

use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::fmt::Display;
use std::str::FromStr;

/// Keyword arguments.
pub struct Settings<'py> {
    function: &'static str,
    left: Bound<'py, PyDict>,
}

impl<'py> Settings<'py> {
    /// The arguments of `function`.
    pub fn of(function: &'static str, given: &Bound<'py, PyDict>) -> PyResult<Self> {
        let left = given.copy()?;
        Ok(Self { function, left })
    }

    /// An argument as it is; none where it is missing or `None`.
    pub fn any(&self, name: &str) -> PyResult<Option<Bound<'py, PyAny>>> {
        let Some(value) = self.left.get_item(name)? else {
            return Ok(None);
        };
        self.left.del_item(name)?;
        Ok(Some(value).filter(|value| !value.is_none()))
    }

    /// An argument of a type that Python has.
    pub fn take<T: for<'a> FromPyObject<'a, 'py>>(&self, name: &str) -> PyResult<Option<T>> {
        let Some(value) = self.any(name)? else {
            return Ok(None);
        };
        let taken = value.extract::<T>().map_err(Into::<PyErr>::into);
        let taken = taken.map_err(|error| {
            let found = value
                .repr()
                .map_or_else(|_| "?".to_owned(), |r| r.to_string());
            PyTypeError::new_err(format!("{name}={found}: {}", error.value(value.py())))
        });
        taken.map(Some)
    }

    /// An argument that is written as a text.
    pub fn parse<T: FromStr<Err: Display>>(&self, name: &str) -> PyResult<Option<T>> {
        self.take::<String>(name)?
            .map(|text| parsed(name, &text))
            .transpose()
    }

    /// Refuses arguments that nobody took.
    pub fn finish(self) -> PyResult<()> {
        match self.left.keys().iter().next() {
            None => Ok(()),
            Some(name) => Err(PyTypeError::new_err(format!(
                "{}() got an unexpected keyword argument '{name}'",
                self.function
            ))),
        }
    }
}

/// A text as what it names.
pub fn parsed<T: FromStr<Err: Display>>(name: &str, text: &str) -> PyResult<T> {
    text.parse()
        .map_err(|error| PyValueError::new_err(format!("{name}: {error}")))
}
