//! What is written at the end: page, tables and numbers.

use super::BenchmarkArgs;
use super::figures::{Curve, Figure, RocPanel};
use super::findings::{Findings, Outcome};
use super::jobs::{REFERENCE, SEEDS};
use super::measure::Found;
use super::page::{Section, page};
use super::readings::readings;
use super::shortfalls::shortfalls;
use super::table::Table;
use super::{cost, tables};
use crate::cells::Protocol;
use crate::provenance::render_into;
use anyhow::Result;
use dose3::atomic;
use serde::Serialize;
use std::path::Path;

/// Figures that may stand in the repository: they show numbers of many windows, no path of a data set.
const PUBLISHED: [&str; 2] = ["epsilon", "roc"];
/// The document beside it that lists the deviations, which gets the table of their effects.
const PARITY: &str = "PARITY.md";
/// Where they go, beside the document.
const FIGURES: &str = "figures";

/// Where the numbers come from.
#[derive(Serialize)]
pub struct Report {
    /// How the real data was found; none for synthetic data.
    pub source: Option<String>,
    /// Arguments after `cargo xtask`.
    pub command: String,
    /// Commit of the working tree.
    pub commit: String,
    /// Cores and processor.
    pub machine: String,
    /// Wall time.
    pub seconds: f64,
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
    jobs: Vec<&'a Found>,
    not_run: Vec<(&'a str, &'a str)>,
}

/// What the ROC figure's own caption cannot know.
pub const ROC_CAPTION: &str = " Windows of the main table, protocol paper, first training seed.";

/// The curves of the main table's rows that a figure has room for, a panel a cell.
pub fn roc_panels(findings: &Findings) -> Vec<RocPanel> {
    let first = format!("main-{}", SEEDS[0]);
    let rows = [
        (first.as_str(), "paper24", "SE(3) split, own noise"),
        (
            first.as_str(),
            "paper24-common",
            "SE(3) split, common noise",
        ),
        (first.as_str(), "r3", "R^3"),
        (first.as_str(), "diffpath6", "DiffPath 6-D"),
        (first.as_str(), "kinematic", "kinematics, no network"),
        ("learned-paper-seed0", "glow", "Glow-LR"),
        ("learned-paper-seed0", "jem", "JEM"),
    ];
    let panel = |(id, ood): &(char, char)| {
        let title = format!("{id}/{ood}");
        let curve = |(job, row, label): &(&str, &str, &str)| {
            let found = findings.row(job, row, Protocol::Paper)?;
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
    /// Writes all.html, all.md and all.json, and puts the tables into the document of `--render`.
    ///
    /// # Errors
    /// Files that cannot be written.
    pub fn write(
        &self,
        args: &BenchmarkArgs,
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
        atomic::write(&args.out.join("all.html"), html.as_bytes())?;
        atomic::write(&args.out.join("all.md"), markdown.as_bytes())?;
        atomic::write(
            &args.out.join("all.json"),
            serde_json::to_string_pretty(&self.json(findings))?.as_bytes(),
        )?;
        println!(
            "wrote {}, all.md and all.json",
            args.out.join("all.html").display()
        );
        if let Some(path) = &args.render {
            self.render(path, &markdown, &sections, findings)?;
            println!("updated {}", path.display());
        }
        Ok(())
    }

    fn json<'a>(&'a self, findings: &'a Findings) -> Json<'a> {
        let (mut jobs, mut not_run) = (Vec::new(), Vec::new());
        for (key, outcome) in &findings.outcomes {
            match outcome {
                Outcome::Found(found) => jobs.push(found.as_ref()),
                Outcome::NotRun(reason) => not_run.push((key.as_str(), reason.as_str())),
            }
        }
        Json {
            report: self,
            jobs,
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
        let outcomes = findings.outcomes.keys();
        let jobs: f64 = outcomes
            .filter_map(|key| findings.found(key))
            .map(|f| f.seconds)
            .sum();
        let mut facts = vec![
            format!("`cargo xtask {}`", self.command),
            format!(
                "commit {}, {}; all jobs together {:.0} s, this run {:.0} s (finished jobs of an earlier run are \
                 taken up); density `{}`.",
                self.commit, self.machine, jobs, self.seconds, self.density
            ),
            "X/Y: in-distribution set X (it fits the density), out-of-distribution set Y. A higher score is more \
             OOD. Networks are trained once and never retrained for a column."
                .to_string(),
        ];
        if let Some(found) = findings.found(REFERENCE) {
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

    /// Puts the tables between the markers, and figures that may be published beside the document.
    fn render(
        &self,
        path: &Path,
        markdown: &str,
        sections: &[Section],
        findings: &Findings,
    ) -> Result<()> {
        let mut text = markdown.to_string();
        let folder = path.parent().unwrap_or(Path::new(".")).join(FIGURES);
        for figure in sections.iter().flat_map(|s| &s.figures) {
            if !PUBLISHED.iter().any(|key| figure.key.starts_with(key)) {
                continue;
            }
            let name = format!("{}.svg", figure.key);
            atomic::write(&folder.join(&name), figure.svg.as_bytes())?;
            text += &format!(
                "### {}\n\n![{}]({FIGURES}/{name})\n\n{}\n\n",
                figure.title, figure.title, figure.caption
            );
        }
        let name = if findings.real {
            "all"
        } else {
            "all-synthetic"
        };
        render_into(path, &text, name)?;
        let parity = path.with_file_name(PARITY);
        if findings.real && parity.exists() {
            let facts = self.facts(findings)[..2].join("\n\n");
            let table = format!("{facts}\n\n{}", readings(findings).markdown());
            render_into(&parity, &table, "readings")?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::super::findings::tests::{findings, job};
    use super::*;
    use crate::all::figures::Curve;

    #[test]
    fn panels_hold_the_curves_that_were_found() {
        let (key, outcome) = job("main-kitti", &[("r3", Protocol::Paper, 0.5)]);
        let Outcome::Found(mut found) = outcome else {
            panic!("the job was made as found")
        };
        found.rows[0].curves = vec![Curve {
            label: "K/O".into(),
            points: vec![(0.0, 0.0), (1.0, 1.0)],
        }];
        let panels = roc_panels(&findings([(key, Outcome::Found(found))]));
        assert_eq!(panels.len(), 1);
        assert_eq!(panels[0].title, "K/O");
        assert_eq!(panels[0].curves[0].label, "R^3");
    }
}
