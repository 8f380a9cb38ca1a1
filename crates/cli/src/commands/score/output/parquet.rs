//! A Parquet file with a row for each log, the same as Python's `Detector.write_table` writes.

use super::super::judge::Judged;
use super::super::sink::{Sink, Target};
use super::super::summary::Summary;
use super::Head;
use crate::output_file::Writing;
use anyhow::{Result, bail};
use dose3::table::{Row, TableWriter, Versions};

pub struct Parquet {
    table: TableWriter<Writing>,
    versions: Versions,
}

impl Parquet {
    pub fn new(to: Target, head: &Head) -> Result<Self> {
        let Target::File(file) = to else {
            bail!("a Parquet file is no text: name it with --out, such as --out results.parquet");
        };
        Ok(Self {
            table: TableWriter::new(file)?,
            versions: head.versions.clone(),
        })
    }
}

impl Sink for Parquet {
    fn log(&mut self, judged: &Judged, _: bool) -> Result<()> {
        let path = judged.path.display().to_string();
        let row = match &judged.outcome {
            Ok((_, report)) => Row::of(&path, report, &self.versions),
            Err(error) => Row::failed(&path, error, &self.versions),
        };
        Ok(self.table.push(row)?)
    }

    fn end(self: Box<Self>, _: &Summary) -> Result<()> {
        self.table.end()?.end()
    }
}
