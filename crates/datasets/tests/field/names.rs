//! Names of columns as tools and people write them.

use super::*;

fn w_last(p: [f64; 3], [w, x, y, z]: [f64; 4]) -> String {
    join(&[p[0], p[1], p[2], x, y, z, w], ",")
}

fn w_first(p: [f64; 3], q: [f64; 4]) -> String {
    join(&[&p[..], &q].concat(), ",")
}

fn yaw(i: usize) -> f64 {
    0.02 * i as f64
}

#[test]
fn words_may_be_joined_by_capitals() {
    let table = lines(|i, p, q| format!("{i},{:.4},{}", 0.1 * i as f64, w_last(p, q)));
    let head = "Frame,Time,HeadPosX,HeadPosY,HeadPosZ,HeadRotX,HeadRotY,HeadRotZ,HeadRotW";
    check(&read(&format!("{head}\n{table}")));
    let head = "frameId,timeStamp,posX,posY,posZ,quatX,quatY,quatZ,quatW";
    check(&read(&format!("{head}\n{table}")));
    // ArduPilot: microseconds; north, east, down.
    let table = lines(|i, p, _| {
        let us = 123_456_789 + 100_000 * i;
        format!(
            "{us},0,0.00,0.00,{:.6},0,0,0,{}",
            yaw(i).to_degrees(),
            join(&p, ",")
        )
    });
    let log = read(&format!(
        "TimeUS,C,Roll,Pitch,Yaw,VN,VE,VD,PN,PE,PD\n{table}"
    ));
    check(&log);
    assert_eq!(log.rate.source, RateSource::Stamps);
}

#[test]
fn the_stamp_is_the_plainest_of_names() {
    let table = lines(|i, p, q| {
        format!(
            "{:.4},{},{}",
            0.01 + 0.001 * i as f64,
            epoch(i),
            w_first(p, q)
        )
    });
    for (other, own) in [
        ("exposure_time", "time"),
        ("deltaTime", "time"),
        ("recv_timestamp", "timestamp"),
        ("rosbagTimestamp", "header.stamp"),
        ("sensor_time", "t"),
    ] {
        check(&read(&format!("{other},{own},x,y,z,qw,qx,qy,qz\n{table}")));
    }
    let table = lines(|i, p, q| format!("{},{}", 100 * i, w_first(p, q)));
    for own in ["time_boot_ms", "sensor_time_ms", "Zeit [ms]", "Temps (ms)"] {
        let log = read(&format!("{own},x,y,z,qw,qx,qy,qz\n{table}"));
        check(&log);
        assert!(
            remarked(&log, RemarkKind::StampUnit).contains("as the header says"),
            "{own}"
        );
    }
    let table = lines(|i, p, q| format!("2123,{:.1},{}", 44_800.0 + 0.1 * i as f64, w_first(p, q)));
    check(&read(&format!("week,tow,x,y,z,qw,qx,qy,qz\n{table}")));
}

#[test]
fn fields_of_more_tools() {
    let ns = |i: usize| 1_600_000_000_000_000_000 + 100_000_000 * i as u64;
    let table = lines(|i, p, q| format!("{},{}", ns(i), w_last(p, q)));
    // OKVIS, Project Aria.
    for head in [
        "timestamp, p_WS_W_x, p_WS_W_y, p_WS_W_z, q_WS_x, q_WS_y, q_WS_z, q_WS_w",
        "tracking_timestamp_ns,tx_world_device,ty_world_device,tz_world_device,qx_world_device,qy_world_device,qz_world_device,qw_world_device",
    ] {
        check(&read(&format!("{head}\n{table}")));
    }
    // The world in the device is no pose of the device.
    let head = "timestamp,tx_device_world,ty_device_world,tz_device_world,qx_device_world,qy_device_world,qz_device_world,qw_device_world";
    refuse(
        &format!("{head}\n{table}"),
        &["position x, y, z"],
        Some(ReadOption::Columns),
    );
    let table = lines(|i, p, q| format!("{},{}", epoch(i), w_first(p, q)));
    for four in ["q0,q1,q2,q3", "qr,qi,qj,qk"] {
        check(&read(&format!("time,x,y,z,{four}\n{table}")));
    }
}

#[test]
fn a_heading_is_clockwise_from_north_where_the_motion_says_so() {
    for (unit, factor) in [
        ("", 180.0 / std::f64::consts::PI),
        ("", 1.0),
        (" [deg]", 180.0 / std::f64::consts::PI),
    ] {
        let table = lines(|i, p, _| {
            let heading = (std::f64::consts::FRAC_PI_2 - yaw(i)) * factor;
            format!("{},{},0.0,0.0,{heading:.9}", epoch(i), join(&p, ","))
        });
        let head = format!("time,easting,northing,altitude,roll,pitch,heading{unit}");
        let log = read(&format!("{head}\n{table}"));
        check(&log);
        let json: Vec<String> = table
            .lines()
            .map(|row| {
                let [t, x, y, z, roll, pitch, heading] = row.split(',').collect::<Vec<_>>()[..] else {
                    panic!("{row}")
                };
                let name = format!("heading{}", unit.replace(" [deg]", "_deg"));
                format!("{{\"t\": {t}, \"x\": {x}, \"y\": {y}, \"z\": {z}, \"roll\": {roll}, \"pitch\": {pitch}, \"{name}\": {heading}}}\n")
            })
            .collect();
        check(&read(&json.concat()));
        // Who says that it is a yaw is obeyed.
        let options = LoadOptions {
            columns: Some("t=1,x=2,y=3,z=4,roll=5,pitch=6,yaw=7".parse().unwrap()),
            ..LoadOptions::default()
        };
        let turned = read_with(&format!("{head}\n{table}"), &options).poses[0].rotation;
        assert!((so3::log(&turned).norm() - std::f64::consts::FRAC_PI_2).abs() < 1e-3);
        let said: Vec<_> = log
            .report
            .remarks
            .iter()
            .filter(|remark| remark.kind == RemarkKind::Angles)
            .collect();
        assert_eq!(said.len(), 2, "{said:?}");
        assert!(said[1].text.contains("is taken as clockwise from north"));
    }
}

#[test]
fn names_that_do_not_tell_are_refused() {
    let table = lines(|i, p, q| format!("{},{},{}", epoch(i), w_first(p, q), w_first(p, q)));
    let fields = "x,y,z,qw,qx,qy,qz";
    refuse(
        &format!("t,{fields},{fields}\n{table}"),
        &["log.txt:1", "each of its names twice"],
        Some(ReadOption::Columns),
    );
    let table = lines(|i, p, _| format!("{},{},0,0,{:.6}", epoch(i), join(&p, ","), yaw(i)));
    check(&read(&format!("t,x,y,z,phi,theta,psi\n{table}")));
    refuse(
        &format!("t,x,y,z,roll [rad],pitch [rad],yaw [deg]\n{table}"),
        &["log.txt:1", "angles in several units"],
        Some(ReadOption::Columns),
    );
    let table = lines(|i, p, q| format!("{}, cam0, {}", i * 50_000, w_first(p, q)));
    let head = "# kapture format: 1.1\n# timestamp, device_id, qw, qx, qy, qz, tx, ty, tz\n";
    refuse(
        &format!("{head}{table}"),
        &["take the world to the sensor", "invert"],
        Some(ReadOption::Format),
    );
}

#[test]
fn whole_seconds_stand_beside_what_is_more() {
    for (names, rate, unit) in [
        ("sec,usec", 1, 1_000),
        ("sec,usec", 10, 1_000),
        ("tv_sec,tv_usec", 10, 1_000),
        ("field.header.stamp.secs,field.header.stamp.nsecs", 10, 1),
        ("seconds,milliseconds", 10, 1_000_000),
    ] {
        let step = 1_000_000_000 / rate;
        let at = |i: usize| 1_600_000_000_700_000_000 + step * i as i64;
        let stamp = |i| (at(i) / 1_000_000_000, at(i) % 1_000_000_000 / unit);
        let table = lines(|i, p, q| {
            let (whole, part) = stamp(i);
            format!("{whole},{part},{}", w_first(p, q))
        });
        let log = read(&format!("{names},x,y,z,qw,qx,qy,qz\n{table}"));
        assert_eq!((log.stamps[0], log.stamps[1]), (at(0), at(1)), "{names}");
        assert_eq!(log.len(), POSES);
        let (a, b) = names.split_once(',').unwrap();
        let records = lines(|i, p, q| {
            let ((whole, part), [w, x, y, z]) = (stamp(i), q);
            format!(
                r#"{{"{a}": {whole}, "{b}": {part}, "position": {p:?}, "rotation_xyzw": {:?}}}"#,
                [x, y, z, w]
            )
        });
        let log = read(&records);
        assert_eq!((log.stamps[0], log.stamps[1]), (at(0), at(1)), "{names}");
    }
    // Alone it is the stamp.
    let table = lines(|i, p, q| format!("{},{}", 123_456_789 + 100_000 * i, w_first(p, q)));
    let log = read(&format!("usec,x,y,z,qw,qx,qy,qz\n{table}"));
    assert_eq!(log.stamps[1] - log.stamps[0], 100_000_000);
    check(&log);
}

#[test]
fn bodies_in_the_plane_have_x_y_and_yaw() {
    let flat = |i: usize| (0.2 * i as f64, 0.01 * (i * i) as f64, 0.03 * i as f64);
    let table = |scale: f64| {
        lines(|i, _, _| {
            let (x, y, yaw) = flat(i);
            format!("{},{x:.6},{y:.6},{:.6}", epoch(i), yaw * scale)
        })
    };
    let check = |log: &Trajectory| {
        assert_eq!(log.len(), POSES);
        for (i, pose) in log.poses.iter().enumerate() {
            let (x, y, yaw) = flat(i);
            assert!((pose.translation - dose3_lie::Vector::new(x, y, 0.0)).norm() < 1e-5);
            let expected = dose3_lie::Rotation::from_euler_angles(0.0, 0.0, yaw);
            assert!((pose.rotation.inverse() * expected).angle() < 1e-5, "{i}");
        }
        let remarks = &log.report.remarks;
        assert!(
            remarks
                .iter()
                .any(|remark| remark.text.contains("in the plane"))
        );
    };
    check(&read(&format!("t,x,y,theta [rad]\n{}", table(1.0))));
    check(&read(&format!(
        "time,pos_x,pos_y,yaw_deg\n{}",
        table(1_f64.to_degrees())
    )));
    check(&read(&format!(
        "stamp,x,y,psi\n{}",
        table(1_f64.to_degrees())
    )));
    let by_number = LoadOptions {
        columns: Some("t=1,x=2,y=3,yaw=4".parse().unwrap()),
        ..LoadOptions::default()
    };
    check(&read_with(&table(1.0), &by_number));
    // Clockwise from north: told by the motion of a body that drives along its first axis.
    let circle = lines(|i, _, _| {
        let yaw = 0.1 * i as f64;
        let heading = (90.0 - yaw.to_degrees()).rem_euclid(360.0);
        format!(
            "{},{:.6},{:.6},{heading:.4}",
            epoch(i),
            9.0 * yaw.sin(),
            -9.0 * yaw.cos()
        )
    });
    let log = read(&format!("time,easting,northing,heading\n{circle}"));
    assert!((log.poses[0].rotation.matrix()[(0, 0)] - 1.0).abs() < 1e-6);
    assert!((log.poses[3].rotation.euler_angles().2 - 0.3).abs() < 1e-6);
    // Neither one angle of another name nor a table without any is a pose.
    for names in [
        "t,x,y,pitch",
        "t,x,y,speed",
        "t,x,y,yaw,alt",
        "t,x,y,yaw,gps_alt",
    ] {
        refuse(
            &format!("{names}\n{}", table(1.0)),
            &["no columns for the position x, y, z"],
            Some(ReadOption::Columns),
        );
    }
}
