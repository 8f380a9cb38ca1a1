//! The two protocols: what they keep, what they drop, and that they never give NaN.

use dose3_datasets::synthetic::{Platform, suite, trajectory};
use dose3_datasets::{
    Error, Frame, Kind, Representation, Scaling, Trajectory, Window, WindowTensor, windows,
};
use dose3_lie::{Pose, Rotation, Vector, so3};
use proptest::prelude::*;

#[path = "../../ood/src/property_cases.rs"]
mod property_cases;

use property_cases::cases;

fn window(log: &Trajectory) -> &[Pose] {
    &log.poses[40..169]
}

fn motion(logs: &[Trajectory]) -> Representation {
    Representation::fit(
        Kind::Motion,
        Scaling::PerDataset,
        logs,
        &windows(logs, 129, 64),
    )
    .unwrap()
}

/// Largest difference of two tensors, translation and rotation.
fn difference(a: &WindowTensor, b: &WindowTensor) -> (f32, f32) {
    let largest = |a: &[f32], b: &[f32]| {
        a.iter()
            .zip(b)
            .map(|(a, b)| (a - b).abs())
            .fold(0.0, f32::max)
    };
    assert_eq!(a.length, b.length);
    (
        largest(&a.translation, &b.translation),
        largest(&a.rotation, &b.rotation),
    )
}

/// The matrix at an element as a rotation in f64.
fn rotation(tensor: &WindowTensor, index: usize) -> Rotation {
    let rows: Vec<f64> = tensor.rotation[9 * index..9 * index + 9]
        .iter()
        .map(|value| f64::from(*value))
        .collect();
    Rotation::from_matrix_unchecked(dose3_lie::Matrix::from_row_slice(&rows))
}

proptest! {
    #![proptest_config(cases(64))]

    #[test]
    fn paper_ignores_where_the_world_begins(shift in prop::array::uniform3(-6e6..6e6_f64)) {
        for platform in Platform::ALL {
            let log = trajectory(platform, 3, 200, 20.0);
            let moved: Vec<Pose> = window(&log)
                .iter()
                .map(|pose| Pose { translation: pose.translation + Vector::from(shift), ..*pose })
                .collect();
            let a = Representation::PAPER.represent(window(&log), log.frame).unwrap();
            let b = Representation::PAPER.represent(&moved, log.frame).unwrap();
            let (metres, turn) = difference(&a, &b);
            // 1e-9 m of rounding at 6e6 m, over windows of at least a few centimetres.
            prop_assert!(metres < 1e-6 && turn == 0.0, "{metres:e}");
        }
    }

    #[test]
    fn motion_ignores_origin_and_heading_of_the_world(
        tangent in prop::array::uniform3(-3.0..3.0_f64),
        shift in prop::array::uniform3(-6e6..6e6_f64),
    ) {
        let world = Pose { rotation: so3::exp(&Vector::from(tangent)), translation: Vector::from(shift) };
        for platform in Platform::ALL {
            let logs = [trajectory(platform, 3, 200, 20.0)];
            let moved: Vec<Pose> = window(&logs[0]).iter().map(|pose| world.compose(pose)).collect();
            let representation = motion(&logs);
            let a = representation.represent(window(&logs[0]), logs[0].frame).unwrap();
            let b = representation.represent(&moved, logs[0].frame).unwrap();
            let (metres, turn) = difference(&a, &b);
            prop_assert!(metres < 1e-6 && turn < 1e-6, "{metres:e} {turn:e}");
            // And it is no empty promise: the paper's representation does see the turn of the world.
            if world.rotation.angle() > 0.1 {
                let paper = Representation::PAPER;
                let a = paper.represent(window(&logs[0]), logs[0].frame).unwrap();
                let b = paper.represent(&moved, logs[0].frame).unwrap();
                prop_assert!(difference(&a, &b).1 > 1e-3);
            }
        }
    }

    #[test]
    fn motion_is_the_same_whatever_axes_a_sensor_has(seed in 0..50_u64) {
        // The same car seen by a camera (right-down-forward) and by an INS (forward-right-down).
        let log = trajectory(Platform::Vehicle, seed, 200, 10.0);
        let representation = motion(std::slice::from_ref(&log));
        let reference = representation.represent(window(&log), Frame::BodyFlu).unwrap();
        for frame in [Frame::CameraRdf, Frame::BodyFrd] {
            let axes = frame.to_forward_left_up();
            let seen: Vec<Pose> = window(&log)
                .iter()
                .map(|pose| Pose { rotation: pose.rotation * axes, ..*pose })
                .collect();
            let tensor = representation.represent(&seen, frame).unwrap();
            let (metres, turn) = difference(&reference, &tensor);
            prop_assert!(metres < 1e-6 && turn < 1e-6, "{frame}: {metres:e} {turn:e}");
        }
    }
}

#[test]
fn frames_turn_forward_into_x() {
    let forward = |frame: Frame, v: [f64; 3]| frame.to_forward_left_up() * Vector::from(v);
    assert_eq!(forward(Frame::CameraRdf, [0.0, 0.0, 1.0]), Vector::x());
    assert_eq!(forward(Frame::CameraRdf, [1.0, 0.0, 0.0]), -Vector::y());
    assert_eq!(forward(Frame::CameraRdf, [0.0, 1.0, 0.0]), -Vector::z());
    assert_eq!(forward(Frame::BodyFrd, [0.0, 1.0, 0.0]), -Vector::y());
    assert_eq!(forward(Frame::BodyFrd, [0.0, 0.0, 1.0]), -Vector::z());
    for frame in Frame::ALL {
        assert!(
            (frame.to_forward_left_up().matrix().determinant() - 1.0).abs() < 1e-15,
            "{frame}"
        );
    }
}

#[test]
fn a_drive_moves_forward_whatever_the_camera() {
    let log = trajectory(Platform::Vehicle, 8, 200, 10.0);
    let tensor = motion(std::slice::from_ref(&log))
        .represent(window(&log), Frame::BodyFlu)
        .unwrap();
    let sum = |axis: usize| {
        tensor
            .translation
            .iter()
            .skip(axis)
            .step_by(3)
            .map(|value| value.abs())
            .sum::<f32>()
    };
    assert!(
        sum(0) > 10.0 * sum(1) && sum(0) > 10.0 * sum(2),
        "{} {} {}",
        sum(0),
        sum(1),
        sum(2)
    );
}

#[test]
fn paper_windows_are_anchored_and_of_unit_size() {
    for platform in Platform::ALL {
        let log = trajectory(platform, 2, 200, 20.0);
        let tensor = Representation::PAPER
            .represent(window(&log), log.frame)
            .unwrap();
        assert_eq!(
            (
                tensor.length,
                tensor.translation.len(),
                tensor.rotation.len()
            ),
            (129, 387, 1161)
        );
        assert_eq!(tensor.translation[..3], [0.0; 3]);
        let largest = tensor
            .translation
            .iter()
            .fold(0.0_f32, |largest, value| largest.max(value.abs()));
        assert_eq!(largest, 1.0);
        for (index, pose) in window(&log).iter().enumerate() {
            assert!(so3::distance(&rotation(&tensor, index), &pose.rotation) < 1e-6);
        }
    }
}

#[test]
fn paper_with_one_scale_keeps_the_size_of_windows() {
    let logs = suite(Platform::Vehicle, 3, 1);
    let cut = windows(&logs, 128, 64);
    let fitted = Representation::fit(Kind::Paper, Scaling::PerDataset, &logs, &cut).unwrap();
    let largest: Vec<f32> = cut
        .iter()
        .map(|window| fitted.represent_window(window, &logs).unwrap())
        .map(|tensor| {
            tensor
                .translation
                .iter()
                .fold(0.0_f32, |largest, value| largest.max(value.abs()))
        })
        .collect();
    assert_eq!(largest.iter().copied().fold(0.0, f32::max), 1.0);
    assert!(largest.iter().any(|value| *value < 0.9));
}

#[test]
fn motion_is_scaled_to_the_size_of_the_noise() {
    for platform in Platform::ALL {
        let logs = suite(platform, 4, 1);
        let cut = windows(&logs, 129, 64);
        let fitted = motion(&logs);
        let (mut steps, mut turns, mut count) = (0.0, 0.0, 0.0);
        let mut largest: f64 = 0.0;
        for window in &cut {
            let tensor = fitted.represent_window(window, &logs).unwrap();
            assert_eq!(tensor.length, 128);
            for index in 0..tensor.length {
                let angle = so3::log(&rotation(&tensor, index)).norm();
                turns += angle * angle;
                largest = largest.max(angle);
                count += 1.0;
            }
            steps += tensor
                .translation
                .iter()
                .map(|value| f64::from(value * value))
                .sum::<f64>();
        }
        let rms = |squares: f64| (squares / count).sqrt();
        assert!(
            (rms(steps) - 1.0).abs() < 1e-3,
            "{platform}: {}",
            rms(steps)
        );
        assert!(
            (0.2..0.51).contains(&rms(turns)),
            "{platform}: {}",
            rms(turns)
        );
        assert!(largest <= 3.001);
    }
}

#[test]
fn a_large_turn_never_looks_small() {
    let scaling = Scaling::Stored {
        translation: 1.0,
        rotation: 30.0,
    };
    let representation = Representation {
        kind: Kind::Motion,
        scaling,
    };
    // 30 times 12 degrees is a whole turn; unclipped it would be none.
    for degrees in [0.1_f64, 1.0, 5.0, 12.0, 90.0, 179.0, 180.0] {
        let turned = Pose {
            rotation: so3::exp(&Vector::new(degrees.to_radians(), 0.0, 0.0)),
            ..Pose::identity()
        };
        let tensor = representation
            .represent(&[Pose::identity(), turned], Frame::Object)
            .unwrap();
        let angle = so3::log(&rotation(&tensor, 0)).norm();
        let expected = (30.0 * degrees.to_radians()).min(3.0);
        assert!((angle - expected).abs() < 1e-6, "{degrees}: {angle}");
    }
}

#[test]
fn standing_still_is_zero_and_finite() {
    let still = vec![
        Pose {
            translation: Vector::new(5.7e6, 6.2e5, -100.0),
            ..Pose::identity()
        };
        129
    ];
    let log = {
        let stamps = (0..129).map(|index| index * 50_000_000).collect();
        Trajectory::new(
            "still",
            dose3_datasets::Format::RobotCar,
            Frame::BodyFrd,
            stamps,
            still.clone(),
        )
    };
    let logs = [log];
    let fitted = motion(&logs);
    assert_eq!(
        fitted.scaling,
        Scaling::Stored {
            translation: 1.0,
            rotation: 1.0
        }
    );
    for representation in [fitted, Representation::PAPER] {
        let tensor = representation.represent(&still, Frame::BodyFrd).unwrap();
        assert!(tensor.translation.iter().all(|value| *value == 0.0));
        for index in 0..tensor.length {
            assert_eq!(rotation(&tensor, index), Rotation::identity());
        }
    }
}

#[test]
fn what_cannot_be_represented_is_refused() {
    let logs = [trajectory(Platform::Drone, 1, 200, 20.0)];
    let cut = windows(&logs, 64, 64);
    let refused = |result: Result<Representation, Error>| {
        assert!(matches!(result, Err(Error::Parameter { .. })))
    };
    refused(Representation::fit(
        Kind::Motion,
        Scaling::PerWindow,
        &logs,
        &cut,
    ));
    let stored = |translation, rotation| Scaling::Stored {
        translation,
        rotation,
    };
    for scaling in [
        stored(0.0, 1.0),
        stored(1.0, -1.0),
        stored(f64::NAN, 1.0),
        stored(1.0, f64::INFINITY),
    ] {
        refused(Representation::fit(Kind::Motion, scaling, &logs, &cut));
        refused(Representation::fit(Kind::Paper, scaling, &logs, &cut));
    }
    let elsewhere = [Window {
        trajectory: 3,
        start: 0,
        length: 64,
    }];
    refused(Representation::fit(
        Kind::Paper,
        Scaling::PerDataset,
        &logs,
        &elsewhere,
    ));

    let motion = Representation {
        kind: Kind::Motion,
        scaling: stored(1.0, 1.0),
    };
    let unresolved = Representation {
        kind: Kind::Paper,
        scaling: Scaling::PerDataset,
    };
    let poses = &logs[0].poses;
    assert!(motion.represent(&poses[..1], Frame::BodyFlu).is_err());
    assert!(motion.represent(&poses[..2], Frame::BodyFlu).is_ok());
    assert!(
        Representation::PAPER
            .represent(&[], Frame::BodyFlu)
            .is_err()
    );
    assert!(unresolved.represent(poses, Frame::BodyFlu).is_err());
    let mut broken = poses[..10].to_vec();
    broken[4].translation.y = f64::NAN;
    for representation in [motion, Representation::PAPER] {
        assert!(representation.represent(&broken, Frame::BodyFlu).is_err());
    }
    broken[4].translation.y = f64::MAX;
    assert!(motion.represent(&broken, Frame::BodyFlu).is_err());
}

#[test]
fn every_axis_gets_a_scale_of_its_own_and_none_is_blown_up() {
    // A metre forward, a centimetre sideways, nothing upward; yaw alone turns.
    let poses: Vec<Pose> = (0..200)
        .map(|i| Pose {
            rotation: so3::exp(&Vector::new(0.0, 0.0, 0.01 * f64::from(i % 2))),
            translation: Vector::new(f64::from(i), 0.01 * f64::from(i % 2), 0.0),
        })
        .collect();
    let stamps = (0..200).map(|i| i * 100_000_000).collect();
    let format = dose3_datasets::Format::Tum;
    let logs = [Trajectory::new(
        "car",
        format,
        Frame::BodyFlu,
        stamps,
        poses,
    )];
    let cut = windows(&logs, 129, 10);
    let fitted = Representation::fit(Kind::Motion, Scaling::PerAxis, &logs, &cut).unwrap();
    let (translation, rotation) = fitted.scaling.stored().unwrap();
    assert!((translation[0] - 1.0).abs() < 1e-3, "{translation:?}");
    assert!((0.009..0.02).contains(&translation[1]), "{translation:?}");
    // An axis that never moves is held at a thousandth of the largest.
    assert!((translation[2] - 1e-3).abs() < 1e-4, "{translation:?}");
    assert!((rotation[2] - 50.0).abs() < 0.5, "{rotation:?}");
    let tensor = fitted
        .represent(&logs[0].poses[..129], Frame::BodyFlu)
        .unwrap();
    let rms = |axis: usize| {
        let of = tensor.translation.iter().skip(axis).step_by(3);
        (of.map(|x| f64::from(*x).powi(2)).sum::<f64>() / 128.0).sqrt()
    };
    assert!((rms(0) - 1.0).abs() < 0.05 && (rms(1) - 1.0).abs() < 0.05);
    // A paper model has no axes of a body.
    assert!(Representation::fit(Kind::Paper, Scaling::PerAxis, &logs, &cut).is_err());
}
