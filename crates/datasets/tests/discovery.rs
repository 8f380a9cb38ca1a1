//! Finding logs in folders, and naming them.

mod common;

use std::fs;
use std::path::{Path, PathBuf};

use common::{drive, euroc, ins, kitti, kitti_times, npy, tum, vo};
use dose3_datasets::{Error, Format, LoadOptions, RateSource, discover, load_all, survey, write};

/// A folder with a bit of everything.
fn tree() -> tempfile::TempDir {
    let root = tempfile::tempdir().unwrap();
    let put = |path: &str, content: &[u8]| {
        let path = root.path().join(path);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, content).unwrap();
    };
    put("kitti/poses/00.txt", kitti(5).as_bytes());
    put("kitti/poses/01.txt", kitti(6).as_bytes());
    put("kitti/sequences/00/times.txt", kitti_times(5).as_bytes());
    put("robotcar/2019-01-11/gps/ins.csv", ins(5).as_bytes());
    put(
        "robotcar/2019-01-11/gps/gps.csv",
        b"timestamp,num_satellites,northing,easting\n1,2,3,4\n",
    );
    put("robotcar/2019-01-11/vo/vo.csv", vo(5).as_bytes());
    put("iros20/traj_1.npy", &npy(5));
    put("tum/freiburg1_xyz/groundtruth.txt", tum(5).as_bytes());
    put(
        "tum/freiburg1_xyz/rgb.txt",
        b"# color images\n1305031102.175304 rgb/1305031102.175304.png\n",
    );
    put(
        "euroc/V1_02/mav0/state_groundtruth_estimate0/data.csv",
        euroc(5).as_bytes(),
    );
    put(
        "euroc/V1_02/mav0/imu0/data.csv",
        b"#timestamp [ns],w_RS_S_x [rad s^-1]\n1403715524907143168,0.1\n",
    );
    put("README.md", b"# Data\n\nSome words.\n");
    put(".hidden/00.txt", kitti(5).as_bytes());
    put("kitti/poses/.00.txt.swp", kitti(5).as_bytes());
    let video = root.path().join("ycb/mustard0/annotated_poses");
    fs::create_dir_all(&video).unwrap();
    write::iros20_poses(&video, &drive(7)).unwrap();
    root
}

fn relative(root: &Path, paths: &[PathBuf]) -> Vec<String> {
    paths
        .iter()
        .map(|path| {
            path.strip_prefix(root)
                .unwrap()
                .to_string_lossy()
                .replace('\\', "/")
        })
        .collect()
}

#[test]
fn logs_are_found_by_content_and_sorted() {
    let root = tree();
    let options = LoadOptions::default();
    let found = survey(root.path(), &options).unwrap();
    assert_eq!(
        relative(root.path(), &found.logs),
        [
            "euroc/V1_02/mav0/state_groundtruth_estimate0/data.csv",
            "iros20/traj_1.npy",
            "kitti/poses/00.txt",
            "kitti/poses/01.txt",
            "robotcar/2019-01-11/gps/ins.csv",
            "robotcar/2019-01-11/vo/vo.csv",
            "tum/freiburg1_xyz/groundtruth.txt",
            "ycb/mustard0/annotated_poses",
        ]
    );
    assert_eq!(
        relative(root.path(), &found.ignored),
        [
            "README.md",
            "euroc/V1_02/mav0/imu0/data.csv",
            "kitti/sequences/00/times.txt",
            "robotcar/2019-01-11/gps/gps.csv",
            "tum/freiburg1_xyz/rgb.txt",
        ]
    );
    assert_eq!(found.reasons.len(), found.ignored.len());
    assert!(
        found.reasons[0].contains("no columns for the position"),
        "{:?}",
        found.reasons
    );
    assert!(
        found.reasons[3].contains("gps/ins.csv"),
        "{:?}",
        found.reasons
    );
    for format in Format::ALL {
        let options = LoadOptions {
            format: Some(format),
            ..options.clone()
        };
        let logs = discover(root.path(), &options).unwrap();
        let expected = match format {
            Format::Kitti | Format::RobotCar => 2,
            Format::Iros20 | Format::Iros20Poses | Format::Tum | Format::Euroc => 1,
            _ => 0,
        };
        assert_eq!(logs.len(), expected, "{format}");
    }
}

#[test]
fn logs_are_named_by_what_tells_them_apart() {
    let root = tree();
    let logs = load_all(&[root.path().to_path_buf()], &LoadOptions::default()).unwrap();
    let names: Vec<(&str, &str)> = logs
        .iter()
        .map(|log| (log.name.as_str(), log.group.as_str()))
        .collect();
    assert_eq!(
        names,
        [
            ("V1_02", "V1_02"),
            ("traj_1", "traj_1"),
            ("00", "00"),
            ("01", "01"),
            ("2019-01-11", "2019-01-11"),
            ("2019-01-11-vo", "2019-01-11"),
            ("freiburg1_xyz", "freiburg1_xyz"),
            ("mustard0", "mustard0"),
        ]
    );
    // The official KITTI archive keeps the times elsewhere; sequence 01 has none here.
    assert_eq!(
        (logs[2].rate.source, logs[3].rate.source),
        (RateSource::Stamps, RateSource::Nominal)
    );
}

#[test]
fn equal_names_get_their_folders() {
    let root = tempfile::tempdir().unwrap();
    for folder in ["a/poses", "b/poses", "c"] {
        fs::create_dir_all(root.path().join(folder)).unwrap();
        fs::write(root.path().join(folder).join("00.txt"), kitti(4)).unwrap();
    }
    let logs = load_all(&[root.path().to_path_buf()], &LoadOptions::default()).unwrap();
    let names: Vec<&str> = logs.iter().map(|log| log.name.as_str()).collect();
    assert_eq!(names, ["a/poses/00", "b/poses/00", "c/00"]);
    assert!(logs.iter().all(|log| log.group == log.name));
}

#[test]
fn a_log_named_twice_counts_once() {
    let root = tree();
    let folder = root.path().join("kitti");
    let paths = [
        folder.clone(),
        folder.join("poses/00.txt"),
        folder.join("poses/../poses/01.txt"),
    ];
    let logs = load_all(&paths, &LoadOptions::default()).unwrap();
    assert_eq!(
        logs.iter().map(|log| log.name.as_str()).collect::<Vec<_>>(),
        ["00", "01"]
    );
}

#[test]
fn nothing_found_is_an_error() {
    let root = tree();
    let empty = root.path().join("empty");
    fs::create_dir(&empty).unwrap();
    let error = load_all(&[root.path().join("tum"), empty], &LoadOptions::default()).unwrap_err();
    assert!(
        matches!(error, Error::NoLog { .. }) && error.to_string().contains("empty: no log found"),
        "{error}"
    );
    assert!(load_all(&[], &LoadOptions::default()).unwrap().is_empty());
    let times = Some(root.path().join("kitti/sequences/00/times.txt"));
    let options = LoadOptions {
        times,
        ..LoadOptions::default()
    };
    let error = load_all(&[root.path().join("kitti")], &options).unwrap_err();
    assert!(error.to_string().contains("times"), "{error}");
}

#[test]
fn names_of_formats_are_read_back() {
    for format in Format::ALL {
        assert_eq!(format.to_string().parse::<Format>().unwrap(), format);
    }
    let error = "avi".parse::<Format>().unwrap_err().to_string();
    assert!(
        error.starts_with("unknown format `avi`; expected one of kitti, robotcar,"),
        "{error}"
    );
    assert!("synthetic".parse::<Format>().is_err(), "nothing to read");
}

/// JSON files of a folder are logs where they hold poses.
#[test]
fn other_json_beside_logs_is_passed_over() {
    let root = tempfile::tempdir().unwrap();
    let put = |name: &str, text: &str| fs::write(root.path().join(name), text).unwrap();
    let pose = |x: usize| {
        format!("{{\"t\": {x}.5, \"position\": [{x}, 0, 0], \"orientation\": [0, 0, 0, 1]}}")
    };
    let poses: Vec<String> = (0..5).map(pose).collect();
    put("log.json", &format!("[{}]", poses.join(",")));
    put("lines.jsonl", &poses.join("\n"));
    put("cut.json", &format!("[{}", poses.join(",")));
    put("config.json", "{\"rate\": 10, \"topics\": [\"a\", \"b\"]}");
    put("names.json", "[{\"name\": \"a\"}, {\"name\": \"b\"}]");
    put("events.jsonl", "{\"event\": 1}\n{\"event\": 2}\n");
    put("out.log", "[INFO] start\n[INFO] end\n");
    put("00.txt", &kitti(5));
    let found = survey(root.path(), &LoadOptions::default()).unwrap();
    assert_eq!(
        relative(root.path(), &found.logs),
        ["00.txt", "cut.json", "lines.jsonl", "log.json"]
    );
    assert_eq!(
        relative(root.path(), &found.ignored),
        ["config.json", "events.jsonl", "names.json", "out.log"]
    );
    assert!(
        found
            .reasons
            .iter()
            .all(|reason| reason == "json without poses")
    );
}

#[test]
fn files_without_the_topic_are_passed_over() {
    let folder = tempfile::tempdir().unwrap();
    let put = |name: &str, content: &str| fs::write(folder.path().join(name), content).unwrap();
    let fields = ["x", "y", "z", "qx", "qy", "qz", "qw"];
    let table = |names: [&str; 2]| {
        let head = names.map(|name| fields.map(|field| format!("{name}_{field}")).join(","));
        let rows = [0, 1, 2].map(|i| format!("0.{i},{i},0,0,0,0,0,1,7,{i},0,0,0,0,1\n"));
        format!("t,{}\n{}", head.join(","), rows.concat())
    };
    put("a.csv", &table(["gt", "est"]));
    put("b.csv", &table(["left", "right"]));
    let record =
        |i| format!("{{\"t\": 0.{i}, \"left\": {{\"p\": [{i}, 0, 0], \"q\": [0, 0, 0, 1]}}}}");
    put("c.json", &format!("[{}]", [0, 1, 2].map(record).join(",")));
    put("d.tum", &tum(5));
    let options = LoadOptions {
        topics: vec!["est".to_owned()],
        ..LoadOptions::default()
    };
    let survey = survey(folder.path(), &options).unwrap();
    assert_eq!(relative(folder.path(), &survey.logs), ["a.csv", "d.tum"]);
    assert_eq!(
        survey.reasons,
        [
            "line 1: poses of left, right; choose one of these",
            "json without poses of est"
        ]
    );
    assert_eq!(
        load_all(&[folder.path().to_path_buf()], &options).unwrap()[0].len(),
        3
    );
}
