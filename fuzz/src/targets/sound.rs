//! What holds of every log that was accepted.

use dose3_datasets::{
    Format, Frame, LoadOptions, LostKind, Remark, RemarkKind, StampUnit, Trajectory, load_bytes,
    write,
};
use dose3_lie::{Matrix, Pose, Rotation, Vector};

/// Panics unless the log is one.
pub fn check(log: &Trajectory) {
    let count = log.poses.len();
    assert!(count > 0, "a log without poses");
    assert_eq!(log.stamps.len(), count, "stamps");
    assert_eq!(log.rows.len(), count, "rows");
    assert!(
        log.stamps.windows(2).all(|pair| pair[0] < pair[1]),
        "stamps do not increase"
    );
    assert!(
        log.breaks.windows(2).all(|pair| pair[0] < pair[1]),
        "breaks do not increase"
    );
    assert!(
        log.breaks.iter().all(|at| *at < count),
        "a break beyond the log"
    );
    assert!(
        log.rate.hertz.is_finite() && log.rate.hertz > 0.0,
        "rate {}",
        log.rate.hertz
    );
    for pose in &log.poses {
        assert!(
            pose.translation.iter().all(|value| value.is_finite()),
            "a position is not finite"
        );
        let matrix = pose.rotation.matrix();
        let off = (matrix.transpose() * matrix - Matrix::identity())
            .abs()
            .max();
        assert!(off < 2e-5, "a rotation is off by {off}");
        assert!(matrix.determinant() > 0.0, "a rotation mirrors");
    }
    assert!(
        log.duration() >= 0.0 && log.distance() >= 0.0,
        "duration or distance"
    );
    let accepted = Trajectory::from_poses("copy", log.frame, log.stamps.clone(), log.poses.clone());
    assert!(
        count < 2 || accepted.is_ok(),
        "not accepted from memory: {accepted:?}"
    );
}

/// Stamps from here on are not read from text, nanoseconds.
pub const LATEST: u64 = 4_000_000_000_000_000_000;

/// Stamps of a clock that was set are later, nanoseconds.
const NO_DATE: i64 = 100_000_000_000_000_000;

/// Panics unless a log written as TUM is read back to the same poses.
pub fn reread(log: &Trajectory) {
    // Text holds stamps before the year 2096; recordings may hold later ones. A first stamp near zero before dates is
    // one of a clock that was not set, and left out.
    if log.len() < 2
        || (log.stamps[0] < NO_DATE && log.stamps[log.len() / 2] > NO_DATE)
        || log
            .stamps
            .iter()
            .any(|stamp| stamp.unsigned_abs() >= LATEST)
    {
        return;
    }
    let mut text = Vec::new();
    if write::tum(&mut text, log).is_err() {
        return;
    }
    let options = LoadOptions {
        format: Some(Format::Tum),
        stamp_unit: Some(StampUnit::Seconds),
        lost: vec![LostKind::Nan],
        ..LoadOptions::default()
    };
    let back = match load_bytes("log", &text, &options) {
        Ok(back) => back,
        Err(error) => panic!("written, but not read: {error}"),
    };
    // Against the header, by its motion; and said.
    let order = |remark: &Remark| remark.kind == RemarkKind::QuaternionOrder;
    if back.report.remarks.iter().any(order) {
        return;
    }
    // What rounding left of a rotation is gone after its quaternion.
    let allowed = 1e-9 + 2.0 * log.report.largest_rotation_error;
    assert_eq!(back.stamps, log.stamps, "stamps after writing");
    for (one, other) in back.poses.iter().zip(&log.poses) {
        assert_eq!(
            one.translation, other.translation,
            "a position after writing"
        );
        let off = (one.rotation.matrix() - other.rotation.matrix())
            .abs()
            .max();
        assert!(off < allowed, "a rotation after writing is off by {off}");
    }
}

/// Poses as from a program: 13 little-endian words a pose, a stamp and 12 numbers.
pub fn poses(bytes: &[u8]) {
    const POSE: usize = 13 * 8;
    let mut stamps = Vec::new();
    let mut poses = Vec::new();
    for pose in bytes.chunks_exact(POSE) {
        let word = |index: usize| {
            let mut word = [0; 8];
            word.copy_from_slice(&pose[8 * index..8 * index + 8]);
            word
        };
        stamps.push(i64::from_le_bytes(word(0)));
        let number = |index: usize| f64::from_le_bytes(word(index));
        let matrix = Matrix::from_fn(|row, column| number(1 + 4 * row + column));
        let translation = Vector::from_fn(|row, _| number(4 + 4 * row));
        poses.push(Pose {
            rotation: Rotation::from_matrix_unchecked(matrix),
            translation,
        });
    }
    if let Ok(log) = Trajectory::from_poses("poses", Frame::BodyFlu, stamps, poses) {
        check(&log);
        reread(&log);
    }
}
