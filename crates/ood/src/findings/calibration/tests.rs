use super::*;
use nalgebra::{UnitQuaternion, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

const HERTZ: f64 = 10.0;
const SHARE: f64 = 0.01;

/// What is wrong with a drive.
#[derive(Clone, Copy, Default)]
struct Wrong {
    late: f64,
    lever: Vector3<f64>,
    turn: Vector3<f64>,
}

/// A drive at 4 to 12 m/s that turns, pitches over hills and rolls in bends, ten poses a second; the position is taken
/// `wrong.late` seconds before the attitude.
fn drive(seed: u64, count: usize, wrong: Wrong) -> Vec<f64> {
    const FINE: usize = 10;
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let step = 1.0 / (HERTZ * FINE as f64);
    let phases: Vec<f64> = (0..12).map(|_| rng.random_range(0.0..6.0)).collect();
    let at = |t: f64, first: usize, low: f64| -> f64 {
        let waves = (0..3).map(|k| (low * (1.0 + 0.77 * k as f64) * t + phases[first + k]).sin());
        waves.sum::<f64>() / 3.0
    };
    let mut rotation = UnitQuaternion::identity();
    let mut position = Vector3::zeros();
    let mut fine = Vec::new();
    let late = (wrong.late * HERTZ * FINE as f64).round() as i64;
    for i in 0..(count + 3) * FINE {
        let t = i as f64 * step;
        fine.push((rotation, position));
        let speed = 8.0 + 4.0 * at(t, 0, 0.21);
        let turn = Vector3::new(
            0.1 * at(t, 3, 2.0),
            0.1 * at(t, 6, 1.1),
            0.4 * at(t, 9, 0.5),
        );
        position += rotation * Vector3::new(speed * step, 0.0, 0.0);
        rotation *= UnitQuaternion::from_scaled_axis(turn * step);
    }
    let poses: Vec<_> = (FINE..(count + 2) * FINE)
        .step_by(FINE)
        .map(|i| {
            let (rotation, _) = fine[i];
            let jitter = Vector3::from_fn(|_, _| rng.random_range(-0.01..0.01));
            let position = fine[(i as i64 - late) as usize].1 + rotation * wrong.lever + jitter;
            (
                rotation * UnitQuaternion::from_scaled_axis(wrong.turn),
                position,
            )
        })
        .collect();
    poses
        .windows(2)
        .flat_map(|p| {
            let u = p[0].0.inverse() * (p[1].1 - p[0].1);
            let w = (p[0].0.inverse() * p[1].0).scaled_axis();
            [u.x, u.y, u.z, w.x, w.y, w.z]
        })
        .collect()
}

fn pieces(increments: &[f64]) -> Vec<CalibrationPiece> {
    CalibrationPiece::of_stretch(increments, HERTZ).unwrap()
}

fn reference(logs: u64) -> CalibrationReference {
    let (mut trusted, mut groups) = (Vec::new(), Vec::new());
    for log in 0..logs {
        for piece in pieces(&drive(log, 2000, Wrong::default())) {
            trusted.push(piece);
            groups.push(log as usize);
        }
    }
    CalibrationReference::fit(&trusted, &groups).unwrap()
}

#[test]
fn causes_are_named_with_sign_and_size() {
    let reference = reference(6);
    let judged = |wrong: Wrong| {
        let pieces = pieces(&drive(77, 1000, wrong));
        reference.judge(&pieces, SHARE).unwrap().unwrap()
    };
    let sound = judged(Wrong::default());
    assert!(!sound.called && sound.chance > SHARE, "{sound:?}");
    let degree = 1_f64.to_radians();
    let lever = |x, y, z| Wrong {
        lever: Vector3::new(x, y, z),
        ..Wrong::default()
    };
    let turn = |y, z| Wrong {
        turn: Vector3::new(0.0, y, z),
        ..Wrong::default()
    };
    let late = |late| Wrong {
        late,
        ..Wrong::default()
    };
    let cases = [
        (
            late(0.1),
            Kind::TimeOffset,
            Axis::Forward,
            0.1,
            " s behind attitude",
        ),
        (
            late(-0.1),
            Kind::TimeOffset,
            Axis::Forward,
            -0.1,
            " s ahead of attitude",
        ),
        (
            lever(1., 0., 0.),
            Kind::LeverArm,
            Axis::Forward,
            1.0,
            " m ahead of the point",
        ),
        (
            lever(0., 1., 0.),
            Kind::LeverArm,
            Axis::Left,
            1.0,
            " m left of the point",
        ),
        (
            lever(0., 0., -1.),
            Kind::LeverArm,
            Axis::Up,
            -1.0,
            " m below the point",
        ),
        (
            turn(degree, 0.),
            Kind::Mounting,
            Axis::Left,
            degree,
            "degrees off, nose down",
        ),
        (
            turn(0., -degree),
            Kind::Mounting,
            Axis::Up,
            -degree,
            "degrees off, to the right",
        ),
    ];
    for (wrong, kind, axis, value, words) in cases {
        let found = judged(wrong);
        assert!(found.called, "{words}: {found:?}");
        assert_eq!((found.kind, found.axis), (kind, axis), "{words}: {found:?}");
        assert!(
            (found.value / value - 1.0).abs() < 0.05,
            "{words}: {found:?}"
        );
        assert!(
            found.sentence(true).contains(words),
            "{}",
            found.sentence(true)
        );
        assert!(found.standard_error > 0.0 && found.trusted_spread > 0.0);
    }
}

#[test]
fn trusted_logs_decide_whether_it_may_be_called() {
    let late = Wrong {
        late: 0.1,
        ..Wrong::default()
    };
    let bad = pieces(&drive(77, 1000, late));
    // One log has nothing to be held out against: the finding is information.
    let found = reference(1).judge(&bad, SHARE).unwrap().unwrap();
    assert!(!found.called && found.z > 5.0, "{found:?}");
    // One odd log of six is named and does not hide the others' faults.
    let (mut trusted, mut groups) = (Vec::new(), Vec::new());
    for log in 0..6 {
        let wrong = if log == 4 { late } else { Wrong::default() };
        for piece in pieces(&drive(log, 2000, wrong)) {
            trusted.push(piece);
            groups.push(10 + log as usize);
        }
    }
    let reference = CalibrationReference::fit(&trusted, &groups).unwrap();
    assert_eq!(reference.odd_groups(), [4]);
    let measured = reference.measured_alarms(SHARE);
    assert_eq!((measured.pieces, measured.groups), (10, 5));
    let text = serde_json::to_string(&reference).unwrap();
    assert_eq!(
        serde_json::from_str::<CalibrationReference>(&text).unwrap(),
        reference
    );
    assert!(
        serde_json::from_str::<CalibrationReference>(&text.replace("\"odd\":[4]", "\"odd\":[9]"))
            .is_err()
    );
}

#[test]
fn one_odd_piece_of_three_trusted_logs_hides_no_fault() {
    let wrong = |late| Wrong {
        late,
        ..Wrong::default()
    };
    let (mut trusted, mut groups) = (Vec::new(), Vec::new());
    for log in 0..3 {
        for part in 0..6 {
            let odd = if (log, part) == (1, 3) { 0.02 } else { 0.0 };
            let part = drive(10 * log + part, 1000, wrong(odd));
            trusted.extend(pieces(&part));
            groups.push(log as usize);
        }
    }
    let reference = CalibrationReference::fit(&trusted, &groups).unwrap();
    let judged = |late| {
        let log = pieces(&drive(77, 1000, wrong(late)));
        reference.judge(&log, SHARE).unwrap().unwrap()
    };
    assert!(judged(0.1).called, "{:?}", judged(0.1));
    // What a trusted piece shows too is not called.
    assert!(!judged(0.02).called && !judged(0.0).called);
    // Where a third of the trusted pieces are odd, nothing is known to be wrong.
    let mixed: Vec<CalibrationPiece> = (0..18)
        .flat_map(|i| pieces(&drive(i, 1000, wrong(if i % 3 == 0 { 0.1 } else { 0.0 }))))
        .collect();
    let reference = CalibrationReference::fit(&mixed, &groups).unwrap();
    let log = pieces(&drive(77, 1000, wrong(0.1)));
    assert!(!reference.judge(&log, SHARE).unwrap().unwrap().called);
}

#[test]
fn another_unit_is_named_as_such() {
    // The trusted point lies ahead of the axle, so turning moves it.
    let ahead = Wrong {
        lever: Vector3::new(1.3, 0.2, 0.5),
        ..Wrong::default()
    };
    let (mut trusted, mut groups) = (Vec::new(), Vec::new());
    for log in 0..6 {
        for piece in pieces(&drive(log, 2000, ahead)) {
            trusted.push(piece);
            groups.push(log as usize);
        }
    }
    let reference = CalibrationReference::fit(&trusted, &groups).unwrap();
    let judged = |increments: &[f64]| {
        let found = reference.judge(&pieces(increments), SHARE).unwrap();
        found.unwrap()
    };
    let metres = drive(77, 1000, ahead);
    let times = |length: f64, turn: f64| -> Vec<f64> {
        let by = |i: usize| if i % 6 < 3 { length } else { turn };
        let all = metres.iter().enumerate();
        all.map(|(i, x)| x * by(i)).collect()
    };
    for (length, words) in [
        (
            1.0 / 0.3048,
            "3.28 times as large as in the trusted logs, as feet",
        ),
        (
            1000.0,
            "1000 times as large as in the trusted logs, as millimetres",
        ),
        (
            0.01,
            "0.0100 times as large as in the trusted logs, as metres",
        ),
    ] {
        let found = judged(&times(length, 1.0));
        assert_eq!(
            (found.kind, found.value),
            (Kind::Length, length),
            "{found:?}"
        );
        let said = found.sentence(true);
        assert!(found.called && said.contains(words), "{said}");
    }
    // A body that is larger, or a point that lies elsewhere, is not another unit.
    let farther = Wrong {
        lever: Vector3::new(3.0, 0.2, 0.5),
        ..Wrong::default()
    };
    let found = judged(&drive(77, 1000, farther));
    assert_eq!((found.kind, found.axis), (Kind::LeverArm, Axis::Forward));
    assert!(!judged(&metres).called);
    // Where nothing of the trusted logs goes with turns, a factor cannot be told.
    let centred = self::reference(6);
    for log in [&metres, &times(1000.0, 1.0), &times(1.0, 0.02)] {
        let found = centred.judge(&pieces(log), SHARE).unwrap().unwrap();
        assert!(
            !matches!(found.kind, Kind::Length | Kind::Turn),
            "{found:?}"
        );
    }
}

#[test]
fn logs_that_show_nothing_are_not_called() {
    let reference = reference(4);
    let still = vec![0.0; 6 * 1000];
    let straight = [1.0, 0.0, 0.0, 0.0, 0.0, 0.0].repeat(1000);
    for log in [still, straight] {
        let found = reference.judge(&pieces(&log), SHARE).unwrap().unwrap();
        assert!(
            !found.called && found.value.is_finite() && found.z.is_finite(),
            "{found:?}"
        );
    }
    assert!(pieces(&[0.0; 6 * 100]).is_empty());
    assert_eq!(reference.judge(&[], SHARE).unwrap(), None);
    assert!(reference.judge(&[], 0.0).is_err());
    assert!(CalibrationPiece::of_stretch(&[0.0; 12], 0.0).is_err());
    assert!(CalibrationPiece::of_stretch(&[0.0; 13], 10.0).is_err());
    assert!(CalibrationReference::fit(&[], &[]).is_err());
    // A trusted planar robot that never moves: judged, never called.
    let still = pieces(&vec![0.0; 6 * 3000]);
    let reference = CalibrationReference::fit(&still, &[0, 1, 2]).unwrap();
    let found = reference.judge(&still, SHARE).unwrap().unwrap();
    assert!(!found.called && found.z == 0.0, "{found:?}");
    // Numbers far beyond any motion stay numbers.
    let wild: Vec<f64> = (0..6 * 500).map(|i| 1e200 * f64::from(i % 7 - 3)).collect();
    let found = reference.judge(&pieces(&wild), SHARE).unwrap().unwrap();
    assert!(found.z.is_finite() && found.value.is_finite() && found.chance.is_finite());
}
