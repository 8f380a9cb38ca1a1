//! What is known to be wrong with the references: named where alarms are counted, not removed.

use super::pieces::Piece;
use dose3_datasets::Trajectory;

/// A step of the RobotCar reference that is longer by this much than those beside it, metres, is a jump of its
/// inertial system.
const JUMP: f64 = 0.5;

/// Name and place of a piece, and its known defect.
pub fn describe(set: char, piece: &Piece) -> String {
    let end = piece.start + piece.trajectory.len();
    let place = format!("{} poses {} to {}", piece.log, piece.start, end - 1);
    match known(set, &piece.log, piece.start..end, &piece.trajectory) {
        Some(defect) => format!("{place} ({defect})"),
        None => place,
    }
}

/// The known defect of a part of a log.
pub fn known(
    set: char,
    log: &str,
    poses: std::ops::Range<usize>,
    trajectory: &Trajectory,
) -> Option<String> {
    match (set, log) {
        ('K', "08") if poses.start < 98 => {
            Some("its poses 0 to 97 climb 1.8 m/s at 1 m/s: a defect of the reference".to_owned())
        }
        // Constant turns of 15 poses while the position goes straight on.
        ('K', "00") if [1954, 2114, 2965].iter().any(|gap| poses.contains(gap)) => Some(
            "the reference is interpolated over gaps of 1.5 s in bends at poses 1954, 2114 and 2965".to_owned(),
        ),
        ('K', "03") => Some("recorded on another day than the others, its mounting differs".to_owned()),
        ('K', "01") => Some("the only motorway".to_owned()),
        ('O', _) => {
            let jump = largest_jump(trajectory);
            (jump >= JUMP).then(|| format!("the reference jumps by {jump:.1} m"))
        }
        _ => None,
    }
}

/// By how much one step is longer than the longer one of those beside it, metres.
fn largest_jump(log: &Trajectory) -> f64 {
    let steps: Vec<f64> = log
        .poses
        .windows(2)
        .map(|pair| (pair[1].translation - pair[0].translation).norm())
        .collect();
    let excess = steps
        .windows(3)
        .map(|three| three[1] - three[0].max(three[2]));
    excess.fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;
    use dose3_datasets::faults::Fault;
    use dose3_datasets::synthetic::{Platform, trajectory};

    #[test]
    fn defects_are_named() {
        let drive = trajectory(Platform::Vehicle, 3, 400, 10.0);
        let defect = |set, log, poses| known(set, log, poses, &drive);
        assert!(defect('K', "08", 0..400).is_some());
        assert!(defect('K', "08", 400..800).is_none());
        assert!(defect('K', "01", 400..800).is_some());
        assert!(defect('O', "2019", 0..400).is_none());
        let jump = Fault::Jump { metres: 3.0 }
            .apply(&drive, 100..200, 1)
            .unwrap();
        assert!(
            known('O', "2019", 0..400, &jump)
                .unwrap()
                .contains("jumps by")
        );
    }
}
