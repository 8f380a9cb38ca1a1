//! Whole sound logs, each judged by the other groups of logs: false alarms.

use super::calibration;
use super::contender::DEFAULT;
use super::defects;
use super::fold::{self, Measured};
use super::judge::ALPHA;
use super::run::Run;
use super::timing;
use anyhow::Result;
use dose3_datasets::Trajectory;
use dose3_ood::ExternalTest;
use dose3_ood::findings::calibration::CalibrationReference;
use serde::Serialize;

/// The default with the stamps and the calibration as tests beside it, as `dose3 score` judges.
pub const ALL_TESTS: &str = "default, stamps, calibration";

/// Whole logs of a set.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct WholeCell {
    /// Letter of the set.
    pub set: char,
    /// Key of the contender.
    pub contender: &'static str,
    /// Logs judged.
    pub logs: usize,
    /// Logs called, with what is known to be wrong with them.
    pub called: Vec<String>,
}

/// Judges every log of a set by the other groups; `recorded` are the logs with the stamps that they came with.
///
/// # Errors
/// A failing fit.
pub fn run(
    set: char,
    recorded: &[Trajectory],
    measured: &Measured<'_>,
    run: &Run<'_>,
) -> Result<Vec<WholeCell>> {
    let mut cells: Vec<WholeCell> = Vec::new();
    for fold in fold::by_group(measured.groups, usize::MAX) {
        let fit = fold::fit(measured, &fold.fitted, run)?;
        let beside = Beside::fit(recorded, measured, &fold.fitted)?;
        for &log in &fold.tested {
            let windows = measured.table.of_log(log);
            if windows.is_empty() {
                continue;
            }
            let stretches: Vec<usize> = windows
                .iter()
                .map(|&window| measured.table.stretches[window])
                .collect();
            let mut add = |contender: &'static str, called: bool| {
                let same = |cell: &WholeCell| cell.set == set && cell.contender == contender;
                let at = cells.iter().position(same).unwrap_or_else(|| {
                    cells.push(WholeCell {
                        set,
                        contender,
                        logs: 0,
                        called: Vec::new(),
                    });
                    cells.len() - 1
                });
                cells[at].logs += 1;
                cells[at].called.extend(called.then(|| {
                    let log = &measured.logs[log];
                    match defects::known(set, &log.name, 0..log.len(), log) {
                        Some(defect) => format!("{} ({defect})", log.name),
                        None => log.name.clone(),
                    }
                }));
            };
            for (contender, fitted) in &fit.fitted {
                let rows =
                    run.measurer
                        .rows(&measured.table, &windows, &contender.set()?, |_| {
                            fit.linear.all()
                        })?;
                add(contender.key, fitted.judge(&rows, &stretches)?.called);
                if contender.key == DEFAULT {
                    let tests = beside.tests(&recorded[log], &measured.logs[log])?;
                    let judged = fitted.judge_with(&rows, &stretches, &tests)?;
                    add(ALL_TESTS, judged.called);
                }
            }
        }
    }
    Ok(cells)
}

/// What is asked of logs beside their windows.
struct Beside {
    stamps: Option<dose3_ood::timing::TimingReference>,
    calibration: Option<CalibrationReference>,
}

impl Beside {
    fn fit(recorded: &[Trajectory], measured: &Measured<'_>, fitted: &[usize]) -> Result<Self> {
        let has_stamps = recorded.iter().all(timing::has_stamps);
        let (mut pieces, mut of) = (Vec::new(), Vec::new());
        for &log in fitted {
            pieces.extend(calibration::pieces(&measured.logs[log])?);
            of.resize(pieces.len(), measured.groups[log]);
        }
        Ok(Self {
            stamps: match has_stamps {
                true => Some(timing::reference(recorded, fitted, measured.groups)?),
                false => None,
            },
            calibration: match pieces.is_empty() {
                true => None,
                false => Some(CalibrationReference::fit(&pieces, &of)?),
            },
        })
    }

    fn tests(&self, recorded: &Trajectory, log: &Trajectory) -> Result<Vec<ExternalTest>> {
        let stamps = self.stamps.as_ref();
        let mut tests: Vec<ExternalTest> = stamps
            .and_then(|reference| timing::test(reference, recorded))
            .into_iter()
            .collect();
        if let Some(reference) = &self.calibration {
            let share = calibration::SHARE;
            let finding = reference.judge(&calibration::pieces(log)?, ALPHA * share)?;
            tests.extend(finding.map(|finding| ExternalTest {
                name: "calibration".to_owned(),
                share,
                p_value: if finding.called { finding.chance } else { 1.0 },
                sentence: finding.sentence(log.frame.has_forward()),
            }));
        }
        Ok(tests)
    }
}
