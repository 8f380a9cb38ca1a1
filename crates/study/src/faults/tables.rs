//! Tables of everything but faults in windows.

use super::alarms::Alarms;
use super::logs::{FAULT, LogCell, PIECE, SHORTEST, STRIDE};
use super::methods::{FOLLOWED, KINEMATIC, METHODS, NETWORK};
use super::near::NearCell;
use super::record::Report;
use super::summary::{mean, show};
use std::fmt::Write as _;

/// Things in the order of their first appearance, each once.
fn distinct<T: PartialEq>(all: impl Iterator<Item = T>) -> Vec<T> {
    let mut once = Vec::new();
    for one in all {
        if !once.contains(&one) {
            once.push(one);
        }
    }
    once
}

fn percent(values: &[f64]) -> String {
    mean(values).map_or_else(|| "–".into(), |v| format!("{:.0}", 100.0 * v))
}

/// Faults in logs.
pub fn logs(report: &Report, out: &mut String) {
    let _ = writeln!(
        out,
        "### Faults in logs\n\nPieces of {PIECE} poses of the tested logs with the fault in poses \
         {} to {} (logs shorter than that, of {SHORTEST} poses or more, are one piece with the fault \
         in the middle third), windows at stride {STRIDE}. `OOD`: pieces that the detector's verdict \
         calls OOD at alpha .05, in percent (sound pieces: false alarms). `found`: pieces whose \
         highest window score is above that of at most 5 % of the sound pieces; with fewer than 39 \
         sound pieces, above all of them. `delay`: median number of poses from the onset to the end \
         of the first window that holds a faulty step and is beyond the window threshold, `–` where \
         half of the pieces or more have none; no window can tell before it ends. Mean over \
         models.\n",
        FAULT.start,
        FAULT.end - 1,
    );
    let all = || report.runs.iter().flat_map(|run| &run.logs);
    for set in &report.sets {
        let of_set: Vec<&LogCell> = all().filter(|c| c.set == set.letter).collect();
        let Some(first) = of_set.first() else {
            continue;
        };
        let heads = FOLLOWED.map(|m| format!("{0}: OOD | found | delay", METHODS[m].key));
        let _ = writeln!(
            out,
            "**{}**, {} pieces\n\n| fault | {} |\n|---|{}",
            set.name,
            first.pieces,
            heads.join(" | "),
            "---|---|---|".repeat(heads.len())
        );
        let mut line = |fault: &Option<String>| {
            let cells = FOLLOWED.map(|m| {
                let own = of_set.iter().filter(|c| c.method == METHODS[m].key);
                let own: Vec<&&LogCell> = own.filter(|c| c.fault == *fault).collect();
                let of = |value: fn(&LogCell) -> f64| -> Vec<f64> {
                    own.iter().map(|c| value(c)).collect()
                };
                let delays: Option<Vec<f64>> = own.iter().map(|c| c.delay).collect();
                let delay = delays.and_then(|d| mean(&d));
                format!(
                    "{} | {} | {}",
                    percent(&of(|c| c.called_ood)),
                    percent(&of(|c| c.detected)),
                    delay.map_or_else(|| "–".into(), |d| format!("{d:.0}"))
                )
            });
            let name = fault.as_deref().unwrap_or("sound");
            let _ = writeln!(out, "| {name} | {} |", cells.join(" | "));
        };
        distinct(of_set.iter().map(|c| c.fault.clone()))
            .iter()
            .for_each(&mut line);
        out.push('\n');
    }
}

/// Changes that must stay in distribution.
pub fn controls(report: &Report, out: &mut String) {
    let _ = writeln!(
        out,
        "### What must stay in distribution\n\nAUROC of windows, and in brackets the share beyond the \
         window threshold, nominally .05. `{}`: tested logs as they are, against the held-out windows \
         of the trusted ones. The others: tested logs changed, against the same logs as they are; .5 \
         and the share of the first line are right. `resample` stands for logs that were recorded \
         faster than the model's rate only. Mean over models.\n",
        super::controls::OTHER_LOG
    );
    let heads = FOLLOWED.map(|m| METHODS[m].key);
    let _ = writeln!(
        out,
        "| set | control | {} |\n|---|---|{}",
        heads.join(" | "),
        "---|".repeat(heads.len())
    );
    let all = || report.runs.iter().flat_map(|run| &run.controls);
    for (set, control) in distinct(all().map(|c| (c.set, c.control.as_str()))) {
        let cells = heads.map(|method| {
            let own = || {
                all().filter(|c| (c.set, c.control.as_str(), c.method) == (set, control, method))
            };
            let auroc: Vec<f64> = own().map(|c| c.auroc).collect();
            let beyond: Vec<f64> = own().map(|c| c.beyond).collect();
            let beyond = mean(&beyond).unwrap_or(f64::NAN);
            format!("{} ({beyond:.3})", show(&auroc))
        });
        let _ = writeln!(out, "| {set} | {control} | {} |", cells.join(" | "));
    }
    out.push('\n');
}

/// Poses inside and outside of faults.
pub fn poses(report: &Report, out: &mut String) {
    let sets: Vec<char> = report.sets.iter().map(|s| s.letter).collect();
    let heads: Vec<String> = sets
        .iter()
        .map(|set| format!("{set} | {set}, no network"))
        .collect();
    let _ = writeln!(
        out,
        "### Where the fault is\n\nAUROC of the scores of single poses, those inside the fault against \
         the others of the same windows, over all places; without the network's part of the score \
         beside it. `–`: the fault fills the window.\n\n| fault | {} |\n|---|{}",
        heads.join(" | "),
        "---|---|".repeat(sets.len())
    );
    let all = || report.runs.iter().flat_map(|run| &run.poses);
    let cell = |fault: Option<&str>, set: char| {
        let own = || all().filter(|c| c.set == set && fault.is_none_or(|f| c.fault == f));
        let full: Vec<f64> = own().map(|c| c.auroc).collect();
        let alone: Vec<f64> = own().map(|c| c.without_network).collect();
        let text =
            |values: &[f64]| mean(values).map_or_else(|| "–".into(), |value| format!("{value:.3}"));
        format!("{} | {}", text(&full), text(&alone))
    };
    let mut line = |name: &str, fault: Option<&str>| {
        let cells: Vec<String> = sets.iter().map(|&set| cell(fault, set)).collect();
        let _ = writeln!(out, "| {name} | {} |", cells.join(" | "));
    };
    for fault in distinct(all().map(|c| c.fault.as_str())) {
        line(fault, Some(fault));
    }
    line("mean", None);
    out.push('\n');
}

/// Near platforms.
pub fn near(report: &Report, out: &mut String) {
    let _ = writeln!(
        out,
        "### Near platforms\n\nAUROC, ID/OOD. Cars: tested windows of one set, and of the other set \
         (all logs) for each the window nearest in mean speed, within 10 % and each used once; \
         windows below .5 m/s are left out. Single logs (TUM freiburg1 xyz, EuRoC V1_02): the first \
         60 % of the poses fit the density, windows of the rest at stride 4 are the ID test; a log \
         whose rest is shorter than a window is only an OOD side, and a gap stands where one log is \
         too little for a row.\n"
    );
    let all = || report.runs.iter().flat_map(|run| &run.near);
    let columns = distinct(all().map(|c| (c.id.as_str(), c.ood.as_str())));
    let rows = METHODS.each_ref().map(|m| m.key);
    let _ = writeln!(
        out,
        "| ID / OOD (windows) | {} |\n|---|{}",
        rows.join(" | "),
        "---|".repeat(rows.len())
    );
    for (id, ood) in columns {
        let own: Vec<&NearCell> = all().filter(|c| c.id == id && c.ood == ood).collect();
        let cells = rows.map(|method| {
            let values = own.iter().filter(|c| c.method == method);
            show(&values.map(|c| c.auroc).collect::<Vec<_>>())
        });
        let (id_windows, ood_windows) = (own[0].id_windows, own[0].ood_windows);
        let _ = writeln!(
            out,
            "| {id} / {ood} ({id_windows}, {ood_windows}) | {} |",
            cells.join(" | ")
        );
    }
    out.push('\n');
}

/// False alarms.
pub fn alarms(report: &Report, out: &mut String) {
    let _ = writeln!(
        out,
        "### False alarms\n\nEvery log of a set judged at alpha .05 by a detector fitted on \
         the set's other logs (logs of one group are left out together). Some of the left-out \
         logs are ones that the networks were trained on. `windows`: share of windows beyond \
         the window threshold, nominally .05.\n\n\
         | set | row | logs | called OOD | share | windows | first model: which |\n\
         |---|---|---|---|---|---|---|"
    );
    for method in [KINEMATIC, NETWORK].map(|m| METHODS[m].key) {
        let (mut all_logs, mut all_ood) = (0, 0);
        for set in &report.sets {
            let of_set: Vec<&Alarms> = report
                .runs
                .iter()
                .flat_map(|run| &run.alarms)
                .filter(|a| a.set == set.letter && a.method == method)
                .collect();
            let Some(first) = of_set.first() else {
                continue;
            };
            let logs: usize = of_set.iter().map(|a| a.logs).sum();
            let ood: usize = of_set.iter().map(|a| a.ood.len()).sum();
            let beyond: Vec<f64> = of_set.iter().map(|a| a.windows_beyond).collect();
            let _ = writeln!(
                out,
                "| {} | {method} | {logs} | {ood} | {:.3} | {} | {} |",
                set.letter,
                ood as f64 / logs.max(1) as f64,
                show(&beyond),
                first.ood.join(", ")
            );
            all_logs += logs;
            all_ood += ood;
        }
        let _ = writeln!(
            out,
            "| all | {method} | {all_logs} | {all_ood} | **{:.3}** | | |",
            all_ood as f64 / all_logs.max(1) as f64
        );
    }
    out.push('\n');
}

/// Platform against platform.
pub fn cells(report: &Report, out: &mut String) {
    let mut columns: Vec<(char, char)> = Vec::new();
    for (i, a) in report.sets.iter().enumerate() {
        for b in &report.sets[i + 1..] {
            columns.extend([(a.letter, b.letter), (b.letter, a.letter)]);
        }
    }
    let names: Vec<String> = columns.iter().map(|(a, b)| format!("{a}/{b}")).collect();
    let _ = writeln!(
        out,
        "### Platform against platform\n\nAUROC. ID/OOD: tested windows of the first set, whose \
         other logs fit the density, against every second window of all logs of the second.\n\n\
         | row | {} | mean | lowest |\n|---|{}---|---|",
        names.join(" | "),
        "---|".repeat(columns.len())
    );
    for method in &METHODS {
        let values: Vec<Vec<f64>> = columns
            .iter()
            .map(|&(id, ood)| {
                report
                    .runs
                    .iter()
                    .flat_map(|run| &run.cells)
                    .filter(|c| c.method == method.key && (c.id, c.ood) == (id, ood))
                    .map(|c| c.auroc.value)
                    .collect()
            })
            .collect();
        let cells: Vec<String> = values.iter().map(|v| show(v)).collect();
        let means: Vec<f64> = values.iter().filter_map(|v| mean(v)).collect();
        let lowest = means.iter().copied().fold(f64::INFINITY, f64::min);
        let _ = writeln!(
            out,
            "| {} | {} | {:.3} | {lowest:.3} |",
            method.key,
            cells.join(" | "),
            mean(&means).unwrap_or(f64::NAN),
        );
    }
    out.push('\n');
}
