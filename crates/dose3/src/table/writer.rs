//! Tables as Parquet files.

use super::Row;
use super::columns::{SCHEMA, columns};
use crate::error::{Error, Result};
use parquet::basic::Compression;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::parser::parse_message_type;
use std::io::Write;
use std::sync::Arc;

/// Rows that are kept in memory before they are written: about 10 MB.
const ROWS: usize = 10_000;

/// Writes rows to a Parquet file, compressed by snappy. Memory does not grow with their number.
///
/// ```
/// use dose3::table::{Row, TableWriter, Versions};
///
/// let versions = Versions { dose3_version: "0.1.0".into(), detector_version: "0.1.0".into() };
/// let mut table = TableWriter::new(Vec::new())?;
/// table.push(Row::failed("drive.txt", "not a log", &versions))?;
/// let bytes = table.end()?;
/// assert_eq!(&bytes[..4], b"PAR1");
/// # Ok::<(), dose3::Error>(())
/// ```
pub struct TableWriter<W: Write + Send> {
    file: SerializedFileWriter<W>,
    rows: Vec<Row>,
}

impl<W: Write + Send> TableWriter<W> {
    /// A table in `sink`.
    ///
    /// # Errors
    /// [`Error::Table`] where nothing can be written.
    pub fn new(sink: W) -> Result<Self> {
        let schema = Arc::new(parse_message_type(SCHEMA).map_err(fault)?);
        let properties = WriterProperties::builder()
            .set_compression(Compression::SNAPPY)
            .set_created_by(format!("dose3 {}", env!("CARGO_PKG_VERSION")))
            .build();
        let file = SerializedFileWriter::new(sink, schema, Arc::new(properties));
        Ok(Self {
            file: file.map_err(fault)?,
            rows: Vec::new(),
        })
    }

    /// The next row.
    ///
    /// # Errors
    /// As [`TableWriter::new`].
    pub fn push(&mut self, row: Row) -> Result<()> {
        self.rows.push(row);
        match self.rows.len() {
            ROWS => self.flush(),
            _ => Ok(()),
        }
    }

    fn flush(&mut self) -> Result<()> {
        let rows = std::mem::take(&mut self.rows);
        let mut group = self.file.next_row_group().map_err(fault)?;
        for column in columns(&rows) {
            let Some(mut writer) = group.next_column().map_err(fault)? else {
                return Err(fault("more columns than the schema has"));
            };
            column.write(&mut writer).map_err(fault)?;
            writer.close().map_err(fault)?;
        }
        group.close().map_err(fault)?;
        Ok(())
    }

    /// Writes what is left, and answers the sink.
    ///
    /// # Errors
    /// As [`TableWriter::new`].
    pub fn end(mut self) -> Result<W> {
        if !self.rows.is_empty() {
            self.flush()?;
        }
        self.file.into_inner().map_err(fault)
    }
}

fn fault(reason: impl ToString) -> Error {
    Error::Table {
        reason: reason.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::table::{Stretch, Versions};
    use parquet::file::reader::{FileReader, SerializedFileReader};
    use parquet::record::{ListAccessor, RowAccessor};

    #[test]
    fn what_was_written_is_read_in_groups_of_rows() {
        let versions = Versions {
            dose3_version: "1".into(),
            detector_version: "2".into(),
        };
        let failed = Row::failed("broken.txt", "no log", &versions);
        let stretch = |first_row| Stretch {
            first_row,
            last_row: first_row + 9,
            start_s: 0.5,
            end_s: 1.5,
            worst_score: 7.25,
        };
        let judged = Row {
            log: Some("drive".into()),
            verdict: "out-of-distribution".into(),
            chance: Some(1e-9),
            windows: Some(12),
            stretches: vec![stretch(3), stretch(40)],
            notes: vec!["interpolated".into()],
            error: None,
            ..failed.clone()
        };
        let mut table = TableWriter::new(tempfile::tempfile().unwrap()).unwrap();
        table.push(judged).unwrap();
        for _ in 0..ROWS {
            table.push(failed.clone()).unwrap();
        }
        let reader = SerializedFileReader::new(table.end().unwrap()).unwrap();
        assert_eq!(reader.num_row_groups(), 2);
        let rows: Vec<_> = reader
            .get_row_iter(None)
            .unwrap()
            .map(std::result::Result::unwrap)
            .collect();
        assert_eq!(rows.len(), ROWS + 1);
        let (first, last) = (&rows[0], &rows[ROWS]);
        assert_eq!(first.get_string(0).unwrap(), "drive");
        assert_eq!(first.get_double(3).unwrap(), 1e-9);
        assert_eq!(first.get_long(10).unwrap(), 12);
        let stretches = first.get_list(14).unwrap();
        assert_eq!(stretches.len(), 2);
        assert_eq!(stretches.get_group(1).unwrap().get_long(0).unwrap(), 40);
        assert_eq!(stretches.get_group(1).unwrap().get_double(4).unwrap(), 7.25);
        assert!(last.get_string(0).is_err() && last.get_double(3).is_err());
        assert_eq!(last.get_string(2).unwrap(), "error");
        assert_eq!(
            last.get_list(14).unwrap().len() + last.get_list(16).unwrap().len(),
            0
        );
        assert_eq!(last.get_string(17).unwrap(), "no log");
        assert_eq!(last.get_string(19).unwrap(), "2");
    }
}
