//! Tables of several bodies, and of tools that write names, units and quotes in their own ways.

use super::*;

fn w_last(p: [f64; 3], [w, x, y, z]: [f64; 4]) -> String {
    join(&[p[0], p[1], p[2], x, y, z, w], ",")
}

fn of(topic: &str) -> LoadOptions {
    LoadOptions {
        topics: vec![topic.to_owned()],
        ..LoadOptions::default()
    }
}

#[test]
fn words_before_the_names_of_fields_tell_bodies_apart() {
    for head in [
        "sim_time,robot_position_x,robot_position_y,robot_position_z,robot_orientation_x,robot_orientation_y,robot_orientation_z,robot_orientation_w",
        "Time,TCP X,TCP Y,TCP Z,TCP qx,TCP qy,TCP qz,TCP qw",
        "t,drone.x,drone.y,drone.z,drone.qx,drone.qy,drone.qz,drone.qw",
    ] {
        let table = lines(|i, p, q| format!("{},{}", epoch(i), w_last(p, q)));
        let log = read(&format!("{head}\n{table}"));
        check(&log);
        assert_eq!(log.rate.source, RateSource::Stamps, "{head}");
        // An empty row is lost tracking, not one of another body.
        let row = table.lines().nth(9).unwrap();
        let lost = table.replace(row, &format!("{},,,,,,,", epoch(9)));
        let log = read(&format!("{head}\n{lost}"));
        assert_eq!(log.report.lost_rows(), 1, "{head}");
    }
    let fields = |name: &str| {
        ["x", "y", "z", "qx", "qy", "qz", "qw"]
            .map(|field| format!("{name}_{field}"))
            .join(",")
    };
    let elsewhere = |p: [f64; 3]| [p[0] + 7.0, p[1], p[2]];
    for (one, other) in [("left", "right"), ("gt", "est")] {
        let table =
            lines(|i, p, q| format!("{},{},{}", epoch(i), w_last(p, q), w_last(elsewhere(p), q)));
        let text = format!("t,{},{}\n{table}", fields(one), fields(other));
        refuse(
            &text,
            &["log.txt:1", &format!("2 of them: {one}, {other}")],
            Some(ReadOption::Topic),
        );
        check(&read_with(&text, &of(one)));
        assert_eq!(read_with(&text, &of(other)).poses[0].translation.x, 7.0);
        assert!(load_bytes("log.txt", text.as_bytes(), &of("middle")).is_err());
    }
    // Names without a word are the log's own, those with one are something beside it.
    let table =
        lines(|i, p, q| format!("{},{},{}", epoch(i), w_last(p, q), w_last(elsewhere(p), q)));
    check(&read(&format!(
        "t,x,y,z,qx,qy,qz,qw,{}\n{table}",
        fields("gt")
    )));
    let three = lines(|i, p, q| {
        let (own, other) = (w_last(p, q), w_last(elsewhere(p), q));
        format!("{},{own},{other},{other}", epoch(i))
    });
    let head = format!("t,x,y,z,qx,qy,qz,qw,{},{}", fields("gt"), fields("est"));
    check(&read(&format!("{head}\n{three}")));
}

#[test]
fn names_of_arrays_and_names_that_come_twice() {
    // PX4's own tables of its flight logs.
    let table = lines(|i, p, q| {
        format!(
            "{},5,{},1",
            123_456_789 + 100_000 * i,
            join(&[&p[..], &q[..]].concat(), ",")
        )
    });
    let head = "timestamp,timestamp_sample,position[0],position[1],position[2],q[0],q[1],q[2],q[3],pose_frame";
    check(&read(&format!("{head}\n{table}")));
    // A message as columns.
    let table = lines(|i, p, q| {
        let (p, q) = (join(&p, ","), join(&[q[1], q[2], q[3], q[0]], ","));
        format!(
            "{},,{i},\"map, odom\",,,{p},,{q}",
            1_600_000_000_000_000_000_u64 + 100_000_000 * i as u64
        )
    });
    let head = "rosbagTimestamp,header,seq,frame_id,pose,position,x,y,z,orientation,x,y,z,w";
    check(&read(&format!("{head}\n{table}")));
}

#[test]
fn a_line_of_units_and_one_for_excel() {
    let table = lines(|i, p, _| {
        let yaw = (0.02 * i as f64).to_degrees();
        format!(
            "{},{},0,0,{yaw:.9}",
            100 * i,
            join(&p.map(|x| 100.0 * x), ",")
        )
    });
    let log = read(&format!(
        "time,x,y,z,roll,pitch,yaw\n[ms],[cm],[cm],[cm],[deg],[deg],[deg]\n{table}"
    ));
    check(&log);
    assert_eq!((log.rows[0], log.report.length_unit), (3, Some(0.01)));
    check(&read(&format!(
        "time,x,y,z,roll,pitch,yaw\nms,cm,cm,cm,deg,deg,deg\n{table}"
    )));
    // A fault of the header is at its line, one of the data at theirs.
    refuse(
        &format!("time,x,y,zz,roll,pitch,yaw\n[ms],[cm],[cm],[cm],[deg],[deg],[deg]\n{table}"),
        &["log.txt:1:", "position x, y, z"],
        Some(ReadOption::Columns),
    );
    let table = lines(|i, p, q| format!("{},{}", epoch(i), w_last(p, q)).replace(',', ";"));
    check(&read(&format!("sep=;\ntime;x;y;z;qx;qy;qz;qw\n{table}")));
}

#[test]
fn separators_within_quotes_and_empty_first_fields() {
    let table = lines(|i, p, q| format!("\"a, b\",{},{},\"1,5\"", epoch(i), w_last(p, q)));
    check(&read(&format!("frame,t,x,y,z,qx,qy,qz,qw,note\n{table}")));
    // A mark of inches is no quote.
    check(&read(&format!(
        "frame,t,x,y,z,qx,qy,qz,qw,note\n{}",
        table.replace("\"a, b\"", "5\"").replace("\"1,5\"", "1")
    )));
    // AirSim, without the name of the vehicle.
    let table = lines(|i, p, q| {
        format!(
            "\t{}\t{}\timage.png",
            epoch(i),
            join(&[&p[..], &q[..]].concat(), "\t")
        )
    });
    let head = "VehicleName\tTimeStamp\tPOS_X\tPOS_Y\tPOS_Z\tQ_W\tQ_X\tQ_Y\tQ_Z\tImageFile";
    check(&read(&format!("{head}\n{table}")));
    // Lines that begin with a tab for no reason.
    let table = lines(|i, p, q| format!("\t{}\t{}", epoch(i), w_last(p, q).replace(',', "\t")));
    check(&read(&table));
    check(&read(&format!("t\tx\ty\tz\tqx\tqy\tqz\tqw\n{table}")));
}

#[test]
fn numbers_before_the_pose_without_a_header() {
    let blanks = |text: String| text.replace(',', " ");
    let log = read(&lines(|i, p, q| {
        blanks(format!(
            "{} {} {}",
            1_600_000_000 + i / 10,
            100_000_000 * (i % 10),
            w_last(p, q)
        ))
    }));
    check(&log);
    assert_eq!(log.stamps[3], 1_600_000_000_300_000_000);
    check(&read(&lines(|i, p, q| {
        blanks(format!("{i} {} {}", epoch(i), w_last(p, q)))
    })));
    // Quaternion first, as Record3D has it.
    check(&read(&lines(|_, p, [w, x, y, z]| {
        join(&[x, y, z, w, p[0], p[1], p[2]], " ")
    })));
}

#[test]
fn a_header_of_very_many_names_takes_no_time() {
    let names: Vec<String> = (0..20_000).map(|i| format!("b{i}_x")).collect();
    let words = "a_".repeat(60_000);
    for head in [names.join(","), format!("{words}x,{words}y,{words}z")] {
        let row = vec!["1"; head.matches(',').count() + 1].join(",");
        let text = format!("{head}\n{row}\n{row}\n");
        assert!(load_bytes("log.txt", text.as_bytes(), &LoadOptions::default()).is_err());
    }
}
