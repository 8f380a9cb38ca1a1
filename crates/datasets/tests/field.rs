//! What real logs look like beyond the data sets: each kind is read to the right poses, stamps and rows, and what was
//! assumed is said.

mod common;

use std::fmt::Write as _;

use dose3_datasets::{
    Format, LoadOptions, LostKind, RateSource, ReadOption, RemarkKind, RowKind, Trajectory,
    load_bytes,
};
use dose3_lie::{Pose, Rotation, Vector, so3};

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

#[test]
fn matrices_may_have_a_stamp_an_index_or_a_last_row() {
    let log = read(&matrices(|_| String::new(), 3, " "));
    check(&log);
    assert_eq!(
        (log.format, log.rate.source),
        (Format::Kitti, RateSource::Nominal)
    );
    let log = read(&("# by my tracker\n".to_owned() + &matrices(|i| format!("{} ", i), 3, " ")));
    check(&log);
    assert_eq!((log.format, log.rows[5]), (Format::Kitti, 7));
    let log = read(&matrices(
        |i| format!("{} ", 1_600_000_000_000_000 + i as u64 * 100_000),
        3,
        " ",
    ));
    check(&log);
    assert_eq!(
        (log.format, log.rate.source),
        (Format::Matrix, RateSource::Stamps)
    );
    check(&read(&matrices(
        |i| format!("{},", 1_600_000_000_000_000_000 + i as u64 * 100_000_000),
        3,
        ",",
    )));
    check(&read(&matrices(|i| format!("{} ", epoch(i)), 4, " ")));
    let log = read(&matrices(|_| String::new(), 4, " "));
    check(&log);
    assert_eq!(
        (log.format, log.rate.source),
        (Format::Matrix, RateSource::Unknown)
    );
    assert!(remarked(&log, RemarkKind::UnknownRate).contains("body's axes"));
    // Column by column.
    let by_column: String = truth()
        .iter()
        .map(|pose| join(pose.matrix().as_slice(), " ") + "\n")
        .collect();
    let log = read(&by_column);
    check(&log);
    assert!(remarked(&log, RemarkKind::Columns).contains("column by column"));
    // A frame that is missing leaves its place empty.
    let index = matrices(|i| format!("{} ", i), 3, " ");
    let without: String = index
        .lines()
        .enumerate()
        .filter(|(i, _)| *i != 4)
        .map(|(_, line)| format!("{line}\n"))
        .collect();
    check_poses(
        &read(&without),
        &(0..POSES).filter(|i| *i != 4).collect::<Vec<_>>(),
    );
    // Three decimals are coarse, and enough.
    let coarse: String = truth()
        .iter()
        .map(|pose| {
            matrix(pose, 3)
                .iter()
                .map(|v| format!("{v:.3}"))
                .collect::<Vec<_>>()
                .join(" ")
                + "\n"
        })
        .collect();
    let log = read(&coarse);
    assert!(
        log.poses
            .iter()
            .zip(truth())
            .all(|(a, b)| (a.rotation.matrix() - b.rotation.matrix()).amax() < 2e-3)
    );
    assert!(remarked(&log, RemarkKind::Encoding).contains("3 decimals"));
}

#[test]
fn tables_of_many_tools() {
    let ns = |index: usize| 1_600_000_000_000_000_000 + index as u64 * 100_000_000;
    let pose = |p: &[f64; 3], [w, x, y, z]: [f64; 4]| {
        format!("{},{}", join(p, ","), join(&[x, y, z, w], ","))
    };
    let echo = "%time,field.header.seq,field.header.stamp,field.header.frame_id,field.pose.position.x,field.pose.position.y,field.pose.position.z,field.pose.orientation.x,field.pose.orientation.y,field.pose.orientation.z,field.pose.orientation.w\n".to_owned();
    // The time of recording is not the stamp.
    check(&read(
        &(echo + &lines(|i, p, q| format!("{},{i},{},map,{}", ns(2 * i) + 7, ns(i), pose(&p, q)))),
    ));
    let airsim =
        "VehicleName\tTimeStamp\tPOS_X\tPOS_Y\tPOS_Z\tQ_W\tQ_X\tQ_Y\tQ_Z\tImageFile\n".to_owned();
    check(&read(
        &(airsim
            + &lines(|i, p, q| {
                format!(
                    "Car\t{}\t{}\t{}\timg_{i}.png",
                    ns(i) / 1_000_000,
                    join(&p, "\t"),
                    join(&q, "\t")
                )
            })),
    ));
    let pair = "#sec,nsec,x,y,z,qx,qy,qz,qw\n".to_owned();
    let log = read(
        &(pair
            + &lines(|i, p, q| {
                format!(
                    "{},{:09},{}",
                    1_600_000_000 + i / 10,
                    i % 10 * 100_000_000,
                    pose(&p, q)
                )
            })),
    );
    check(&log);
    assert_eq!(log.stamps[1], 1_600_000_000_100_000_000);
    check(&read(&lines(|i, p, q| {
        format!(
            "{},{},map,base_link,{}",
            1_600_000_000 + i / 10,
            i % 10 * 100_000_000,
            pose(&p, q)
        )
    })));
    check(&read(
        &("num,t,x,y,z,qx,qy,qz,qw\n".to_owned()
            + &lines(|i, p, q| format!("{i},{},{}", epoch(i), pose(&p, q)))),
    ));
    // TUM with more columns, with and without their names.
    let more = |index: usize, p: [f64; 3], [w, x, y, z]: [f64; 4]| {
        format!(
            "{} {} {} {}",
            epoch(index),
            join(&p, " "),
            join(&[x, y, z, w], " "),
            index + 1
        )
    };
    check(&read(&lines(more)));
    check(&read(
        &("#timestamp x y z qx qy qz qw id\n".to_owned() + &lines(more)),
    ));
    // Seven columns: no stamp, or no quaternion.
    let log = read(&lines(|_, p, [w, x, y, z]| {
        format!("{} {}", join(&p, " "), join(&[x, y, z, w], " "))
    }));
    check(&log);
    assert_eq!(log.rate.source, RateSource::Unknown);
    let yaw = |index: usize| 0.02 * index as f64;
    let log = read(&lines(|i, p, _| {
        format!(
            "{}, {}, 0.0, 0.0, {:.6}",
            ns(i) / 1000,
            join(&p, ", "),
            yaw(i)
        )
    }));
    check(&log);
    assert!(remarked(&log, RemarkKind::Angles).contains("radians"));
    let heading = "GPSTime,easting,northing,altitude,vel_east,roll,pitch,heading\n".to_owned();
    let log = read(
        &(heading
            + &lines(|i, p, _| {
                format!(
                    "{},{},1.0,0.0,0.0,{:.6}",
                    ns(i) / 1000,
                    join(&p, ","),
                    yaw(i)
                )
            })),
    );
    check(&log);
    let degrees = "time,x,y,z,roll,pitch,yaw\n".to_owned()
        + &lines(|i, p, _| {
            format!(
                "{},{},0.0,0.0,{:.6}",
                epoch(i),
                join(&p, ","),
                yaw(i).to_degrees()
            )
        });
    let log = read(&degrees);
    check(&log);
    assert!(remarked(&log, RemarkKind::Angles).contains("degrees"));
    check(&read(&degrees.replace("yaw", "yaw [deg]")));
    // FAST-LIO: 25 columns.
    let zeros = " 0.0000".repeat(18);
    check(&read(&lines(|i, p, _| {
        format!(
            "{:.6} 0.0 0.0 {:.6} {}{zeros}",
            i as f64 * 0.1,
            yaw(i),
            join(&p, " ")
        )
    })));
    // Columns that nobody knows are asked for, and taken.
    let strange = "when,a,b,c,d,e,f,g\n".to_owned()
        + &lines(|i, p, q| format!("{},{}", epoch(i), pose(&p, q)));
    refuse(
        &strange,
        &["these column names were not understood"],
        Some(ReadOption::Columns),
    );
    for columns in [
        "when,a,b,c,g,d,e,f",
        "1,2,3,4,8,5,6,7",
        "t=when,x=a,y=b,z=c,qx=d,qy=e,qz=f,qw=8",
    ] {
        let options = LoadOptions {
            columns: Some(columns.parse().unwrap()),
            ..LoadOptions::default()
        };
        check(&read_with(&strange, &options));
    }
}

#[test]
fn lost_tracking_is_a_gap_that_is_counted_and_located() {
    let plain = tum(epoch, " ", false);
    for (word, kind) in [
        ("nan nan nan nan nan nan nan", LostKind::Nan),
        ("0 0 0 0 0 0 0", LostKind::Zero),
        ("0 0 0 0 0 0 1", LostKind::Identity),
        ("-nan(ind) 1.#IND inf 0 0 0 1", LostKind::Nan),
    ] {
        let text: String = plain
            .lines()
            .enumerate()
            .map(|(i, line)| {
                if (10..14).contains(&i) {
                    format!("{} {word}\n", epoch(i))
                } else {
                    format!("{line}\n")
                }
            })
            .collect();
        let log = read(&text);
        let kept: Vec<usize> = (0..10).chain(14..POSES).collect();
        check_poses(&log, &kept);
        let [span] = log.report.lost[..] else {
            panic!("{:?}", log.report.lost)
        };
        assert_eq!(
            (
                span.kind,
                span.first_row,
                span.last_row,
                span.rows,
                span.before
            ),
            (kind, 11, 14, 4, 10)
        );
        assert_eq!(span.first_stamp, Some(1_600_000_001_000_000_000));
        assert_eq!(log.breaks, [10]);
        assert!(log.report.lines()[0].contains("rows 11 to 14"));
        assert!(!log.report.is_clean());
        let strict = LoadOptions {
            strict: true,
            ..LoadOptions::default()
        };
        let error = load_bytes("log", text.as_bytes(), &strict).unwrap_err();
        assert!(error.to_string().contains(":11: "), "{error}");
    }
    // Standing at the start is not lost, and neither is what the user does not call so.
    check(&read(&plain));
    let identities = plain.replace("1600000001.200000 ", "1600000001.200000 0 0 0 0 0 0 1 #");
    let identities: String = identities
        .lines()
        .map(|line| line.split(" #").next().unwrap_or_default().to_owned() + "\n")
        .collect();
    let only = LoadOptions {
        lost: vec![LostKind::Nan],
        ..LoadOptions::default()
    };
    assert_eq!(read_with(&identities, &only).len(), POSES);
    let named = LoadOptions {
        lost: vec![LostKind::Identity],
        ..LoadOptions::default()
    };
    assert_eq!(read_with(&identities, &named).len(), POSES - 2);
}

#[test]
fn a_row_cut_in_its_last_number_is_dropped() {
    let text = matrices(|_| String::new(), 3, " ").replace("0.000000\n", "12.500000\n");
    let cut = text.trim_end().strip_suffix("00000").unwrap();
    let log = read(cut);
    assert_eq!((log.len(), log.report.truncated_tail), (POSES - 1, 1));
    assert_eq!(read(text.trim_end()).len(), POSES);
}

#[test]
fn numbers_and_text_written_in_other_ways() {
    let plain = tum(epoch, " ", false);
    let fortran = plain.lines().map(|line| {
        let (stamp, rest) = line.split_once(' ').unwrap();
        let numbers: Vec<String> = rest.split(' ').map(|n| format!("{n}D+00")).collect();
        format!("{stamp} {}\n", numbers.join(" "))
    });
    let fortran: String = fortran.collect();
    for text in [fortran, plain.replace('.', ","), plain.replace('\n', "\r")] {
        let log = read(&text);
        check(&log);
        remarked(&log, RemarkKind::Encoding);
    }
    let utf16: Vec<u8> = plain.encode_utf16().flat_map(u16::to_le_bytes).collect();
    check(&load_bytes("a.tum", &utf16, &LoadOptions::default()).unwrap());
    let latin: Vec<u8> = [b"# Winkel in \xb0\n", plain.as_bytes()].concat();
    check(&load_bytes("a.tum", &latin, &LoadOptions::default()).unwrap());
}

#[test]
fn what_is_implausible_is_remarked() {
    let fast = tum(|i| format!("1600000000.{:06}", i * 100), " ", false);
    remarked(&read(&fast), RemarkKind::ImplausibleRate);
    remarked(&read(&fast), RemarkKind::ImplausibleSpeed);
    let fixed = lines(|i, p, _| format!("{} {} 0 0 0 1", epoch(i), join(&p, " ")));
    remarked(&read(&fixed), RemarkKind::ConstantOrientation);
    let degrees = "timestamp,northing,easting,down,roll,pitch,yaw\n".to_owned()
        + &lines(|i, p, _| {
            format!(
                "{},{},1.2,-0.8,{:.5}",
                1_600_000_000_000_000 + i as u64 * 100_000,
                join(&p, ","),
                (0.02 * i as f64).to_degrees() / 5.0
            )
        });
    remarked(&read(&degrees), RemarkKind::ImplausibleAttitude);
    assert!(read(&tum(epoch, " ", false)).report.remarks.is_empty());
}

#[test]
fn graphs_images_and_renderings() {
    let vertices = lines(|i, p, [w, x, y, z]| {
        format!(
            "VERTEX_SE3:QUAT {i} {} {}",
            join(&p, " "),
            join(&[x, y, z, w], " ")
        )
    });
    let log = read(
        &(vertices.clone()
            + "EDGE_SE3:QUAT 0 1 1 0 0 0 0 0 1 1 0 0 0 0 0 1 0 0 0 0 1 0 0 0 1 0 0 1 0 1\n"),
    );
    check(&log);
    assert_eq!(
        (log.format, log.rate.source),
        (Format::G2o, RateSource::Unknown)
    );
    let reversed: String = vertices
        .lines()
        .rev()
        .map(|line| format!("{line}\n"))
        .collect();
    check(&read(&reversed));
    let planar = lines(|i, p, _| {
        format!(
            "VERTEX_SE2 {i} {:.6} {:.6} {:.6}",
            p[0],
            p[1],
            0.02 * i as f64
        )
    });
    check(&read(&planar));

    let mut colmap = "# Image list with two lines of data per image:\n#   IMAGE_ID, QW, QX, QY, QZ, TX, TY, TZ, CAMERA_ID, NAME\n#   POINTS2D[] as (X, Y, POINT3D_ID)\n".to_owned();
    // Written in another order than that of the names, points missing in some.
    for index in (0..POSES).rev() {
        let inverse = truth()[index].inverse();
        let half = 0.01 * index as f64;
        let t: [f64; 3] = inverse.translation.into();
        let points = if index % 3 == 0 {
            ""
        } else {
            "1.5 2.5 -1 3.0 4.0 7"
        };
        writeln!(
            colmap,
            "{} {} {} 1 f{index:03}.png\n{points}",
            index + 1,
            join(&[half.cos(), 0.0, 0.0, -half.sin()], " "),
            join(&t, " ")
        )
        .unwrap();
    }
    let log = read(&colmap);
    check(&log);
    assert_eq!(log.format, Format::Colmap);

    let frames: Vec<String> = truth()
        .iter()
        .enumerate()
        .map(|(index, pose)| {
            let rows: Vec<String> = matrix(pose, 4)
                .chunks(4)
                .map(|row| format!("[{}]", join(row, ", ")))
                .collect();
            format!(
                "{{\"file_path\": \"r_{index}.png\", \"transform_matrix\": [{}]}}",
                rows.join(", ")
            )
        })
        .collect();
    let log = read(&format!(
        "{{\"camera_angle_x\": 0.7, \"frames\": [{}]}}",
        frames.join(",\n")
    ));
    check(&log);
    assert_eq!(
        (log.format, log.row_kind),
        (Format::Transforms, RowKind::Record)
    );

    let open3d: String = truth()
        .iter()
        .enumerate()
        .map(|(index, pose)| {
            let rows: Vec<String> = matrix(pose, 4)
                .chunks(4)
                .map(|row| join(row, " "))
                .collect();
            format!("{index} {index} {}\n{}\n", index + 1, rows.join("\n"))
        })
        .collect();
    let log = read(&open3d);
    check(&log);
    assert_eq!((log.format, log.rows[1]), (Format::Open3d, 1));
    // A frame that is missing leaves its place in time empty.
    let kept: Vec<usize> = (0..POSES).filter(|index| *index != 17).collect();
    let lines: Vec<&str> = open3d.lines().collect();
    let without = lines
        .chunks(5)
        .enumerate()
        .filter(|(index, _)| *index != 17);
    let without: Vec<String> = without.map(|(_, block)| block.join("\n")).collect();
    let log = read(&without.join("\n"));
    check_poses(&log, &kept);
    assert_eq!(log.report.missing_frames, 1);
    let frames: Vec<String> = kept.iter().map(|index| frames[*index].clone()).collect();
    check_poses(
        &read(&format!("{{\"frames\": [{}]}}", frames.join(",\n"))),
        &kept,
    );
}

#[test]
fn arrays_of_every_shape() {
    let array = |shape: &[u64], values: Vec<f64>| {
        use npyz::WriterBuilder;
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
    };
    let n = POSES as u64;
    let flat = |rows: usize| {
        truth()
            .iter()
            .flat_map(|pose| matrix(pose, rows))
            .collect::<Vec<f64>>()
    };
    let seven = || {
        rows()
            .into_iter()
            .flat_map(|(p, [w, x, y, z])| [p[0], p[1], p[2], x, y, z, w])
    };
    let eight = rows()
        .into_iter()
        .enumerate()
        .flat_map(|(i, (p, [w, x, y, z]))| [1.6e9 + i as f64 / 10.0, p[0], p[1], p[2], x, y, z, w]);
    for (shape, values) in [
        (vec![n, 4, 4], flat(4)),
        (vec![n, 3, 4], flat(3)),
        (vec![n, 12], flat(3)),
        (vec![n, 16], flat(4)),
        (vec![n, 7], seven().collect()),
    ] {
        let log = load_bytes("a.npy", &array(&shape, values), &LoadOptions::default()).unwrap();
        check(&log);
        assert_eq!(
            (log.format, log.row_kind, log.rows[0]),
            (Format::Npy, RowKind::Record, 0),
            "{shape:?}"
        );
        assert_eq!(log.rate.source, RateSource::Unknown, "{shape:?}");
    }
    let log = load_bytes(
        "a.npy",
        &array(&[n, 8], eight.collect()),
        &LoadOptions::default(),
    )
    .unwrap();
    assert_eq!((log.len(), log.rate.source), (POSES, RateSource::Stamps));
    let mut broken = flat(4);
    broken[17 * 16 + 3] = f64::NAN;
    let bytes = array(&[n, 4, 4], broken);
    let log = load_bytes("a.npy", &bytes, &LoadOptions::default()).unwrap();
    assert_eq!(log.report.lost[0].first_row, 17);
    let strict = LoadOptions {
        strict: true,
        ..LoadOptions::default()
    };
    let error = load_bytes("a.npy", &bytes, &strict)
        .unwrap_err()
        .to_string();
    assert!(error.contains("pose 17"), "{error}");
}

#[test]
fn packed_files_are_unpacked_and_bombs_refused() {
    use std::io::Write as _;
    let plain = tum(epoch, " ", false);
    let mut gzip = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::default());
    gzip.write_all(plain.as_bytes()).unwrap();
    let gzip = gzip.finish().unwrap();
    let log = load_bytes("07.txt.gz", &gzip, &LoadOptions::default()).unwrap();
    check(&log);
    assert_eq!(log.name, "07");
    let zstd = ruzstd::encoding::compress_to_vec(
        plain.as_bytes(),
        ruzstd::encoding::CompressionLevel::Fastest,
    );
    check(&load_bytes("07.txt.zst", &zstd, &LoadOptions::default()).unwrap());
    // Two frames, one after the other.
    let (first, second) = plain.split_at(plain.find("1600000001").unwrap());
    let pack = |text: &str| {
        ruzstd::encoding::compress_to_vec(
            text.as_bytes(),
            ruzstd::encoding::CompressionLevel::Fastest,
        )
    };
    let both = [pack(first), pack(second)].concat();
    check(&load_bytes("a.zst", &both, &LoadOptions::default()).unwrap());
    for cut in [gzip.len() / 2, 11] {
        let error = load_bytes("a.gz", &gzip[..cut], &LoadOptions::default())
            .unwrap_err()
            .to_string();
        assert!(error.contains("cut off or damaged"), "{error}");
    }
    // A frame of a thousand blocks that each repeat one byte 128 Ki times.
    let mut bomb = vec![0x28, 0xb5, 0x2f, 0xfd, 0x00, 0x58];
    for index in 0..1000_u32 {
        let header = (131_072 << 3) | (1 << 1) | u32::from(index == 999);
        bomb.extend(&header.to_le_bytes()[..3]);
        bomb.push(b'0');
    }
    let error = load_bytes("bomb.zst", &bomb, &LoadOptions::default())
        .unwrap_err()
        .to_string();
    assert!(error.contains("more than 64 MiB"), "{error}");
}
