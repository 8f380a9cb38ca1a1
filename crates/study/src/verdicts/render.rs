//! Tables of what was measured.

mod split;

use super::Record;
use super::pieces::{Called, Plan};
use super::real::{Judgement, RealCell};
use super::windows::{DETECTABLE, FaultCell};
use dose3_ood::metrics::Estimate;
use std::collections::BTreeSet;
use std::fmt::Write;

/// The document.
pub fn markdown(record: &Record) -> String {
    let mut text = String::new();
    let synthetic = if record.synthetic {
        "SYNTHETIC data: these numbers say nothing of real sensors. "
    } else {
        ""
    };
    let [command, where_from] = record.provenance.lines();
    let _ = writeln!(
        text,
        "{command}\n\n{synthetic}{where_from}; {} logs, windows of {} steps, density `{}`.\n",
        record.part, record.window, record.density,
    );
    let rows: Vec<String> = record
        .contenders
        .iter()
        .map(|(key, statistics)| format!("{key}: `{statistics}`"))
        .collect();
    let _ = writeln!(text, "Rows: {}.\n", rows.join("; "));
    window_tables(&mut text, record);
    split::tables(&mut text, record);
    called_tables(&mut text, record);
    split::few(&mut text, &record.few);
    split::whole(&mut text, &record.whole);
    split::calibration(&mut text, &record.calibration);
    timing_tables(&mut text, record);
    real_tables(&mut text, record);
    not_judged(&mut text, &record.not_judged);
    text
}

/// Sets and faults that some contender tells from sound motion.
fn detectable(cells: &[FaultCell]) -> BTreeSet<(char, &str)> {
    cells
        .iter()
        .filter(|cell| cell.auroc >= DETECTABLE)
        .map(|cell| (cell.set, cell.fault.as_str()))
        .collect()
}

fn mean(values: impl Iterator<Item = f64>) -> Option<f64> {
    let values: Vec<f64> = values.collect();
    (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
}

fn number(value: Option<f64>, digits: usize) -> String {
    value.map_or_else(|| "–".to_owned(), |value| format!("{value:.digits$}"))
}

fn unique<T: Clone + PartialEq>(values: impl Iterator<Item = T>) -> Vec<T> {
    let mut known = Vec::new();
    for value in values {
        if !known.contains(&value) {
            known.push(value);
        }
    }
    known
}

fn head(text: &mut String, first: &str, columns: &[String]) {
    let _ = writeln!(text, "| {first} | {} |", columns.join(" | "));
    let _ = writeln!(text, "|{}", "---|".repeat(columns.len() + 1));
}

fn line(text: &mut String, first: &str, cells: &[String]) {
    let _ = writeln!(text, "| {first} | {} |", cells.join(" | "));
}

fn window_tables(text: &mut String, record: &Record) {
    let cells = &record.windows;
    if cells.is_empty() {
        return;
    }
    let found = detectable(cells);
    let sets = unique(cells.iter().map(|cell| cell.set));
    let rows = unique(cells.iter().map(|cell| cell.contender));
    let lists = unique(cells.iter().map(|cell| cell.list));
    let _ = writeln!(
        text,
        "### Windows: AUROC of faulty windows against the same places without the fault\n\n\
         Means over the faults that some row finds at {DETECTABLE} or more (their number in brackets).\n"
    );
    let mut columns = Vec::new();
    for list in &lists {
        columns.extend(sets.iter().map(|set| {
            let of_list = |(s, fault): &&(char, &str)| {
                s == set && cells.iter().any(|c| c.list == *list && c.fault == *fault)
            };
            format!("{list} {set} ({})", found.iter().filter(of_list).count())
        }));
        columns.push(format!("{list}, mean of sets"));
    }
    head(text, "row", &columns);
    for row in &rows {
        let mut numbers = Vec::new();
        for list in &lists {
            let of_set = |set: char| {
                mean(
                    cells
                        .iter()
                        .filter(|c| c.list == *list && c.contender == *row && c.set == set)
                        .filter(|c| found.contains(&(c.set, c.fault.as_str())))
                        .map(|c| c.auroc),
                )
            };
            let means: Vec<Option<f64>> = sets.iter().map(|set| of_set(*set)).collect();
            numbers.extend(means.iter().map(|value| number(*value, 3)));
            numbers.push(number(mean(means.into_iter().flatten()), 3));
        }
        line(text, row, &numbers);
    }
    for set in sets {
        let places = cells
            .iter()
            .filter(|c| c.set == set)
            .map(|c| c.windows)
            .max();
        let _ = writeln!(text, "\n**{set}**, {} places\n", places.unwrap_or(0));
        let columns: Vec<String> = rows.iter().map(|row| (*row).to_owned()).collect();
        head(text, "fault", &columns);
        for fault in unique(
            cells
                .iter()
                .filter(|c| c.set == set)
                .map(|c| c.fault.as_str()),
        ) {
            let of_row = |row: &&str| {
                let cell = cells
                    .iter()
                    .find(|c| (c.set, c.fault.as_str(), c.contender) == (set, fault, *row));
                number(cell.map(|cell| cell.auroc), 3)
            };
            line(text, fault, &rows.iter().map(of_row).collect::<Vec<_>>());
        }
    }
    text.push('\n');
}

fn called_tables(text: &mut String, record: &Record) {
    let cells = &record.called;
    let found = detectable(&record.windows);
    let kinds = unique(cells.iter().map(|cell| (cell.plan, cell.trusted)));
    if kinds.is_empty() {
        return;
    }
    let _ = writeln!(
        text,
        "### Logs called out of distribution at alpha .05, percent\n\n{} In brackets: sound pieces called, of how many.\n",
        if found.is_empty() {
            "Mean over all faults that were injected."
        } else {
            "Mean over the faults whose windows some row finds at .8 or more."
        }
    );
    let sets = unique(cells.iter().map(|cell| cell.set));
    let rows = unique(cells.iter().map(|cell| cell.contender));
    let mut columns: Vec<String> = sets.iter().map(char::to_string).collect();
    columns.push("mean".to_owned());
    for (plan, trusted) in &kinds {
        let _ = writeln!(text, "**{}**\n", title(*plan, *trusted));
        head(text, "row", &columns);
        for row in &rows {
            let of = |set: char| -> Vec<&Called> {
                let same = |cell: &&Called| {
                    (cell.set, cell.contender) == (set, *row)
                        && (cell.plan, cell.trusted) == (*plan, *trusted)
                };
                cells.iter().filter(same).collect()
            };
            let mut means = Vec::new();
            let mut texts = Vec::new();
            for set in &sets {
                let of_set = of(*set);
                let faults = of_set.iter().filter(|cell| {
                    let known = |fault: &String| found.contains(&(*set, fault.as_str()));
                    cell.fault
                        .as_ref()
                        .is_some_and(|fault| found.is_empty() || known(fault))
                });
                let share =
                    |cell: &&&Called| 100.0 * cell.called as f64 / cell.pieces.max(1) as f64;
                let called = mean(faults.collect::<Vec<_>>().iter().map(share));
                let sound = of_set.iter().find(|cell| cell.fault.is_none());
                let alarms = sound.map_or(String::new(), |cell| {
                    format!(" ({}/{})", cell.called, cell.pieces)
                });
                texts.push(format!("{}{alarms}", number(called, 1)));
                means.extend(called);
            }
            texts.push(number(mean(means.into_iter()), 1));
            line(text, row, &texts);
        }
        text.push('\n');
        for row in &rows {
            let alarms: Vec<String> = cells
                .iter()
                .filter(|c| c.contender == *row && (c.plan, c.trusted) == (*plan, *trusted))
                .flat_map(|c| {
                    c.alarms
                        .iter()
                        .map(move |alarm| format!("{} {alarm}", c.set))
                })
                .collect();
            // With few trusted logs alarms are many, and their places say little.
            if !alarms.is_empty() && trusted.is_none() {
                let _ = writeln!(
                    text,
                    "Sound pieces called by {row}: {}.\n",
                    alarms.join("; ")
                );
            }
        }
    }
    let whole = kinds.iter().filter(|(_, trusted)| trusted.is_none());
    for (plan, _) in whole {
        for set in &sets {
            per_fault(text, cells, *plan, *set, &rows);
        }
    }
}

fn per_fault(text: &mut String, cells: &[Called], plan: Plan, set: char, rows: &[&'static str]) {
    let of_set: Vec<&Called> = cells
        .iter()
        .filter(|cell| cell.set == set && cell.plan == plan && cell.trusted.is_none())
        .collect();
    let Some(pieces) = of_set.iter().map(|cell| cell.pieces).max() else {
        return;
    };
    let _ = writeln!(
        text,
        "<details><summary>{}, {set}: every fault, {pieces} pieces</summary>\n",
        title(plan, None)
    );
    let columns: Vec<String> = rows.iter().map(|row| (*row).to_owned()).collect();
    head(text, "fault", &columns);
    for fault in unique(of_set.iter().map(|cell| cell.fault.clone())) {
        let of_row = |row: &&str| {
            let cell = of_set
                .iter()
                .find(|c| c.contender == *row && c.fault == fault);
            number(
                cell.map(|c| 100.0 * c.called as f64 / c.pieces.max(1) as f64),
                0,
            )
        };
        let name = fault.clone().unwrap_or_else(|| "sound".to_owned());
        line(text, &name, &rows.iter().map(of_row).collect::<Vec<_>>());
    }
    let _ = writeln!(text, "\n</details>\n");
}

fn title(plan: Plan, trusted: Option<usize>) -> String {
    let trusted = trusted.map_or(String::new(), |logs| format!(", {logs} trusted"));
    format!("{} faulty poses of {}{trusted}", plan.faulty, plan.length)
}

fn timing_tables(text: &mut String, record: &Record) {
    if record.timing.is_empty() && record.without_stamps.is_empty() {
        return;
    }
    let _ = writeln!(
        text,
        "### Stamps\n\nPieces of 1000 recorded poses, each judged by the stamps of the other groups of logs, at a tenth of \
         alpha .05. Faults last ten seconds or their own time, jitter all of the piece.\n"
    );
    let sets = unique(record.timing.iter().map(|cell| cell.set.clone()));
    if !sets.is_empty() {
        head(text, "fault, percent called", &sets);
        for fault in unique(record.timing.iter().map(|cell| cell.fault.clone())) {
            let of_set = |set: &String| {
                let cell = record
                    .timing
                    .iter()
                    .find(|c| c.set == *set && c.fault == fault);
                cell.map_or_else(
                    || "–".to_owned(),
                    |c| {
                        format!(
                            "{:.0} ({}/{})",
                            100.0 * c.called as f64 / c.pieces.max(1) as f64,
                            c.called,
                            c.pieces
                        )
                    },
                )
            };
            let name = fault.clone().unwrap_or_else(|| "sound".to_owned());
            line(text, &name, &sets.iter().map(of_set).collect::<Vec<_>>());
        }
        text.push('\n');
    }
    for alarms in &record.timing_alarms {
        let called = if alarms.called.is_empty() {
            "none is called".to_owned()
        } else {
            format!("called: {}", alarms.called.join("; "))
        };
        let _ = writeln!(
            text,
            "{}: of {} whole sound logs {called}.\n",
            alarms.set, alarms.logs
        );
    }
    for example in record
        .timing
        .iter()
        .filter_map(|c| Some((c.fault.as_ref()?, c.example.as_ref()?, &c.set)))
    {
        let (fault, said, set) = example;
        let _ = writeln!(text, "- {set}, {fault}: {said}");
    }
    if !record.without_stamps.is_empty() {
        let _ = writeln!(
            text,
            "\nWithout stamps, so not judged by them: {}.",
            record.without_stamps.join(", ")
        );
    }
    text.push('\n');
}

fn real_tables(text: &mut String, record: &Record) {
    for set in unique(record.real.iter().map(|cell| cell.set)) {
        let of_set: Vec<&RealCell> = record.real.iter().filter(|cell| cell.set == set).collect();
        for protocol in unique(of_set.iter().map(|cell| cell.protocol)) {
            let cells: Vec<&&RealCell> = of_set.iter().filter(|c| c.protocol == protocol).collect();
            let kinds = unique(cells.iter().map(|cell| cell.kind.as_str()));
            let _ = writeln!(
                text,
                "### {set}, trusted: {protocol}\n\nLogs called out of distribution at alpha .05, of how many; AUROC against the \
                 sound logs by mean score and by worst three windows in a row, with 95 % intervals over logs.\n"
            );
            let columns: Vec<String> = kinds.iter().map(|kind| (*kind).to_owned()).collect();
            head(text, "row", &columns);
            for row in unique(cells.iter().map(|cell| cell.contender)) {
                let of_kind = |kind: &&str| {
                    let cell = cells
                        .iter()
                        .find(|c| c.contender == row && c.kind == **kind);
                    cell.map_or_else(|| "–".to_owned(), |cell| real_cell(cell))
                };
                line(text, row, &kinds.iter().map(of_kind).collect::<Vec<_>>());
            }
            text.push('\n');
            sound_called(text, &record.judgements, set, protocol);
        }
    }
}

fn not_judged(text: &mut String, logs: &[String]) {
    if !logs.is_empty() {
        let _ = writeln!(text, "Logs that cannot be judged: {}.\n", logs.join("; "));
    }
}

fn real_cell(cell: &RealCell) -> String {
    let auroc = |estimate: &Option<Estimate>| {
        estimate.as_ref().map(|e| {
            let interval = e.interval.map_or(String::new(), |i| {
                format!(" [{:.2}, {:.2}]", i.lower, i.upper)
            });
            format!("{:.2}{interval}", e.value)
        })
    };
    let called = format!("{}/{}", cell.called, cell.logs);
    match (auroc(&cell.auroc_mean), auroc(&cell.auroc_worst)) {
        (Some(mean), Some(worst)) => format!("{called}; {mean}; {worst}"),
        _ => called,
    }
}

fn sound_called(text: &mut String, judgements: &[Judgement], set: &str, protocol: &str) {
    let of =
        |j: &&Judgement| j.set == set && j.protocol == protocol && j.kind == "sound" && j.called;
    for row in unique(judgements.iter().filter(of).map(|j| j.contender)) {
        let names: Vec<String> = judgements
            .iter()
            .filter(of)
            .filter(|j| j.contender == row)
            .map(|j| match &j.defect {
                Some(defect) => format!("{} ({defect})", j.log),
                None => j.log.clone(),
            })
            .collect();
        let _ = writeln!(text, "Sound logs called by {row}: {}.\n", names.join("; "));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn means_are_over_detectable_faults() {
        let window = |contender, fault: &str, auroc| FaultCell {
            set: 'K',
            contender,
            list: "suite",
            fault: fault.to_owned(),
            windows: 9,
            auroc,
        };
        let called = |contender, fault: Option<&str>, called| Called {
            set: 'K',
            contender,
            plan: Plan {
                length: 1000,
                faulty: 100,
            },
            trusted: None,
            fault: fault.map(str::to_owned),
            pieces: 10,
            called,
            alarms: match fault {
                None => vec!["08 poses 0 to 999 (a defect)".to_owned()],
                Some(_) => Vec::new(),
            },
        };
        let record = Record {
            contenders: vec![("default", "kinematic"), ("lin", "lin")],
            windows: vec![
                window("default", "jump:1m", 0.7),
                window("lin", "jump:1m", 0.9),
                window("default", "slip:1m/s", 0.6),
                window("lin", "slip:1m/s", 0.5),
            ],
            called: vec![
                called("default", None, 1),
                called("default", Some("jump:1m"), 6),
                called("default", Some("slip:1m/s"), 0),
            ],
            ..Record::default()
        };
        let text = markdown(&record);
        assert!(
            text.contains("| row | suite K (1) | suite, mean of sets |"),
            "{text}"
        );
        assert!(text.contains("| default | 0.700 | 0.700 |"), "{text}");
        assert!(text.contains("| default | 60.0 (1/10) | 60.0 |"), "{text}");
        assert!(text.contains("K 08 poses 0 to 999 (a defect)"), "{text}");
        assert!(text.contains("| slip:1m/s | 0 |"), "{text}");
    }
}
