//! Arrow tables, by Arrow's C data interface: pyarrow, polars, pandas and others, none of which is needed here.
//!
//! A table is read as the csv file with the same columns and every digit of its numbers, so that names of columns, units,
//! rows without a pose and several logs in one table mean the same in both.

use crate::error::Error;
use arrow_array::cast::AsArray;
use arrow_array::ffi_stream::{FFI_ArrowArrayStream, RecordBatchStreamReader};
use arrow_array::types::{
    Float32Type, Float64Type, Int8Type, Int16Type, Int32Type, Int64Type, TimestampMicrosecondType,
    TimestampMillisecondType, TimestampNanosecondType, TimestampSecondType, UInt8Type, UInt16Type,
    UInt32Type, UInt64Type,
};
use arrow_array::{Array, RecordBatch};
use arrow_schema::{ArrowError, DataType, TimeUnit};
use dose3_datasets::{Format, LoadOptions, StampUnit};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::PyCapsule;
use std::fmt::Write as _;

/// The name that Arrow gives the capsules of streams.
const STREAM: &std::ffi::CStr = c"arrow_array_stream";

/// The batches of an object with `__arrow_c_stream__`.
pub fn batches(table: &Bound<'_, PyAny>) -> PyResult<Vec<RecordBatch>> {
    let capsule = table.call_method0("__arrow_c_stream__")?;
    let capsule = capsule.cast::<PyCapsule>()?;
    let stream = capsule.pointer_checked(Some(STREAM))?;
    let stream = stream.cast::<FFI_ArrowArrayStream>().as_ptr();
    // SAFETY: a capsule of this name holds a stream; it is moved out, and an empty one is left for the capsule to drop.
    let reader = unsafe { RecordBatchStreamReader::from_raw(stream) };
    let batches: Result<Vec<RecordBatch>, ArrowError> = reader.and_then(Iterator::collect);
    batches.map_err(|e| Error::new_err(format!("the table cannot be read: {e}")))
}

/// The table as text with a header, and the options that read it.
pub fn text(batches: &[RecordBatch], options: &LoadOptions) -> PyResult<(String, LoadOptions)> {
    let mut options = LoadOptions {
        format: options.format.or(Some(Format::Csv)),
        ..options.clone()
    };
    let Some(first) = batches.first() else {
        return Err(Error::new_err("the table has no rows"));
    };
    let schema = first.schema();
    let log_column = options.log_column.as_deref();
    let kept: Vec<usize> = (0..schema.fields().len())
        .filter(|i| {
            is_number(schema.field(*i).data_type()) || log_column == Some(schema.field(*i).name())
        })
        .collect();
    let is_time = |i: &usize| matches!(schema.field(*i).data_type(), DataType::Timestamp(..));
    if options.stamp_unit.is_none() && kept.iter().any(is_time) {
        options.stamp_unit = Some(StampUnit::Nanoseconds);
    }
    let mut out = String::new();
    for (place, i) in kept.iter().enumerate() {
        cell(&mut out, place, schema.field(*i).name())?;
    }
    out.push('\n');
    for batch in batches {
        let columns = kept.iter().map(|i| Cells::of(batch.column(*i).as_ref()));
        let columns = columns.collect::<PyResult<Vec<_>>>()?;
        for row in 0..batch.num_rows() {
            for (place, column) in columns.iter().enumerate() {
                if place > 0 {
                    out.push(',');
                }
                column.write(&mut out, row)?;
            }
            out.push('\n');
        }
    }
    Ok((out, options))
}

fn is_number(kind: &DataType) -> bool {
    kind.is_integer()
        || matches!(
            kind,
            DataType::Float32 | DataType::Float64 | DataType::Timestamp(..)
        )
}

/// A text in a cell of its own.
fn cell(out: &mut String, place: usize, text: &str) -> PyResult<()> {
    if text.contains([',', '"', '\n', '\r']) {
        return Err(Error::new_err(format!(
            "the table has the name {text:?}, expected one without commas, quotes and line ends"
        )));
    }
    if place > 0 {
        out.push(',');
    }
    out.push_str(text);
    Ok(())
}

/// One column of a batch, as numbers or texts.
enum Cells<'a> {
    Float(&'a dyn Array, Box<dyn Fn(usize) -> f64 + 'a>),
    Whole(&'a dyn Array, Box<dyn Fn(usize) -> i128 + 'a>),
    Text(&'a dyn Array, Box<dyn Fn(usize) -> &'a str + 'a>),
}

impl<'a> Cells<'a> {
    fn of(array: &'a dyn Array) -> PyResult<Self> {
        macro_rules! whole {
            ($kind:ty, $factor:expr) => {{
                let values = array.as_primitive::<$kind>();
                Self::Whole(
                    array,
                    Box::new(move |i| i128::from(values.value(i)) * $factor),
                )
            }};
        }
        Ok(match array.data_type() {
            DataType::Float64 => {
                let values = array.as_primitive::<Float64Type>();
                Self::Float(array, Box::new(move |i| values.value(i)))
            }
            DataType::Float32 => {
                let values = array.as_primitive::<Float32Type>();
                Self::Float(array, Box::new(move |i| f64::from(values.value(i))))
            }
            DataType::Int8 => whole!(Int8Type, 1),
            DataType::Int16 => whole!(Int16Type, 1),
            DataType::Int32 => whole!(Int32Type, 1),
            DataType::Int64 => whole!(Int64Type, 1),
            DataType::UInt8 => whole!(UInt8Type, 1),
            DataType::UInt16 => whole!(UInt16Type, 1),
            DataType::UInt32 => whole!(UInt32Type, 1),
            DataType::UInt64 => whole!(UInt64Type, 1),
            DataType::Timestamp(TimeUnit::Second, _) => whole!(TimestampSecondType, 1_000_000_000),
            DataType::Timestamp(TimeUnit::Millisecond, _) => {
                whole!(TimestampMillisecondType, 1_000_000)
            }
            DataType::Timestamp(TimeUnit::Microsecond, _) => whole!(TimestampMicrosecondType, 1000),
            DataType::Timestamp(TimeUnit::Nanosecond, _) => whole!(TimestampNanosecondType, 1),
            DataType::Utf8 => {
                let values = array.as_string::<i32>();
                Self::Text(array, Box::new(move |i| values.value(i)))
            }
            DataType::LargeUtf8 => {
                let values = array.as_string::<i64>();
                Self::Text(array, Box::new(move |i| values.value(i)))
            }
            DataType::Utf8View => {
                let values = array.as_string_view();
                Self::Text(array, Box::new(move |i| values.value(i)))
            }
            other => {
                let found =
                    format!("a column that names logs must hold texts or numbers, found {other}");
                return Err(PyTypeError::new_err(found));
            }
        })
    }

    /// An empty cell for null.
    fn write(&self, out: &mut String, row: usize) -> PyResult<()> {
        let (Self::Float(array, _) | Self::Whole(array, _) | Self::Text(array, _)) = self;
        if array.is_null(row) {
            return Ok(());
        }
        // Writing to a String cannot fail.
        let _ = match self {
            Self::Float(_, value) => write!(out, "{:?}", value(row)),
            Self::Whole(_, value) => write!(out, "{}", value(row)),
            Self::Text(_, value) => return cell(out, 0, value(row)),
        };
        Ok(())
    }
}
