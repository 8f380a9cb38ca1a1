//! Pages to look at: one a log, and a list of them where there are several.

use super::super::judge::Judged;
use super::super::sink::Sink;
use super::super::summary::Summary;
use crate::args::Score;
use crate::output_file::Kind;
use crate::per_log::PerLog;
use anyhow::Result;
use dose3::Detector;
use dose3_page::{BEGINS, Entry, Page, Told, list};
use std::path::Path;

const PAGE: Kind = Kind {
    name: "page of an earlier run",
    begins: |start| start.starts_with(BEGINS.as_bytes()),
};

pub struct Pages<'a> {
    files: PerLog,
    detector: &'a Detector,
    told: Told,
    entries: Vec<Entry>,
    many: bool,
}

impl<'a> Pages<'a> {
    pub fn new(path: &Path, args: &Score, detector: &'a Detector) -> Result<Self> {
        Ok(Self {
            files: PerLog::new(path, "html", PAGE, args.showing.force)?,
            detector,
            told: Told {
                detector: Some(args.detector.display().to_string()),
                command: Some(args.command.clone()),
                list: None,
            },
            entries: Vec::new(),
            many: false,
        })
    }
}

impl Sink for Pages<'_> {
    fn log(&mut self, judged: &Judged, many: bool) -> Result<()> {
        self.many |= many;
        let Ok((log, report)) = &judged.outcome else {
            return Ok(());
        };
        let told = Told {
            list: many.then(|| self.files.back()),
            ..self.told.clone()
        };
        let html = Page::new(self.detector, log, report, told)?.html();
        if !many {
            return self.files.single().save(html.as_bytes());
        }
        let file = self.files.of(&report.log.name)?;
        file.save(html.as_bytes())?;
        let address = self.files.address(&file)?;
        self.entries.push(Entry::new(report, address));
        Ok(())
    }

    fn end(self: Box<Self>, summary: &Summary) -> Result<()> {
        // A single log that could not be judged has no page; the list says why.
        if !self.many && summary.errors.is_empty() {
            return Ok(());
        }
        let failed = summary.errors.iter();
        let failed: Vec<(String, String)> = failed
            .map(|failure| (failure.path.clone(), failure.error.clone()))
            .collect();
        let html = list(&self.entries, &failed, &self.told);
        self.files.single().save(html.as_bytes())
    }
}
