//! What may be said of a stretch, before the strongest are chosen.

use crate::report::{Place, Reason, ReasonAxis, ReasonKind};
use crate::series::{Motion, TrustedRanges, Unit};
use dose3_lie::Pose;
use std::ops::Range;

/// A stretch to be explained. Indices of poses are those of `motion`.
pub(super) struct Stretch<'a> {
    pub motion: &'a Motion,
    pub ranges: &'a TrustedRanges,
    /// The poses of `motion`, in the axes of the file.
    pub all: &'a [Pose],
    /// Those to look at.
    pub poses: Range<usize>,
    /// The detector's windows among them.
    pub windows: &'a [Range<usize>],
    /// Whether axes are forward, left and up.
    pub named: bool,
    pub hertz: f64,
}

/// One deviation.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Candidate {
    pub kind: ReasonKind,
    pub axis: ReasonAxis,
    pub amount: f64,
    pub trusted: Option<[f64; 2]>,
    pub unit: Unit,
    /// 1 is the end of the trusted range.
    pub strength: f64,
    /// From the first to the last that deviates.
    pub poses: Range<usize>,
    /// The one that deviates most; none where a number of the whole stretch does.
    pub peak: Option<usize>,
    pub sentence: String,
}

impl Candidate {
    /// Whether it names a cause that is read from how position and attitude go together.
    pub fn is_calibration(&self) -> bool {
        use ReasonKind::{LeverArm, Mounting, Scale, TimeOffset};
        matches!(self.kind, TimeOffset | LeverArm | Mounting | Scale)
    }

    /// At its place in the user's file.
    pub fn reason(self, place: Place) -> Reason {
        Reason {
            kind: self.kind,
            axis: self.axis,
            amount: self.amount,
            trusted: self.trusted,
            unit: self.unit,
            strength: self.strength,
            place,
            sentence: self.sentence,
        }
    }
}

/// The first to the last of `poses` for which `deviates`; none where it is none of them.
pub(super) fn span(poses: Range<usize>, deviates: impl Fn(usize) -> bool) -> Option<Range<usize>> {
    let mut found = poses.filter(|pose| deviates(*pose));
    let first = found.next()?;
    Some(first..found.next_back().unwrap_or(first) + 1)
}
