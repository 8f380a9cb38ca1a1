//! The synthetic platforms move as their physics says, differ from log to log, and are the same every time.

use std::collections::HashSet;

use dose3_datasets::synthetic::{Platform, SUITE_HERTZ, suite, trajectory};
use dose3_datasets::{Format, Trajectory};
use dose3_lie::{Pose, Vector, so3};

fn increments(log: &Trajectory) -> Vec<Pose> {
    log.poses
        .windows(2)
        .map(|pair| pair[0].inverse().compose(&pair[1]))
        .collect()
}

fn share(values: impl Iterator<Item = bool>) -> f64 {
    let values: Vec<bool> = values.collect();
    values.iter().filter(|value| **value).count() as f64 / values.len() as f64
}

/// World accelerations by second differences, m/s^2.
fn accelerations(log: &Trajectory) -> Vec<Vector> {
    let square = log.rate.hertz * log.rate.hertz;
    log.poses
        .windows(3)
        .map(|p| (p[2].translation - p[1].translation * 2.0 + p[0].translation) * square)
        .collect()
}

#[test]
fn the_same_every_time_and_different_every_log() {
    for platform in Platform::ALL {
        let logs = suite(platform, 12, 9);
        assert_eq!(logs, suite(platform, 12, 9));
        let prints: HashSet<String> = logs.iter().map(Trajectory::fingerprint).collect();
        assert_eq!(prints.len(), 12);
        assert!(
            suite(platform, 12, 10)
                .iter()
                .all(|log| !prints.contains(&log.fingerprint()))
        );
        // A longer suite begins with the shorter one.
        assert_eq!(suite(platform, 3, 9), logs[..3]);
        for log in &logs {
            assert_eq!(
                (log.format, log.frame, log.rate.hertz),
                (Format::Synthetic, platform.frame(), SUITE_HERTZ)
            );
            assert!(log.name.starts_with("synthetic-") && log.group == log.name);
            assert!((1200..=2400).contains(&log.len()));
            for pose in &log.poses {
                let r = pose.rotation.matrix();
                assert!((r.tr_mul(r) - dose3_lie::Matrix::identity()).amax() < 1e-12);
                assert!(pose.translation.iter().all(|value| value.is_finite()));
            }
        }
    }
}

#[test]
fn any_rate_and_length_is_taken() {
    for platform in Platform::ALL {
        for hertz in [0.0, -5.0, f64::NAN, f64::INFINITY, 0.3, 7.0, 1000.0] {
            assert_eq!(trajectory(platform, 1, 20, hertz).len(), 20);
        }
        assert!(trajectory(platform, 1, 0, 10.0).is_empty());
        assert_eq!(trajectory(platform, 1, 1, 10.0).len(), 1);
    }
}

#[test]
fn the_course_does_not_depend_on_the_number_of_poses() {
    for platform in Platform::ALL {
        let long = trajectory(platform, 4, 300, 20.0);
        let short = trajectory(platform, 4, 100, 20.0);
        assert_eq!(short.poses, long.poses[..100]);
    }
}

#[test]
fn vehicles_drive() {
    let logs = suite(Platform::Vehicle, 12, 5);
    let mut standing = 0.0;
    for log in &logs {
        let steps = increments(log);
        let speeds: Vec<f64> = steps
            .iter()
            .map(|step| step.translation.norm() * log.rate.hertz)
            .collect();
        assert!(speeds.iter().all(|speed| *speed < 25.0));
        standing += share(speeds.iter().map(|speed| *speed < 0.1));
        // Forward, not sideways: the sensor sits ahead of the rear axle and swings out a little in turns.
        for (step, speed) in steps.iter().zip(&speeds) {
            if *speed > 3.0 {
                assert!(
                    step.translation.x > 0.9 * step.translation.norm(),
                    "{}",
                    log.name
                );
            }
        }
        // Roll and pitch of a car on a road, and all headings in the long run.
        for pose in &log.poses {
            let (roll, pitch, _) = pose.rotation.euler_angles();
            assert!(roll.abs() < 0.1 && pitch.abs() < 0.12, "{roll} {pitch}");
        }
        // What a driver and tyres can do, the rattle of the road included.
        let horizontal = accelerations(log).into_iter().map(|a| a.x.hypot(a.y));
        assert!(share(horizontal.map(|a| a < 6.0)) > 0.995);
    }
    assert!(standing / 12.0 > 0.005, "nobody ever stops: {standing}");
    // In a bend the body leans out: roll to the right (positive) in a left turn (positive yaw rate).
    let mut product = 0.0;
    for log in &logs {
        for (step, pose) in increments(log).iter().zip(&log.poses) {
            let yaw_rate = so3::log(&step.rotation).z * log.rate.hertz;
            let (roll, _, _) = pose.rotation.euler_angles();
            if yaw_rate.abs() > 0.2 {
                product += roll * yaw_rate;
            }
        }
    }
    assert!(product > 0.0, "{product}");
}

#[test]
fn hands_turn_things_in_front_of_the_camera() {
    let logs = suite(Platform::Handheld, 12, 5);
    let mut resting = 0.0;
    for log in &logs {
        for pose in &log.poses {
            assert!(
                (0.1..1.6).contains(&pose.translation.z),
                "{}",
                pose.translation.z
            );
            assert!(pose.translation.x.abs() < 0.8 && pose.translation.y.abs() < 0.8);
        }
        let rates: Vec<f64> = increments(log)
            .iter()
            .map(|step| so3::log(&step.rotation).norm() * log.rate.hertz)
            .collect();
        assert!(rates.iter().all(|rate| *rate < 8.0));
        resting += share(rates.iter().map(|rate| *rate < 0.1));
        // The object is seen from many sides.
        let furthest = log
            .poses
            .iter()
            .map(|pose| so3::distance(&log.poses[0].rotation, &pose.rotation));
        assert!(furthest.fold(0.0, f64::max) > 0.8, "{}", log.name);
    }
    assert!((0.02..0.5).contains(&(resting / 12.0)), "{resting}");
}

#[test]
fn drones_tilt_into_their_acceleration() {
    for log in suite(Platform::Drone, 12, 5) {
        let accelerations = accelerations(&log);
        let (mut product, mut thrust, mut tilt) = (0.0, 0.0, 0.0);
        for (acceleration, pose) in accelerations.iter().zip(&log.poses[1..]) {
            let up = pose.rotation * Vector::z();
            assert!(up.z > 0.75, "{}: a tilt of more than 41 degrees", log.name);
            product += acceleration.x * up.x + acceleration.y * up.y;
            thrust += acceleration.x.powi(2) + acceleration.y.powi(2);
            tilt += up.x.powi(2) + up.y.powi(2);
            assert!(pose.translation.z > 0.0, "{}: below ground", log.name);
        }
        let correlation = product / (thrust * tilt).sqrt();
        assert!(correlation > 0.75, "{}: {correlation}", log.name);
        let heading = log.poses.iter().map(|pose| pose.rotation.euler_angles().2);
        let (low, high) = heading.fold((f64::MAX, f64::MIN), |(low, high), yaw| {
            (low.min(yaw), high.max(yaw))
        });
        assert!(high - low > 0.5, "{}: never turns", log.name);
    }
}
