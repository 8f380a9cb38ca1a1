//! Few trusted logs: what is called beside them, and how often sound logs are.

use super::fold::{self, Measured};
use super::pieces::{self, Plan};
use super::run::Run;
use super::{Record, parts};
use crate::faults::protocol::LogSet;
use anyhow::Result;
use dose3_datasets::faults::Fault;
use serde::Serialize;

/// Numbers of trusted logs with faults in the others.
const FEW: [usize; 4] = [1, 2, 3, 5];
/// Numbers of trusted logs whose false alarms are counted beside every choice of them.
const COUNTED: [usize; 3] = [1, 2, 3];
/// Most choices of so few logs with faults.
const CHOICES: usize = 4;
/// Most pieces with faults judged by so few.
const FEW_PIECES: usize = 24;
/// Every so many faults are enough for them: all would say the same at greater length.
const FEW_FAULTS: usize = 5;
const PLAN: Plan = Plan {
    length: 1000,
    faulty: 100,
};

/// Sound pieces of all other groups, judged beside every choice of so many groups that follow each other by name.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FewAlarms {
    /// Letter of the set.
    pub set: char,
    /// Key of the contender.
    pub contender: &'static str,
    /// Trusted groups.
    pub trusted: usize,
    /// Pieces of about 1000 poses judged; each is judged beside several choices.
    pub pieces: usize,
    /// Pieces called.
    pub called: usize,
}

/// The groups trusted in a choice: `trusted` of `count` from `first` on, in a circle.
fn choice(first: usize, trusted: usize, count: usize) -> Vec<usize> {
    (0..trusted).map(|i| (first + i) % count).collect()
}

/// One log of each group chosen, and all logs of the other groups.
fn split(groups: &[usize], chosen: &[usize]) -> (Vec<usize>, Vec<usize>) {
    let one_of = |group: &usize| groups.iter().position(|of| of == group);
    let others = (0..groups.len()).filter(|log| !chosen.contains(&groups[*log]));
    (chosen.iter().filter_map(one_of).collect(), others.collect())
}

/// Faults in pieces of the others, beside up to four choices.
///
/// # Errors
/// A failing network, a fault that cannot be injected, too little trusted data for any row.
pub fn faults(
    run: &mut Run<'_>,
    set: &LogSet,
    measured: &Measured<'_>,
    record: &mut Record,
) -> Result<()> {
    let faults: Vec<Fault> = parts::faults(run)
        .into_iter()
        .map(|(_, fault)| fault)
        .step_by(FEW_FAULTS)
        .collect();
    let count = measured.groups.iter().max().map_or(0, |last| last + 1);
    let choices = CHOICES.min(count);
    for trusted in FEW.into_iter().filter(|trusted| *trusted < count) {
        for first in (0..choices).map(|i| i * count / choices) {
            let (fitted, tested) = split(measured.groups, &choice(first, trusted, count));
            let fit = fold::fit(measured, &fitted, run)?;
            let most = run.most_pieces().min(FEW_PIECES).div_ceil(choices);
            let pieces = pieces::of_logs(&set.logs, &tested, PLAN.length, most);
            let (what, seed) = ((PLAN, Some(trusted)), run.seed());
            let measurer = &mut run.measurer;
            let found = pieces::run(set.letter, &pieces, what, &faults, &fit, seed, measurer)?;
            pieces::add(&mut record.called, found);
        }
    }
    say!("{}: few trusted logs", set.name);
    Ok(())
}

/// Counts false alarms beside every choice of one, two and three groups.
///
/// # Errors
/// A failing network, too little trusted data for any row.
pub fn alarms(
    run: &mut Run<'_>,
    set: &LogSet,
    measured: &Measured<'_>,
    record: &mut Record,
) -> Result<()> {
    let (mut sound, mut group) = (Vec::new(), Vec::new());
    for (log, of) in measured.groups.iter().enumerate() {
        let pieces = pieces::of_logs(&set.logs, &[log], PLAN.length, run.most_pieces());
        group.resize(group.len() + pieces.len(), *of);
        sound.extend(pieces.into_iter().map(|piece| piece.trajectory));
    }
    let windows = run.measurer.windows(&sound);
    let table = run.measurer.measure(&sound, &windows)?;
    let count = measured.groups.iter().max().map_or(0, |last| last + 1);
    for trusted in COUNTED.into_iter().filter(|trusted| *trusted < count) {
        let firsts = if run.one_fold() { 1 } else { count };
        let mut cells: Vec<FewAlarms> = Vec::new();
        for first in 0..firsts {
            let chosen = choice(first, trusted, count);
            let (fitted, _) = split(measured.groups, &chosen);
            let fit = fold::fit(measured, &fitted, run)?;
            let judged: Vec<usize> = (0..sound.len())
                .filter(|piece| !chosen.contains(&group[*piece]))
                .collect();
            for (contender, called) in pieces::judge(&table, &judged, &fit, &run.measurer)? {
                let same = |cell: &FewAlarms| cell.contender == contender;
                let at = cells.iter().position(same).unwrap_or_else(|| {
                    cells.push(FewAlarms {
                        set: set.letter,
                        contender,
                        trusted,
                        pieces: 0,
                        called: 0,
                    });
                    cells.len() - 1
                });
                cells[at].pieces += judged.len();
                cells[at].called += called.len();
            }
        }
        record.few.extend(cells);
    }
    say!("{}: false alarms beside few trusted logs", set.name);
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn choices_go_around_and_never_judge_what_they_trust() {
        let groups = [0, 0, 1, 2, 3];
        assert_eq!(choice(3, 2, 4), [3, 0]);
        let (fitted, tested) = split(&groups, &choice(3, 2, 4));
        assert_eq!((fitted, tested), (vec![4, 0], vec![2, 3]));
    }
}
