//! Each fault of the coupling, and of filters and files, does what it says, measured on a synthetic log.

mod common;

use common::faults::{HERTZ, RANGE, SPEED, drive, faulty, near, offset, step, straight};
use dose3_datasets::faults::Fault;
use dose3_datasets::{Frame, Trajectory};
use dose3_lie::{Pose, Rotation, Vector, so3};

fn place(log: &Trajectory, pose: usize) -> Vector {
    log.poses[pose].translation
}

/// Body-frame steps within the range against those of a log that has the fault all along.
#[track_caller]
fn moves_as(faulty: &Trajectory, throughout: impl Fn(usize) -> Pose) {
    for pose in RANGE.start + 1..RANGE.end {
        let (here, there) = (
            step(faulty, pose),
            throughout(pose - 1).relative(&throughout(pose)),
        );
        near((here.translation - there.translation).amax(), 0.0, 1e-9);
        near(so3::distance(&here.rotation, &there.rotation), 0.0, 1e-9);
    }
}

#[test]
fn late_positions_are_those_of_earlier_poses() {
    let sound = drive();
    // Two steps of the log.
    let late = faulty("position-late:0.2s", &sound, 1);
    moves_as(&late, |pose| {
        Pose::new(sound.poses[pose].rotation, place(&sound, pose - 2))
    });
    for pose in 0..sound.len() {
        assert_eq!(late.poses[pose].rotation, sound.poses[pose].rotation);
    }
    let half = faulty("position-late:0.05s", &sound, 1);
    moves_as(&half, |pose| {
        let between = (place(&sound, pose) + place(&sound, pose - 1)) / 2.0;
        Pose::new(sound.poses[pose].rotation, between)
    });
    // No step where it begins or ends.
    let sound = straight();
    let late = faulty("position-late:0.2s", &sound, 1);
    near(offset(&late, &sound, RANGE.end).norm(), 0.0, 1e-9);
}

#[test]
fn late_attitudes_are_those_of_earlier_poses() {
    let sound = drive();
    let late = faulty("attitude-late:0.2s", &sound, 1);
    moves_as(&late, |pose| {
        Pose::new(sound.poses[pose - 2].rotation, place(&sound, pose))
    });
    // Nothing before the first pose of a stretch.
    let first = Fault::AttitudeLate { seconds: 0.2 };
    let first = first.apply(&sound, 0..100, 1).unwrap();
    for pose in [1, 2] {
        near(so3::log(&step(&first, pose).rotation).norm(), 0.0, 1e-12);
    }
    assert!(so3::log(&step(&first, 3).rotation).norm() > 1e-6);
}

#[test]
fn a_lever_arm_moves_as_another_point_of_the_body() {
    let sound = drive();
    for (name, arm) in [
        ("lever-arm:forward:2.0m", Vector::x() * 2.0),
        ("lever-arm:left:2.0m", Vector::y() * 2.0),
        ("lever-arm:up:2.0m", Vector::z() * 2.0),
    ] {
        let mut sides = [0, 0];
        for seed in 0..20 {
            let moved = faulty(name, &sound, seed);
            let turned =
                sound.poses[RANGE.end - 1].rotation * arm - sound.poses[RANGE.start].rotation * arm;
            let side = offset(&moved, &sound, RANGE.end - 1).dot(&turned).signum();
            moves_as(&moved, |pose| {
                let pose = sound.poses[pose];
                Pose::new(pose.rotation, pose.transform_point(&(arm * side)))
            });
            sides[usize::from(side > 0.0)] += 1;
        }
        assert!(sides[0] > 2 && sides[1] > 2, "{sides:?}");
    }
    // In a camera's axes, forward is z.
    let mut camera = sound.clone();
    camera.frame = Frame::CameraRdf;
    let moved = faulty("lever-arm:forward:2.0m", &camera, 1);
    let pose = RANGE.start + 1;
    let turned =
        camera.poses[pose].rotation * Vector::z() - camera.poses[pose - 1].rotation * Vector::z();
    let extra = offset(&moved, &camera, pose);
    near(
        (extra - turned * 2.0)
            .norm()
            .min((extra + turned * 2.0).norm()),
        0.0,
        1e-9,
    );
}

#[test]
fn an_extrinsic_turn_has_no_beginning() {
    let sound = drive();
    let turned = faulty("extrinsic:up:1.0deg", &sound, 1);
    // On a straight way the body slides to one side by the sine of the angle.
    let line = straight();
    let slides = faulty("extrinsic:up:1.0deg", &line, 1);
    for pose in RANGE.start + 1..RANGE.end {
        let motion = step(&slides, pose);
        near(
            motion.translation.y.abs(),
            SPEED / HERTZ * 1_f64.to_radians().sin(),
            1e-9,
        );
        near(so3::log(&motion.rotation).norm(), 0.0, 1e-9);
    }
    let side = -step(&slides, RANGE.start + 1).translation.y.signum();
    let turn = so3::exp(&(Vector::z() * side * 1_f64.to_radians()));
    moves_as(&turned, |pose| {
        Pose::new(sound.poses[pose].rotation * turn, place(&sound, pose))
    });
    assert_eq!(turned.poses[..=RANGE.start], sound.poses[..=RANGE.start]);
}

#[test]
fn smoothing_is_a_running_mean() {
    let sound = drive();
    let smooth = faulty("smooth-position:0.5s", &sound, 1);
    moves_as(&smooth, |pose| {
        let five: Vector = (pose - 2..=pose + 2).map(|pose| place(&sound, pose)).sum();
        Pose::new(sound.poses[pose].rotation, five / 5.0)
    });
    // Rotations about one axis have a mean that everyone agrees on.
    let mut swaying = straight();
    for (index, pose) in swaying.poses.iter_mut().enumerate() {
        pose.rotation = Rotation::from_euler_angles(0.0, 0.0, yaw(index));
    }
    let smooth = faulty("smooth:0.3s", &swaying, 1);
    moves_as(&smooth, |pose| {
        let mean = (yaw(pose - 1) + yaw(pose) + yaw(pose + 1)) / 3.0;
        Pose::new(
            Rotation::from_euler_angles(0.0, 0.0, mean),
            place(&swaying, pose),
        )
    });
}

fn yaw(index: usize) -> f64 {
    0.3 * (index as f64 * 0.7).sin()
}

#[test]
fn a_bridged_gap_is_straight() {
    let sound = drive();
    let bridged = faulty("bridged-gap:2.0s", &sound, 1);
    let first = step(&bridged, RANGE.start + 1);
    for pose in RANGE.start + 1..=RANGE.start + 20 {
        let way = place(&bridged, pose) - place(&bridged, pose - 1);
        let straight = place(&sound, RANGE.start + 20) - place(&sound, RANGE.start);
        near((way - straight / 20.0).norm(), 0.0, 1e-9);
        near(
            so3::distance(&step(&bridged, pose).rotation, &first.rotation),
            0.0,
            1e-9,
        );
    }
    assert_eq!(bridged.poses[..=RANGE.start], sound.poses[..=RANGE.start]);
    assert_eq!(
        bridged.poses[RANGE.start + 20..],
        sound.poses[RANGE.start + 20..]
    );
}

#[test]
fn a_low_rate_is_interpolated_between_its_poses() {
    let sound = drive();
    let slow = faulty("interpolated:5.0x", &sound, 1);
    for index in (0..RANGE.len()).step_by(5) {
        let pose = RANGE.start + index;
        assert_eq!(slow.poses[pose], sound.poses[pose]);
        if pose + 5 < RANGE.end {
            let way = place(&sound, pose + 5) - place(&sound, pose);
            for within in pose + 1..=pose + 5 {
                let step = place(&slow, within) - place(&slow, within - 1);
                near((step - way / 5.0).norm(), 0.0, 1e-9);
            }
        }
    }
    assert_eq!(slow.poses[RANGE.end - 1..], sound.poses[RANGE.end - 1..]);
}

#[test]
fn stale_poses_repeat_the_one_before() {
    let sound = drive();
    let mut stale = 0;
    for seed in 0..10 {
        let repeated = faulty("stale:0.3", &sound, seed);
        assert_eq!(repeated.stamps, sound.stamps);
        for pose in 0..sound.len() {
            if repeated.poses[pose] != sound.poses[pose] {
                assert!(RANGE.contains(&pose));
                assert_eq!(repeated.poses[pose], repeated.poses[pose - 1]);
                stale += 1;
            }
        }
    }
    // 3990 draws: a standard deviation of 29.
    near(f64::from(stale), 0.3 * 3990.0, 120.0);
}

#[test]
fn rounded_positions_lie_on_a_grid() {
    let sound = drive();
    let coarse = faulty("quantised:0.25m", &sound, 1);
    for pose in RANGE {
        let cells = place(&coarse, pose) / 0.25;
        near((cells - cells.map(f64::round)).amax(), 0.0, 1e-9);
        assert!(offset(&coarse, &sound, pose).amax() <= 0.125 + 1e-9);
        assert_eq!(coarse.poses[pose].rotation, sound.poses[pose].rotation);
    }
    // Between 2^22 and 2^23 metres a 32-bit float steps by half a metre, below 2^20 by a sixteenth.
    let single = faulty("single-precision", &sound, 1);
    let origin = place(&sound, RANGE.start);
    let mut coarsest = Vector::zeros();
    for pose in RANGE {
        let north = (place(&single, pose) - origin).x * 2.0;
        near(north - north.round(), 0.0, 1e-6);
        let west = (place(&single, pose) - origin).y * 16.0;
        near(west - west.round(), 0.0, 1e-6);
        coarsest = coarsest.sup(&offset(&single, &sound, pose).abs());
    }
    assert!(coarsest.x > 0.2 && coarsest.x <= 0.25 + 1e-6, "{coarsest}");
    assert!(
        coarsest.y > 0.025 && coarsest.y <= 0.03125 + 1e-6,
        "{coarsest}"
    );
    assert!(coarsest.z < 1e-4, "{coarsest}");
}

#[test]
fn odometry_in_the_plane_has_neither_height_nor_tilt() {
    let sound = drive();
    let flat = faulty("frozen-height", &sound, 1);
    for pose in RANGE {
        near(place(&flat, pose).z, place(&sound, RANGE.start).z, 1e-9);
        near((offset(&flat, &sound, pose)).xy().norm(), 0.0, 1e-9);
        assert_eq!(flat.poses[pose].rotation, sound.poses[pose].rotation);
    }
    let level = faulty("level", &sound, 1);
    moves_as(&level, |pose| {
        let (_, _, yaw) = sound.poses[pose].rotation.euler_angles();
        Pose::new(
            Rotation::from_euler_angles(0.0, 0.0, yaw),
            place(&sound, pose),
        )
    });
}

#[test]
fn a_course_is_where_the_last_step_went() {
    let mut sound = drive();
    // It stands for two seconds.
    let stop = sound.poses[300];
    for pose in &mut sound.poses[301..320] {
        pose.translation = stop.translation;
    }
    let course = faulty("heading-from-course", &sound, 1);
    // Slower than 0.3 m/s, the heading before is held.
    let goes = |pose: &usize| (place(&sound, *pose) - place(&sound, pose - 1)).xy().norm() >= 0.03;
    let heading = |pose: usize| {
        let last = (RANGE.start..=pose).rev().find(goes).unwrap();
        let way = place(&sound, last) - place(&sound, last - 1);
        let (roll, pitch, _) = sound.poses[pose].rotation.euler_angles();
        Rotation::from_euler_angles(roll, pitch, way.y.atan2(way.x))
    };
    moves_as(&course, |pose| {
        Pose::new(heading(pose), place(&sound, pose))
    });
}

#[test]
fn a_closure_is_spread_over_its_time() {
    let sound = drive();
    let closed = faulty("closure:1.0m:2.0s", &sound, 1);
    for (seconds, expected) in [
        (0.5, 0.25),
        (1.0, 0.5),
        (2.0, 1.0),
        (10.0, 1.0),
        (50.0, 1.0),
    ] {
        let pose = RANGE.start + (seconds * HERTZ) as usize;
        near(offset(&closed, &sound, pose).norm(), expected, 1e-9);
    }
    // At most to the end of the range, and at least in one step.
    let slow = faulty("closure:1.0m:1000.0s", &sound, 1);
    near(offset(&slow, &sound, RANGE.end - 1).norm(), 1.0, 1e-9);
    near(offset(&slow, &sound, RANGE.end + 50).norm(), 1.0, 1e-9);
    let sudden = faulty("closure:1.0m:0.0s", &sound, 1);
    near(offset(&sudden, &sound, RANGE.start + 1).norm(), 1.0, 1e-9);
}
