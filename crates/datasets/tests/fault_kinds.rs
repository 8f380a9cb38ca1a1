//! Each fault does what it says, measured on a synthetic log.

mod common;

use std::ops::Range;

use common::faults::{HERTZ, RANGE, SECONDS, SPEED, drive, faulty, near, offset, step, straight};
use dose3_datasets::faults::Axis;
use dose3_datasets::{Frame, Trajectory};
use dose3_lie::{Pose, Rotation, Vector, so3};

fn path(log: &Trajectory, range: Range<usize>) -> f64 {
    log.poses[range]
        .windows(2)
        .map(|pair| (pair[1].translation - pair[0].translation).norm())
        .sum()
}

fn same(a: &[Pose], b: &[Pose], tolerance: f64) -> bool {
    a.len() == b.len()
        && a.iter().zip(b).all(|(a, b)| {
            (a.translation - b.translation).amax() < tolerance
                && so3::distance(&a.rotation, &b.rotation) < tolerance
        })
}

#[test]
fn a_jump_is_one_step_for_good() {
    let sound = drive();
    let mut directions = Vector::zeros();
    for seed in 0..200 {
        let jumped = faulty("jump:1.0m", &sound, seed);
        assert_eq!(jumped.poses[..=RANGE.start], sound.poses[..=RANGE.start]);
        let jump = offset(&jumped, &sound, RANGE.start + 1);
        near(jump.norm(), 1.0, 1e-12);
        let up = sound.poses[RANGE.start].rotation * Vector::z();
        near(jump.dot(&up), 0.0, 1e-9);
        for pose in RANGE.start + 1..sound.len() {
            near((offset(&jumped, &sound, pose) - jump).norm(), 0.0, 1e-9);
            assert_eq!(jumped.poses[pose].rotation, sound.poses[pose].rotation);
        }
        directions += jump / 200.0;
    }
    assert!(
        directions.norm() < 0.2,
        "no direction is preferred: {directions}"
    );
    // Without a forward axis, any direction.
    let mut object = sound;
    object.frame = Frame::Object;
    let up = object.poses[RANGE.start].rotation * Vector::z();
    let vertical = (0..200).filter(|seed| {
        let jumped = faulty("jump:1.0m", &object, *seed);
        offset(&jumped, &object, RANGE.start + 1).dot(&up).abs() > 0.5
    });
    // Half of a sphere's surface lies that far from its equator.
    near(vertical.count() as f64, 100.0, 25.0);
}

#[test]
fn frozen_poses_do_not_move() {
    let sound = drive();
    let frozen = faulty("freeze:2.0s", &sound, 0);
    for pose in RANGE.start + 1..=RANGE.start + 20 {
        assert_eq!(step(&frozen, pose).translation, Vector::zeros());
        assert_eq!(frozen.poses[pose], sound.poses[RANGE.start]);
    }
    assert_eq!(
        frozen.poses[RANGE.start + 21..],
        sound.poses[RANGE.start + 21..]
    );
    assert_eq!(frozen.stamps, sound.stamps);
    // At most to the end of the range.
    let long = faulty("freeze:1000.0s", &sound, 0);
    assert_eq!(long.poses[RANGE.end - 1], sound.poses[RANGE.start]);
    assert_eq!(long.poses[RANGE.end..], sound.poses[RANGE.end..]);
}

#[test]
fn dropped_poses_are_missing_and_the_others_keep_their_stamps() {
    let sound = drive();
    let mut lost = 0;
    for seed in 0..10 {
        let lossy = faulty("drop:0.3", &sound, seed);
        lost += sound.len() - lossy.len();
        let mut from = 0;
        for (stamp, pose) in lossy.stamps.iter().zip(&lossy.poses) {
            from += sound.stamps[from..]
                .iter()
                .position(|other| other == stamp)
                .unwrap();
            assert_eq!(sound.poses[from], *pose);
        }
        assert_eq!(lossy.poses[..=RANGE.start], sound.poses[..=RANGE.start]);
        let after = sound.len() - RANGE.end;
        assert_eq!(lossy.poses[lossy.len() - after..], sound.poses[RANGE.end..]);
    }
    // 3990 draws: a standard deviation of 29.
    near(lost as f64, 0.3 * 3990.0, 120.0);
}

#[test]
fn jitter_has_the_standard_deviation_asked_for() {
    let sound = drive();
    let (shaken, turned) = (
        faulty("jitter-position:0.05m", &sound, 1),
        faulty("jitter-rotation:0.01rad", &sound, 1),
    );
    let spread = |noise: &[f64]| {
        let count = noise.len() as f64;
        let mean = noise.iter().sum::<f64>() / count;
        (
            mean,
            (noise.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / count).sqrt(),
        )
    };
    for axis in 0..3 {
        let noise: Vec<f64> = RANGE
            .map(|pose| offset(&shaken, &sound, pose)[axis])
            .collect();
        let (mean, deviation) = spread(&noise);
        near(mean, 0.0, 0.05 * 0.2);
        near(deviation, 0.05, 0.05 * 0.15);
        let noise: Vec<f64> = RANGE
            .map(|pose| {
                let turn = sound.poses[pose].rotation.inverse() * turned.poses[pose].rotation;
                so3::log(&turn)[axis]
            })
            .collect();
        let (mean, deviation) = spread(&noise);
        near(mean, 0.0, 0.01 * 0.2);
        near(deviation, 0.01, 0.01 * 0.15);
    }
    for pose in 0..sound.len() {
        assert_eq!(shaken.poses[pose].rotation, sound.poses[pose].rotation);
        assert_eq!(
            turned.poses[pose].translation,
            sound.poses[pose].translation
        );
        let untouched =
            shaken.poses[pose] == sound.poses[pose] && turned.poses[pose] == sound.poses[pose];
        assert_eq!(untouched, !RANGE.contains(&pose), "{pose}");
    }
}

#[test]
fn a_drift_in_yaw_bends_the_path_into_a_circle() {
    let sound = straight();
    let rate = 0.02;
    let bent = faulty("drift-yaw:0.02rad/s", &sound, 1);
    let last = RANGE.end - 1;
    let turn = sound.poses[last].rotation.inverse() * bent.poses[last].rotation;
    let angle = so3::log(&turn).z;
    near(angle.abs(), rate * SECONDS, 1e-9);
    near(so3::log(&turn).xy().norm(), 0.0, 1e-9);
    // A circle of radius speed / rate, to the half step by which a chord differs from the arc.
    let seen = sound.poses[RANGE.start]
        .relative(&bent.poses[last])
        .translation;
    let radius = SPEED / rate;
    near(seen.x, radius * angle.abs().sin(), 0.5);
    near(seen.y, angle.signum() * radius * (1.0 - angle.cos()), 0.5);
    near(path(&bent, RANGE), path(&sound, RANGE), 1e-9);
}

#[test]
fn drifts_of_position_and_scale_grow_with_time() {
    let sound = drive();
    let slid = faulty("drift-position:0.3m/s", &sound, 1);
    let last = RANGE.end - 1;
    near(offset(&slid, &sound, last).norm(), 0.3 * SECONDS, 1e-9);
    near(
        offset(&slid, &sound, RANGE.start + 100).norm(),
        0.3 * 10.0,
        1e-9,
    );
    let stays = offset(&slid, &sound, 699) - offset(&slid, &sound, last);
    near(stays.norm(), 0.0, 1e-9);

    let sound = straight();
    let grown = faulty("drift-scale:0.01/s", &sound, 1);
    let ratio =
        |pose| step(&grown, pose).translation.norm() / step(&sound, pose).translation.norm();
    near(ratio(RANGE.start + 1), 1.001, 1e-9);
    near(ratio(last), 1.0 + 0.01 * SECONDS, 1e-9);
    near(ratio(last + 1), 1.0, 1e-9);
}

#[test]
fn a_wrong_scale_stretches_the_path() {
    let sound = drive();
    let scaled = faulty("scale:1.2x", &sound, 1);
    near(path(&scaled, RANGE) / path(&sound, RANGE), 1.2, 1e-9);
    near(
        path(&scaled, RANGE.end - 1..700),
        path(&sound, RANGE.end - 1..700),
        1e-9,
    );
    for (scaled, sound) in scaled.poses.iter().zip(&sound.poses) {
        assert_eq!(scaled.rotation, sound.rotation);
    }
}

#[test]
fn reversal_runs_backward_and_twice_is_nothing() {
    let sound = drive();
    let backward = faulty("reversal", &sound, 1);
    for index in RANGE.start + 1..RANGE.end {
        let mirror = RANGE.start + RANGE.end - index;
        let undone = step(&backward, index).compose(&step(&sound, mirror));
        assert!(same(&[undone], &[Pose::identity()], 1e-9));
    }
    assert!(!same(&backward.poses, &sound.poses, 1.0));
    assert!(same(
        &faulty("reversal", &backward, 1).poses,
        &sound.poses,
        1e-9
    ));
}

#[test]
fn a_time_warp_changes_speed_and_keeps_the_course() {
    let sound = straight();
    let warped = faulty("time-warp:0.3", &sound, 1);
    let speeds: Vec<f64> = (RANGE.start + 1..RANGE.end)
        .map(|pose| step(&warped, pose).translation.x * HERTZ)
        .collect();
    let extreme = |pick: fn(f64, f64) -> f64| speeds.iter().copied().reduce(pick).unwrap();
    near(extreme(f64::max), 1.3 * SPEED, 0.02 * SPEED);
    near(extreme(f64::min), 0.7 * SPEED, 0.02 * SPEED);
    // Four waves in 40 seconds: eight changes from fast to slow or back, less the one at the end.
    let crossings = speeds
        .windows(2)
        .filter(|pair| (pair[0] > SPEED) != (pair[1] > SPEED));
    assert_eq!(crossings.count(), 7);
    for pose in RANGE {
        near(step(&sound, pose).translation.yz().norm(), 0.0, 1e-9);
    }
    // On a real course, every pose lies between two of the sound log.
    let sound = drive();
    let warped = faulty("time-warp:0.3", &sound, 1);
    for index in [RANGE.start, RANGE.end - 1] {
        assert!(same(
            &warped.poses[index..=index],
            &sound.poses[index..=index],
            1e-9
        ));
    }
    for pose in &warped.poses[RANGE] {
        let detour = sound.poses[RANGE].windows(2).map(|pair| {
            let legs = (pose.translation - pair[0].translation).norm()
                + (pair[1].translation - pose.translation).norm();
            legs - (pair[1].translation - pair[0].translation).norm()
        });
        near(detour.fold(f64::MAX, f64::min), 0.0, 1e-6);
    }
}

#[test]
fn a_mounting_error_turns_the_body_about_its_up_axis() {
    let sound = drive();
    let mut sides = [0, 0];
    for seed in 0..40 {
        let askew = faulty("mounting:5.0deg", &sound, seed);
        let mut left = 0.0;
        for pose in RANGE {
            assert_eq!(askew.poses[pose].translation, sound.poses[pose].translation);
            let turn =
                so3::log(&(sound.poses[pose].rotation.inverse() * askew.poses[pose].rotation));
            near(turn.xy().norm(), 0.0, 1e-9);
            near(turn.z.abs(), 5_f64.to_radians(), 1e-9);
            left = turn.z.signum();
        }
        sides[usize::from(left > 0.0)] += 1;
        assert_eq!(askew.poses[..RANGE.start], sound.poses[..RANGE.start]);
        assert_eq!(askew.poses[RANGE.end..], sound.poses[RANGE.end..]);
    }
    assert!(sides[0] > 8 && sides[1] > 8, "{sides:?}");
}

#[test]
fn roll_and_pitch_change_places() {
    let mut sound = drive();
    sound.poses[200].rotation = Rotation::from_euler_angles(0.1, -0.3, 2.0);
    let swapped = faulty("roll-pitch-swap", &sound, 1);
    let expected = Rotation::from_euler_angles(-0.3, 0.1, 2.0);
    near(
        so3::distance(&swapped.poses[200].rotation, &expected),
        0.0,
        1e-9,
    );
    assert!(same(
        &faulty("roll-pitch-swap", &swapped, 1).poses,
        &sound.poses,
        1e-9
    ));
    // North-east-down: pitch up is pitch up, and a roll to the right stays one.
    let mut down = sound.clone();
    down.frame = Frame::BodyFrd;
    let swapped = faulty("roll-pitch-swap", &down, 1);
    // In forward-left-up axes, pitch and yaw have the other sign: (0.1, -0.3) is (0.1, 0.3) there.
    let expected = Rotation::from_euler_angles(0.3, -0.1, 2.0);
    near(
        so3::distance(&swapped.poses[200].rotation, &expected),
        0.0,
        1e-9,
    );
}

#[test]
fn wrong_handedness_is_the_motion_in_a_mirror() {
    let sound = drive();
    for (axis, name) in [(0, Axis::Forward), (1, Axis::Left), (2, Axis::Up)] {
        let mirrored = faulty(&format!("handedness:{name}"), &sound, 1);
        for pose in RANGE.start + 1..RANGE.end {
            let (mut here, mut there) = (step(&sound, pose), step(&mirrored, pose));
            here.translation[axis] *= -1.0;
            near((here.translation - there.translation).amax(), 0.0, 1e-9);
            // Turns about the mirrored axis keep their sense, those about the others lose it.
            here.translation = -so3::log(&here.rotation);
            here.translation[axis] *= -1.0;
            there.translation = so3::log(&there.rotation);
            near((here.translation - there.translation).amax(), 0.0, 1e-9);
        }
        let back = faulty(&format!("handedness:{name}"), &mirrored, 1);
        assert!(same(&back.poses, &sound.poses, 1e-9));
    }
}

#[test]
fn mirrored_positions_leave_the_rotations() {
    let sound = drive();
    let mirrored = faulty("mirrored-positions:left", &sound, 1);
    for pose in RANGE.start + 1..RANGE.end {
        let world =
            |log: &Trajectory| log.poses[pose].translation - log.poses[pose - 1].translation;
        let (here, there) = (world(&sound), world(&mirrored));
        near(
            (Vector::new(here.x, -here.y, here.z) - there).amax(),
            0.0,
            1e-9,
        );
        assert_eq!(mirrored.poses[pose].rotation, sound.poses[pose].rotation);
    }
}

#[test]
fn degrees_for_radians_shrink_rotations() {
    let sound = drive();
    let shrunk = faulty("degrees-for-radians", &sound, 1);
    for pose in RANGE {
        let (here, there) = (&sound.poses[pose], &shrunk.poses[pose]);
        let expected = so3::log(&here.rotation) * (std::f64::consts::PI / 180.0);
        near((so3::log(&there.rotation) - expected).amax(), 0.0, 1e-9);
        assert_eq!(here.translation, there.translation);
    }
}

#[test]
fn a_slip_goes_to_one_side() {
    let sound = straight();
    let mut sides = [0, 0];
    for seed in 0..40 {
        let slipped = faulty("slip:0.3m/s", &sound, seed);
        let expected = step(&slipped, RANGE.start + 1).translation.y;
        near(expected.abs(), 0.03, 1e-9);
        for pose in RANGE.start + 1..RANGE.end {
            let motion = step(&slipped, pose).translation;
            near(
                (motion - Vector::new(SPEED / HERTZ, expected, 0.0)).norm(),
                0.0,
                1e-9,
            );
        }
        near(offset(&slipped, &sound, 699).norm(), 0.3 * SECONDS, 1e-9);
        sides[usize::from(expected > 0.0)] += 1;
    }
    assert!(sides[0] > 8 && sides[1] > 8, "{sides:?}");
}

#[test]
fn a_wrong_rate_skips_or_repeats_poses() {
    let sound = drive();
    let fast = faulty("rate:2.0x", &sound, 1);
    assert_eq!(fast.len(), 700 - 200);
    let slow = faulty("rate:0.5x", &sound, 1);
    assert_eq!(slow.len(), 700 + 400);
    for index in 0..200 {
        assert_eq!(
            fast.poses[RANGE.start + index],
            sound.poses[RANGE.start + 2 * index]
        );
    }
    for index in 0..800 {
        assert_eq!(
            slow.poses[RANGE.start + index],
            sound.poses[RANGE.start + index / 2]
        );
    }
    assert_eq!(fast.poses[300..], sound.poses[500..]);
    assert_eq!(slow.poses[900..], sound.poses[500..]);
    // The stamps claim the rate of the sound log, everywhere.
    for log in [&fast, &slow] {
        assert!(
            log.stamps
                .windows(2)
                .all(|pair| pair[1] - pair[0] == 100_000_000)
        );
        assert_eq!(log.rate, sound.rate);
    }
    assert_eq!(faulty("rate:1.25x", &sound, 1).len(), 700 - 80);
}
