//! Tables of faults in windows.

use super::methods::METHODS;
use super::record::Report;
use super::summary::{self, Line, mean, show};
use super::windows::{CUT, FAULT};
use std::fmt::Write as _;

/// What all faults come down to.
pub fn summary(report: &Report, out: &mut String) {
    let sites: Vec<String> = report.runs.first().map_or(Vec::new(), |run| {
        let all = run.sites.iter();
        all.map(|(set, n)| format!("{n} in {set}")).collect()
    });
    let _ = writeln!(
        out,
        "### Faults in windows: summary\n\n\
         {} faults and severities, injected into poses {} to {} of cuts of {CUT} poses from \
         the tested logs ({}; evenly spread over places where the path over the fault's range \
         is at least a fifth of its median: where a platform stands, freezing, dropping, \
         reversing or scaling its motion changes nothing). Jumps and standstill that sound logs \
             hold are left in them, trusted and tested. AUROC of the window centred on the \
         faulty poses against the window of the same cut without fault. `detectable`: some row \
         reaches {:.1} on the tested logs themselves. `gain`: mean difference to `kinematic` \
         over detectable faults that it finds at less than .9. `worst`: lowest difference on \
         any fault; `below`: faults where the row is lower by more than .01, of all faults.\n",
        report.faults,
        FAULT.start,
        FAULT.end - 1,
        sites.join(", "),
        summary::DETECTABLE,
    );
    let _ = writeln!(
        out,
        "| set | row | mean, all | mean, detectable (n) | gain where weak (n) | worst to \
         kinematic | below | worst to moments24 | below |\n|---|---|---|---|---|---|---|---|---|"
    );
    for s in &report.summaries {
        let set = s.set.map_or_else(|| "all".into(), |set| set.to_string());
        let gain = s
            .gain_where_weak
            .map_or_else(|| "–".into(), |gain| format!("{gain:+.3}"));
        let _ = writeln!(
            out,
            "| {set} | {} | {:.3} | {} ({}) | {gain} ({}) | {:+.3} {} | {} | {:+.3} {} | {} |",
            s.method,
            s.mean_all,
            show(&s.mean_detectable_of_models),
            s.detectable,
            s.weak,
            s.worst_to_kinematic.0,
            s.worst_to_kinematic.1,
            s.below_kinematic,
            s.worst_to_moments.0,
            s.worst_to_moments.1,
            s.below_moments,
        );
    }
    out.push('\n');
}

/// Every fault in every set.
pub fn faults(report: &Report, out: &mut String, lines: &[Line]) {
    for set in &report.sets {
        let _ = writeln!(
            out,
            "### Faults in windows: {}\n\nAUROC, mean over models; in brackets for two rows \
             the 95 % bootstrap interval over places (first model; neighbouring places share \
             poses, so it is somewhat narrow). *Italic*: no row detects it.\n\n| fault | {} |\n\
             |---|{}",
            set.name,
            METHODS.each_ref().map(|m| m.key).join(" | "),
            "---|".repeat(METHODS.len())
        );
        for line in lines.iter().filter(|line| line.set == set.letter) {
            let cells: Vec<String> = (0..METHODS.len()).map(|m| cell(report, line, m)).collect();
            let mark = if line.detectable() { "" } else { "*" };
            let _ = writeln!(
                out,
                "| {mark}{}{mark} | {} |",
                line.fault,
                cells.join(" | ")
            );
        }
        out.push('\n');
    }
}

fn cell(report: &Report, line: &Line, method: usize) -> String {
    let Some(value) = mean(&line.auroc[method]) else {
        return "–".into();
    };
    let interval = report.runs.first().and_then(|run| {
        let mut cells = run.windows.iter();
        cells
            .find(|c| {
                c.set == line.set && c.fault == line.fault && c.method == METHODS[method].key
            })?
            .interval
    });
    match interval {
        Some(i) => format!("{value:.3} ({:.2}–{:.2})", i.lower, i.upper),
        None => format!("{value:.3}"),
    }
}
