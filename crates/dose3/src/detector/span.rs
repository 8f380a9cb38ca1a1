//! A few steps of the trusted logs, by single numbers: what alarms of streams see at once.

use crate::error::Result;
use dose3_datasets::{LogGroups, Trajectory, increments, stretches};
use dose3_ood::alarm::{SpanReference, SpanSeries, SpanWorkspace, span_row};

/// Steps of the spans: what is plain shows in the first, what is weak in the second.
const STEPS: [usize; 2] = [8, 32];
/// Numbers of a step.
const AXES: usize = 6;

/// Of the trusted logs that are `kept`, which all have the rate `hertz`; none of a length that no log has.
pub(super) fn fit(
    logs: &[Trajectory],
    groups: &LogGroups,
    kept: impl Fn(&usize) -> bool,
    hertz: f64,
) -> Result<Vec<SpanReference>> {
    let mut work = SpanWorkspace::default();
    let mut all = [const { Vec::new() }; STEPS.len()];
    for log in (0..logs.len()).filter(kept) {
        let (t, group) = (&logs[log], groups.of_log[log]);
        for stretch in stretches(t, t.max_gap) {
            let motion = increments(&t.poses[stretch], t.frame);
            for (steps, series) in STEPS.iter().zip(&mut all) {
                let spans = motion.chunks_exact(AXES * steps);
                let rows = spans.map(|span| span_row(span, hertz, &mut work));
                series.push(SpanSeries {
                    group,
                    rows: rows.collect::<std::result::Result<_, _>>()?,
                });
            }
        }
    }
    let each = STEPS.iter().zip(&all);
    Ok(each
        .filter_map(|(steps, series)| SpanReference::fit(*steps, hertz, series))
        .collect())
}
