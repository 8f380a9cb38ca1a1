//! Streams say what verdicts say, to the last bit, and survive what robots send.

// A test that was not run says so.
#![allow(clippy::print_stderr)]

use dose3::stream::{
    Alarm, AlarmKind, EventKind, Fault, Monitor, RaisedBy, Said, Stream, StreamOptions, StreamState,
};
use dose3::{Detector, FitOptions, Frame, Pose, Trajectory};
use dose3_datasets::faults::Fault as Injected;
use dose3_datasets::synthetic::{Platform, suite, trajectory};
use std::path::PathBuf;
use std::sync::{Arc, OnceLock};

fn fit(statistics: &str) -> Detector {
    let options = FitOptions {
        statistics: Some(statistics.parse().unwrap()),
        density: "mixture:2".parse().unwrap(),
        steps: Some(6),
        ..FitOptions::default()
    };
    let trusted = suite(Platform::Vehicle, 5, 1);
    Detector::builder().options(options).fit(&trusted).unwrap()
}

fn default_detector() -> &'static Detector {
    static DETECTOR: OnceLock<Detector> = OnceLock::new();
    DETECTOR.get_or_init(|| fit("kinematic,differences,lin/cc"))
}

fn monitor() -> Arc<Monitor> {
    default_detector()
        .monitor(&StreamOptions::default())
        .unwrap()
}

fn all_said(stream: &mut Stream, log: &Trajectory) -> Vec<Said> {
    let mut all = Vec::new();
    for (stamp, pose) in log.stamps.iter().zip(&log.poses) {
        all.extend_from_slice(stream.push(*stamp, *pose).unwrap());
    }
    all.extend_from_slice(stream.finish().unwrap());
    all
}

fn events(said: &[Said]) -> Vec<&EventKind> {
    let event = |said: &'_ Said| matches!(said, Said::Event(_));
    let kinds = said.iter().filter(|s| event(s));
    kinds
        .map(|said| match said {
            Said::Event(event) => &event.kind,
            other => panic!("{other:?}"),
        })
        .collect()
}

fn alarms(said: &[Said]) -> Vec<AlarmKind> {
    said.iter()
        .filter_map(|said| match said {
            Said::Alarm(alarm) => Some(alarm.alarm),
            _ => None,
        })
        .collect()
}

/// The windows that a verdict would cut have the verdict's numbers.
fn says_what_a_verdict_says(detector: &Detector, log: &Trajectory) -> usize {
    let report = detector.judge(log).unwrap();
    let mut stream = detector
        .stream(log.frame, &StreamOptions::default())
        .unwrap();
    let said = all_said(&mut stream, log);
    let windows: Vec<_> = said
        .iter()
        .filter_map(|said| match said {
            Said::Window(window) if window.in_verdict => Some(window),
            _ => None,
        })
        .collect();
    assert_eq!(windows.len(), report.windows.len(), "{}", log.name);
    for (live, offline) in windows.iter().zip(&report.windows) {
        let bits = |a: f64, b: f64| assert_eq!(a.to_bits(), b.to_bits(), "{}", log.name);
        bits(live.score.value(), offline.score.value());
        bits(live.p_value, offline.p_value);
        assert_eq!(live.beyond, offline.beyond);
        assert_eq!(live.first_stamp_ns, offline.first_stamp_ns);
        assert_eq!(live.last_stamp_ns, offline.last_stamp_ns);
    }
    windows.len()
}

#[test]
fn windows_have_the_numbers_of_a_verdict_at_any_rate_and_with_gaps() {
    let detector = default_detector();
    for hertz in [10.0, 20.0, 33.0, 100.0] {
        let drive = trajectory(Platform::Vehicle, 20, (60.0 * hertz) as usize, hertz);
        assert!(says_what_a_verdict_says(detector, &drive) >= 14);
    }
    // Lost poses, a pause, and stamps that waver.
    let mut log = trajectory(Platform::Vehicle, 21, 1800, 20.0);
    let keep = |i: usize| i % 7 != 3 && !(800..830).contains(&i);
    let kept: Vec<usize> = (0..log.len()).filter(|i| keep(*i)).collect();
    let wavering = |i: usize| log.stamps[i] + (i as i64 * 7919 % 9001) * 1000;
    log = Trajectory::from_poses(
        "gaps",
        log.frame,
        kept.iter().map(|&i| wavering(i)).collect::<Vec<_>>(),
        kept.iter().map(|&i| log.poses[i]),
    )
    .unwrap();
    assert!(says_what_a_verdict_says(detector, &log) > 15);
}

/// Detectors of every class of rates: of slow logs, of logs at the usual rate, one that was asked to measure faster; each
/// beside logs at its rate, a little off it, at a multiple, and at what is no multiple.
#[test]
fn windows_have_the_numbers_of_a_verdict_in_every_class_of_rates() {
    for (trusted, asked, judged) in [
        (5.0, None, [5.0, 5.02, 10.0, 13.7]),
        (20.0, Some(20.0), [20.0, 19.9, 100.0, 31.3]),
    ] {
        let options = FitOptions {
            statistics: Some("kinematic,lin".parse().unwrap()),
            density: "mixture:2".parse().unwrap(),
            rate: asked,
            window: Some(64),
            ..FitOptions::default()
        };
        let logs: Vec<Trajectory> = (0..4)
            .map(|seed| trajectory(Platform::Vehicle, seed, (80.0 * trusted) as usize, trusted))
            .collect();
        let detector = Detector::builder().options(options).fit(&logs).unwrap();
        for hertz in judged {
            let drive = trajectory(Platform::Vehicle, 30, (60.0 * hertz) as usize, hertz);
            assert!(says_what_a_verdict_says(&detector, &drive) >= 14, "{hertz}");
        }
    }
}

/// Each data set is trusted in part; another log of it is pushed pose by pose.
#[test]
fn windows_of_real_logs_have_the_numbers_of_a_verdict() {
    let root = std::env::var_os("DOSE3_DATA").map(PathBuf::from);
    for (set, judged, trusted) in [
        ("kitti/poses", "07.txt", &["03.txt", "09.txt", "10.txt"][..]),
        (
            "iros20",
            "traj_3.npy",
            &["traj_4.npy", "traj_5.npy", "traj_6.npy", "traj_7.npy"],
        ),
        (
            "robotcar",
            "2019-01-15-13-06-37",
            &["2019-01-11-14-02-26", "2019-01-14-12-05-52"],
        ),
        (
            "vio/trusted",
            "UZH-FPV_Indoor_Forward_5_Davis_With_Gt.txt",
            &[
                "UZH-FPV_Indoor_Forward_3_Davis_With_Gt.txt",
                "UZH-FPV_Indoor_Forward_6_Davis_With_Gt.txt",
                "UZH-FPV_Indoor_Forward_7_Davis_With_Gt.txt",
            ],
        ),
    ] {
        let Some(folder) = root.as_ref().map(|r| r.join(set)).filter(|f| f.exists()) else {
            eprintln!("{set}: not run, real data is needed, $DOSE3_DATA names its folder");
            continue;
        };
        let options = FitOptions {
            density: "mixture:2".parse().unwrap(),
            ..FitOptions::default()
        };
        let trusted = dose3::load(trusted.iter().map(|name| folder.join(name))).unwrap();
        let detector = Detector::builder().options(options).fit(&trusted).unwrap();
        for log in dose3::load([folder.join(judged)]).unwrap() {
            let windows = says_what_a_verdict_says(&detector, &log);
            assert!(windows > 1, "{}: {windows}", log.name);
        }
    }
}

#[test]
fn networks_and_the_paper_s_windows_say_what_verdicts_say() {
    let drive = trajectory(Platform::Vehicle, 22, 500, 20.0);
    for statistics in ["kinematic,residual", "kinematic+differences", "moments24"] {
        assert!(says_what_a_verdict_says(&fit(statistics), &drive) > 3);
    }
}

#[test]
fn a_stream_that_was_put_away_goes_on_to_the_last_bit() {
    let monitor = monitor();
    let sound = trajectory(Platform::Vehicle, 23, 1600, 20.0);
    let log = Injected::Freeze { seconds: 2.0 }.apply(&sound, 900..1300, 3);
    let log = log.unwrap();
    let whole = all_said(&mut monitor.stream(log.frame).unwrap(), &log);
    assert!(!alarms(&whole).is_empty());
    let mut said = Vec::new();
    let mut stream = monitor.stream(log.frame).unwrap();
    for (i, (stamp, pose)) in log.stamps.iter().zip(&log.poses).enumerate() {
        if [10, 31, 700, 701, 990, 1100, 1599].contains(&i) {
            let json = serde_json::to_string(&stream.state()).unwrap();
            let state: StreamState = serde_json::from_str(&json).unwrap();
            stream = monitor.resume(state).unwrap();
            assert_eq!(serde_json::to_string(&stream.state()).unwrap(), json);
        }
        said.extend_from_slice(stream.push(*stamp, *pose).unwrap());
    }
    said.extend_from_slice(stream.finish().unwrap());
    assert_eq!(said, whole);

    let mut halfway = monitor.stream(log.frame).unwrap();
    for (stamp, pose) in log.stamps.iter().zip(&log.poses).take(700) {
        halfway.push(*stamp, *pose).unwrap();
    }
    for (what, alter) in ALTERED {
        let mut state = serde_json::to_value(halfway.state()).unwrap();
        alter(&mut state);
        // What is no state at all is refused even earlier.
        let resumed = serde_json::from_value(state).map(|state| monitor.resume(state).is_ok());
        assert!(!matches!(resumed, Ok(true)), "{what}");
    }

    // It belongs to its monitor.
    let other = default_detector().monitor(&StreamOptions {
        alarms_per_hour: 0.5,
        ..StreamOptions::default()
    });
    let refused = other.unwrap().resume(stream.state());
    let refused = refused.err().unwrap().to_string();
    assert!(refused.contains("other options"), "{refused}");
}

type Alter = fn(&mut serde_json::Value);

/// States that would hang, panic or count wrongly.
const ALTERED: [(&str, Alter); 11] = [
    ("no time between samples", |s| {
        s["sampler"]["period"] = 0.0.into()
    }),
    ("samples that are long due", |s| {
        s["sampler"]["index"] = 0.into();
    }),
    ("a stretch that begins in another age", |s| {
        s["sampler"]["first"] = i64::MIN.into();
    }),
    ("no rotation", |s| s["ring"]["last"][0] = 17.0.into()),
    ("a position out of this world", |s| {
        s["intake"]["last"][1][9] = 1e300.into();
    }),
    ("a rate of nothing", |s| {
        s["intake"]["hertz"] = 1e-300.into()
    }),
    ("a count without end", |s| {
        s["intake"]["pushed"] = u64::MAX.into()
    }),
    ("stamps that go back", |s| {
        s["ring"]["stamps"][0] = i64::MAX.into()
    }),
    ("samples behind those that are due", |s| {
        let stamps = s["ring"]["stamps"].as_array_mut().unwrap();
        let last = stamps.last_mut().unwrap();
        *last = (last.as_i64().unwrap() + 1_000_000_000_000).into();
    }),
    ("a last pose at another time", |s| {
        let stamp = s["intake"]["last"][0].as_i64().unwrap();
        s["intake"]["last"][0] = (stamp - 1).into();
    }),
    ("another shape", |s| s["ring"]["steps"] = [1.0].into()),
];

#[test]
fn a_clock_that_only_goes_back_is_told_and_nothing_piles_up() {
    let monitor = monitor();
    let log = trajectory(Platform::Vehicle, 29, 1000, 20.0);
    let mut stream = monitor.stream(log.frame).unwrap();
    let mut said = Vec::new();
    let second = 1_000_000_000;
    for (i, pose) in log.poses.iter().enumerate() {
        said.extend_from_slice(stream.push(-(i as i64) * second, *pose).unwrap());
    }
    let back = |k: &&&EventKind| matches!(k, EventKind::ClockBack { seconds } if *seconds == 1.0);
    let kinds = events(&said);
    assert_eq!(kinds.iter().filter(back).count(), kinds.len());
    assert!(kinds.len() > 10);
    let kept = serde_json::to_string(&stream.state()).unwrap();
    assert!(kept.len() < 20_000, "{}", kept.len());
    // What comes in order is judged.
    let said = all_said(&mut stream, &log);
    assert!(said.iter().any(|s| matches!(s, Said::Window(_))));
}

#[test]
fn what_robots_send_is_reported_and_changes_no_number() {
    let monitor = monitor();
    let log = trajectory(Platform::Vehicle, 24, 800, 20.0);
    let clean = all_said(&mut monitor.stream(log.frame).unwrap(), &log);
    let mut stream = monitor.stream(log.frame).unwrap();
    let mut said = Vec::new();
    let bad = Pose::new(log.poses[0].rotation, log.poses[0].translation * f64::NAN);
    for (i, (stamp, pose)) in log.stamps.iter().zip(&log.poses).enumerate() {
        said.extend_from_slice(stream.push(*stamp, *pose).unwrap());
        if i % 50 == 49 {
            said.extend_from_slice(stream.push(*stamp, *pose).unwrap());
            said.extend_from_slice(stream.push(log.stamps[i - 2], log.poses[i - 2]).unwrap());
            said.extend_from_slice(stream.push(*stamp + 1, bad).unwrap());
            let zero = stream.push_quaternion(*stamp + 2, [0.0; 3], [0.0; 4]);
            said.extend_from_slice(zero.unwrap());
            let long = stream.push_quaternion(*stamp + 3, [0.0; 3], [0.0, 0.0, 0.0, 2.0]);
            said.extend_from_slice(long.unwrap());
        }
    }
    said.extend_from_slice(stream.finish().unwrap());
    let windows = |said: &[Said]| -> Vec<Said> {
        let window = |s: &&Said| matches!(s, Said::Window(_));
        said.iter().filter(window).cloned().collect()
    };
    assert_eq!(windows(&said), windows(&clean));
    let kinds = events(&said);
    let of = |wanted: fn(&EventKind) -> bool| kinds.iter().filter(|k| wanted(k)).count();
    // 40 s of log: said at once, then every ten seconds.
    assert_eq!(of(|k| matches!(k, EventKind::Doubled { .. })), 4);
    assert_eq!(of(|k| matches!(k, EventKind::Late { .. })), 4);
    assert_eq!(of(|k| matches!(k, EventKind::BadPose { .. })), 4);
    assert_eq!(of(|k| matches!(k, EventKind::Rate { .. })), 1);
}

#[test]
fn pauses_jumps_and_clocks_begin_a_new_stretch() {
    let monitor = monitor();
    let log = trajectory(Platform::Vehicle, 25, 400, 10.0);
    let shifted = |stamp: i64, metres: f64| -> Trajectory {
        let mut other = log.clone();
        other.stamps.iter_mut().for_each(|s| *s += stamp);
        for pose in &mut other.poses {
            pose.translation.x += metres;
        }
        other
    };
    let day = 86_400_000_000_000;
    let parts = [
        log.clone(),
        shifted(log.stamps[399] + 5_000_000_000, 0.0),
        shifted(log.stamps[399] * 2 + 5_100_000_000, 5000.0),
        shifted(-day, 5000.0),
    ];
    let mut stream = monitor.stream(log.frame).unwrap();
    let mut said = Vec::new();
    for part in &parts {
        for (stamp, pose) in part.stamps.iter().zip(&part.poses) {
            said.extend_from_slice(stream.push(*stamp, *pose).unwrap());
        }
    }
    let kinds = events(&said);
    assert!(matches!(kinds[1], EventKind::Gap { .. }), "{kinds:?}");
    assert!(matches!(kinds[2], EventKind::Reset { .. }), "{kinds:?}");
    assert!(matches!(kinds[3], EventKind::ClockBack { .. }), "{kinds:?}");
    // Every part has the windows that it has alone.
    let scores = |said: &[Said]| -> Vec<u64> {
        said.iter()
            .filter_map(|s| match s {
                Said::Window(w) => Some(w.score.value().to_bits()),
                _ => None,
            })
            .collect()
    };
    let alone = scores(&all_said(&mut monitor.stream(log.frame).unwrap(), &log));
    let together = scores(&said);
    assert_eq!(together.len(), 4 * alone.len());
    assert_eq!(together[..alone.len()], alone[..]);
    assert_eq!(together[alone.len()..2 * alone.len()], alone[..]);

    stream.reset();
    let fresh = monitor.stream(log.frame).unwrap();
    assert_eq!(stream.state(), fresh.state());
}

#[test]
fn slow_poses_and_strange_frames_are_refused_in_words() {
    let monitor = monitor();
    let slow = trajectory(Platform::Vehicle, 26, 200, 4.0);
    let said = all_said(&mut monitor.stream(slow.frame).unwrap(), &slow);
    let kinds = events(&said);
    assert!(matches!(kinds[0], EventKind::TooSlow { .. }), "{kinds:?}");
    assert!(!said.iter().any(|s| matches!(s, Said::Window(_))));
    assert!(monitor.stream(Frame::Sensor).is_err());
    let refused = |options: StreamOptions| {
        let refused = default_detector().monitor(&options).err().unwrap();
        refused.to_string()
    };
    let default = StreamOptions::default();
    let every = refused(StreamOptions {
        every: Some(7),
        ..default
    });
    assert!(every.contains("divisor"), "{every}");
    for alarms_per_hour in [0.0, -1.0, f64::NAN, 61.0] {
        let text = refused(StreamOptions {
            alarms_per_hour,
            ..default
        });
        assert!(text.contains("alarms"), "{text}");
    }
    let gap = refused(StreamOptions {
        max_gap_s: Some(0.0),
        ..default
    });
    assert!(gap.contains("pause"), "{gap}");
    let rate = refused(StreamOptions {
        rate_hz: Some(1e300),
        ..default
    });
    assert!(rate.contains("1e300") && rate.contains("1e6 Hz"), "{rate}");
}

#[test]
fn numbers_beyond_all_measure_are_an_event_and_no_panic() {
    let monitor = monitor();
    let log = trajectory(Platform::Vehicle, 27, 500, 10.0);
    let mut stream = default_detector()
        .stream(
            log.frame,
            &StreamOptions {
                reset_m: Some(f64::MAX),
                ..StreamOptions::default()
            },
        )
        .unwrap();
    for x in [1e200, 1e9] {
        let mut said = Vec::new();
        for (i, (stamp, pose)) in log.stamps.iter().zip(&log.poses).enumerate() {
            let mut pose = *pose;
            pose.translation.x = if i % 2 == 1 { x } else { -x };
            said.extend_from_slice(stream.push(*stamp, pose).unwrap());
        }
        let too_far = |k: &&EventKind| {
            matches!(
                k,
                EventKind::BadPose {
                    what: Fault::TooFar,
                    ..
                }
            )
        };
        // As in whole logs, which hold no position beyond 1e9 m.
        assert_eq!(
            events(&said).iter().any(too_far),
            x > 1e9,
            "{:?}",
            events(&said)
        );
        let window = |s: &Said| matches!(s, Said::Window(w) if w.beyond && w.chance > 0.0);
        assert_eq!(said.iter().any(window), x <= 1e9);
    }
    // Where such steps are jumps, they are told now and then.
    let mut stream = monitor.stream(log.frame).unwrap();
    let mut said = Vec::new();
    for (i, stamp) in log.stamps.iter().enumerate() {
        let mut pose = log.poses[i];
        pose.translation.x = if i % 2 == 1 { 9e8 } else { -9e8 };
        said.extend_from_slice(stream.push(*stamp, pose).unwrap());
    }
    let kinds = events(&said);
    assert_eq!(kinds.len(), 1 + 5, "{kinds:?}");
    assert!(matches!(kinds[5], EventKind::Reset { count: 100, metres } if metres.is_finite()));
}

#[test]
fn an_alarm_is_raised_soon_and_ends_with_its_fault() {
    let monitor = monitor();
    let sound = trajectory(Platform::Vehicle, 28, 3000, 20.0);
    let said = all_said(&mut monitor.stream(sound.frame).unwrap(), &sound);
    assert!(alarms(&said).is_empty());
    let fault = Injected::JitterPosition { metres: 0.3 };
    let log = fault.apply(&sound, 1200..1500, 5).unwrap();
    let said = all_said(&mut monitor.stream(log.frame).unwrap(), &log);
    assert_eq!(alarms(&said), [AlarmKind::Raised, AlarmKind::Ended]);
    let told: Vec<_> = said
        .iter()
        .filter_map(|s| match s {
            Said::Alarm(alarm) => Some(alarm),
            _ => None,
        })
        .collect();
    let seconds = |ns: i64| (ns - log.stamps[1200]) as f64 * 1e-9;
    let (raised, ended) = (told[0], told[1]);
    assert!((0.0..3.0).contains(&seconds(raised.raised_ns)), "{raised}");
    assert!((-0.5..1.0).contains(&seconds(raised.since_ns)), "{raised}");
    let end = seconds(ended.ended_ns.unwrap());
    assert!((13.0..19.0).contains(&end), "{ended}");
    assert!(ended.worst_excess >= raised.worst_excess && !raised.groups.is_empty());
    assert!(raised.to_string().contains("unlike the trusted logs"));
    assert!(raised.why.iter().all(|why| why.contains("trusted")) && !raised.why.is_empty());
}

#[test]
fn what_one_number_shows_is_heard_at_once() {
    let monitor = monitor();
    let sound = trajectory(Platform::Vehicle, 28, 3000, 20.0);
    // Backward from one pose to the next.
    let log = Injected::Reversal.apply(&sound, 1200..1400, 5).unwrap();
    let said = all_said(&mut monitor.stream(log.frame).unwrap(), &log);
    let raised: Vec<&Alarm> = said
        .iter()
        .filter_map(|said| match said {
            Said::Alarm(alarm) if alarm.alarm == AlarmKind::Raised => Some(alarm),
            _ => None,
        })
        .collect();
    let first = raised[0];
    let seconds = (first.raised_ns - log.stamps[1200]) as f64 * 1e-9;
    assert!((0.0..2.0).contains(&seconds), "{first}");
    assert_eq!(first.raised_by, RaisedBy::Number);
    assert_eq!((first.test.as_str(), first.groups.len()), ("numbers", 1));
}

#[test]
fn stamps_unlike_the_trusted_ones_are_told_once() {
    let monitor = monitor();
    let log = trajectory(Platform::Vehicle, 29, 3000, 20.0);
    let of_stamps = |log: &Trajectory| -> Vec<(i64, String)> {
        let said = all_said(&mut monitor.stream(log.frame).unwrap(), log);
        said.iter()
            .filter_map(|said| match said {
                Said::Event(event) => match &event.kind {
                    EventKind::Stamps(_) => Some((event.stamp_ns, event.to_string())),
                    _ => None,
                },
                _ => None,
            })
            .collect()
    };
    assert_eq!(of_stamps(&log), []);
    let lossy = Injected::Drop { share: 0.25 };
    let heard = of_stamps(&lossy.apply(&log, 1000..2000, 3).unwrap());
    let lost: Vec<_> = heard
        .iter()
        .filter(|(_, s)| s.contains("missing"))
        .collect();
    assert_eq!(lost.len(), 1, "{heard:?}");
    let seconds = (lost[0].0 - log.stamps[1000]) as f64 * 1e-9;
    assert!((0.0..6.0).contains(&seconds), "{heard:?}");
    let stall = Injected::Stall { seconds: 0.4 };
    let heard = of_stamps(&stall.apply(&log, 1000..1100, 3).unwrap());
    assert!(heard[0].1.contains("pause"), "{heard:?}");
}
