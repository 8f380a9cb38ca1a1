//! What the chance of a verdict rests on.

use serde::{Deserialize, Serialize};

/// What a chance rests on: how much trusted data, and whether a model of its tail.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Basis {
    /// Groups of trusted logs that the log was compared with.
    pub groups: usize,
    /// Trusted windows that the tails were fitted to.
    pub windows: usize,
    /// The smallest chance that `groups` groups can give by ranks alone, without a model: `1 / (n + 1)`.
    pub smallest_rank_p: f64,
    /// Whether the chance was read off a fitted tail, beyond the 0.9 quantile of the trusted runs; never
    /// for a test from outside.
    pub tail: bool,
    /// Whether there are only two groups: how logs differ has been seen once.
    pub provisional: bool,
}

impl Basis {
    pub(super) fn new(groups: usize, windows: usize, tail: bool) -> Self {
        Self {
            groups,
            windows,
            smallest_rank_p: 1.0 / (groups + 1) as f64,
            tail,
            provisional: groups == 2,
        }
    }

    /// How often sound logs were called where so few groups were trusted; empty for more than three.
    #[must_use]
    pub fn measured_alarms(&self) -> &'static [MeasuredAlarms] {
        match self.groups {
            1 => &ONE,
            2 => &TWO,
            3 => &THREE,
            _ => &[],
        }
    }
}

/// False alarms that were measured on public data.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct MeasuredAlarms {
    /// The data.
    pub data: &'static str,
    /// Sound pieces of 1000 poses called.
    pub called: usize,
    /// Sound pieces judged.
    pub pieces: usize,
}

const fn alarms(data: &'static str, called: usize, pieces: usize) -> MeasuredAlarms {
    MeasuredAlarms {
        data,
        called,
        pieces,
    }
}

// `cargo xtask benchmark --faults --only few --rows default`: the default statistics at 10 Hz and alpha 0.05, n groups
// that follow each other by name trusted (one log of each), from every group on; pieces of all other groups.
const ONE: [MeasuredAlarms; 3] = [
    alarms("KITTI", 31, 190),
    alarms("IROS20", 22, 154),
    alarms("RobotCar", 5, 222),
];
const TWO: [MeasuredAlarms; 3] = [
    alarms("KITTI", 0, 189),
    alarms("IROS20", 0, 426),
    alarms("RobotCar", 2, 148),
];
const THREE: [MeasuredAlarms; 3] = [
    alarms("KITTI", 1, 168),
    alarms("IROS20", 30, 420),
    alarms("RobotCar", 3, 74),
];

#[cfg(test)]
mod tests {
    use super::Basis;

    #[test]
    fn few_groups_come_with_measured_alarms() {
        let basis = |groups| Basis::new(groups, 100, true);
        assert_eq!(basis(9).smallest_rank_p, 0.1);
        let provisional: Vec<bool> = (1..5).map(|n| basis(n).provisional).collect();
        assert_eq!(provisional, [false, true, false, false]);
        assert!(basis(4).measured_alarms().is_empty());
        for groups in 1..=3 {
            let all = basis(groups).measured_alarms();
            assert_eq!(all.len(), 3);
            assert!(all.iter().all(|a| a.called <= a.pieces && a.pieces > 50));
        }
    }
}
