//! Recordings to look at in Foxglove, PlotJuggler or rerun, one a log.

use super::super::judge::Judged;
use super::super::sink::Sink;
use super::super::summary::Summary;
use crate::args::Score;
use crate::output_file::Kind;
use crate::per_log::PerLog;
use crate::recording::{is_own, recording};
use anyhow::Result;
use dose3::Detector;
use std::path::Path;

/// A user's own recording is an MCAP file too, so the name of the writer counts.
const RECORDING: Kind = Kind {
    name: "recording of an earlier run",
    begins: is_own,
};

pub struct Recordings<'a> {
    files: PerLog,
    detector: &'a Detector,
}

impl<'a> Recordings<'a> {
    pub fn new(path: &Path, args: &Score, detector: &'a Detector) -> Result<Self> {
        Ok(Self {
            files: PerLog::new(path, "mcap", RECORDING, args.showing.force)?,
            detector,
        })
    }
}

impl Sink for Recordings<'_> {
    fn log(&mut self, judged: &Judged, many: bool) -> Result<()> {
        let Ok((log, report)) = &judged.outcome else {
            return Ok(());
        };
        let bytes = recording(self.detector, log, report)?;
        match many {
            true => self.files.of(&report.log.name)?.save(&bytes),
            false => self.files.single().save(&bytes),
        }
    }

    fn end(self: Box<Self>, _: &Summary) -> Result<()> {
        Ok(())
    }
}
