//! The table of reasons.

use super::{Case, Record};
use std::fmt::Write;

/// The document.
pub fn markdown(record: &Record) -> String {
    let mut text = String::new();
    let synthetic = match record.synthetic {
        true => "SYNTHETIC data: these numbers say nothing of real sensors. ",
        false => "",
    };
    let [command, where_from] = record.provenance.lines();
    let _ = writeln!(
        text,
        "{command}\n\n{synthetic}{where_from}; {} logs, {} pieces of 1000 poses with a fault of 100 poses each.\n",
        record.part, record.pieces
    );
    let _ = writeln!(
        text,
        "A case is *detected* where the piece is called and is not called without the fault, and a bad stretch holds \
         poses of the fault. *Named*: one of the at most three sentences of that stretch has a kind and an axis of \
         the last column; *first*: the first one has.\n"
    );
    let all: Vec<&Case> = record.cases.iter().collect();
    let _ = writeln!(text, "All: {}.\n", summary(&all));
    for list in ["suite", "couplings"] {
        let of_list: Vec<&Case> = all.iter().copied().filter(|c| c.list == list).collect();
        let _ = writeln!(text, "## The {list}\n\n{}.\n", summary(&of_list));
        let _ = writeln!(
            text,
            "| fault | detected | named | first | an example of what was said | names it |\n|---|---|---|---|---|---|"
        );
        for (_, fault, names) in record.faults.iter().filter(|(of, ..)| *of == list) {
            let cases: Vec<&Case> = of_list
                .iter()
                .copied()
                .filter(|case| case.fault == *fault)
                .collect();
            let example = cases.iter().find_map(|case| case.reasons.first());
            let example = example.map_or("–", |reason| reason.sentence.as_str());
            let _ = writeln!(
                text,
                "| {fault} | {} | {} | {} | {example} | {names} |",
                cases.len(),
                share(&cases, |case| case.named_by.is_some()),
                share(&cases, |case| case.named_by == Some(1)),
            );
        }
        let _ = writeln!(text);
    }
    text
}

fn share(cases: &[&Case], is: impl Fn(&Case) -> bool) -> String {
    match cases.len() {
        0 => "–".to_owned(),
        n => format!(
            "{:.0} %",
            100.0 * cases.iter().filter(|c| is(c)).count() as f64 / n as f64
        ),
    }
}

/// Over all cases, and the mean over faults, in which one that is easily detected counts no more than another.
fn summary(cases: &[&Case]) -> String {
    let mut faults: Vec<&str> = cases.iter().map(|case| case.fault.as_str()).collect();
    faults.sort_unstable();
    faults.dedup();
    let of_fault = |fault: &str| {
        let of: Vec<&&Case> = cases.iter().filter(|case| case.fault == fault).collect();
        of.iter().filter(|case| case.named_by.is_some()).count() as f64 / of.len() as f64
    };
    let mean = faults.iter().map(|fault| of_fault(fault)).sum::<f64>() / faults.len().max(1) as f64;
    let named = cases.iter().filter(|case| case.named_by.is_some()).count();
    format!(
        "{} detected cases, {named} named ({}), {} by the first sentence; mean over {} faults with a detected case {:.0} %",
        cases.len(),
        share(cases, |case| case.named_by.is_some()),
        share(cases, |case| case.named_by == Some(1)),
        faults.len(),
        100.0 * mean
    )
}
