//! Logs of several files, forced formats, settings and paths that are wrong.

mod common;

use std::fs;
use std::path::{Path, PathBuf};

use common::bad::Outcome::{Fails, Loses, Repairs};
use common::bad::{Outcome, check};
use common::{drive, euroc, ins, kitti, kitti_times, npy, tum};
use dose3_datasets::Place::{File, Line};
use dose3_datasets::{
    Error, Format, LoadOptions, LoadReport, LostKind, load, windows, windows_of_each, write,
};

#[test]
fn wrong_format_forced() {
    let texts = [
        (Format::Kitti, "00.txt", kitti(6).into_bytes()),
        (Format::Tum, "a.txt", tum(6).into_bytes()),
        (Format::Euroc, "data.csv", euroc(6).into_bytes()),
        (Format::RobotCar, "ins.csv", ins(6).into_bytes()),
        (Format::Iros20, "a.npy", npy(6)),
    ];
    let folder = tempfile::tempdir().unwrap();
    for (own, file, content) in &texts {
        let path = folder.path().join(file);
        fs::write(&path, content).unwrap();
        for forced in Format::ALL {
            let options = LoadOptions {
                format: Some(forced),
                ..LoadOptions::default()
            };
            match load(&path, &options) {
                Ok(log) => {
                    // Any table of numbers is a csv, KITTI's lines are matrices, and named columns are obeyed
                    // whatever the format is called.
                    let named = |format| matches!(format, Format::Tum | Format::Euroc);
                    let wider = matches!(forced, Format::Csv | Format::Matrix)
                        || named(forced) && named(*own);
                    assert!(forced == *own || wider, "{own} as {forced}");
                    assert_eq!((log.format, log.len()), (forced, 6));
                }
                // A file where a folder of one-pose files belongs is an error of the file system.
                Err(Error::Io { .. }) => assert_eq!(forced, Format::Iros20Poses),
                Err(Error::Input(fault)) => {
                    assert_ne!(forced, *own);
                    assert_eq!(fault.path, path);
                }
                Err(other) => panic!("{own} as {forced}: {other}"),
            }
        }
    }
}

#[test]
fn kitti_times_that_do_not_fit() {
    let stamps = |seconds: &[&str]| seconds.join("\n") + "\n";
    let clean = |_: &mut LoadReport| {};
    let cases = [
        ("fitting", kitti_times(6), Repairs(6, clean)),
        (
            "too few",
            kitti_times(5),
            Fails(
                "00_times.txt",
                File,
                &["6 stamps", "00.txt", "found 5", "nominal"],
            ),
        ),
        (
            "too many",
            kitti_times(7),
            Fails("00_times.txt", File, &["6 stamps", "found 7"]),
        ),
        (
            "not numbers",
            stamps(&["0", "1", "x", "3", "4", "5"]),
            Fails("00_times.txt", Line(3), &["stamp in seconds", "`x`"]),
        ),
        (
            "NaN",
            stamps(&["0", "nan", "2", "3", "4", "5"]),
            Fails("00_times.txt", Line(2), &["stamp in seconds", "`nan`"]),
        ),
        (
            "two columns",
            stamps(&["0 1", "1 2"]),
            Fails("00_times.txt", Line(1), &["one stamp"]),
        ),
        (
            "backward",
            stamps(&["0", "1", "2", "1.5", "4", "5"]),
            Fails("00_times.txt", Line(4), &["a stamp after 2 s"]),
        ),
        (
            "empty",
            String::new(),
            Fails("00_times.txt", File, &["empty"]),
        ),
        (
            "one stamp twice",
            stamps(&["0", "1", "1", "3", "4", "5"]),
            Repairs(5, |r| r.conflicting_stamps = 1),
        ),
    ];
    for (name, times, outcome) in cases {
        let folder = tempfile::tempdir().unwrap();
        let poses = folder.path().join("00.txt");
        fs::write(&poses, kitti(6)).unwrap();
        fs::write(folder.path().join("00_times.txt"), times).unwrap();
        check(
            name,
            &poses,
            folder.path(),
            &LoadOptions::default(),
            &outcome,
        );
    }
    let folder = tempfile::tempdir().unwrap();
    let poses = folder.path().join("00.txt");
    fs::write(&poses, kitti(6)).unwrap();
    let options = LoadOptions {
        times: Some(folder.path().join("none.txt")),
        ..LoadOptions::default()
    };
    let error = load(&poses, &options).unwrap_err();
    assert!(error.to_string().contains("none.txt"), "{error}");
}

#[test]
fn annotated_poses_with_faults() {
    let with = |damage: &dyn Fn(&Path)| -> (tempfile::TempDir, PathBuf) {
        let root = tempfile::tempdir().unwrap();
        let folder = root.path().join("mustard/annotated_poses");
        fs::create_dir_all(&folder).unwrap();
        write::iros20_poses(&folder, &drive(6)).unwrap();
        damage(&folder);
        (root, folder)
    };
    let identity = "1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n";
    let broken = |content: &'static str| {
        move |folder: &Path| fs::write(folder.join("0000003.txt"), content).unwrap()
    };
    type Damage<'a> = Box<dyn Fn(&Path) + 'a>;
    let cases: Vec<(&str, Damage<'_>, Outcome)> = vec![
        ("clean", Box::new(|_| {}), Repairs(6, |_| {})),
        (
            "missing frame",
            Box::new(|folder| fs::remove_file(folder.join("0000002.txt")).unwrap()),
            Repairs(5, |r| r.missing_frames = 1),
        ),
        (
            "another file",
            Box::new(|folder| fs::write(folder.join("notes.txt"), "hello").unwrap()),
            Repairs(6, |_| {}),
        ),
        (
            "number twice",
            Box::new(|folder| fs::write(folder.join("3.txt"), identity).unwrap()),
            Repairs(6, |r| r.conflicting_stamps = 1),
        ),
        (
            "cut off",
            Box::new(broken("1 0 0 0\n0 1 0 0\n")),
            Fails(
                "0000003.txt",
                File,
                &["four lines of 4 numbers", "2 lines", "missing"],
            ),
        ),
        (
            "five lines",
            Box::new(broken("1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n0 0 0 1\n")),
            Fails("0000003.txt", Line(5), &["four lines"]),
        ),
        (
            "short line",
            Box::new(broken("1 0 0 0\n0 1 0\n0 0 1 0\n0 0 0 1\n")),
            Fails("0000003.txt", Line(2), &["4 numbers"]),
        ),
        (
            "NaN",
            Box::new(broken("1 0 0 nan\n0 1 0 0\n0 0 1 0\n0 0 0 1\n")),
            Loses(5, LostKind::Nan, &[3]),
        ),
        (
            "transposed",
            Box::new(broken("1 0 0 0\n0 1 0 0\n0 0 1 0\n5 6 7 1\n")),
            Fails("0000003.txt", File, &["5 6 7 1", "transposed"]),
        ),
        (
            "mirrored",
            Box::new(broken("1 0 0 0\n0 1 0 0\n0 0 -1 0\n0 0 0 1\n")),
            Fails("0000003.txt", File, &["reflection"]),
        ),
        (
            "empty",
            Box::new(broken("")),
            Fails("0000003.txt", File, &["empty"]),
        ),
        (
            "BOM and CRLF",
            Box::new(broken(
                "\u{feff}0 -1 0 0\r\n1 0 0 0\r\n0 0 1 0\r\n0 0 0 1\r\n",
            )),
            Repairs(6, |r| {
                r.byte_order_mark = true;
                r.crlf_lines = 4;
            }),
        ),
    ];
    for (name, damage, outcome) in &cases {
        let (root, folder) = with(damage);
        // Given as itself, and found below its video's folder.
        for path in [folder.as_path(), root.path()] {
            check(name, path, &folder, &LoadOptions::default(), outcome);
        }
        if let Ok(log) = load(&folder, &LoadOptions::default()) {
            assert_eq!(
                (log.name.as_str(), log.format),
                ("mustard", Format::Iros20Poses)
            );
            assert_eq!(
                log.stamps.last(),
                Some(&166_666_667),
                "{name}: a missing frame keeps its place in time"
            );
        }
    }
}

#[test]
fn paths_that_are_not_one_log() {
    let root = tempfile::tempdir().unwrap();
    let options = LoadOptions::default();
    assert!(matches!(
        load(&root.path().join("none"), &options),
        Err(Error::Io { .. })
    ));
    let empty = load(root.path(), &options).unwrap_err();
    assert!(
        matches!(empty, Error::NotOneLog { found: 0, .. }),
        "{empty}"
    );
    fs::write(root.path().join("00.txt"), kitti(3)).unwrap();
    fs::write(root.path().join("01.txt"), kitti(3)).unwrap();
    let two = load(root.path(), &options).unwrap_err();
    assert!(matches!(two, Error::NotOneLog { found: 2, .. }));
    assert!(
        two.to_string().contains("00.txt") && two.to_string().contains("name one of them"),
        "{two}"
    );
}

#[test]
fn settings_out_of_range() {
    let path = Path::new("unused");
    for options in [
        LoadOptions {
            rotation_tolerance: f64::NAN,
            ..LoadOptions::default()
        },
        LoadOptions {
            rotation_tolerance: -1.0,
            ..LoadOptions::default()
        },
        LoadOptions {
            quaternion_tolerance: 1.0,
            ..LoadOptions::default()
        },
        LoadOptions {
            max_gap: Some(0.0),
            ..LoadOptions::default()
        },
        LoadOptions {
            max_gap: Some(f64::NAN),
            ..LoadOptions::default()
        },
    ] {
        assert!(
            matches!(load(path, &options), Err(Error::Parameter { .. })),
            "{options:?}"
        );
    }
}

#[test]
fn a_log_shorter_than_a_window() {
    let log = drive(100);
    assert!(windows(std::slice::from_ref(&log), 128, 64).is_empty());
    let message = windows_of_each(&[log], 128, 64).unwrap_err().to_string();
    for word in [
        "longest gap-free stretch has 100 poses",
        "a window needs 128",
        "shorter window",
    ] {
        assert!(message.contains(word), "{message}");
    }
}
