//! What holds for every fault, and for the controls.

mod common;

use std::collections::HashSet;
use std::ops::Range;

use common::bad_poses;
use dose3_datasets::faults::{Axis, Control, Fault, Injection, faulty_steps};
use dose3_datasets::synthetic::{Platform, trajectory};
use dose3_datasets::{Error, Format, Frame, Trajectory, Window, stretches};
use dose3_lie::{Matrix, Pose, Vector, so3};

const RANGE: Range<usize> = 150..400;

fn log(platform: Platform) -> Trajectory {
    trajectory(platform, 11, 600, 10.0)
}

/// The faults of all lists.
fn every() -> Vec<(&'static str, String, Fault)> {
    [Fault::suite(), Fault::couplings(), Fault::timing()].concat()
}

fn step(log: &Trajectory, pose: usize) -> Pose {
    log.poses[pose - 1].relative(&log.poses[pose])
}

/// Larger of the difference in metres and in radians.
fn difference(a: &Pose, b: &Pose) -> f64 {
    (a.translation - b.translation)
        .amax()
        .max(so3::distance(&a.rotation, &b.rotation))
}

fn largest_difference(a: &Trajectory, b: &Trajectory) -> f64 {
    assert_eq!(a.len(), b.len());
    a.poses
        .iter()
        .zip(&b.poses)
        .map(|(a, b)| difference(a, b))
        .fold(0.0, f64::max)
}

fn inject(fault: &Fault, log: &Trajectory) -> Injection {
    fault.inject(log, RANGE, 5).unwrap()
}

#[test]
fn only_the_affected_steps_change() {
    for platform in Platform::ALL {
        let sound = log(platform);
        for (_, _, fault) in every() {
            let Injection {
                trajectory: faulty,
                affected,
            } = inject(&fault, &sound);
            let what = format!("{fault} on {platform}");
            assert_eq!(
                faulty.poses[..RANGE.start],
                sound.poses[..RANGE.start],
                "{what}"
            );
            assert_eq!(faulty.stamps[..RANGE.start], sound.stamps[..RANGE.start]);
            assert!(
                RANGE.start <= affected.start
                    && affected.end <= faulty.len()
                    && !affected.is_empty(),
                "{what}: {affected:?}"
            );
            // From the end of the affected poses on, every step is one of the sound log, so many poses later.
            let shift = sound.len() as isize - faulty.len() as isize;
            let twin = |pose: usize| (pose as isize + shift) as usize;
            for pose in (1..affected.start).chain(affected.end..faulty.len()) {
                let twin = if pose < affected.start {
                    pose
                } else {
                    twin(pose)
                };
                let error = difference(&step(&faulty, pose), &step(&sound, twin));
                assert!(error < 1e-9, "{what}: step into {pose} off by {error:e}");
                assert_eq!(
                    faulty.stamps[pose] - faulty.stamps[pose - 1],
                    sound.stamps[twin] - sound.stamps[twin - 1],
                    "{what}"
                );
            }
            let lasts = |log: &Trajectory, pose: usize| log.stamps[pose] - log.stamps[pose - 1];
            let is_sound = |pose: usize| {
                let motion = step(&faulty, pose);
                (1..sound.len()).any(|twin| {
                    difference(&motion, &step(&sound, twin)) < 1e-9
                        && lasts(&faulty, pose) == lasts(&sound, twin)
                })
            };
            let changed = affected.clone().filter(|pose| !is_sound(*pose)).count();
            // Of the steps after lost poses and at another rate, only some are wrong.
            let least = match fault {
                Fault::Drop { .. } => 0.03,
                Fault::Rate { .. } | Fault::Stale { .. } | Fault::Doubled { .. } => 0.15,
                _ => 0.7,
            };
            assert!(
                changed as f64 > least * affected.len() as f64,
                "{what}: {changed} of {affected:?}"
            );
        }
    }
}

#[test]
fn logs_stay_logs_and_seeds_decide() {
    for platform in Platform::ALL {
        let sound = log(platform);
        for (_, _, fault) in every() {
            let what = format!("{fault} on {platform}");
            let faulty = fault.apply(&sound, RANGE, 5).unwrap();
            assert_eq!(faulty.len(), faulty.stamps.len());
            assert!(
                faulty.stamps.windows(2).all(|pair| pair[0] < pair[1]),
                "{what}"
            );
            if !matches!(fault, Fault::Stall { .. }) {
                assert_eq!(stretches(&faulty, None).len(), 1, "{what}");
            }
            assert_eq!(bad_poses(&faulty, 1e-12), 0, "{what}");
            assert_eq!(
                (&faulty.name, &faulty.group, faulty.frame, faulty.rate),
                (&sound.name, &sound.group, sound.frame, sound.rate)
            );
            assert_eq!(faulty, fault.apply(&sound, RANGE, 5).unwrap(), "{what}");
            assert_eq!(
                fault.affected(&sound, RANGE, 5).unwrap(),
                inject(&fault, &sound).affected
            );
            let draws: HashSet<String> = (0..20)
                .map(|seed| fault.apply(&sound, RANGE, seed).unwrap().fingerprint())
                .collect();
            let expected = match fault {
                Fault::Jump { .. }
                | Fault::Drop { .. }
                | Fault::JitterPosition { .. }
                | Fault::JitterRotation { .. }
                | Fault::DriftPosition { .. }
                | Fault::Stale { .. }
                | Fault::Closure { .. }
                | Fault::StampJitter { .. }
                | Fault::Doubled { .. }
                | Fault::Uneven { .. } => 20,
                Fault::DriftYaw { .. }
                | Fault::Mounting { .. }
                | Fault::Slip { .. }
                | Fault::LeverArm { .. }
                | Fault::Extrinsic { .. } => 2,
                _ => 1,
            };
            assert_eq!(draws.len(), expected, "{what}");
        }
    }
}

#[test]
fn severity_zero_changes_nothing() {
    let nothing = [
        "jump:0m",
        "freeze:0s",
        "drop:0",
        "jitter-position:0m",
        "jitter-rotation:0deg",
        "drift-yaw:0deg/s",
        "drift-position:0m/s",
        "drift-scale:0/s",
        "scale:1x",
        "time-warp:0",
        "mounting:0deg",
        "slip:0m/s",
        "rate:1x",
        "position-late:0s",
        "attitude-late:0s",
        "lever-arm:left:0m",
        "extrinsic:up:0deg",
        "smooth:0s",
        "smooth-position:0s",
        "bridged-gap:0s",
        "quantised:0m",
        "stale:0",
        "interpolated:1x",
        "closure:0m:2s",
        "stall:0s",
        "burst:0s",
        "stamp-jitter:0s",
        "doubled:0",
        "uneven:0",
        "thinned:1x",
    ];
    let sound = log(Platform::Drone);
    for name in nothing {
        let fault: Fault = name.parse().unwrap();
        for range in [RANGE, 0..600, 598..600] {
            let same = fault.apply(&sound, range, 3).unwrap();
            assert!(largest_difference(&same, &sound) < 1e-9, "{name}");
            assert_eq!(same.stamps, sound.stamps, "{name}");
        }
    }
    for (name, _, fault) in every() {
        let named = nothing.iter().any(|text| text.starts_with(name));
        let alone = matches!(
            fault,
            Fault::Reversal
                | Fault::RollPitchSwap
                | Fault::Handedness { .. }
                | Fault::MirroredPositions { .. }
                | Fault::DegreesForRadians
                | Fault::SinglePrecision
                | Fault::FrozenHeight
                | Fault::Level
                | Fault::HeadingFromCourse
        );
        assert!(named != alone, "{name}");
    }
}

/// The same motion written in the axes of another frame, world and body alike.
fn in_frame(log: &Trajectory, frame: Frame) -> Trajectory {
    let axes = frame.to_forward_left_up().inverse();
    let mut log = log.clone();
    log.frame = frame;
    for pose in &mut log.poses {
        *pose = Pose::new(
            axes * pose.rotation * axes.inverse(),
            axes * pose.translation,
        );
    }
    log
}

#[test]
fn a_fault_is_the_same_whatever_axes_a_sensor_has() {
    let sound = log(Platform::Vehicle);
    for (_, _, fault) in every() {
        // Noise is drawn along the sensor's own axes.
        if matches!(
            fault,
            Fault::JitterPosition { .. } | Fault::JitterRotation { .. }
        ) {
            continue;
        }
        for frame in [Frame::CameraRdf, Frame::BodyFrd] {
            let one = in_frame(&fault.apply(&sound, RANGE, 5).unwrap(), frame);
            let other = fault.apply(&in_frame(&sound, frame), RANGE, 5).unwrap();
            let error = largest_difference(&one, &other);
            assert!(error < 1e-9, "{fault} in {frame}: {error:e}");
        }
    }
}

#[test]
fn faults_of_the_motion_do_not_depend_on_the_world() {
    let sound = log(Platform::Drone);
    for (_, _, fault) in every() {
        if matches!(
            fault,
            Fault::JitterPosition { .. }
                | Fault::RollPitchSwap
                | Fault::MirroredPositions { .. }
                | Fault::DegreesForRadians
                | Fault::Quantised { .. }
                | Fault::SinglePrecision
                | Fault::FrozenHeight
                | Fault::Level
                | Fault::HeadingFromCourse
        ) {
            continue;
        }
        let turn = |log: &Trajectory| Control::RotateWorld.apply(log, 9).unwrap();
        let one = turn(&inject(&fault, &sound).trajectory);
        let other = inject(&fault, &turn(&sound)).trajectory;
        assert!(largest_difference(&one, &other) < 1e-9, "{fault}");
    }
}

#[test]
fn coordinates_of_a_map_cost_no_accuracy() {
    let sound = log(Platform::Vehicle);
    let mut far = sound.clone();
    for pose in &mut far.poses {
        pose.translation += Vector::new(5_735_000.0, 620_000.0, -110.0);
    }
    for (_, _, fault) in every() {
        // Coordinates are what it rounds.
        if matches!(fault, Fault::Quantised { .. }) {
            continue;
        }
        let (near, far) = (inject(&fault, &sound), inject(&fault, &far));
        assert_eq!(near.affected, far.affected);
        for pose in 1..near.trajectory.len() {
            let error = difference(&step(&near.trajectory, pose), &step(&far.trajectory, pose));
            // The course of a step of centimetres is as much less exact.
            let allowed = match fault {
                Fault::HeadingFromCourse => 1e-7,
                _ => 1e-8,
            };
            assert!(error < allowed, "{fault}: {error:e}");
        }
    }
}

#[test]
fn controls_leave_the_motion() {
    for platform in Platform::ALL {
        let sound = log(platform);
        for control in [Control::Reanchor, Control::RotateWorld] {
            let changed = control.apply(&sound, 4).unwrap();
            assert!(largest_difference(&changed, &sound) > 0.1);
            assert_eq!(changed.stamps, sound.stamps);
            assert_eq!(bad_poses(&changed, 1e-12), 0);
            for pose in 1..sound.len() {
                let error = difference(&step(&changed, pose), &step(&sound, pose));
                assert!(error < 1e-9, "{control} on {platform}: {error:e}");
            }
        }
        for control in Control::ALL {
            let changed = control.apply(&sound, 4).unwrap();
            assert_eq!(changed, control.apply(&sound, 4).unwrap());
            assert_ne!(changed, control.apply(&sound, 5).unwrap());
            assert_eq!(control.name().parse::<Control>().unwrap(), control);
        }
    }
    let empty = Trajectory::new("none", Format::Tum, Frame::Sensor, vec![], vec![]);
    assert!(Control::Reanchor.apply(&empty, 1).is_err());
}

#[test]
fn a_resampled_log_lies_on_the_same_course() {
    let (velocity, spin) = (Vector::new(3.0, -1.0, 0.5), Vector::new(0.2, 0.1, -0.4));
    let at = |seconds: f64| Pose::new(so3::exp(&(spin * seconds)), velocity * seconds);
    let stamps: Vec<i64> = (0..300).map(|index| index * 100_000_000).collect();
    let poses = stamps
        .iter()
        .map(|stamp| at(*stamp as f64 * 1e-9))
        .collect();
    let mut steady = Trajectory::new("steady", Format::Tum, Frame::Sensor, stamps, poses);
    // A pose alone in its stretch has nothing beside it to be sampled between.
    steady.breaks = vec![100, 101];
    let changed = Control::Resample.apply(&steady, 4).unwrap();
    assert_eq!(
        (changed.len(), changed.breaks.as_slice()),
        (99 + 198, &[99][..])
    );
    assert_eq!(changed.rate.hertz, steady.rate.hertz);
    for (stamp, pose) in changed.stamps.iter().zip(&changed.poses) {
        let phase = (stamp % 100_000_000) as f64 * 1e-8;
        assert!((0.25..0.75).contains(&phase), "{phase}");
        assert!(difference(pose, &at(*stamp as f64 * 1e-9)) < 1e-9);
    }
}

#[test]
fn names_are_read_back() {
    let mut seen = HashSet::new();
    for (name, severity, fault) in &every() {
        let text = fault.to_string();
        let expected = if severity.is_empty() {
            (*name).to_owned()
        } else {
            format!("{name}:{severity}")
        };
        assert_eq!(text, expected);
        assert_eq!(text.parse::<Fault>().unwrap(), *fault, "{text}");
        assert!(seen.insert(text), "{fault} twice");
        let short = fault.label();
        let read = short.parse::<Fault>().unwrap();
        assert_eq!(read.label(), short);
    }
    for text in [
        "jump:1.0m",
        "freeze:2.0s",
        "jitter-rotation:0.3deg",
        "drift-yaw:0.5deg/s",
        "scale:1.05x",
        "mounting:10.0deg",
        "handedness:left",
        "reversal",
        "lever-arm:forward:0.5m",
        "extrinsic:up:1.0deg",
        "closure:1.0m:2.0s",
        "stamp-jitter:0.1s",
    ] {
        assert!(seen.contains(text), "{text}");
    }
    // Angles that are no round number of degrees are kept to the last bit all the same.
    let odd = Fault::Mounting {
        radians: 0.123_456_789_012_345_6,
    };
    assert_eq!(odd.to_string().parse::<Fault>().unwrap(), odd);
    assert_eq!(
        "mounting:0.25rad".parse::<Fault>().unwrap(),
        Fault::Mounting { radians: 0.25 }
    );
    assert_eq!(
        "handedness:forward".parse::<Fault>().unwrap(),
        Fault::Handedness {
            axis: Axis::Forward
        }
    );
    for text in [
        "",
        "jump",
        "jump:",
        "jump:1",
        "jump:m",
        "jump:1deg",
        "freeze:1m",
        "reversal:1",
        "mounting:5",
        "handedness:down",
        "teleport:1m",
        "drift-yaw:1deg",
        "lever-arm:1m",
        "lever-arm:left",
        "closure:1m",
        "closure:1m:2s:3s",
        "level:1m",
    ] {
        let error = text.parse::<Fault>().unwrap_err();
        assert!(
            matches!(error, Error::UnknownName { .. }),
            "{text}: {error}"
        );
        assert!(error.to_string().contains("jump:1.0m"), "{error}");
    }
}

#[test]
fn stronger_is_further_from_none() {
    for (fault, expected) in [
        (Fault::Jump { metres: 0.2 }, "jump:0.28m"),
        (Fault::Scale { factor: 1.05 }, "scale:1.07x"),
        (Fault::Rate { factor: 0.5 }, "rate:0.4167x"),
    ] {
        assert_eq!(fault.stronger(1.4).label(), expected);
    }
    for (_, severity, fault) in every() {
        assert!(
            fault
                .stronger(1.4)
                .apply(&log(Platform::Vehicle), RANGE, 1)
                .is_ok()
        );
        let number = severity.contains(|c: char| c.is_ascii_digit());
        assert_eq!(fault.stronger(1.4) != fault, number, "{fault}");
    }
}

#[test]
fn bad_severities_and_ranges_are_errors() {
    for text in [
        "jump:-1m",
        "jump:NaNm",
        "freeze:infs",
        "drop:1.0",
        "time-warp:1",
        "scale:0x",
        "scale:-1x",
        "rate:0x",
        "rate:NaNx",
        "mounting:181deg",
        "jitter-position:1e9m",
        "closure:1m:-1s",
        "thinned:0.5x",
        "stale:1",
    ] {
        let error = text.parse::<Fault>().unwrap_err();
        assert!(
            matches!(
                error,
                Error::Parameter {
                    what: "severity of the fault",
                    ..
                }
            ),
            "{text}: {error}"
        );
    }
    let sound = log(Platform::Vehicle);
    let unchecked = Fault::Drop { share: f64::NAN };
    assert!(unchecked.apply(&sound, RANGE, 1).is_err());
    let mut broken = sound.clone();
    broken.breaks = vec![300];
    for (_, _, fault) in every() {
        #[allow(clippy::reversed_empty_ranges)]
        for range in [10..10, 10..11, 20..10, 590..601, 600..700, 0..usize::MAX] {
            let error = fault.apply(&sound, range, 1).unwrap_err();
            assert!(error.to_string().contains("range of the fault"), "{error}");
        }
        assert!(fault.apply(&broken, RANGE, 1).is_err());
        // Up to the break and from it on, the break goes with its pose.
        for (range, inside) in [(200..300, true), (300..400, false)] {
            let faulty = fault.apply(&broken, range, 1).unwrap();
            let moved = if inside {
                faulty.len() as isize - 600
            } else {
                0
            };
            assert_eq!(faulty.breaks, [(300 + moved) as usize], "{fault}");
            let stalls = matches!(fault, Fault::Stall { seconds } if seconds > 1.0);
            let expected = if stalls { 3 } else { 2 };
            assert_eq!(stretches(&faulty, None).len(), expected, "{fault}");
        }
        for range in [0..600, 0..2, 598..600] {
            let injection = fault.inject(&sound, range, 1).unwrap();
            assert!(
                injection.affected.start >= 1
                    && injection.affected.end <= injection.trajectory.len()
            );
            assert_eq!(bad_poses(&injection.trajectory, 1e-12), 0);
        }
    }
}

#[test]
fn windows_count_their_faulty_steps() {
    let count = |start, length| {
        let window = Window {
            trajectory: 0,
            start,
            length,
        };
        faulty_steps(&(10..15), &window)
    };
    // The step into pose 10 needs pose 9.
    assert_eq!(
        [count(0, 10), count(0, 11), count(9, 2), count(10, 2)],
        [0, 1, 1, 1]
    );
    assert_eq!(
        [
            count(10, 1),
            count(0, 100),
            count(12, 50),
            count(14, 5),
            count(15, 5)
        ],
        [0, 5, 2, 0, 0]
    );
    assert_eq!(
        faulty_steps(
            &(10..10),
            &Window {
                trajectory: 0,
                start: 0,
                length: 50
            }
        ),
        0
    );
    // A matrix is used here so that the helper above is known to see a bad one.
    let mut log = log(Platform::Vehicle);
    log.poses[3].rotation = dose3_lie::Rotation::from_matrix_unchecked(Matrix::identity() * 1.001);
    assert_eq!(bad_poses(&log, 1e-12), 1);
}
