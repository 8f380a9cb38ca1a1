//! What real logs look like beyond the data sets: each kind is read to the right poses, stamps and rows, and what was
//! assumed is said.

mod bodies;
mod echo;
mod formats;
mod json;
mod names;
mod npz;
mod structured;
mod tools;
mod values;

use std::fmt::Write as _;

use dose3_datasets::{
    Format, LoadOptions, LostKind, RateSource, ReadOption, RemarkKind, RowKind, Trajectory,
    load_bytes,
};
use dose3_lie::{Pose, Rotation, Vector, so3};
use npyz::WriterBuilder as _;

const POSES: usize = 24;

/// A car on a bend: 8 m/s, 0.2 rad/s, 10 Hz.
fn truth() -> Vec<Pose> {
    let mut position = Vector::zeros();
    (0..POSES)
        .map(|index| {
            let yaw = 0.02 * index as f64;
            let pose = Pose {
                rotation: Rotation::from_euler_angles(0.0, 0.0, yaw),
                translation: position,
            };
            position += Vector::new(0.8 * yaw.cos(), 0.8 * yaw.sin(), 0.0);
            pose
        })
        .collect()
}

/// x y z, and w x y z, of each pose.
fn rows() -> Vec<([f64; 3], [f64; 4])> {
    let half = |index: usize| 0.01 * index as f64;
    let poses = truth().into_iter().enumerate();
    poses
        .map(|(index, pose)| {
            (
                pose.translation.into(),
                [half(index).cos(), 0.0, 0.0, half(index).sin()],
            )
        })
        .collect()
}

/// An array as `numpy.save` writes it.
fn array<T: npyz::AutoSerialize>(shape: &[u64], values: Vec<T>) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut writer = npyz::WriteOptions::new()
        .default_dtype()
        .shape(shape)
        .writer(&mut bytes)
        .begin_nd()
        .unwrap();
    writer.extend(values).unwrap();
    writer.finish().unwrap();
    bytes
}

/// Lines made from stamp number, position and quaternion w, x, y, z.
fn lines(line: impl Fn(usize, [f64; 3], [f64; 4]) -> String) -> String {
    let rows = rows().into_iter().enumerate();
    rows.map(|(index, (p, q))| line(index, p, q) + "\n")
        .collect()
}

/// Numbers with a separator between.
fn join(numbers: &[f64], separator: &str) -> String {
    let words: Vec<String> = numbers
        .iter()
        .map(|number| format!("{number:.6}"))
        .collect();
    words.join(separator)
}

fn tum(stamp: impl Fn(usize) -> String, separator: &str, w_first: bool) -> String {
    lines(|index, p, [w, x, y, z]| {
        let q = if w_first { [w, x, y, z] } else { [x, y, z, w] };
        [stamp(index), join(&p, separator), join(&q, separator)].join(separator)
    })
}

fn epoch(index: usize) -> String {
    format!("{}.{}00000", 1_600_000_000 + index / 10, index % 10)
}

fn matrix(pose: &Pose, rows: usize) -> Vec<f64> {
    let m = pose.matrix();
    (0..4 * rows).map(|at| m[(at / 4, at % 4)]).collect()
}

fn matrices(lead: impl Fn(usize) -> String, rows: usize, separator: &str) -> String {
    let poses = truth().into_iter().enumerate();
    poses
        .map(|(index, pose)| format!("{}{}\n", lead(index), join(&matrix(&pose, rows), separator)))
        .collect()
}

#[track_caller]
fn read(text: &str) -> Trajectory {
    read_with(text, &LoadOptions::default())
}

#[track_caller]
fn read_with(text: &str, options: &LoadOptions) -> Trajectory {
    match load_bytes("log.txt", text.as_bytes(), options) {
        Ok(log) => log,
        Err(error) => panic!("{error}\n{}", &text[..text.len().min(300)]),
    }
}

fn refuse(text: &str, words: &[&str], option: Option<ReadOption>) {
    let error = load_bytes("log.txt", text.as_bytes(), &LoadOptions::default()).unwrap_err();
    for word in words {
        assert!(error.to_string().contains(word), "no `{word}` in {error}");
    }
    assert_eq!(error.read_option(), option, "{error}");
}

#[track_caller]
fn refuse_bytes(name: &str, bytes: &[u8], words: &[&str]) {
    let error = load_bytes(name, bytes, &LoadOptions::default()).unwrap_err();
    for word in words {
        assert!(error.to_string().contains(word), "no `{word}` in {error}");
    }
}

/// All poses of the truth, and the stamps 0.1 s apart.
#[track_caller]
fn check(log: &Trajectory) {
    check_poses(log, &(0..POSES).collect::<Vec<_>>());
}

#[track_caller]
fn check_poses(log: &Trajectory, kept: &[usize]) {
    let truth = truth();
    assert_eq!(log.len(), kept.len(), "{:?}", log.report);
    for (pose, index) in log.poses.iter().zip(kept) {
        let off = truth[*index].inverse().compose(pose);
        let angle = so3::log(&off.rotation).norm();
        assert!(
            angle < 3e-5 && off.translation.norm() < 3e-5,
            "pose {index}: {angle} {}",
            off.translation.norm()
        );
    }
    for (stamp, index) in log.stamps.iter().zip(kept) {
        let expected = (*index - kept[0]) as i64 * 100_000_000;
        assert!((stamp - log.stamps[0] - expected).abs() <= 1, "{stamp}");
    }
}

#[track_caller]
fn remarked(log: &Trajectory, kind: RemarkKind) -> &str {
    let found = log.report.remarks.iter().find(|remark| remark.kind == kind);
    &found
        .unwrap_or_else(|| panic!("no {kind:?} in {:?}", log.report.remarks))
        .text
}

#[test]
fn the_header_decides_the_order_of_the_quaternion() {
    let comment = "# timestamp tx ty tz qw qx qy qz\n".to_owned();
    let log = read(&(comment + &tum(epoch, " ", true)));
    check(&log);
    assert_eq!(
        (log.format, log.rows[0], log.row_kind),
        (Format::Tum, 2, RowKind::Line)
    );
    assert_eq!(log.stamp_in_file(1).as_deref(), Some("1600000000.1"));
    for header in [
        "timestamp,tx,ty,tz,qx,qy,qz,qw\n",
        "num_sec,x,y,z,qx,qy,qz,qw\n#\n",
        "#timestamp [s],p_RS_R_x [m],p_RS_R_y [m],p_RS_R_z [m],q_RS_x [],q_RS_y [],q_RS_z [],q_RS_w []\n",
    ] {
        let header = header.replace("num_sec", "t");
        check(&read(&(header + &tum(epoch, ",", false))));
    }
    // A header without a mark, blanks between.
    let log = read(&("timestamp tx ty tz qx qy qz qw\n".to_owned() + &tum(epoch, " ", false)));
    check(&log);
}

#[test]
fn without_a_header_the_motion_decides_the_order_and_the_report_says_so() {
    let nanoseconds =
        |index: usize| (1_600_000_000_000_000_000 + index as u64 * 100_000_000).to_string();
    for w_first in [true, false] {
        for separator in [",", ";", "\t"] {
            let log = read(&tum(nanoseconds, separator, w_first));
            check(&log);
            let order = if w_first { "w, x, y, z" } else { "x, y, z, w" };
            assert!(remarked(&log, RemarkKind::QuaternionOrder).contains(order));
        }
        // The habit of a TUM file is overruled only by a motion that leaves no doubt, and not in silence.
        let log = read(&tum(epoch, " ", w_first));
        check(&log);
        let said = log
            .report
            .remarks
            .iter()
            .any(|remark| remark.kind == RemarkKind::QuaternionOrder);
        assert_eq!(said, w_first);
    }
    // A body that moves straight on tells nothing: the habit, and a remark.
    let straight = |separator: &str| -> String {
        (0..POSES)
            .map(|i| {
                [
                    nanoseconds(i),
                    join(&[i as f64, 0.0, 0.0, 0.5, 0.5, 0.5, 0.5], separator),
                ]
                .join(separator)
                    + "\n"
            })
            .collect()
    };
    assert!(remarked(&read(&straight(",")), RemarkKind::QuaternionOrder).contains("habit"));
    // The user's word is the last one.
    let options = LoadOptions {
        columns: Some("1,2,3,4,8,5,6,7".parse().unwrap()),
        ..LoadOptions::default()
    };
    check(&read_with(&tum(nanoseconds, ",", false), &options));
}

#[test]
fn stamps_have_the_unit_of_the_header_or_of_their_size() {
    let scaled =
        |first: u64, step: u64| move |index: usize| (first + index as u64 * step).to_string();
    for (text, unit) in [
        (
            tum(scaled(1_600_000_000_000_000_000, 100_000_000), " ", false),
            "nanoseconds",
        ),
        (
            tum(
                |i| {
                    format!(
                        "{}.000000",
                        1_600_000_000_000_000_000 + i as u64 * 100_000_000
                    )
                },
                " ",
                false,
            ),
            "nanoseconds",
        ),
        (
            tum(scaled(1_600_000_000_000_000, 100_000), " ", false),
            "microseconds",
        ),
        (tum(scaled(0, 100), " ", false), "milliseconds"),
        (
            "#timestamp [us],p_x [m],p_y [m],p_z [m],q_w,q_x,q_y,q_z\n".to_owned()
                + &tum(scaled(1_600_000_000_000_000, 100_000), ",", true),
            "microseconds",
        ),
        (
            "stamp_ms,px,py,pz,qw,qx,qy,qz\n".to_owned() + &tum(scaled(5000, 100), ",", true),
            "milliseconds",
        ),
    ] {
        let log = read(&text);
        check(&log);
        assert!(
            remarked(&log, RemarkKind::StampUnit).contains(unit),
            "{:?}",
            log.report.remarks
        );
    }
    // An index is none; the rate makes it right.
    let index = tum(|i| i.to_string(), " ", false);
    let log = read(&index);
    assert_eq!(log.rate.hertz, 1.0);
    let remark = log
        .report
        .remarks
        .iter()
        .find(|remark| remark.kind == RemarkKind::StampsAreAnIndex);
    assert_eq!(
        remark.and_then(|remark| remark.option),
        Some(ReadOption::Rate)
    );
    let options = LoadOptions {
        rate: Some(10.0),
        ..LoadOptions::default()
    };
    let log = read_with(&index, &options);
    check(&log);
    assert_eq!(log.rate.source, RateSource::Given);
    // ... and the unit, said, is obeyed.
    let options = LoadOptions {
        stamp_unit: Some("ms".parse().unwrap()),
        ..LoadOptions::default()
    };
    check(&read_with(
        &tum(|i| (100 * i).to_string(), " ", false),
        &options,
    ));
    assert_eq!(read_with(&index, &options).rate.hertz, 1000.0);
}

#[test]
fn shared_stamps_are_named_and_a_rate_replaces_them() {
    let constant = tum(|_| "1600000000.000000".to_owned(), " ", false);
    refuse(
        &constant,
        &["1600000000 s on all 24 rows", "32-bit"],
        Some(ReadOption::Rate),
    );
    let whole = tum(|i| (1_600_000_000 + i / 10).to_string(), " ", false);
    refuse(
        &whole,
        &["24 rows with 3 stamps", "lost their decimals"],
        Some(ReadOption::Rate),
    );
    let options = LoadOptions {
        rate: Some(10.0),
        ..LoadOptions::default()
    };
    check(&read_with(&constant, &options));
    check(&read_with(&whole, &options));
    // A first stamp that was never filled in.
    let log = read(&tum(
        |i| {
            if i == 0 {
                "0.000000".to_owned()
            } else {
                epoch(i)
            }
        },
        " ",
        false,
    ));
    check_poses(&log, &(1..POSES).collect::<Vec<_>>());
    assert!(remarked(&log, RemarkKind::OutlierStamp).contains("line 1 has the stamp 0 s"));
}
