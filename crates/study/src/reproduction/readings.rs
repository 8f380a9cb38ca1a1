//! What every choice that differs from the paper or the authors' code does to AUROC.

use super::experiment::Experiment;
use super::findings::{Findings, Query};
use super::table::Table;
use crate::rows::{
    HIGH_NOISE, LOW_NOISE, ONE_COMPONENT, Row, SPLIT, SPLIT_OWN2, SPLIT_OWN4, SPLIT_SHARED,
    SPLIT_SHARED2, TWELVE_ONE_COMPONENT,
};
use crate::split::Split;

/// A choice: what it is called, and where its numbers stand.
type Choice = (&'static str, Experiment, Row, Split);

const UNSEEN: Split = Split::HeldOut;

/// The choices, those that are compared next to each other. The first of each group is what is done here
/// unless told otherwise.
fn groups() -> Vec<(&'static str, Vec<Choice>)> {
    let (main, readings) = (Experiment::first(), Experiment::readings());
    let reference = Experiment::reference();
    let shared = |label, experiment| (label, experiment, SPLIT_SHARED, UNSEEN);
    let reading = |label, row| (label, readings, row, UNSEEN);
    vec![
        (
            "ID test windows (main table)",
            vec![
                (
                    "own noise, logs that the density has not seen",
                    main,
                    SPLIT,
                    UNSEEN,
                ),
                (
                    "own noise, a tenth of the fitted windows",
                    main,
                    SPLIT,
                    Split::ReleasedCode,
                ),
                (
                    "two shared draws, logs that the density has not seen",
                    main,
                    SPLIT_SHARED2,
                    UNSEEN,
                ),
                (
                    "two shared draws, a tenth of the fitted windows",
                    main,
                    SPLIT_SHARED2,
                    Split::ReleasedCode,
                ),
            ],
        ),
        (
            "noise draws",
            vec![
                reading("one draw a window (paper)", SPLIT),
                reading("two draws a window", SPLIT_OWN2),
                reading("four draws a window", SPLIT_OWN4),
                reading("one draw shared by all windows", SPLIT_SHARED),
                reading("two draws shared by all windows", SPLIT_SHARED2),
            ],
        ),
        (
            "range of t, one shared draw",
            vec![
                reading("all 30 steps", SPLIT_SHARED),
                reading("the 15 with less noise", LOW_NOISE),
                reading("the 15 with more noise", HIGH_NOISE),
            ],
        ),
        (
            "density",
            vec![
                reading(
                    "24 statistics, mixture of five, one shared draw",
                    SPLIT_SHARED,
                ),
                reading(
                    "24 statistics, mixture of one, one shared draw",
                    ONE_COMPONENT,
                ),
                reading(
                    "12 statistics, mixture of one, own noise",
                    TWELVE_ONE_COMPONENT,
                ),
            ],
        ),
        (
            "RobotCar's angles, one shared draw",
            vec![
                shared("radians", readings),
                shared(
                    "radians converted from degrees again",
                    Experiment::degrees_twice(),
                ),
            ],
        ),
        (
            "rotation schedule, one shared draw, 1,500 training steps",
            vec![
                shared("cosine", reference),
                shared("linear 1e-4 to 0.02 (authors' code)", Experiment::linear()),
            ],
        ),
        (
            "scale of the translations, one shared draw, 1,500 training steps",
            vec![
                shared("each window by its largest displacement", reference),
                shared(
                    "all by KITTI's largest displacement",
                    Experiment::stored_scale(),
                ),
                shared(
                    "each set by its own (authors' code)",
                    Experiment::own_scale(),
                ),
            ],
        ),
    ]
}

/// The table.
pub fn readings(findings: &Findings) -> Table {
    let mut rows = Vec::new();
    for (group, choices) in groups() {
        for (label, experiment, row, split) in choices {
            let query = Query {
                of: &[experiment],
                row,
                split,
            };
            rows.push(findings.line(&format!("{group}: {label}"), query));
        }
    }
    Table {
        title: "What each choice does".into(),
        text: "Split SE(3) statistics of networks trained on KITTI, first seed; one choice changes within a group. \
               Split `held-out` but where the row says otherwise. The main table has at most 700 windows a set, the \
               other groups 400, at other strides: compare within a group."
            .into(),
        head: findings.heads("choice"),
        rows,
        notes: Vec::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::super::experiment::{Effort, plan};
    use super::*;

    #[test]
    fn every_choice_is_measured() {
        let plan = plan(Effort::Quick);
        for (_, experiment, row, _) in groups().into_iter().flat_map(|(_, choices)| choices) {
            assert!(plan.contains(&experiment), "{}", experiment.name());
            assert!(experiment.rows.contains(&row), "{row:?}");
        }
    }
}
