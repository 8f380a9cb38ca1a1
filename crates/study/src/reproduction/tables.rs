//! The tables of the paper from what was found.

use super::experiment::{Experiment, LENGTHS, STEPS, TRAINED_ON};
use super::findings::{Findings, Query};
use super::table::{Entry, Line, Table};
use crate::networks::Network;
use crate::rows::{
    LEARNED, MAIN, R3, R3_SHARED, RESIDUAL, Row, SPLIT, SPLIT_SHARED, SPLIT_SHARED2, label,
    printed_name,
};
use crate::split::Split;

/// Rows repeated with untrained networks.
const UNTRAINED: [Row; 3] = [SPLIT, SPLIT_SHARED2, RESIDUAL];

struct Sheet {
    title: &'static str,
    text: &'static str,
    split: Split,
    learned: Vec<Experiment>,
    main: Vec<Experiment>,
    untrained: Experiment,
    printed: bool,
}

/// The main table: windows of the paper under each split, and windows of body-frame motion.
pub fn main(findings: &Findings) -> Vec<Table> {
    let paper = |title, text, split| Sheet {
        title,
        text,
        split,
        learned: findings.present(&Experiment::learned()),
        main: findings.present(&Experiment::main()),
        untrained: Experiment::untrained(),
        printed: true,
    };
    let sheets = [
        paper(
            "AUROC, `paper` windows, split `held-out`",
            "Networks trained on KITTI; windows of 128 poses as the paper makes them. ID test windows come from \
             logs that neither the density nor the network has seen. Mean ± standard deviation over three training \
             seeds, which are seeds of noise and density too.",
            Split::HeldOut,
        ),
        paper(
            "AUROC, `paper` windows, split `released-code`",
            "The same windows and scores; ID test windows are a random tenth of those the density was fitted \
             on, as in the authors' code. This flatters: the question is asked of windows that are known.",
            Split::ReleasedCode,
        ),
        Sheet {
            title: "AUROC, `motion` windows, split `held-out`",
            text: "Networks trained on KITTI; windows of 128 body-frame increments at 10 Hz (docs/METHOD.md), scaled \
                   by constants of the KITTI training logs, so that neither the platform's size in a window nor the \
                   axes of its world give it away; ID test windows from unseen logs. One training seed. The paper \
                   has no such table.",
            split: Split::HeldOut,
            learned: vec![Experiment::learned_motion()],
            main: vec![Experiment::motion()],
            untrained: Experiment::motion_untrained(),
            printed: false,
        },
    ];
    sheets.iter().map(|sheet| sheet.table(findings)).collect()
}

impl Sheet {
    fn table(&self, findings: &Findings) -> Table {
        let mut rows = Vec::new();
        let of_learned = LEARNED.iter().map(|row| (row, &self.learned));
        let of_networks = MAIN.iter().map(|row| (row, &self.main));
        for (row, of) in of_learned.chain(of_networks) {
            let query = self.query(of, *row);
            rows.push(findings.line(label(row), query));
            let printed = printed_name(row).filter(|_| self.printed);
            rows.extend(printed.and_then(|name| findings.printed_line(name)));
        }
        for row in UNTRAINED {
            let label = format!("untrained network: {}", label(&row));
            let query = self.query(std::slice::from_ref(&self.untrained), row);
            rows.push(findings.line(&label, query));
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

    fn query<'a>(&self, of: &'a [Experiment], row: Row) -> Query<'a> {
        Query {
            of,
            row,
            split: self.split,
        }
    }
}

fn of_network(findings: &Findings, label: &str, network: Network, row: Row) -> Line {
    let query = Query {
        of: &[Experiment::of(network)],
        row,
        split: Split::HeldOut,
    };
    findings.line(label, query)
}

/// The table of training sets.
pub fn training_sets(findings: &Findings) -> Table {
    let mut rows = Vec::new();
    for (letter, network) in TRAINED_ON {
        for (row, name) in [
            (R3, "R^3"),
            (R3_SHARED, "R^3, one shared draw"),
            (SPLIT, "SE(3)"),
            (SPLIT_SHARED, "SE(3), one shared draw"),
        ] {
            let label = format!("{name}, trained on {letter}");
            rows.push(of_network(findings, &label, network, row));
            let printed = printed_name(&row).map(|name| format!("{letter} {name}"));
            rows.extend(printed.and_then(|name| findings.printed_line(&name)));
        }
    }
    Table {
        title: "Training sets".into(),
        text: "Networks of 1,500 optimiser steps on windows of 128 poses, 30 diffusion steps, split `held-out`; \
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
         each; 30 diffusion steps, split `held-out`.",
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
         poses, all T steps visited, split `held-out`.",
        "steps",
        &STEPS,
    )
}

fn ablation(
    findings: &Findings,
    title: &str,
    text: &str,
    unit: &str,
    list: &[(usize, Network)],
) -> Table {
    let mut rows = Vec::new();
    for (number, network) in list {
        let name = format!("{number} {unit}");
        rows.push(of_network(findings, &name, *network, SPLIT));
        rows.extend(findings.printed_line(&name));
        let shared = format!("{name}, one shared draw");
        rows.push(of_network(findings, &shared, *network, SPLIT_SHARED));
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
    let mut rows = Vec::new();
    for (row, noise) in [(SPLIT, "own noise"), (SPLIT_SHARED2, "two shared draws")] {
        for at in &findings.columns {
            let Some(cell) = findings.cell(&Experiment::first(), &row, Split::HeldOut, *at) else {
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
            rows.push(Line::new(format!("{}/{}, {noise}", at.0, at.1), cells));
        }
    }
    Table {
        title: "All metrics of the split SE(3) statistics".into(),
        text: "Split `held-out`, first training seed; 95 % intervals by bootstrap over logs, both sides.".into(),
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
    for experiment in [
        Experiment::first(),
        Experiment::reference(),
        Experiment::motion(),
    ] {
        let Some(found) = findings.found(&experiment) else {
            continue;
        };
        let network = experiment.network().name;
        for set in &found.sets {
            rows.push(Line::new(
                format!("{}: {} ({network})", set.letter, set.name),
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
        head: ["set (network)", "windows", "logs that fit the density", "ID test logs"]
            .map(String::from)
            .to_vec(),
        rows,
        notes: Vec::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::super::findings::tests::{findings, found};
    use super::*;

    #[test]
    fn printed_lines_stand_below_their_rows_and_missing_experiments_say_why() {
        let findings = findings([found(Experiment::first(), &[(SPLIT, 0.9), (R3, 0.4)])]);
        let table = &main(&findings)[0];
        let at = |label: &str| table.rows.iter().position(|r| r.label == label).unwrap();
        let split = at(label(&SPLIT));
        assert_eq!(table.rows[split].cells[0].text, "0.900");
        assert!(table.rows[split + 1].printed);
        assert_eq!(table.rows[split + 1].cells[0].text, "1.000");
        let jem = at(label(&LEARNED[0]));
        assert_eq!(
            table.rows[jem].cells[0].text,
            "not run: not among the experiments of this run"
        );
        assert_eq!(table.rows[jem + 1].cells[0].text, "0.211");
    }

    #[test]
    fn one_and_two_shared_draws_are_two_rows() {
        let experiment = Experiment::readings();
        let of = [found(
            experiment,
            &[(SPLIT_SHARED, 0.6), (SPLIT_SHARED2, 0.8)],
        )];
        let findings = findings(of);
        let mean = |row| {
            findings.overall(Query {
                of: &[experiment],
                row,
                split: Split::HeldOut,
            })
        };
        let near = |found: Option<f64>, expected: f64| {
            assert!((found.unwrap() - expected).abs() < 1e-12);
        };
        near(mean(SPLIT_SHARED), 0.6);
        near(mean(SPLIT_SHARED2), 0.8);
    }
}
