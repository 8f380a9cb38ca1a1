//! What must not change a verdict: the origin and axes of the world, the epoch of the clock, the unit and the format of
//! the file, how a rotation is written, the number of threads. Each on sound and faulty logs; real ones too where
//! `$DOSE3_DATA` names their folder.

// A test that was not run says so.
#![allow(clippy::print_stderr)]

use dose3::logs::{self, ReadOptions};
use dose3::nalgebra::{Rotation3, UnitQuaternion, Vector3};
use dose3::{Computing, Detector, FitOptions, Report, Trajectory};
use dose3_datasets::faults::Fault;
use dose3_datasets::synthetic::{Platform, suite, trajectory};
use dose3_datasets::{LoadOptions, StampUnit, resample, write};
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

/// A year, nanoseconds.
const YEAR: i64 = 31_557_600_000_000_000;
/// Scores differ by less, in units of `1 + |score|`, where poses differ by rounding only.
const ROUNDING: f64 = 1e-6;

fn default_detector() -> &'static Detector {
    static DETECTOR: OnceLock<Detector> = OnceLock::new();
    DETECTOR.get_or_init(|| Detector::fit(&suite(Platform::Vehicle, 8, 1)).unwrap())
}

fn network_detector() -> &'static Detector {
    static DETECTOR: OnceLock<Detector> = OnceLock::new();
    DETECTOR.get_or_init(|| {
        let options = FitOptions {
            statistics: Some("kinematic,residual+eps-mean".parse().unwrap()),
            density: "mixture:2".parse().unwrap(),
            steps: Some(6),
            ..FitOptions::default()
        };
        let builder = Detector::builder().options(options);
        builder.fit(&suite(Platform::Vehicle, 5, 1)).unwrap()
    })
}

/// A sound drive and four faulty ones.
fn drives() -> Vec<Trajectory> {
    let sound = trajectory(Platform::Vehicle, 40, 1600, 20.0);
    let mut drives = with_faults(&sound);
    drives.push(sound);
    drives
}

fn with_faults(sound: &Trajectory) -> Vec<Trajectory> {
    let middle = sound.len() / 3..sound.len() / 2;
    let faults = [
        Fault::Freeze { seconds: 2.0 },
        Fault::JitterPosition { metres: 0.3 },
        Fault::Mounting { radians: 0.2 },
        Fault::TimeWarp { depth: 0.6 },
    ];
    let faulty = faults.iter().map(|fault| {
        let mut log = fault.apply(sound, middle.clone(), 5).unwrap();
        log.name = format!("{} {}", sound.name, fault.name());
        log
    });
    faulty.collect()
}

fn judge(detector: &Detector, log: &Trajectory) -> Report {
    let report = detector.judge(log);
    report.unwrap_or_else(|error| panic!("{}: {error}", log.name))
}

/// The same verdict, by the same windows, within `tolerance`; to the last bit where it is 0.
fn assert_same(what: &str, one: &Report, other: &Report, tolerance: f64) {
    let name = &one.log.name;
    assert_eq!(one.verdict, other.verdict, "{name}, {what}");
    assert_eq!(one.windows.len(), other.windows.len(), "{name}, {what}");
    let near = |a: f64, b: f64| match tolerance == 0.0 {
        true => a.to_bits() == b.to_bits(),
        false => (a - b).abs() <= tolerance * (1.0 + a.abs()),
    };
    for (i, (a, b)) in one.windows.iter().zip(&other.windows).enumerate() {
        let (a, b) = (a.score.value(), b.score.value());
        assert!(near(a, b), "{name}, {what}: window {i} has {a}, then {b}");
    }
    let (a, b) = (one.evidence.p_value, other.evidence.p_value);
    assert!(near(a.ln(), b.ln()), "{name}, {what}: chance {a}, then {b}");
}

fn moved(log: &Trajectory, rotation: Rotation3<f64>, place: Vector3<f64>) -> Trajectory {
    let mut moved = log.clone();
    for pose in &mut moved.poses {
        pose.rotation = rotation * pose.rotation;
        pose.translation = rotation * pose.translation + place;
    }
    moved
}

/// Tolerances: of another frame of the world, and where nothing but rounding of the same poses is between.
fn relations(detector: &Detector, log: &Trajectory, rounding: f64) {
    let report = judge(detector, log);
    let same = |what: &str, other: &Trajectory, tolerance: f64| {
        assert_same(what, &report, &judge(detector, other), tolerance);
    };

    let first = &log.poses[0];
    let origin = first.rotation.inverse();
    same(
        "anchored at its first pose",
        &moved(log, origin, -(origin * first.translation)),
        rounding,
    );
    let turned = Rotation3::from_euler_angles(0.4, -1.1, 2.0);
    same(
        "in a turned world",
        &moved(log, turned, Vector3::zeros()),
        rounding,
    );
    let city = Vector3::new(4_321.0, -987.0, 120.0);
    same(
        "in another place",
        &moved(log, Rotation3::identity(), city),
        rounding,
    );

    for years in [-30, 20, 200] {
        let mut later = log.clone();
        later
            .stamps
            .iter_mut()
            .for_each(|stamp| *stamp += years * YEAR);
        same("in another year", &later, 0.0);
    }
    for threads in [1, 2, 3] {
        let computing = Computing {
            threads,
            ..Computing::default()
        };
        let pool = rayon_pool(threads);
        let other = pool.install(|| judge(&detector.clone().on(computing), log));
        assert_eq!(report, other, "{} on {threads} threads", log.name);
    }
    let rate = report.log.rate_hz;
    if rate < log.rate.hertz * 0.9 {
        same(
            "resampled to the right rate",
            &resample(log, rate).unwrap(),
            0.0,
        );
    }
    of_parts(detector, log, &report);
}

fn rayon_pool(threads: usize) -> rayon::ThreadPool {
    let builder = rayon::ThreadPoolBuilder::new().num_threads(threads);
    builder.build().unwrap()
}

/// Two files of one log, cut where a window begins: their windows are windows of the whole.
fn of_parts(detector: &Detector, log: &Trajectory, whole: &Report) {
    let middle = &whole.windows[whole.windows.len() / 2];
    let cut = log
        .stamps
        .partition_point(|stamp| *stamp < middle.first_stamp_ns);
    let parts = [log.cut(0..cut), log.cut(cut..log.len())];
    let mut found = 0;
    for part in &parts {
        for window in &judge(detector, part).windows {
            let same = whole.windows.iter().find(|of_whole| {
                of_whole.first_stamp_ns == window.first_stamp_ns
                    && of_whole.last_stamp_ns == window.last_stamp_ns
            });
            let same = same.unwrap_or_else(|| panic!("{}: a window of a part alone", log.name));
            assert_eq!(same.score.value().to_bits(), window.score.value().to_bits());
            found += 1;
        }
    }
    // All but those that lie across the cut.
    let across = whole.windows.iter().filter(|window| {
        window.first_stamp_ns < log.stamps[cut] && window.last_stamp_ns >= log.stamps[cut]
    });
    assert_eq!(found + across.count(), whole.windows.len(), "{}", log.name);
}

#[test]
fn the_world_the_clock_the_rate_and_the_threads_change_no_verdict() {
    let mut verdicts = Vec::new();
    for log in drives() {
        relations(default_detector(), &log, ROUNDING);
        verdicts.push(judge(default_detector(), &log).is_ood());
    }
    assert!(
        verdicts.contains(&true) && verdicts.contains(&false),
        "{verdicts:?}"
    );
}

#[test]
fn nor_do_they_where_networks_look() {
    for log in drives() {
        // Networks compute in single precision.
        relations(network_detector(), &log, 1e-3);
    }
}

#[test]
fn nor_do_they_with_real_logs() {
    let Some(root) = std::env::var_os("DOSE3_DATA").map(PathBuf::from) else {
        eprintln!("not run: real data is needed, $DOSE3_DATA names its folder");
        return;
    };
    let kitti = |name: &str| root.join(format!("kitti/poses/{name}.txt"));
    if !kitti("07").exists() {
        eprintln!("not run: no KITTI in $DOSE3_DATA");
        return;
    }
    let trusted = ["00", "02", "03", "05", "06", "08", "09", "10"].map(kitti);
    let detector = Detector::fit(&dose3::load(trusted).unwrap()).unwrap();
    let log = dose3::load([kitti("07")]).unwrap().remove(0);
    for log in with_faults(&log).iter().chain([&log]) {
        // Six digits of a position and nine of a rotation were written, so the rounding of f64 stays small beside them.
        relations(&detector, log, 1e-5);
    }
}

/// A log through a file: written by `write`, read as `options` say.
fn through(folder: &Path, name: &str, text: &[u8], options: &ReadOptions) -> Trajectory {
    let path = folder.join(name);
    std::fs::write(&path, text).unwrap();
    let mut logs = logs::read(&[path], options).unwrap();
    assert_eq!(logs.len(), 1);
    logs.remove(0)
}

/// A row of eight numbers for each pose: seconds, position, quaternion x, y, z, w.
fn rows(log: &Trajectory, unit: f64, row: impl Fn(usize, [String; 8]) -> String) -> Vec<u8> {
    let mut text = String::new();
    for (i, (stamp, pose)) in log.stamps.iter().zip(&log.poses).enumerate() {
        let (q, p) = (
            UnitQuaternion::from_rotation_matrix(&pose.rotation),
            pose.translation / unit,
        );
        let seconds = format!("{}.{:09}", stamp / 1_000_000_000, stamp % 1_000_000_000);
        let numbers = [p.x, p.y, p.z, q.i, q.j, q.k, q.w].map(|x| x.to_string());
        let mut all = vec![seconds];
        all.extend(numbers);
        let _ = writeln!(text, "{}", row(i, all.try_into().unwrap()));
    }
    text.into_bytes()
}

#[test]
fn formats_columns_units_and_signs_change_no_verdict() {
    let folder = tempfile::tempdir().unwrap();
    let detector = default_detector();
    let frame = ReadOptions {
        frame: Some(dose3::Frame::BodyFlu),
        ..ReadOptions::default()
    };
    for log in drives() {
        let read = |name: &str, text: &[u8], options: &ReadOptions| {
            let log = through(folder.path(), name, text, options);
            judge(detector, &log)
        };
        let tum = rows(&log, 1.0, |_, numbers| numbers.join(" "));
        let report = read("log.txt", &tum, &frame);
        assert_same("written as TUM", &judge(detector, &log), &report, ROUNDING);

        // A quaternion and its negative are one rotation.
        let flipped = rows(&log, 1.0, |i, mut numbers| {
            if i * 2_654_435_761 % 97 < 48 {
                for number in &mut numbers[4..] {
                    *number = match number.strip_prefix('-') {
                        Some(positive) => positive.to_owned(),
                        None => format!("-{number}"),
                    };
                }
            }
            numbers.join(" ")
        });
        assert_same(
            "with other signs",
            &report,
            &read("flipped.txt", &flipped, &frame),
            0.0,
        );

        let header = "t,x,y,z,qx,qy,qz,qw\n";
        let csv = rows(&log, 1.0, |_, numbers| numbers.join(","));
        let csv = [header.as_bytes(), &csv].concat();
        assert_same("as csv", &report, &read("log.csv", &csv, &frame), 0.0);
        let reversed = rows(&log, 1.0, |_, mut numbers| {
            numbers.reverse();
            numbers.join(",")
        });
        let reversed = [b"qw,qz,qy,qx,z,y,x,t\n", &reversed[..]].concat();
        let said = read("reversed.csv", &reversed, &frame);
        assert_same("with columns from right to left", &report, &said, 0.0);

        for (unit, name) in [
            (0.001, "millimetres"),
            (0.3048, "feet"),
            (1000.0, "kilometres"),
        ] {
            let text = rows(&log, unit, |_, numbers| numbers.join(" "));
            let options = ReadOptions {
                unit,
                ..frame.clone()
            };
            let said = read("unit.txt", &text, &options);
            assert_same(&format!("in {name}"), &report, &said, ROUNDING);
        }
        let nanoseconds: String = String::from_utf8(tum)
            .unwrap()
            .lines()
            .map(|line| format!("{}\n", line.replacen('.', "", 1)))
            .collect();
        let options = ReadOptions {
            load: LoadOptions {
                stamp_unit: Some(StampUnit::Nanoseconds),
                ..LoadOptions::default()
            },
            ..frame.clone()
        };
        let said = read("nanoseconds.txt", nanoseconds.as_bytes(), &options);
        assert_same("with stamps in nanoseconds", &report, &said, 0.0);

        let mut euroc = Vec::new();
        write::euroc(&mut euroc, &log).unwrap();
        assert_same(
            "as EuRoC",
            &report,
            &read("data.csv", &euroc, &frame),
            ROUNDING,
        );
    }
}
