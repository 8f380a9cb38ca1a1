//! What every choice that differs from the paper or the authors' code does to AUROC.

use super::findings::{Findings, Query};
use super::jobs::REFERENCE;
use super::table::Table;
use crate::cells::Protocol;

/// A choice: job, row and protocol.
type Choice = (&'static str, &'static str, &'static str, Protocol);

const PAPER: Protocol = Protocol::Paper;

/// The choices, those that are compared next to each other. The first of each group is what is done here
/// unless told otherwise.
const GROUPS: [(&str, &[Choice]); 7] = [
    (
        "ID test windows",
        &[
            (
                "own noise, logs that the density has not seen",
                "main-kitti",
                "paper24",
                PAPER,
            ),
            (
                "own noise, a tenth of the fitted windows",
                "main-kitti",
                "paper24",
                Protocol::ReleasedCode,
            ),
            (
                "common noise, logs that the density has not seen",
                "main-kitti",
                "paper24-common",
                PAPER,
            ),
            (
                "common noise, a tenth of the fitted windows",
                "main-kitti",
                "paper24-common",
                Protocol::ReleasedCode,
            ),
        ],
    ),
    (
        "noise draws",
        &[
            ("one draw a window (paper)", "readings", "paper24", PAPER),
            ("two draws a window", "readings", "draws2", PAPER),
            ("four draws a window", "readings", "draws4", PAPER),
            (
                "one draw for all windows",
                "readings",
                "paper24-common",
                PAPER,
            ),
            ("two draws for all windows", "readings", "common2", PAPER),
        ],
    ),
    (
        "range of t, common noise",
        &[
            ("all 30 steps", "readings", "paper24-common", PAPER),
            ("the 15 with less noise", "readings", "low-noise", PAPER),
            ("the 15 with more noise", "readings", "high-noise", PAPER),
        ],
    ),
    (
        "density",
        &[
            (
                "24 statistics, mixture of five, common noise",
                "readings",
                "paper24-common",
                PAPER,
            ),
            (
                "24 statistics, mixture of one, common noise",
                "readings",
                "one-component",
                PAPER,
            ),
            (
                "12 statistics, mixture of one, own noise",
                "readings",
                "twelve-one-component",
                PAPER,
            ),
        ],
    ),
    (
        "RobotCar's angles, common noise",
        &[
            ("radians", "readings", "paper24-common", PAPER),
            (
                "radians converted from degrees again",
                "degrees-twice",
                "paper24-common",
                PAPER,
            ),
        ],
    ),
    (
        "rotation schedule, common noise, 1,500 training steps",
        &[
            ("cosine", REFERENCE, "paper24-common", PAPER),
            (
                "linear 1e-4 to 0.02 (authors' code)",
                "kitti-linear",
                "paper24-common",
                PAPER,
            ),
        ],
    ),
    (
        "scale of the translations, common noise, 1,500 training steps",
        &[
            (
                "each window by its largest displacement",
                REFERENCE,
                "paper24-common",
                PAPER,
            ),
            (
                "all by KITTI's largest displacement",
                "stored-scale",
                "paper24-common",
                PAPER,
            ),
            (
                "each set by its own (authors' code)",
                "own-scale",
                "paper24-common",
                PAPER,
            ),
        ],
    ),
];

/// The table.
pub fn readings(findings: &Findings) -> Table {
    let mut rows = Vec::new();
    for (group, choices) in GROUPS {
        for (label, job, row, protocol) in choices {
            let query = Query {
                jobs: &[job],
                row,
                protocol: *protocol,
            };
            rows.push(findings.line(&format!("{group}: {label}"), query));
        }
    }
    Table {
        title: "What each choice does".into(),
        text: "Split SE(3) statistics of networks trained on KITTI, first seed; one choice changes within a group. \
               Protocol `paper` but where the row says otherwise."
            .into(),
        head: findings.heads("choice"),
        rows,
        notes: Vec::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::super::jobs::plan;
    use super::*;

    #[test]
    fn every_choice_is_a_row_of_a_job() {
        let jobs = plan(true);
        for (_, job, row, _) in GROUPS.iter().flat_map(|(_, choices)| choices.iter()) {
            let job = jobs.iter().find(|j| j.key == *job).unwrap();
            assert!(job.rows.iter().any(|r| r.key == *row), "{} {row}", job.key);
        }
    }
}
