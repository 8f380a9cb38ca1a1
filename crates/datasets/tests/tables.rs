//! Tables that hold several logs, told apart by a column.

use dose3_datasets::{
    Error, Format, LoadOptions, Place, ReadOption, RemarkKind, RowKind, Trajectory, load_bytes,
    load_each, load_several, load_several_bytes,
};

fn by(column: &str) -> LoadOptions {
    LoadOptions {
        log_column: Some(column.to_owned()),
        ..LoadOptions::default()
    }
}

fn read(text: &str, column: &str) -> Result<Vec<Trajectory>, Error> {
    load_several_bytes("table.csv", text.as_bytes(), &by(column))
}

/// Where a body is that moves by one along its own first axis at each step and turns by a hundredth.
fn position(run: usize, index: usize) -> [f64; 3] {
    let yaw = |step: usize| 0.01 * step as f64;
    let x = (0..index).map(|step| yaw(step).cos()).sum();
    let y = (0..index).map(|step| yaw(step).sin()).sum();
    [x, y, run as f64]
}

/// Pose `index` of run `run`, which is its height.
fn row(run: usize, index: usize) -> String {
    let half = 0.005 * index as f64;
    let [x, y, z] = position(run, index);
    format!(
        "{}.{}00,{x},{y},{z},{},0,0,{}",
        1_600_000_000 + index / 10,
        index % 10,
        half.cos(),
        half.sin()
    )
}

/// Rows of two runs in turn, the second backwards.
fn interleaved() -> String {
    let mut text = "run,stamp,x,y,z,qw,qx,qy,qz\n".to_owned();
    for index in 0..12 {
        text += &format!("first drive,{}\n", row(0, index));
        text += &format!("7,{}\n", row(7, 11 - index));
    }
    text
}

#[test]
fn rows_of_several_logs_in_turn_are_told_apart_and_sorted() {
    let logs = read(&interleaved(), "run").unwrap();
    let names: Vec<&str> = logs.iter().map(|log| log.name.as_str()).collect();
    assert_eq!(names, ["first drive", "7"]);
    for (log, run) in logs.iter().zip([0, 7]) {
        assert_eq!(
            (log.len(), log.format, log.row_kind),
            (12, Format::Csv, RowKind::Line)
        );
        assert_eq!(log.group, log.name);
        for (index, pose) in log.poses.iter().enumerate() {
            assert_eq!(pose.translation.as_slice(), position(run, index));
            let (_, _, yaw) = pose.rotation.euler_angles();
            assert!((yaw - 0.01 * index as f64).abs() < 1e-12);
            assert_eq!(
                log.stamps[index],
                1_600_000_000_000_000_000 + index as i64 * 100_000_000
            );
        }
    }
    let rows: Vec<u64> = (0..12).map(|index| 2 + 2 * index).collect();
    assert_eq!(logs[0].rows, rows);
    let back: Vec<u64> = (0..12).map(|index| 25 - 2 * index).collect();
    assert_eq!(logs[1].rows, back);
    let sorted = |log: &Trajectory| {
        let remarks = log.report.remarks.iter();
        let found: Vec<String> = remarks
            .filter(|remark| remark.kind == RemarkKind::Sorted)
            .map(|remark| remark.text.clone())
            .collect();
        found
    };
    assert_eq!(sorted(&logs[0]), Vec::<String>::new());
    assert!(
        sorted(&logs[1])[0].contains("line 5 goes back"),
        "{:?}",
        sorted(&logs[1])
    );
}

#[test]
fn columns_by_number_tabs_and_tables_without_a_header() {
    let tabs = interleaved().replace(',', "\t");
    for column in ["RUN", "1"] {
        let logs = read(&tabs, column).unwrap();
        assert_eq!((logs.len(), logs[1].poses[3].translation.z), (2, 7.0));
    }
    let bare = interleaved().split_once('\n').unwrap().1.to_owned();
    let options = LoadOptions {
        columns: Some("-,t,x,y,z,qw,qx,qy,qz".parse().unwrap()),
        ..by("1")
    };
    let logs = load_several_bytes("bare.csv", bare.as_bytes(), &options).unwrap();
    assert_eq!((logs.len(), logs[1].len(), logs[1].rows[0]), (2, 12, 24));
    assert_eq!(logs[1].poses[0].translation.as_slice(), [0.0, 0.0, 7.0]);
}

#[test]
fn files_give_the_same_and_one_log_is_not_asked_of_several() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("table.csv");
    std::fs::write(&path, interleaved()).unwrap();
    let logs = load_several(&path, &by("run")).unwrap();
    let bytes = read(&interleaved(), "run").unwrap();
    assert_eq!(logs[1].poses, bytes[1].poses);
    let fault = load_bytes("table.csv", interleaved().as_bytes(), &by("run")).unwrap_err();
    assert!(
        matches!(fault, Error::NotOneLog { found: 2, .. }),
        "{fault}"
    );
}

#[test]
fn a_bad_log_does_not_stop_the_others() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("table.csv");
    let table = interleaved()
        + "alone,"
        + &row(3, 0)
        + "\nlast,"
        + &row(2, 0)
        + "\nlast,"
        + &row(2, 1)
        + "\n";
    std::fs::write(
        &path,
        table.replacen("\n7,1600000001.000,", "\n7,1600000001.000,oops", 1),
    )
    .unwrap();
    let whole = read(&interleaved(), "run").unwrap();
    let logs = load_each(&path, &by("run")).unwrap();
    let bad: Vec<String> = logs
        .iter()
        .filter_map(|log| log.as_ref().err())
        .map(ToString::to_string)
        .collect();
    assert!(
        bad[0].contains("(log `7`)") && bad[1].contains("(log `alone`)"),
        "{bad:?}"
    );
    assert_eq!(logs.len(), whole.len() + 2);
    assert_eq!(logs[logs.len() - 1].as_ref().unwrap().name, "last");
    assert_eq!(
        load_several(&path, &by("run")).unwrap_err().to_string(),
        bad[0]
    );
}

#[test]
fn a_table_cut_off_in_its_last_value_loses_only_that_row() {
    let mut text = "stamp,x,y,z,qw,qx,qy,qz,run\n".to_owned();
    for index in 0..6 {
        text += &format!("{},run_10\n{},run_11\n", row(0, index), row(1, index));
    }
    let whole = text.clone() + &row(1, 6) + ",run_11\n";
    let cut = text.clone() + &row(1, 6) + ",run_";
    let lengths = |text: &str| -> Vec<usize> {
        read(text, "run")
            .unwrap()
            .iter()
            .map(Trajectory::len)
            .collect()
    };
    assert_eq!(lengths(&whole), [6, 7]);
    assert_eq!(lengths(&cut), [6, 6]);
    assert_eq!(lengths(&(text + "1600000009.1,3")), [6, 6]);
}

#[test]
fn what_is_wrong_is_said_with_the_log() {
    let input = |text: &str, column: &str| match read(text, column).unwrap_err() {
        Error::Input(fault) => fault,
        other => panic!("{other}"),
    };
    let fault = input(&interleaved(), "sequence");
    assert_eq!(fault.option, Some(ReadOption::LogColumn));
    assert!(fault.found.contains("run,stamp"), "{fault}");
    let fault = input(&interleaved().replacen("\n7,", "\n,", 1), "run");
    assert_eq!(
        (fault.place, fault.found.as_str()),
        (Place::Line(3), "nothing")
    );
    let alone = interleaved() + "alone," + &row(3, 0) + "\n";
    let fault = input(&alone, "run");
    assert_eq!(fault.found, "one (log `alone`)");
    let broken = interleaved() + "7,1600000009.0,1,oops,-1,1,0,0,0\n";
    let fault = input(&broken, "run");
    assert_eq!(fault.place, Place::Line(26));
    assert!(fault.found.contains("(log `7`)"), "{fault}");
}
