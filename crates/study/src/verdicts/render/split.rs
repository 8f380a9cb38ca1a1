//! Verdicts by list of faults, of whole logs, and of calibration.

use super::super::Record;
use super::super::calibration::CalibrationCell;
use super::super::few::FewAlarms;
use super::super::pieces::{Called, Plan};
use super::super::whole::WholeCell;
use super::{detectable, head, line, mean, number, title, unique};
use std::collections::BTreeMap;
use std::fmt::Write;

/// A row is beaten where a single block calls more by so many percent.
const BEATEN: f64 = 10.0;
/// Rows of one block.
const BLOCKS: [&str; 4] = ["kinematic", "differences", "lin", "cc"];

/// Percent called by list of faults, and how often a single block calls more.
pub fn tables(text: &mut String, record: &Record) {
    let plans = unique(
        record
            .called
            .iter()
            .filter(|c| c.trusted.is_none())
            .map(|c| c.plan),
    );
    if record.windows.is_empty() || plans.is_empty() {
        return;
    }
    let found = detectable(&record.windows);
    let windows = record.windows.iter();
    let lists: BTreeMap<(char, &str), &str> = windows
        .map(|cell| ((cell.set, cell.fault.as_str()), cell.list))
        .collect();
    let names = unique(record.windows.iter().map(|cell| cell.list));
    let sets = unique(record.called.iter().map(|cell| cell.set));
    let rows = unique(record.called.iter().map(|cell| cell.contender));
    let _ = writeln!(
        text,
        "### Logs called, by list of faults, percent\n\nMeans of sets over the faults whose windows some row finds at .8 or \
         more. Beaten: cells (a fault in a set) in which a single block calls over {BEATEN:.0} points more, of all cells.\n"
    );
    for plan in plans {
        let _ = writeln!(text, "**{}**\n", title(plan, None));
        let mut columns: Vec<String> = names.iter().map(|name| (*name).to_owned()).collect();
        columns.extend(["both".to_owned(), "beaten".to_owned()]);
        head(text, "row", &columns);
        for row in &rows {
            let of = |set: char, list: Option<&str>| {
                let cells = record.called.iter().filter(move |c| {
                    (c.set, c.contender, c.plan, c.trusted) == (set, *row, plan, None)
                });
                mean(cells.filter_map(|cell| {
                    let key = (set, cell.fault.as_deref()?);
                    let wanted = list.is_none_or(|list| lists.get(&key) == Some(&list));
                    (found.contains(&key) && wanted).then(|| percent(cell))
                }))
            };
            let over_sets = |list| mean(sets.iter().filter_map(|set| of(*set, list)));
            let mut cells: Vec<String> = names
                .iter()
                .map(|list| number(over_sets(Some(*list)), 1))
                .collect();
            cells.push(number(over_sets(None), 1));
            cells.push(beaten(record, plan, row));
            line(text, row, &cells);
        }
        text.push('\n');
    }
}

fn percent(cell: &Called) -> f64 {
    100.0 * cell.called as f64 / cell.pieces.max(1) as f64
}

fn beaten(record: &Record, plan: Plan, row: &str) -> String {
    let of_plan =
        |cell: &&Called| cell.plan == plan && cell.trusted.is_none() && cell.fault.is_some();
    let mut best: BTreeMap<(char, &str), f64> = BTreeMap::new();
    for cell in record.called.iter().filter(of_plan) {
        if let Some(fault) = cell
            .fault
            .as_deref()
            .filter(|_| BLOCKS.contains(&cell.contender))
        {
            let most = best.entry((cell.set, fault)).or_default();
            *most = most.max(percent(cell));
        }
    }
    let own: Vec<&Called> = record
        .called
        .iter()
        .filter(of_plan)
        .filter(|c| c.contender == row)
        .collect();
    let more = own.iter().filter(|cell| {
        let most = cell
            .fault
            .as_deref()
            .and_then(|fault| best.get(&(cell.set, fault)));
        most.is_some_and(|most| *most > percent(cell) + BEATEN)
    });
    format!("{} of {}", more.count(), own.len())
}

/// Whole sound logs.
pub fn whole(text: &mut String, cells: &[WholeCell]) {
    if cells.is_empty() {
        return;
    }
    let sets = unique(cells.iter().map(|cell| cell.set));
    let _ = writeln!(
        text,
        "### Whole sound logs called at alpha .05\n\nEach judged by the other groups of logs.\n"
    );
    let columns: Vec<String> = sets.iter().map(char::to_string).collect();
    head(text, "row", &columns);
    let rows = unique(cells.iter().map(|cell| cell.contender));
    let of = |row: &str, set: char| cells.iter().find(|c| c.contender == row && c.set == set);
    for row in &rows {
        let counts = sets.iter().map(|set| {
            let cell = of(row, *set);
            cell.map_or_else(
                || "–".to_owned(),
                |c| format!("{}/{}", c.called.len(), c.logs),
            )
        });
        line(text, row, &counts.collect::<Vec<_>>());
    }
    text.push('\n');
    for row in &rows {
        let called: Vec<String> = sets
            .iter()
            .filter_map(|set| Some((set, of(row, *set)?)))
            .flat_map(|(set, cell)| cell.called.iter().map(move |log| format!("{set} {log}")))
            .collect();
        if !called.is_empty() {
            let _ = writeln!(text, "Called by {row}: {}.\n", called.join("; "));
        }
    }
}

/// Sound pieces beside few trusted logs.
pub fn few(text: &mut String, cells: &[FewAlarms]) {
    if cells.is_empty() {
        return;
    }
    let _ = writeln!(
        text,
        "### Sound pieces called beside few trusted logs at alpha .05\n\nEvery choice of so many groups that follow each \
         other by name is trusted in turn (one log of each); pieces of about 1000 poses of all other groups.\n"
    );
    let sets = unique(cells.iter().map(|cell| cell.set));
    let columns: Vec<String> = sets.iter().map(char::to_string).collect();
    head(text, "row, trusted", &columns);
    for (row, trusted) in unique(cells.iter().map(|cell| (cell.contender, cell.trusted))) {
        let counts = sets.iter().map(|set| {
            let cell = cells
                .iter()
                .find(|c| (c.contender, c.trusted, c.set) == (row, trusted, *set));
            cell.map_or_else(|| "–".to_owned(), |c| format!("{}/{}", c.called, c.pieces))
        });
        line(
            text,
            &format!("{row}, {trusted}"),
            &counts.collect::<Vec<_>>(),
        );
    }
    text.push('\n');
}

/// Faults of the calibration.
pub fn calibration(text: &mut String, cells: &[CalibrationCell]) {
    if cells.is_empty() {
        return;
    }
    let _ = writeln!(
        text,
        "### Calibration: pieces called by the finding, percent\n\nThe fault is in all of the log; pieces of about 1000 poses, \
         and in brackets whole logs, at a fifth of alpha .05.\n"
    );
    let columns = unique(cells.iter().map(|cell| (cell.set, cell.logs)));
    let names: Vec<String> = columns
        .iter()
        .map(|(set, logs)| format!("{set}, {logs}"))
        .collect();
    head(text, "fault", &names);
    for fault in unique(cells.iter().map(|cell| cell.fault.as_deref())) {
        let of = |(set, logs): &(char, &str)| {
            let same =
                |c: &&CalibrationCell| (c.set, c.logs, c.fault.as_deref()) == (*set, *logs, fault);
            cells.iter().find(same).map_or_else(
                || "–".to_owned(),
                |c| {
                    let share = 100.0 * c.called as f64 / c.pieces.max(1) as f64;
                    let (pieces, whole) = (c.pieces, c.whole);
                    format!(
                        "{share:.0}, {}/{pieces} ({}/{whole})",
                        c.called, c.whole_called
                    )
                },
            )
        };
        line(
            text,
            fault.unwrap_or("sound"),
            &columns.iter().map(of).collect::<Vec<_>>(),
        );
    }
    text.push('\n');
    for cell in cells {
        match &cell.fault {
            None if !cell.alarms.is_empty() => {
                let _ = writeln!(
                    text,
                    "Sound pieces called, {}, {}: {}.\n",
                    cell.set,
                    cell.logs,
                    cell.alarms.join("; ")
                );
            }
            _ => {}
        }
    }
    for cell in cells.iter().filter(|cell| cell.logs == cells[0].logs) {
        if let (Some(fault), Some(said)) = (&cell.fault, &cell.example) {
            let _ = writeln!(text, "- {}, {fault}: {said}", cell.set);
        }
    }
    text.push('\n');
}
