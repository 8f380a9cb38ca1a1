//! Tables as well-known tools write them.

use super::*;

/// Position, then a quaternion with w last, between commas.
fn w_last(p: [f64; 3], [w, x, y, z]: [f64; 4]) -> String {
    join(&[p[0], p[1], p[2], x, y, z, w], ",")
}

fn nanoseconds(index: usize) -> u64 {
    1_600_000_000_000_000_000 + 100_000_000 * index as u64
}

/// The rotation vector of a pose of the truth.
fn vector(index: usize) -> [f64; 3] {
    so3::log(&truth()[index].rotation).into()
}

#[test]
fn lines_that_end_in_a_separator() {
    // VINS-Mono and VINS-Fusion: eleven numbers and a comma, not the twelve of a matrix.
    let vins = lines(|i, [x, y, z], [w, a, b, c]| {
        let numbers = join(&[x, y, z, w, a, b, c, 8.0, 0.1, 0.0], ",");
        format!("{},{numbers},", nanoseconds(i))
    });
    let log = read(&vins);
    check(&log);
    assert_eq!(log.format, Format::Euroc);
    assert_eq!(log.rows[0], 1);
    // The same with other ends of lines, and below a header that ends so too.
    check(&read(&vins.replace('\n', "\r\n")));
    let tail = lines(|i, p, q| format!("{},{},", epoch(i), w_last(p, q)));
    check(&read(&tail));
    check(&read(&format!("t,x,y,z,qx,qy,qz,qw,\n{tail}")));
    check(&read(&tail.replace(',', ";")));
    // Seven numbers and a comma are a pose without a stamp.
    check(&read(&lines(|_, p, q| w_last(p, q) + ",")));
    check(&read(
        &matrices(|_| String::new(), 3, ",").replace('\n', ",\n"),
    ));
    // A last column that has a name and no value is one.
    let named = lines(|i, p, q| format!("{},{},", epoch(i), w_last(p, q)));
    check(&read(&format!("t,x,y,z,qx,qy,qz,qw,remark\n{named}")));
    let lost = lines(|i, p, [_, x, y, z]| {
        format!("{},{},", epoch(i), join(&[p[0], p[1], p[2], x, y, z], ","))
    });
    let error = load_bytes(
        "log.txt",
        format!("t,x,y,z,qx,qy,qz,qw\n{lost}").as_bytes(),
        &LoadOptions::default(),
    );
    let words = error.unwrap_err().to_string();
    assert!(words.contains("24 rows without a pose"), "{words}");
}

#[test]
fn stamps_that_are_dates() {
    let date = |i: usize| format!("2020-09-13T12:26:4{}.{}", i / 10, i % 10);
    let table = |ends: &str| lines(|i, p, q| format!("{}{ends},{}", date(i), w_last(p, q)));
    for ends in ["Z", "", "+00:00"] {
        for head in ["timestamp,x,y,z,qx,qy,qz,qw\n", ""] {
            let log = read(&format!("{head}{}", table(ends)));
            check(&log);
            assert_eq!(log.stamps[0], 1_600_000_000_000_000_000, "{ends}");
            let said = remarked(&log, RemarkKind::StampUnit);
            assert!(said.contains("dates"), "{said}");
        }
    }
    let log = read(&table("+02:00").replace('T', " "));
    assert_eq!(log.stamps[0], 1_599_992_800_000_000_000);
    // Between blanks, in a TUM file.
    check(&read(&table("Z").replace(',', " ")));
    let wrong = table("Z").replacen("2020-09", "2020-19", 1);
    refuse(
        &format!("timestamp,x,y,z,qx,qy,qz,qw\n{wrong}"),
        &["log.txt:2", "a stamp in seconds", "2020-19-13"],
        None,
    );
}

#[test]
fn tables_of_several_topics() {
    let header = "__time,/odom/header/frame,/odom/pose/pose/orientation/w,/odom/pose/pose/orientation/x,/odom/pose/pose/orientation/y,/odom/pose/pose/orientation/z,/odom/pose/pose/position/x,/odom/pose/pose/position/y,/odom/pose/pose/position/z,/odom/twist/twist/linear/x,/imu/orientation/x,/imu/orientation/y,/imu/orientation/z,/imu/orientation/w";
    let pose = |p: [f64; 3], q: [f64; 4]| join(&[&q[..], &p[..]].concat(), ",");
    // Rows of the IMU between those of the odometry are no lost tracking.
    let table = lines(|i, p, q| {
        format!(
            "{},map,{},8.0,,,,\n{}5,,,,,,,,,,0.5,0.5,0.5,0.5",
            epoch(i),
            pose(p, q),
            epoch(i)
        )
    });
    let log = read(&format!("{header}\n{table}"));
    check(&log);
    assert!(log.report.lost.is_empty(), "{:?}", log.report.lost);
    assert_eq!(log.rows[1], 4);
    // Two topics with poses: one must be chosen, and stamps in its messages are taken before the time of recording.
    let two = "__time,/a/header/stamp,/a/pose/position/x,/a/pose/position/y,/a/pose/position/z,/a/pose/orientation/w,/a/pose/orientation/x,/a/pose/orientation/y,/a/pose/orientation/z,/b/position/x,/b/position/y,/b/position/z,/b/orientation/w,/b/orientation/x,/b/orientation/y,/b/orientation/z";
    let table = lines(|i, p, q| {
        let pose = join(&[&p[..], &q[..]].concat(), ",");
        format!("{}7,{},{pose},9,9,9,1,0,0,0", epoch(i), epoch(i))
    });
    let text = format!("{two}\n{table}");
    refuse(
        &text,
        &["log.txt:1", "/a/pose, /b"],
        Some(ReadOption::Topic),
    );
    let of = |topic: &str| LoadOptions {
        topics: vec![topic.to_owned()],
        ..LoadOptions::default()
    };
    let log = read_with(&text, &of("/a"));
    check(&log);
    assert_eq!(log.stamps[0], 1_600_000_000_000_000_000);
    assert_eq!(read_with(&text, &of("/b")).poses[3].translation.x, 9.0);
    let error = load_bytes("log.txt", text.as_bytes(), &of("/c")).unwrap_err();
    assert!(
        error.to_string().contains("poses of /a/pose, /b"),
        "{error}"
    );
}

#[test]
fn quaternions_and_vectors_under_other_letters() {
    // Unity and ZED.
    for names in ["time;px;py;pz;rx;ry;rz;rw", "time;x;y;z;ox;oy;oz;ow"] {
        let table = lines(|i, p, q| format!("{},{}", epoch(i), w_last(p, q)).replace(',', ";"));
        check(&read(&format!("{names}\n{table}")));
        check(&read(&format!("{names}\n{}", table.replace('.', ","))));
    }
    // Universal Robots, and names that say what they are.
    for names in [
        "timestamp,actual_TCP_pose_0,actual_TCP_pose_1,actual_TCP_pose_2,actual_TCP_pose_3,actual_TCP_pose_4,actual_TCP_pose_5,target_TCP_pose_0",
        "timestamp,x,y,z,rotvec_x,rotvec_y,rotvec_z,other",
    ] {
        let table = lines(|i, p, _| {
            let pose = join(&[&p[..], &vector(i)].concat(), ",");
            format!("{},{pose},7", epoch(i))
        });
        check(&read(&format!("{names}\n{table}")));
    }
    // `rx, ry, rz` alone may be angles too.
    let table = lines(|i, p, _| {
        let pose = join(&[&p[..], &vector(i)].concat(), ",");
        format!("{},{pose}", epoch(i))
    });
    let text = format!("t,x,y,z,rx,ry,rz\n{table}");
    refuse(
        &text,
        &["log.txt:1", "rotation vector or angles"],
        Some(ReadOption::Columns),
    );
    let options = LoadOptions {
        columns: Some("t,x,y,z,rx,ry,rz".parse().unwrap()),
        ..LoadOptions::default()
    };
    check(&read_with(&text, &options));
    refuse(
        "t,X,Y,Z,A,B,C\n1,1,1,1,1,1,1\n",
        &["yaw, pitch and roll"],
        Some(ReadOption::Columns),
    );
    refuse(
        "t,latitude,longitude,altitude,roll,pitch,yaw\n1,1,1,1,1,1,1\n",
        &["are no metres"],
        Some(ReadOption::Columns),
    );
}

#[test]
fn units_of_positions_in_the_header() {
    let table =
        |factor: f64| lines(|i, p, q| format!("{},{}", epoch(i), w_last(p.map(|x| x * factor), q)));
    for (names, factor, unit) in [
        ("t,x [mm],y [mm],z [mm],qx,qy,qz,qw", 1000.0, Some(0.001)),
        ("t,x_mm,y_mm,z_mm,qx,qy,qz,qw", 1000.0, Some(0.001)),
        ("t,x(cm),y(cm),z(cm),qx,qy,qz,qw", 100.0, Some(0.01)),
        ("t,x [m],y [m],z [m],qx,qy,qz,qw", 1.0, None),
        ("t,tx_m,ty_m,tz_m,qx,qy,qz,qw", 1.0, None),
    ] {
        let log = read(&format!("{names}\n{}", table(factor)));
        check(&log);
        assert_eq!(log.report.length_unit, unit, "{names}");
        let said = log.report.remarks.iter();
        let said = said.filter(|remark| remark.kind == RemarkKind::LengthUnit);
        assert_eq!(said.count(), usize::from(unit.is_some()), "{names}");
    }
    refuse(
        &format!("t,x [mm],y [mm],z [m],qx,qy,qz,qw\n{}", table(1.0)),
        &["log.txt:1", "positions in several units"],
        Some(ReadOption::Columns),
    );
}

#[test]
fn tables_of_motive() {
    let table = |units: &str, factor: f64| {
        let head = format!(
            "Format Version,1.23,Take Name,Take 1,Rotation Type,Quaternion,Length Units,{units},Coordinate Space,Global\n\n\
             ,Type,Rigid Body,Rigid Body,Rigid Body,Rigid Body,Rigid Body,Rigid Body,Rigid Body,Rigid Body,Rigid Body Marker\n\
             ,Name,drone,drone,drone,drone,drone,drone,drone,drone,drone:Marker1\n\
             ,ID,1,1,1,1,1,1,1,1,2\n\
             ,,Rotation,Rotation,Rotation,Rotation,Position,Position,Position,Mean Marker Error,Position\n\
             Frame,Time (Seconds),X,Y,Z,W,X,Y,Z,,X\n"
        );
        head + &lines(|i, p, [w, x, y, z]| {
            let pose = [
                x,
                y,
                z,
                w,
                p[0] * factor,
                p[1] * factor,
                p[2] * factor,
                0.01,
                3.0,
            ];
            format!("{i},{:.6},{}", 0.1 * i as f64, join(&pose, ","))
        })
    };
    let text = table("Meters", 1.0);
    let log = read(&text);
    check(&log);
    assert_eq!((log.format, log.rows[0]), (Format::Csv, 8));
    let said = log.report.remarks.iter().map(|remark| remark.text.as_str());
    assert!(said.clone().any(|text| text.contains("rigid body `drone`")));
    check(&read(&format!("\u{feff}{}", text.replace('\n', "\r\n"))));
    check(&read(&table("Millimeters", 1000.0)));
    // A frame in which the body was not seen.
    let row = text.lines().nth(10).unwrap();
    let unseen = text.replace(row, "3,0.300000,,,,,,,,,");
    let log = read(&unseen);
    assert_eq!((log.len(), log.report.lost[0].first_row), (POSES - 1, 11));
    // Several bodies.
    let two = text.replacen(
        "drone,drone,drone,drone,drone,drone,drone,drone",
        "a,a,a,a,a,a,a,b",
        1,
    );
    refuse(
        &two,
        &["log.txt:7", "2 bodies: a, b"],
        Some(ReadOption::Topic),
    );
    let options = LoadOptions {
        topics: vec!["a".to_owned()],
        ..LoadOptions::default()
    };
    check(&read_with(&two, &options));
    refuse(
        &text.replacen("X,Y,Z,W", "X,Y,Z,", 1),
        &["log.txt:7", "Rotation Type Quaternion"],
        None,
    );
    refuse(&text[..200], &["log.txt:1", "begins with Frame"], None);
    refuse(
        "Objects\n100\n,,Global Angle drone,,,,,\nFrame,Sub Frame,RX,RY,RZ,TX,TY,TZ\n",
        &["this looks like Vicon's"],
        Some(ReadOption::Columns),
    );
}
