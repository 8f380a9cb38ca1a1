//! What is written at the end: page, tables and numbers.

use super::experiment::Experiment;
use super::figures::{Figure, RocPanel};
use super::findings::{Findings, Outcome};
use super::page::{Section, page};
use super::readings::readings;
use super::record::{Curve, MEASUREMENT, Record};
use super::shortfalls::shortfalls;
use super::table::Table;
use super::{cost, tables};
use crate::options::Options;
use crate::provenance::{Provenance, write_document};
use crate::rows::{KINEMATIC, LEARNED, R3, Row, SIX_PATH, SPLIT, SPLIT_SHARED2};
use crate::split::Split;
use anyhow::Result;
use dose3::atomic;
use serde::Serialize;
use std::path::{Path, PathBuf};

/// Figures that may stand in the repository: they show numbers of many windows, no path of a data set.
const PUBLISHED: [&str; 2] = ["epsilon", "roc"];
/// Where they go, beside the document.
const FIGURES: &str = "figures";

/// Where the numbers come from.
#[derive(Serialize)]
pub struct Report {
    /// How the real data was found; none for synthetic data.
    pub source: Option<String>,
    /// Command, commit, machine, time.
    #[serde(flatten)]
    pub provenance: Provenance,
    /// Whether results of earlier runs were taken up where they were the same.
    pub resumed: bool,
    /// Density over the statistics.
    pub density: String,
    /// Fewer windows, steps and seeds.
    pub quick: bool,
    /// Seconds of training the shipped network.
    pub training: Option<f64>,
    /// Figures that could not be drawn, and why.
    pub missing: Vec<String>,
}

#[derive(Serialize)]
struct Json<'a> {
    report: &'a Report,
    measurement: u32,
    experiments: Vec<JsonExperiment<'a>>,
    not_run: Vec<JsonMissing<'a>>,
}

#[derive(Serialize)]
struct JsonExperiment<'a> {
    name: String,
    experiment: &'a Experiment,
    record: &'a Record,
}

#[derive(Serialize)]
struct JsonMissing<'a> {
    name: String,
    experiment: &'a Experiment,
    reason: &'a str,
}

/// What the ROC figure's own caption cannot know.
pub const ROC_CAPTION: &str = " Windows of the main table, split held-out, first training seed.";

/// The curves of the main table's rows that a figure has room for, a panel a cell.
pub fn roc_panels(findings: &Findings) -> Vec<RocPanel> {
    let (first, learned) = (Experiment::first(), Experiment::learned()[0]);
    let rows: [(Experiment, Row, &str); 7] = [
        (first, SPLIT, "SE(3) split, own noise"),
        (first, SPLIT_SHARED2, "SE(3) split, two shared draws"),
        (first, R3, "R^3"),
        (first, SIX_PATH, "DiffPath 6-D"),
        (first, KINEMATIC, "kinematics, no network"),
        (learned, LEARNED[1], "Glow-LR"),
        (learned, LEARNED[0], "JEM"),
    ];
    let panel = |(id, ood): &(char, char)| {
        let title = format!("{id}/{ood}");
        let curve = |(experiment, row, label): &(Experiment, Row, &str)| {
            let found = findings.row(experiment, row, Split::HeldOut)?;
            let curve = found.curves.iter().find(|c| c.label == title)?;
            Some(Curve {
                label: (*label).to_string(),
                points: curve.points.clone(),
            })
        };
        let curves: Vec<Curve> = rows.iter().filter_map(curve).collect();
        (!curves.is_empty()).then_some(RocPanel { title, curves })
    };
    findings.columns.iter().filter_map(panel).collect()
}

impl Report {
    /// Writes all.html, all.md and all.json, and the document of the folder that was asked for.
    ///
    /// # Errors
    /// Files that cannot be written.
    pub fn write(
        &self,
        options: &Options,
        findings: &Findings,
        figures: Vec<Figure>,
    ) -> Result<()> {
        let paper = Section {
            title: "The paper's tables",
            anchor: "tables",
            tables: {
                let mut all = tables::main(findings);
                all.extend([
                    cost::cost(findings, self.training),
                    tables::training_sets(findings),
                    tables::lengths(findings),
                    tables::steps(findings),
                ]);
                all
            },
            figures: Vec::new(),
        };
        let honest = Section {
            title: "What to make of them",
            anchor: "reading",
            tables: vec![
                shortfalls(findings),
                tables::metrics(findings),
                readings(findings),
                tables::data(findings),
            ],
            figures: Vec::new(),
        };
        let drawn = Section {
            title: "Figures",
            anchor: "figures",
            tables: Vec::new(),
            figures,
        };
        let sections = [paper, drawn, honest];
        let facts = self.facts(findings);
        let html = page(
            "DOSE3: the tables and figures of the paper, reproduced",
            self.warning().as_deref(),
            &facts,
            &sections,
        );
        let markdown = self.markdown(&facts, &sections);
        atomic::write(&options.out.join("all.html"), html.as_bytes())?;
        atomic::write(&options.out.join("all.md"), markdown.as_bytes())?;
        atomic::write(
            &options.out.join("all.json"),
            serde_json::to_string_pretty(&self.json(findings))?.as_bytes(),
        )?;
        say!(
            "wrote {}, all.md and all.json",
            options.out.join("all.html").display()
        );
        if let Some(path) = &options.render {
            let path = self.render(path, &markdown, &sections, findings)?;
            say!("updated {}", path.display());
        }
        Ok(())
    }

    fn json<'a>(&'a self, findings: &'a Findings) -> Json<'a> {
        let (mut experiments, mut not_run) = (Vec::new(), Vec::new());
        for (experiment, outcome) in &findings.outcomes {
            let name = experiment.name();
            match outcome {
                Outcome::Found(record) => experiments.push(JsonExperiment {
                    name,
                    experiment,
                    record,
                }),
                Outcome::NotRun(reason) => not_run.push(JsonMissing {
                    name,
                    experiment,
                    reason,
                }),
            }
        }
        Json {
            report: self,
            measurement: MEASUREMENT,
            experiments,
            not_run,
        }
    }

    fn warning(&self) -> Option<String> {
        let mut parts = Vec::new();
        if self.source.is_none() {
            parts.push(
                "SYNTHETIC data, generated by the benchmark. These numbers say that the pipeline works; they \
                 say nothing about the paper's tables.",
            );
        }
        if self.quick {
            parts.push(
                "`--quick`: a fifth of the windows, a third of the diffusion steps, one seed.",
            );
        }
        (!parts.is_empty()).then(|| parts.join(" "))
    }

    fn facts(&self, findings: &Findings) -> Vec<String> {
        let records = findings.outcomes.iter();
        let seconds: f64 = records
            .filter_map(|(experiment, _)| findings.found(experiment))
            .map(|record| record.seconds)
            .sum();
        let taken_up = match self.resumed {
            true => " (experiments that an earlier run had finished are taken up)",
            false => "",
        };
        let [command, origin] = self.provenance.lines();
        let mut facts = vec![
            command,
            format!(
                "{origin}{taken_up}; all experiments together {seconds:.0} s; density `{}`.",
                self.density
            ),
            "X/Y: in-distribution set X (it fits the density), out-of-distribution set Y. A higher score is more \
             OOD. Networks are trained once and never retrained for a column."
                .to_string(),
        ];
        if let Some(found) = findings
            .found(&Experiment::reference())
            .and_then(|r| r.network.as_ref())
        {
            facts.push(format!(
                "Networks trained on KITTI saw logs {}.",
                found.trained_on.join(", ")
            ));
        }
        facts.extend(
            self.missing
                .iter()
                .map(|reason| format!("Not drawn: {reason}.")),
        );
        facts
    }

    fn markdown(&self, facts: &[String], sections: &[Section]) -> String {
        let mut out = String::new();
        if let Some(warning) = self.warning() {
            out += &format!("**{warning}**\n\n");
        }
        out += &facts.join("\n\n");
        out += "\n\n";
        out += &sections
            .iter()
            .flat_map(|s| &s.tables)
            .map(Table::markdown)
            .collect::<String>();
        out
    }

    /// Writes the tables as a document, and figures that may be published beside it.
    fn render(
        &self,
        folder: &Path,
        markdown: &str,
        sections: &[Section],
        findings: &Findings,
    ) -> Result<PathBuf> {
        let mut text = markdown.to_string();
        for figure in sections.iter().flat_map(|s| &s.figures) {
            if !PUBLISHED.iter().any(|key| figure.key.starts_with(key)) {
                continue;
            }
            let name = format!("{}.svg", figure.key);
            atomic::write(&folder.join(FIGURES).join(&name), figure.svg.as_bytes())?;
            text += &format!(
                "### {}\n\n![{}]({FIGURES}/{name})\n\n{}\n\n",
                figure.title, figure.title, figure.caption
            );
        }
        let name = match findings.real {
            true => "paper-tables",
            false => "paper-tables-synthetic",
        };
        let title = "Every table and figure of the paper";
        write_document(folder, name, title, &text)
    }
}

#[cfg(test)]
mod tests {
    use super::super::findings::tests::{findings, record};
    use super::*;

    #[test]
    fn panels_hold_the_curves_that_were_found() {
        let first = Experiment::first();
        let mut record = record(&first, &[]);
        record.rows[0].splits[0].curves = vec![Curve {
            label: "K/O".into(),
            points: vec![(0.0, 0.0), (1.0, 1.0)],
        }];
        let panels = roc_panels(&findings([(first, Outcome::Found(Box::new(record)))]));
        assert_eq!(panels.len(), 1);
        assert_eq!(panels[0].title, "K/O");
        assert_eq!(panels[0].curves[0].label, "R^3");
    }
}
