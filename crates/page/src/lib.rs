#![doc = include_str!("../README.md")]

mod data;
mod escape;
mod index;
mod quantities;
mod sections;
mod thin;
mod views;
mod words;

pub use index::{Entry, list};

use data::Data;
use dose3::{Detector, Report, Result, Trajectory};
use escape::{Text, fill};

/// How every page begins, so that a program can tell its own pages from other files.
pub const BEGINS: &str = "<!doctype html>\n<!-- dose3 page -->";

/// What the caller knows and a report does not say.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Told {
    /// The detector's file.
    pub detector: Option<String>,
    /// The command that made the page, to be shown as what repeats it.
    pub command: Option<String>,
    /// The page that lists this one among others: its address seen from this page.
    pub list: Option<String>,
}

/// The page of one log.
pub struct Page<'a> {
    detector: &'a Detector,
    read: &'a Trajectory,
    report: &'a Report,
    data: Data,
    told: Told,
}

impl<'a> Page<'a> {
    /// Of `report`, which `detector` gave of `log`. A report that was read back from JSON has no scores of single
    /// poses; their chart is then left out.
    ///
    /// # Errors
    /// A log that `detector` does not judge, which is then not the one of `report`.
    pub fn new(
        detector: &'a Detector,
        log: &'a Trajectory,
        report: &'a Report,
        told: Told,
    ) -> Result<Self> {
        let series = detector.series(log, report)?;
        Ok(Self {
            data: Data::new(detector, &series, log.frame, report),
            detector,
            read: log,
            report,
            told,
        })
    }

    /// The whole file. The same input gives the same bytes.
    #[must_use]
    pub fn html(&self) -> String {
        let (report, log) = (self.report, self.read);
        let (verdict, _) = words::verdict(report);
        let title = Text(format!("{}: {verdict}", report.log.name)).to_string();
        let list = match &self.told.list {
            Some(address) => format!("<nav><a href=\"{}\">all logs</a></nav>", Text(address)),
            None => String::new(),
        };
        fill(
            include_str!("assets/page.html"),
            &[
                ("begins", BEGINS),
                ("title", &title),
                ("style", include_str!("assets/page.css")),
                ("uplot-style", include_str!("assets/uplot/uPlot.min.css")),
                ("list", &list),
                ("head", &sections::verdict::head(report, log)),
                ("reasons", &sections::reasons::html(report)),
                ("places", &sections::places::html(report)),
                ("trusted", &sections::trusted::html(self.detector, report)),
                ("timing", &sections::body::timing(report, log)),
                ("calibration", &sections::body::calibration(report)),
                ("reading", &sections::reading::html(report, log)),
                ("made", &sections::verdict::made(report)),
                ("repeat", &sections::repeat::html(self.detector, &self.told)),
                ("data", &escape::json(&self.data)),
                ("uplot", include_str!("assets/uplot/uPlot.iife.min.js")),
                ("paths", include_str!("assets/paths.js")),
                ("charts", include_str!("assets/charts.js")),
                ("page", include_str!("assets/page.js")),
                ("copy", include_str!("assets/copy.js")),
            ],
        )
    }
}
