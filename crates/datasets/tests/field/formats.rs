//! Tables, matrices, graphs, arrays and packed files.

use super::*;

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
    // TORO.
    let yaw = |i: usize| 0.02 * i as f64;
    let toro = lines(|i, p, _| format!("VERTEX3 {i} {} 0 0 {:.6}", join(&p, " "), yaw(i)));
    check(&read(&format!(
        "{toro}EDGE3 0 1 0.8 0 0 0 0 0.02 1 0 0 0 0 0 1 0 0 0 0 1 0 0 0 1 0 0 1 0 1\n"
    )));
    let toro = lines(|i, p, _| format!("VERTEX2 {i} {:.6} {:.6} {:.6}", p[0], p[1], yaw(i)));
    check(&read(&toro));
    // GTSAM's keys have a letter for each robot in their first byte.
    let keys = |letter: u8, index: usize| (u64::from(letter) << 56) + index as u64;
    let robot = |letter: u8| {
        lines(|i, p, [w, x, y, z]| {
            let pose = join(&[p[0], p[1], p[2], x, y, z, w], " ");
            format!("VERTEX_SE3:QUAT {} {pose}", keys(letter, i))
        })
    };
    check(&read(&robot(b'x')));
    let two = robot(b'a') + &robot(b'b').replace("0.800000 ", "7.800000 ");
    refuse(&two, &["keys of 2: a, b"], Some(ReadOption::Topic));
    let options = LoadOptions {
        topics: vec!["a".to_owned()],
        ..LoadOptions::default()
    };
    check(&read_with(&two, &options));

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
    assert!(error.contains("more than 16 MiB"), "{error}");
}

#[test]
fn folders_of_camera_poses() {
    let root = tempfile::tempdir().unwrap();
    for (folder, name) in [("seq-01", "frame-00000N.pose.txt"), ("pose", "N.txt")] {
        let folder = root.path().join(folder);
        std::fs::create_dir(&folder).unwrap();
        for (index, pose) in truth().iter().take(8).enumerate() {
            let numbers = matrix(pose, 4);
            let lost = ["-inf -inf -inf -inf"; 4].join("\n");
            let rows = numbers
                .chunks(4)
                .map(|row| join(row, " "))
                .collect::<Vec<_>>()
                .join("\n");
            let text = if index == 5 { lost } else { rows };
            std::fs::write(folder.join(name.replace('N', &index.to_string())), text).unwrap();
        }
        std::fs::write(folder.join("frame-000000.color.png"), b"\x89PNG").unwrap();
        let log = dose3_datasets::load(&folder, &LoadOptions::default()).unwrap();
        assert_eq!((log.len(), log.rows[6], log.rate.hertz), (7, 7, 30.0));
        assert_eq!(
            (log.frame, log.report.lost_rows()),
            (dose3_datasets::Frame::CameraRdf, 1)
        );
        let options = LoadOptions {
            rate: Some(10.0),
            ..LoadOptions::default()
        };
        let log = dose3_datasets::load(&folder, &options).unwrap();
        check_poses(&log, &[0, 1, 2, 3, 4, 6, 7]);
    }
}
