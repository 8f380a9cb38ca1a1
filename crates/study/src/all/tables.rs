//! The tables of the paper from what was found.

use super::findings::{Findings, Query};
use super::jobs::{LENGTHS, REFERENCE, SEEDS, STEPS, TRAINED_ON};
use super::rows::{NETWORK, PLAIN, Row};
use super::table::{Entry, Line, Table};
use crate::cells::Protocol;

/// Keys of the jobs of the main table.
pub fn main_jobs() -> Vec<String> {
    SEEDS.iter().map(|n| format!("main-{n}")).collect()
}

/// Keys of the jobs of the learned baselines, `paper` windows.
pub fn learned_jobs() -> Vec<String> {
    (0..SEEDS.len()).map(learned_job).collect()
}

/// Key of the job of the learned baselines with `paper` windows and this training seed.
pub fn learned_job(seed: usize) -> String {
    format!("learned-paper-seed{seed}")
}

/// Key of the job of the learned baselines on body-frame motion.
pub const LEARNED_MOTION: &str = "learned-motion-seed0";

/// The learned baselines: key and label.
pub const LEARNED: [(&str, &str); 2] = [
    ("jem", "JEM (trained on KITTI, not refitted)"),
    (
        "glow",
        "Glow, likelihood ratio (trained on KITTI, not refitted)",
    ),
];

/// The rows of the main table without those of the learned baselines: those that the paper prints, in its order, then the others.
pub const ORDER: [&str; 9] = [
    "r3",
    "paper12",
    "paper24",
    "paper24-common",
    "residual",
    "diffpath1",
    "diffpath6",
    "moments24",
    "kinematic",
];

/// Rows repeated with untrained networks.
const UNTRAINED: [&str; 3] = ["paper24", "paper24-common", "residual"];

struct View {
    title: &'static str,
    text: &'static str,
    protocol: Protocol,
    learned: Vec<String>,
    main: Vec<String>,
    untrained: &'static str,
    printed: bool,
}

/// The main table under each of the three protocols.
pub fn main(findings: &Findings) -> Vec<Table> {
    let paper = |title, text, protocol| View {
        title,
        text,
        protocol,
        learned: learned_jobs(),
        main: main_jobs(),
        untrained: "untrained",
        printed: true,
    };
    let views = [
        paper(
            "AUROC, networks trained on KITTI, protocol `paper`",
            "Windows of 128 poses as the paper makes them. ID test windows come from logs that neither the \
             density nor the network has seen. Mean ± standard deviation over three training seeds, which \
             are seeds of noise and density too.",
            Protocol::Paper,
        ),
        paper(
            "AUROC, networks trained on KITTI, protocol `released-code`",
            "The same windows and scores; ID test windows are a random tenth of those the density was fitted \
             on, as in the authors' code. This flatters: the question is asked of windows that are known.",
            Protocol::ReleasedCode,
        ),
        View {
            title: "AUROC, networks trained on KITTI, protocol `motion`",
            text: "Windows of 128 body-frame increments at 10 Hz (docs/METHOD.md), scaled by constants of the \
                   KITTI training logs, so that neither the platform's size in a window nor the axes of its \
                   world give it away; ID test windows from unseen logs. One training seed. The paper has no \
                   such table.",
            protocol: Protocol::Paper,
            learned: vec![LEARNED_MOTION.into()],
            main: vec!["motion".into()],
            untrained: "motion-untrained",
            printed: false,
        },
    ];
    views.iter().map(|view| view.table(findings)).collect()
}

impl View {
    fn table(&self, findings: &Findings) -> Table {
        let mut rows = Vec::new();
        let mut push = |label: &str, row: &str, jobs: &[String]| {
            let jobs: Vec<&str> = jobs.iter().map(String::as_str).collect();
            rows.push(findings.line(
                label,
                Query {
                    jobs: &present(findings, &jobs),
                    row,
                    protocol: self.protocol,
                },
            ));
            rows.extend(self.printed.then(|| findings.printed_line(row)).flatten());
        };
        for (key, label) in LEARNED {
            push(label, key, &self.learned);
        }
        for key in ORDER {
            push(label(key), key, &self.main);
        }
        for key in UNTRAINED {
            let label = format!("untrained network: {}", label(key));
            let line = findings.line(
                &label,
                Query {
                    jobs: &[self.untrained],
                    row: key,
                    protocol: self.protocol,
                },
            );
            rows.push(line);
        }
        Table {
            title: self.title.into(),
            text: self.text.into(),
            head: findings.heads("method"),
            rows,
            notes: vec![
                "Untrained networks: one draw of weights, at most 400 windows a set.".to_string(),
            ],
        }
    }
}

/// Those jobs that are among the outcomes (`--quick` has one seed), or all where none is.
pub fn present<'a>(findings: &Findings, jobs: &[&'a str]) -> Vec<&'a str> {
    let known: Vec<&str> = jobs
        .iter()
        .copied()
        .filter(|j| findings.outcomes.contains_key(*j))
        .collect();
    if known.is_empty() {
        jobs.to_vec()
    } else {
        known
    }
}

/// What a row of the main table is called.
pub fn label(key: &str) -> &'static str {
    NETWORK
        .iter()
        .chain(&PLAIN)
        .find(|row: &&Row| row.key == key)
        .map_or("", |row| row.label)
}

fn query<'a>(job: &'a [&'a str], row: &'a str) -> Query<'a> {
    Query {
        jobs: job,
        row,
        protocol: Protocol::Paper,
    }
}

/// The table of training sets.
pub fn training_sets(findings: &Findings) -> Table {
    let mut rows = Vec::new();
    for (letter, network) in TRAINED_ON {
        for (row, name) in [
            ("r3", "R^3"),
            ("r3-common", "R^3, one common draw"),
            ("paper24", "SE(3)"),
            ("paper24-common", "SE(3), one common draw"),
        ] {
            let label = format!("{name}, trained on {letter}");
            rows.push(findings.line(&label, query(&[network], row)));
            rows.extend(findings.printed_line(&format!("{letter} {row}")));
        }
    }
    Table {
        title: "Training sets".into(),
        text: "Networks of 1,500 optimiser steps on windows of 128 poses, 30 diffusion steps, protocol `paper`; \
               each was trained on the logs of its set that are not ID test logs. The paper announces a row \
               for IROS20 and does not print it."
            .into(),
        head: findings.heads("statistics, training set"),
        rows,
        notes: Vec::new(),
    }
}

/// The table of sequence lengths.
pub fn lengths(findings: &Findings) -> Table {
    ablation(
        findings,
        "Sequence lengths",
        "A network a length, trained on KITTI for 1,500 optimiser steps that see the same number of poses \
         each; 30 diffusion steps, protocol `paper`.",
        "poses",
        &LENGTHS,
    )
}

/// The table of diffusion steps.
pub fn steps(findings: &Findings) -> Table {
    ablation(
        findings,
        "Diffusion steps",
        "A network a number of diffusion steps T, trained on KITTI for 1,500 optimiser steps; windows of 128 \
         poses, all T steps visited, protocol `paper`.",
        "steps",
        &STEPS,
    )
}

fn ablation(
    findings: &Findings,
    title: &str,
    text: &str,
    unit: &str,
    list: &[(usize, &str)],
) -> Table {
    let mut rows = Vec::new();
    for (number, network) in list {
        for (row, name) in [("paper24", ""), ("paper24-common", ", one common draw")] {
            rows.push(findings.line(&format!("{number} {unit}{name}"), query(&[network], row)));
            let printed = findings.printed_line(&format!("{number} {unit}"));
            rows.extend(printed.filter(|_| row == "paper24"));
        }
    }
    Table {
        title: title.into(),
        text: text.into(),
        head: findings.heads(unit),
        rows,
        notes: Vec::new(),
    }
}

/// All metrics of two rows of the main table, with intervals.
pub fn metrics(findings: &Findings) -> Table {
    let job = format!("main-{}", SEEDS[0]);
    let mut rows = Vec::new();
    for row in ["paper24", "paper24-common"] {
        for at in &findings.columns {
            let Some(cell) = findings.cell(&job, row, Protocol::Paper, *at) else {
                continue;
            };
            let estimates = [cell.auroc, cell.aupr_in, cell.aupr_out, cell.fpr_at_95_tpr];
            let mut cells = vec![Entry::from(format!(
                "{}, {}, {}",
                cell.fit_windows, cell.id_windows, cell.ood_windows
            ))];
            cells.extend(estimates.iter().map(|e| {
                Entry::from(match &e.interval {
                    Some(i) => format!("{:.3} ({:.3} to {:.3})", e.value, i.lower, i.upper),
                    None => format!("{:.3}", e.value),
                })
            }));
            let name = if row == "paper24" { "own" } else { "common" };
            rows.push(Line::new(format!("{}/{}, {name} noise", at.0, at.1), cells));
        }
    }
    Table {
        title: "All metrics of the split SE(3) statistics".into(),
        text: "Protocol `paper`, first training seed; 95 % intervals by bootstrap over logs, both sides.".into(),
        head: ["ID/OOD", "fit, ID test, OOD windows", "AUROC", "AUPR-in", "AUPR-out", "FPR at 95 % TPR"]
            .map(String::from)
            .to_vec(),
        rows,
        notes: Vec::new(),
    }
}

/// The sets of the main table.
pub fn data(findings: &Findings) -> Table {
    let mut rows = Vec::new();
    for job in [
        format!("main-{}", SEEDS[0]),
        REFERENCE.into(),
        "motion".into(),
    ] {
        let Some(found) = findings.found(&job) else {
            continue;
        };
        for set in &found.sets {
            rows.push(Line::new(
                format!("{}: {} ({job})", set.letter, set.name),
                vec![
                    Entry::from(format!("{} at stride {}", set.windows, set.stride)),
                    Entry::from(set.fit_logs.join(", ")),
                    Entry::from(set.test_logs.join(", ")),
                ],
            ));
        }
    }
    Table {
        title: "Windows and logs".into(),
        text: "The stride is the smallest multiple of 32 poses that leaves at most 700 windows a set in the main \
               table and 400 in the others, so that no set drowns the others and the run stays short."
            .into(),
        head: ["set (job)", "windows", "logs that fit the density", "ID test logs"]
            .map(String::from)
            .to_vec(),
        rows,
        notes: Vec::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::super::findings::tests::{findings, job};
    use super::*;

    #[test]
    fn every_row_of_the_main_table_has_a_label() {
        for key in ORDER.iter().chain(&UNTRAINED) {
            assert!(!label(key).is_empty(), "{key}");
        }
        assert_eq!(ORDER.len(), NETWORK.len() + PLAIN.len());
    }

    #[test]
    fn the_paper_stands_below_our_row_and_missing_jobs_say_so() {
        let found = findings([job("main-kitti", &[("paper24", Protocol::Paper, 0.75)])]);
        let table = &main(&found)[0];
        let split = table
            .rows
            .iter()
            .position(|r| r.label == label("paper24"))
            .unwrap();
        assert_eq!(table.rows[split].cells[0].text, "0.750");
        assert!(table.rows[split + 1].printed);
        assert_eq!(table.rows[split + 1].cells[0].text, "1.000");
        assert!(table.rows[0].cells[0].text.starts_with("not run"));
        assert!(
            training_sets(&found).rows[0].cells[0]
                .text
                .starts_with("not run")
        );
    }
}
