//! JSON of many shapes.

use super::*;

/// A list of records, each made from its index, position and quaternion w, x, y, z.
fn list(record: impl Fn(usize, [f64; 3], [f64; 4]) -> String) -> String {
    let rows = rows().into_iter().enumerate();
    let records: Vec<String> = rows.map(|(i, (p, q))| record(i, p, q)).collect();
    format!("[{}]", records.join(",\n"))
}

fn numbers(numbers: &[f64]) -> String {
    format!("[{}]", join(numbers, ", "))
}

fn xyzw([w, x, y, z]: [f64; 4]) -> String {
    numbers(&[x, y, z, w])
}

fn nested(pose: &Pose, rows: usize) -> String {
    let rows: Vec<String> = matrix(pose, rows).chunks(4).map(numbers).collect();
    format!("[{}]", rows.join(","))
}

#[track_caller]
fn check_json(text: &str) -> Trajectory {
    let log = read(text);
    check(&log);
    assert_eq!((log.format, log.row_kind), (Format::Json, RowKind::Record));
    assert_eq!((log.rows[0], log.rows[5]), (0, 5));
    log
}

#[test]
fn lines_that_watch_reads_are_a_log() {
    let watch = lines(|i, p, q| {
        format!(
            "{{\"stamp\": {}, \"position\": {}, \"orientation\": {}}}",
            epoch(i),
            numbers(&p),
            xyzw(q)
        )
    });
    let log = read(&watch);
    check(&log);
    assert_eq!((log.format, log.row_kind), (Format::Json, RowKind::Line));
    assert_eq!((log.rows[0], log.rows[5]), (1, 6));
    // A line that is cut off is counted, one that is damaged is named, blank ones count as lines.
    let cut = &watch[..watch.len() - 30];
    let log = read(cut);
    check_poses(&log, &(0..POSES - 1).collect::<Vec<_>>());
    assert_eq!(log.report.truncated_tail, 1);
    refuse(
        &watch.replacen(&epoch(4), "x", 1),
        &["log.txt:5", "JSON"],
        None,
    );
    let lost = watch.replacen(&epoch(4), &format!("\n{}", epoch(4)), 1);
    assert!(load_bytes("log.txt", lost.as_bytes(), &LoadOptions::default()).is_err());
    let log = read(&format!("\n{}", watch.replacen("0.800000", "NaN", 1)));
    assert_eq!(log.report.lost_rows(), 1);
    assert_eq!(log.report.lost[0].first_row, 3);
}

#[test]
fn objects_within_objects() {
    let text = list(|i, [x, y, z], [w, a, b, c]| {
        format!(
            "{{\"header\": {{\"stamp\": {{\"sec\": {}, \"nanosec\": {}}}}}, \"pose\": {{\"position\": {{\"x\": {x}, \"y\": {y}, \"z\": {z}}}, \"orientation\": {{\"x\": {a}, \"y\": {b}, \"z\": {c}, \"w\": {w}}}}}, \"twist\": {{\"linear\": {{\"x\": 8}}}}}}",
            1_600_000_000 + i / 10,
            100_000_000 * (i % 10)
        )
    });
    let log = check_json(&text);
    assert_eq!(log.stamps[0], 1_600_000_000_000_000_000);
    let said = remarked(&log, RemarkKind::Columns);
    assert!(said.contains("`pose.position.x`"), "{said}");
    // Below names, and with the stamp in another unit.
    let text = list(|i, [x, y, z], _| {
        format!(
            "{{\"time_ms\": {}, \"x\": {x}, \"y\": {y}, \"z\": {z}, \"rpy\": [0, 0, {}]}}",
            100 * i,
            0.02 * i as f64
        )
    });
    check_json(&format!(
        "{{\"meta\": {{\"n\": 3}}, \"data\": {{\"track\": {text}}}}}"
    ));
}

#[test]
fn quaternions_in_lists() {
    // nuScenes has w first; of others the motion tells.
    let nuscenes = |token: &str| {
        list(|i, p, q| {
            format!(
                "{{{token}\"timestamp\": {}, \"rotation\": {}, \"translation\": {}}}",
                1_600_000_000_000_000_u64 + 100_000 * i as u64,
                numbers(&q),
                numbers(&p)
            )
        })
    };
    let log = check_json(&nuscenes("\"token\": \"ab\", "));
    assert_eq!(log.stamps[0], 1_600_000_000_000_000_000);
    let log = check_json(&nuscenes(""));
    let said = remarked(&log, RemarkKind::QuaternionOrder);
    assert!(said.contains("as w, x, y, z"), "{said}");
    check_json(&list(|i, p, q| {
        format!(
            "{{\"t\": \"{}\", \"pos\": {}, \"quat_xyzw\": {}}}",
            epoch(i),
            numbers(&p),
            xyzw(q)
        )
    }));
    check_json(&list(|i, p, q| {
        format!("{{\"t\": {}, \"pose\": {}}}", epoch(i), {
            let [w, x, y, z] = q;
            numbers(&[p[0], p[1], p[2], x, y, z, w])
        })
    }));
}

#[test]
fn matrices_in_lists() {
    let poses = truth();
    let plain: Vec<String> = poses.iter().map(|pose| nested(pose, 4)).collect();
    let log = check_json(&format!("[{}]", plain.join(",")));
    assert_eq!(log.rate.source, RateSource::Unknown);
    check_json(&format!("{{\"poses\": [{}]}}", plain.join(",")));
    let stamped = |rows: usize| {
        list(|i, _, _| {
            format!(
                "{{\"timestamp\": {}, \"transform\": {}}}",
                epoch(i),
                nested(&poses[i], rows)
            )
        })
    };
    assert_eq!(check_json(&stamped(4)).rate.source, RateSource::Stamps);
    check_json(&stamped(3));
    // By columns, as ARKit has them.
    check_json(&list(|i, _, _| {
        let m = poses[i].matrix();
        let numbers: Vec<f64> = (0..16).map(|at| m[(at % 4, at / 4)]).collect();
        format!(
            "{{\"t\": {}, \"transform\": {}}}",
            epoch(i),
            self::numbers(&numbers)
        )
    }));
    // Rotation and position apart, as viewers of splats have them.
    check_json(&list(|i, p, _| {
        let m = poses[i].rotation.matrix().to_owned();
        let rows: Vec<String> = (0..3)
            .map(|row| numbers(&[m[(row, 0)], m[(row, 1)], m[(row, 2)]]))
            .collect();
        format!(
            "{{\"id\": {i}, \"width\": 640, \"position\": {}, \"rotation\": [{}]}}",
            numbers(&p),
            rows.join(",")
        )
    }));
}

#[test]
fn lists_side_by_side_and_numbered_records() {
    let column = |of: &dyn Fn(usize, [f64; 3], [f64; 4]) -> String| list(of);
    check_json(&format!(
        "{{\"name\": \"run\", \"timestamps\": {}, \"positions\": {}, \"orientations\": {}}}",
        column(&|i, _, _| epoch(i)),
        column(&|_, p, _| numbers(&p)),
        column(&|_, _, q| xyzw(q))
    ));
    let mut keyed: Vec<String> = (0..POSES)
        .map(|i| format!("\"{i}\": {{\"pose\": {}}}", nested(&truth()[i], 4)))
        .collect();
    keyed.reverse();
    let log = check_json(&format!("{{{}}}", keyed.join(",")));
    assert_eq!(log.rate.source, RateSource::Unknown);
    let keyed: Vec<String> = (0..POSES)
        .map(|i| format!("\"{}\": {{\"pose\": {}}}", epoch(i), nested(&truth()[i], 4)))
        .collect();
    let log = check_json(&format!("{{{}}}", keyed.join(",")));
    assert_eq!(log.stamps[0], 1_600_000_000_000_000_000);
}

#[test]
fn what_is_no_list_of_poses_is_refused() {
    let poses = list(|_, p, q| {
        format!(
            "{{\"position\": {}, \"orientation\": {}}}",
            numbers(&p),
            xyzw(q)
        )
    });
    let two = format!("{{\"a\": {poses}, \"b\": {{\"c\": {poses}}}}}");
    refuse(&two, &["2 lists of poses: a, b.c"], Some(ReadOption::Topic));
    let options = LoadOptions {
        topics: vec!["b.c".to_owned()],
        ..LoadOptions::default()
    };
    check(&read_with(&two, &options));
    let columns = Some(ReadOption::Columns);
    refuse("{\"a\": 3}", &["no list of records"], columns);
    refuse("[{\"u\": 1}, {\"u\": 2}]", &["the names `u`"], columns);
    refuse("[1, 2, 3]", &["no list of records"], columns);
    // Seven numbers that are no position and quaternion are not taken for one.
    refuse(
        "[{\"pose\": [1,2,3,4,5,6,7]}, {\"pose\": [1,2,3,4,5,6,7]}]",
        &["the names `pose`"],
        columns,
    );
    refuse(&poses[..poses.len() - 9], &["JSON", "EOF"], None);
    refuse("[INFO] start\n[INFO] end\n", &["JSON"], None);
    // A record without its numbers is lost tracking, as in a table.
    let lost = poses.replacen("\"position\"", "\"u\"", 2);
    let log = read(&lost);
    assert_eq!((log.len(), log.report.lost_rows()), (POSES - 2, 2));
    // Other names are said by the user.
    let odd = list(|i, [x, y, z], [w, a, b, c]| {
        format!(
            "{{\"k\": {}, \"u\": [{x}, {y}, {z}], \"v\": [{w}, {a}, {b}, {c}]}}",
            epoch(i)
        )
    });
    refuse(&odd, &["the names `k, u, v`"], columns);
    let options = LoadOptions {
        columns: Some(
            "t=k,x=u.0,y=u.1,z=u.2,qw=v.0,qx=v.1,qy=v.2,qz=v.3"
                .parse()
                .unwrap(),
        ),
        ..LoadOptions::default()
    };
    check(&read_with(&odd, &options));
}

#[test]
fn several_bodies_in_a_record_are_told_apart() {
    let elsewhere = |p: [f64; 3]| [p[0] + 7.0, p[1], p[2]];
    let lists = list(|i, p, q| {
        format!(
            "{{\"t\": {}, \"gt\": {{\"pos\": {}, \"orientation\": {}}}, \"est\": {{\"pos\": {}, \"orientation\": {}}}}}",
            epoch(i),
            numbers(&elsewhere(p)),
            xyzw(q),
            numbers(&p),
            xyzw(q)
        )
    });
    let body = |name: &str, p: [f64; 3], [w, x, y, z]: [f64; 4]| {
        let values = [p[0], p[1], p[2], w, x, y, z].into_iter();
        let names = ["x", "y", "z", "qw", "qx", "qy", "qz"].into_iter();
        let fields = names.zip(values);
        let fields = fields.map(|(field, value)| format!("\"{name}_{field}\": {value:.6}"));
        fields.collect::<Vec<_>>().join(", ")
    };
    let flat = list(|i, p, q| {
        let (gt, est) = (body("gt", elsewhere(p), q), body("est", p, q));
        format!("{{\"t\": {}, {gt}, {est}}}", epoch(i))
    });
    for text in [&lists, &flat] {
        refuse(text, &["2 of them", "gt", "est"], Some(ReadOption::Topic));
        let of = |topic: &str| LoadOptions {
            topics: vec![topic.to_owned()],
            ..LoadOptions::default()
        };
        check(&read_with(text, &of("est")));
        assert_eq!(read_with(text, &of("gt")).poses[0].translation.x, 7.0);
        assert!(load_bytes("log.txt", text.as_bytes(), &of("middle")).is_err());
    }
}

#[test]
fn units_in_names_are_obeyed() {
    let yaw = |i: usize| (0.02 * i as f64).to_degrees();
    let log = check_json(&list(|i, p, _| {
        let [x, y, z] = p.map(|value| 100.0 * value);
        format!(
            "{{\"t_ms\": {}, \"x_cm\": {x:.6}, \"y_cm\": {y:.6}, \"z_cm\": {z:.6}, \"roll_deg\": 0.0, \"pitch_deg\": 0.0, \"yaw_deg\": {:.6}}}",
            100 * i,
            yaw(i)
        )
    }));
    assert_eq!(log.report.length_unit, Some(0.01));
    assert!(remarked(&log, RemarkKind::Angles).contains("as the header says"));
}

#[test]
fn objects_of_bop_are_in_millimetres() {
    let objects = |count: usize| {
        let frames = truth().into_iter().enumerate().map(|(i, pose)| {
            let m = matrix(&pose, 3);
            let r: Vec<f64> = m
                .iter()
                .enumerate()
                .filter(|(at, _)| at % 4 != 3)
                .map(|(_, v)| *v)
                .collect();
            let t = [3, 7, 11].map(|at| 1000.0 * m[at]);
            let object = format!(
                "{{\"cam_R_m2c\": {}, \"cam_t_m2c\": {}, \"obj_id\": 5}}",
                numbers(&r),
                numbers(&t)
            );
            format!("\"{i}\": [{}]", vec![object; count].join(", "))
        });
        format!("{{{}}}", frames.collect::<Vec<_>>().join(",\n"))
    };
    let log = check_json(&objects(1));
    assert_eq!(log.report.length_unit, Some(0.001));
    assert!(load_bytes("log.txt", objects(2).as_bytes(), &LoadOptions::default()).is_err());
}
