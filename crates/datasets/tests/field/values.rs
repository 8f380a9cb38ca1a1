//! Lost tracking, rows cut off, unusual numbers, implausible motion.

use super::*;

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
fn steps_of_windows_and_seven_numbers_in_other_orders_are_refused() {
    // 100 ns since 1601 and since the year 1.
    for first in [132_400_000_000_000_000_u64, 637_355_968_000_000_000] {
        let ticks = tum(|i| (first + 1_000_000 * i as u64).to_string(), " ", false);
        refuse(&ticks, &["steps of 100 ns"], Some(ReadOption::Rate));
        let options = LoadOptions {
            rate: Some(10.0),
            ..LoadOptions::default()
        };
        check(&read_with(&ticks, &options));
    }
    let yaw = |i: usize| 0.02 * i as f64;
    let numbers = |i: usize, six: [f64; 6]| format!("{} {}", epoch(i), join(&six, " "));
    let [rpy, ypr, first, degrees] = [
        lines(|i, p, _| numbers(i, [p[0], p[1], p[2], 0.0, 0.0, yaw(i)])),
        lines(|i, p, _| numbers(i, [p[0], p[1], p[2], yaw(i), 0.0, 0.0])),
        lines(|i, p, _| numbers(i, [0.0, 0.0, yaw(i), p[0], p[1], p[2]])),
        lines(|i, p, _| numbers(i, [p[0], p[1], p[2], 0.0, 0.0, yaw(i).to_degrees()])),
    ];
    check(&read(&rpy));
    check(&read(&degrees));
    let option = Some(ReadOption::Columns);
    refuse(&ypr, &["a stamp, position, yaw, pitch, roll"], option);
    refuse(&first, &["a stamp, roll, pitch, yaw, position"], option);
    let options = LoadOptions {
        columns: Some("t,roll,pitch,yaw,x,y,z".parse().unwrap()),
        ..LoadOptions::default()
    };
    check(&read_with(&first, &options));
}
