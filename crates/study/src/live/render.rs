//! The page.

use super::Record;
use super::faults::{Delays, Piece};
use dose3_ood::alarm::{LevelBasis, RaisedBy};
use std::collections::BTreeMap;
use std::fmt::Write;

/// Seconds within which the families below should be heard.
const SOON: f64 = 6.0;
/// Families of faults that should be heard soon.
const FAMILIES: [&str; 5] = [
    "freeze",
    "jump",
    "reversal",
    "jitter-position",
    "jitter-rotation",
];

/// All tables.
pub fn markdown(record: &Record) -> String {
    let [command, where_from] = record.provenance.lines();
    let synthetic = match record.synthetic {
        true => "SYNTHETIC data: these numbers say nothing of real sensors. ",
        false => "",
    };
    let mut text = format!(
        "{command}\n\n{synthetic}{where_from}; {} logs. Default detectors; at most {} false alarms an hour are \
         allowed, a window every {:.1} s.\n\n",
        record.part, record.alarms_per_hour, record.every
    );
    sound(record, &mut text);
    soon(record, &mut text);
    stamps(record, &mut text);
    real(record, &mut text);
    each(record, &mut text);
    levels(record, &mut text);
    text
}

fn sound(record: &Record, text: &mut String) {
    text.push_str("### Sound logs, left out by group\n\n");
    text.push_str("An hour is an hour of windows; logs are put end to end. Alarms where the reference has a known defect are counted and named.\n\n");
    text.push_str("| set | logs | hours | alarms | an hour | most in one hour | of them at known defects |\n|---|---|---|---|---|---|---|\n");
    let mut named = String::new();
    let mut sets: Vec<&str> = record.sound.iter().map(|log| log.set).collect();
    sets.dedup();
    for set in sets {
        let logs: Vec<_> = record.sound.iter().filter(|log| log.set == set).collect();
        let hours: f64 = logs.iter().map(|log| log.hours).sum();
        let alarms: usize = logs.iter().map(|log| log.alarms.len()).sum();
        let mut by_hour: BTreeMap<u64, usize> = BTreeMap::new();
        let mut before = 0.0;
        for log in &logs {
            for alarm in &log.alarms {
                let at = before + (alarm.at / 3600.0).min(log.hours);
                *by_hour.entry(at as u64).or_default() += 1;
            }
            before += log.hours;
        }
        let each = logs.iter().flat_map(|log| &log.alarms);
        let known = each.filter(|alarm| alarm.defect.is_some()).count();
        let most = by_hour.values().max().copied().unwrap_or(0);
        let _ = writeln!(
            text,
            "| {set} | {} | {hours:.2} | {alarms} | {:.2} | {most} | {known} |",
            logs.len(),
            alarms as f64 / hours
        );
        for log in logs {
            for alarm in &log.alarms {
                let defect = alarm.defect.as_deref().map(|d| format!(" ({d})"));
                let _ = writeln!(
                    named,
                    "- {set}, {} at {:.1} s: {:.1} by {}, {}{}",
                    log.log,
                    alarm.at,
                    alarm.excess,
                    alarm.reason,
                    word(alarm.by),
                    defect.unwrap_or_default()
                );
            }
        }
    }
    let _ = writeln!(text, "\n{named}");
}

fn word(by: RaisedBy) -> &'static str {
    match by {
        RaisedBy::Window => "one window",
        RaisedBy::Run => "a run of windows",
        RaisedBy::Sum => "evidence that added up",
        RaisedBy::Number => "a number of a few steps",
    }
}

/// How many of `pieces` were heard within [`SOON`], and of how many.
fn heard(pieces: &[&Piece]) -> (usize, usize) {
    let soon = |piece: &&&Piece| piece.delay.is_some_and(|delay| delay <= SOON);
    (pieces.iter().filter(soon).count(), pieces.len())
}

fn called(cells: &[&Delays]) -> (Vec<Piece>, Vec<Piece>) {
    let all = cells.iter().flat_map(|cell| cell.pieces.iter().cloned());
    all.filter(|piece| !piece.before)
        .partition(|piece| piece.called)
}

fn quantile(delays: &[f64], q: f64) -> String {
    let mut sorted = delays.to_vec();
    sorted.sort_by(f64::total_cmp);
    match sorted.is_empty() {
        true => "-".to_owned(),
        false => format!("{:.1}", dose3_ood::statistics::quantile_sorted(&sorted, q)),
    }
}

fn row(pieces: &[Piece]) -> String {
    let refs: Vec<&Piece> = pieces.iter().collect();
    let (soon, of) = heard(&refs);
    let delays: Vec<f64> = pieces.iter().filter_map(|piece| piece.delay).collect();
    let share = 100.0 * soon as f64 / of.max(1) as f64;
    format!(
        "{of} | {} | {soon} ({share:.0} %) | {} | {}",
        delays.len(),
        quantile(&delays, 0.5),
        quantile(&delays, 0.9)
    )
}

fn soon(record: &Record, text: &mut String) {
    let _ = writeln!(
        text,
        "### Within {SOON} s\n\nPieces of 1000 poses with a fault of about 100 poses that the verdict on the whole piece calls.\n"
    );
    text.push_str("| set | faults | called by the verdict | alarm | within 6 s | median delay, s | 0.9 quantile, s |\n|---|---|---|---|---|---|---|\n");
    let mut sets: Vec<char> = record.faults.iter().map(|cell| cell.set).collect();
    sets.dedup();
    for set in sets {
        for family in FAMILIES {
            let of = |cell: &&Delays| cell.set == set && cell.family == family;
            let cells: Vec<&Delays> = record.faults.iter().filter(of).collect();
            let (called, _) = called(&cells);
            if !called.is_empty() {
                let _ = writeln!(text, "| {set} | {family} | {} |", row(&called));
            }
        }
    }
    for family in FAMILIES {
        let of = |cell: &&Delays| cell.family == family;
        let cells: Vec<&Delays> = record.faults.iter().filter(of).collect();
        let (called, _) = called(&cells);
        let _ = writeln!(text, "| all | {family} | {} |", row(&called));
    }
    let of = |cell: &&Delays| FAMILIES.contains(&cell.family);
    let cells: Vec<&Delays> = record.faults.iter().filter(of).collect();
    let (yes, _) = called(&cells);
    let _ = writeln!(text, "| all | these five | {} |", row(&yes));
    let cells: Vec<&Delays> = record.faults.iter().collect();
    let (yes, no) = called(&cells);
    let _ = writeln!(text, "| all | every fault | {} |", row(&yes));
    let by = |by| yes.iter().filter(|piece| piece.by == Some(by)).count();
    let _ = writeln!(
        text,
        "\nRaised by one window: {}, by a run of windows: {}, by evidence that added up: {}, by a number of a few steps: {}.",
        by(RaisedBy::Window),
        by(RaisedBy::Run),
        by(RaisedBy::Sum),
        by(RaisedBy::Number)
    );
    let refs: Vec<&Piece> = no.iter().filter(|piece| piece.delay.is_some()).collect();
    let _ = writeln!(
        text,
        "\nOf {} faulty pieces that the verdict does not call {} raise an alarm.\n",
        no.len(),
        refs.len()
    );
}

fn stamps(record: &Record, text: &mut String) {
    if record.stamps.is_empty() {
        return;
    }
    text.push_str("### Stamps\n\nEvents of stamps, pauses and doubled poses in logs as they were recorded: all of them in whole sound logs, left out by group; pieces of 1000 poses with a fault of the stamps from two fifths on that are followed by one.\n\n");
    text.push_str("| set | fault | logs or pieces | hours | events, or pieces with one | within 6 s | median delay, s |\n|---|---|---|---|---|---|---|\n");
    for cell in &record.stamps {
        let soon = cell.delays.iter().filter(|delay| **delay <= SOON).count();
        let _ = match &cell.fault {
            None => writeln!(
                text,
                "| {} | none | {} | {:.2} | {} | | |",
                cell.set, cell.pieces, cell.hours, cell.events
            ),
            Some(fault) => writeln!(
                text,
                "| {} | {fault} | {} | | {} | {soon} | {} |",
                cell.set,
                cell.pieces,
                cell.events,
                quantile(&cell.delays, 0.5)
            ),
        };
    }
    text.push('\n');
}

fn real(record: &Record, text: &mut String) {
    if record.real.is_empty() {
        return;
    }
    text.push_str("### Diverged odometries (vio), recordings left out in turn\n\nAn estimate has diverged where it travels twice as far in a second as the trusted estimate of the recording in any; an alarm cannot come before the first window. Delays count from the later of the two.\n\n");
    text.push_str("| log | verdict | diverged at, s | first window, s | alarm at, s | delay, s |\n|---|---|---|---|---|---|\n");
    let number = |x: Option<f64>| x.map_or("-".to_owned(), |x| format!("{x:.1}"));
    for log in &record.real {
        let _ = writeln!(
            text,
            "| {} | {} | {} | {:.1} | {} | {} |",
            log.log,
            if log.called { "called" } else { "-" },
            number(log.onset),
            log.first_window,
            number(log.alarm),
            number(log.delay())
        );
    }
    let called: Vec<_> = record.real.iter().filter(|log| log.called).collect();
    let soon = called
        .iter()
        .filter(|log| log.delay().is_some_and(|delay| delay <= SOON));
    let _ = writeln!(
        text,
        "\n{} of {} that the verdict calls within {SOON} s.\n",
        soon.count(),
        called.len()
    );
}

fn each(record: &Record, text: &mut String) {
    text.push_str("### Every fault\n\nPieces, those that the verdict calls; of these with an alarm, with one within 6 s; delays.\n\n");
    text.push_str("| set | fault | pieces | called by the verdict | alarm | within 6 s | median delay, s | 0.9 quantile, s |\n|---|---|---|---|---|---|---|---|\n");
    for cell in &record.faults {
        let (called, _) = called(&[cell]);
        let _ = writeln!(
            text,
            "| {} | {} | {} | {} |",
            cell.set,
            cell.fault,
            cell.pieces.len(),
            row(&called)
        );
    }
    text.push('\n');
}

fn levels(record: &Record, text: &mut String) {
    text.push_str("### Levels\n\nOf runs of so many windows (-ln p) and of evidence that adds up (ln W): what windows as independent as the trusted ones ask for / what the peaks of the trusted logs ask for. The larger counts.\n\n");
    text.push_str("| set | window, s | groups | hours | runs | sum |\n|---|---|---|---|---|---|\n");
    for level in &record.levels {
        let both = |basis: &LevelBasis| match basis.trusted {
            Some(trusted) => format!("{:.1} / {trusted:.1}", basis.bound),
            None => format!("{:.1}", basis.bound),
        };
        let runs = level.runs.iter();
        let runs: Vec<String> = runs
            .map(|r| format!("{}: {}", r.windows, both(r)))
            .collect();
        let _ = writeln!(
            text,
            "| {} | {:.1} | {} | {:.2} | {} | {} |",
            level.set,
            level.window,
            level.groups,
            level.hours,
            runs.join("; "),
            both(&level.summed)
        );
    }
}
