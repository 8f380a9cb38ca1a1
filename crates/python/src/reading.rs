//! How files are read, as keyword arguments.

use crate::settings::{Settings, parsed};
use dose3::logs::ReadOptions;
use dose3_datasets::{Frame, LoadOptions};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use std::collections::BTreeMap;
use std::path::PathBuf;

/// The reading options among `settings`; the names are those of the program's flags.
pub fn reading(settings: &Settings<'_>) -> PyResult<ReadOptions> {
    let usual = LoadOptions::default();
    let stamp: Option<String> = settings.take("stamp")?;
    let record_time = match stamp.as_deref() {
        None | Some("header") => false,
        Some("record") => true,
        Some(other) => {
            return Err(PyValueError::new_err(format!(
                "stamp is {other:?}, expected 'header' or 'record'"
            )));
        }
    };
    let frames: BTreeMap<String, String> = settings.take("frames")?.unwrap_or_default();
    let frames = frames
        .into_iter()
        .map(|(log, frame)| Ok((log, parsed::<Frame>("frames", &frame)?)))
        .collect::<PyResult<_>>()?;
    let lost: Vec<String> = settings.take("lost")?.unwrap_or_default();
    let load = LoadOptions {
        format: settings.parse("format")?,
        times: settings.take::<PathBuf>("times")?,
        max_gap: settings.take("max_gap")?,
        stamp_unit: settings.parse("stamp_unit")?,
        rate: settings.take("rate")?,
        columns: settings.parse("columns")?,
        log_column: settings.take("log_column")?,
        lost: lost
            .iter()
            .map(|kind| parsed("lost", kind))
            .collect::<PyResult<_>>()?,
        strict: settings.take("strict")?.unwrap_or(usual.strict),
        topics: settings.take("topics")?.unwrap_or_default(),
        tf: settings.take("tf")?,
        record_time,
        ..usual
    };
    let options = ReadOptions {
        load,
        frame: settings.parse("frame")?,
        frames,
        nominal_rate: settings.take("nominal_rate")?,
        unit: settings.take("unit")?.unwrap_or(1.0),
    };
    crate::error::guarded(|| options.check())?;
    Ok(options)
}
