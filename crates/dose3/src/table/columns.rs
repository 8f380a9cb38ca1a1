//! Rows as columns of a Parquet file.

use super::Row;
use parquet::column::writer::ColumnWriterImpl;
use parquet::data_type::{ByteArray, ByteArrayType, DataType, DoubleType, Int64Type};
use parquet::errors::Result;
use parquet::file::writer::SerializedColumnWriter;

/// The columns of a [`Row`], in the order of [`columns`].
pub(super) const SCHEMA: &str = "
message dose3 {
    optional binary log (STRING);
    required binary path (STRING);
    required binary verdict (STRING);
    optional double chance;
    optional double alpha;
    optional binary decided_by (STRING);
    optional double excess;
    optional double score;
    optional double worst_score;
    optional double threshold;
    optional int64 windows;
    optional int64 beyond;
    optional int64 poses;
    optional double rate_hz;
    required group stretches (LIST) {
        repeated group list {
            required group element {
                required int64 first_row;
                required int64 last_row;
                required double start_s;
                required double end_s;
                required double worst_score;
            }
        }
    }
    required group reasons (LIST) {
        repeated group list {
            required binary element (STRING);
        }
    }
    required group notes (LIST) {
        repeated group list {
            required binary element (STRING);
        }
    }
    optional binary error (STRING);
    required binary dose3_version (STRING);
    required binary detector_version (STRING);
}";

/// Values of a column, and where they stand: which rows have one, and which begin a list.
pub(super) struct Values<T> {
    values: Vec<T>,
    /// 1 for a value, 0 for none (a missing one, an empty list); none for columns where each row has one.
    defined: Option<Vec<i16>>,
    /// 0 for the first of a row, 1 for what follows it in a list; none without lists.
    repeated: Option<Vec<i16>>,
}

impl<T> Values<T> {
    fn required(rows: &[Row], value: impl Fn(&Row) -> T) -> Self {
        Self {
            values: rows.iter().map(value).collect(),
            defined: None,
            repeated: None,
        }
    }

    fn optional(rows: &[Row], value: impl Fn(&Row) -> Option<T>) -> Self {
        let all: Vec<Option<T>> = rows.iter().map(value).collect();
        Self {
            defined: Some(all.iter().map(|v| i16::from(v.is_some())).collect()),
            values: all.into_iter().flatten().collect(),
            repeated: None,
        }
    }

    fn list(rows: &[Row], list: impl Fn(&Row) -> Vec<T>) -> Self {
        let (mut values, mut defined, mut repeated) = (Vec::new(), Vec::new(), Vec::new());
        for row in rows {
            let list = list(row);
            defined.push(i16::from(!list.is_empty()));
            repeated.push(0);
            let more = list.len().saturating_sub(1);
            defined.extend(std::iter::repeat_n(1, more));
            repeated.extend(std::iter::repeat_n(1, more));
            values.extend(list);
        }
        Self {
            values,
            defined: Some(defined),
            repeated: Some(repeated),
        }
    }

    fn write<D: DataType<T = T>>(&self, column: &mut ColumnWriterImpl<'_, D>) -> Result<()> {
        let (defined, repeated) = (self.defined.as_deref(), self.repeated.as_deref());
        column.write_batch(&self.values, defined, repeated)?;
        Ok(())
    }
}

/// A column of one of the three types that there are.
pub(super) enum Column {
    Text(Values<ByteArray>),
    Number(Values<f64>),
    Count(Values<i64>),
}

impl Column {
    pub fn write(&self, column: &mut SerializedColumnWriter<'_>) -> Result<()> {
        match self {
            Self::Text(values) => values.write(column.typed::<ByteArrayType>()),
            Self::Number(values) => values.write(column.typed::<DoubleType>()),
            Self::Count(values) => values.write(column.typed::<Int64Type>()),
        }
    }
}

/// The columns of some rows, as [`SCHEMA`] has them.
pub(super) fn columns(rows: &[Row]) -> Vec<Column> {
    let text =
        |value: fn(&Row) -> &str| Column::Text(Values::required(rows, |row| bytes(value(row))));
    let maybe_text = |value: fn(&Row) -> Option<&String>| {
        Column::Text(Values::optional(rows, |row| value(row).map(|t| bytes(t))))
    };
    let number = |value: fn(&Row) -> Option<f64>| Column::Number(Values::optional(rows, value));
    let count = |value: fn(&Row) -> Option<u64>| {
        Column::Count(Values::optional(rows, |row| value(row).map(whole)))
    };
    let rows_of = |value: fn(&super::Stretch) -> u64| {
        let of = |row: &Row| row.stretches.iter().map(|s| whole(value(s))).collect();
        Column::Count(Values::list(rows, of))
    };
    let numbers_of = |value: fn(&super::Stretch) -> f64| {
        let of = |row: &Row| row.stretches.iter().map(value).collect();
        Column::Number(Values::list(rows, of))
    };
    let texts = |value: fn(&Row) -> &Vec<String>| {
        let of = |row: &Row| value(row).iter().map(|text| bytes(text)).collect();
        Column::Text(Values::list(rows, of))
    };
    vec![
        maybe_text(|row| row.log.as_ref()),
        text(|row| &row.path),
        text(|row| &row.verdict),
        number(|row| row.chance),
        number(|row| row.alpha),
        maybe_text(|row| row.decided_by.as_ref()),
        number(|row| row.excess),
        number(|row| row.score),
        number(|row| row.worst_score),
        number(|row| row.threshold),
        count(|row| row.windows),
        count(|row| row.beyond),
        count(|row| row.poses),
        number(|row| row.rate_hz),
        rows_of(|stretch| stretch.first_row),
        rows_of(|stretch| stretch.last_row),
        numbers_of(|stretch| stretch.start_s),
        numbers_of(|stretch| stretch.end_s),
        numbers_of(|stretch| stretch.worst_score),
        texts(|row| &row.reasons),
        texts(|row| &row.notes),
        maybe_text(|row| row.error.as_ref()),
        text(|row| &row.versions.dose3_version),
        text(|row| &row.versions.detector_version),
    ]
}

fn bytes(text: &str) -> ByteArray {
    ByteArray::from(text.as_bytes().to_vec())
}

/// Counts of poses and rows are far below 2^63.
fn whole(count: u64) -> i64 {
    i64::try_from(count).unwrap_or(i64::MAX)
}
