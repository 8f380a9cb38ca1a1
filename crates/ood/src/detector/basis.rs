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

// Measured at alpha 0.05 with `kinematic,differences` at 10 Hz: n groups that follow each other by name are
// trusted, from every group on, and the pieces of all other logs of the set are judged.
const ONE: [MeasuredAlarms; 3] = [
    alarms("KITTI", 69, 190),
    alarms("IROS20", 64, 463),
    alarms("RobotCar", 7, 222),
];
const TWO: [MeasuredAlarms; 3] = [
    alarms("KITTI", 57, 189),
    alarms("IROS20", 14, 462),
    alarms("RobotCar", 10, 148),
];
const THREE: [MeasuredAlarms; 3] = [
    alarms("KITTI", 10, 168),
    alarms("IROS20", 1, 420),
    alarms("RobotCar", 2, 74),
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
        let share = |groups| {
            let all = basis(groups).measured_alarms().iter();
            let (called, of) = all.fold((0, 0), |(c, n), a| (c + a.called, n + a.pieces));
            f64::from(called as u32) / f64::from(of as u32)
        };
        assert!(share(1) > share(2) && share(2) > share(3));
    }
}
