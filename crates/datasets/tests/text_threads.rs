//! A long text is the same log, and the same fault, for any number of threads.

use dose3_datasets::{LoadOptions, Trajectory, load_bytes};

/// 60,000 poses, more than three pieces of text, with lost, repeated, blank and commented rows in between.
fn text() -> Vec<String> {
    let mut lines = vec!["# timestamp tx ty tz qx qy qz qw".to_owned()];
    for index in 0..60_000 {
        let (time, x) = (1.6e9 + f64::from(index) * 0.1, f64::from(index) * 0.05);
        let yaw = (f64::from(index) * 1e-3).sin();
        let (w, z) = ((yaw / 2.0).cos(), (yaw / 2.0).sin());
        let place = if index % 997 == 5 {
            "nan".to_owned()
        } else {
            format!("{x:.9}")
        };
        lines.push(format!(
            "{time:.6} {place} {:.9} 0.0 0.0 0.0 {z:.12} {w:.12}",
            x * 0.5
        ));
        match index % 1009 {
            3 => lines.push(lines[lines.len() - 1].clone()),
            4 => lines.push("# a remark".to_owned()),
            5 => lines.push("  ".to_owned()),
            _ => {}
        }
    }
    lines
}

fn read(text: &str, threads: usize) -> Result<Trajectory, String> {
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build()
        .unwrap();
    let read = || load_bytes("long.tum", text.as_bytes(), &LoadOptions::default());
    pool.install(read).map_err(|fault| fault.to_string())
}

#[test]
fn the_log_does_not_depend_on_threads() {
    let lines = text();
    for end in ["\n", "\r\n"] {
        let text = lines.join(end) + end;
        let one = read(&text, 1).unwrap();
        assert_eq!((one.len(), one.report.lost_rows()), (60_000 - 61, 61));
        assert_eq!(
            (one.report.repeated_poses, one.report.blank_lines),
            (60, 60)
        );
        // The row of a pose is its line, behind everything before it.
        for index in [0, 20_000, one.len() - 1] {
            let line = &lines[one.rows[index] as usize - 1];
            assert!(
                line.contains(&format!("{:.9} ", one.poses[index].translation.x)),
                "{line}"
            );
        }
        for threads in [2, 3, 8] {
            assert!(read(&text, threads).unwrap() == one, "{threads}");
        }
        // Without stamps, as matrices.
        let kitti = |line: &String| {
            let x = line.split(' ').nth(1).unwrap_or("0");
            format!(
                "1 0 0 {} 0 1 0 0.0000000000000000000 0 0 1 0.000000000000000",
                if x == "nan" { "nan" } else { "2.5" }
            )
        };
        let text = lines[1..].iter().map(kitti).collect::<Vec<_>>().join(end) + end;
        let one = read(&text, 1).unwrap();
        assert!(read(&text, 3).unwrap() == one);
    }
}

#[test]
fn a_fault_names_its_line_for_any_number_of_threads() {
    for at in [2, 30_000, 59_000] {
        let mut lines = text();
        lines[at] = lines[at].replace("0.0 0.0 0.0", "0.0 zero 0.0");
        let text = lines.join("\n") + "\n";
        let one = read(&text, 1).unwrap_err();
        assert!(
            one.starts_with(&format!("long.tum:{}: expected a number for qx", at + 1)),
            "{one}"
        );
        assert!(
            [2, 8]
                .iter()
                .all(|threads| read(&text, *threads).unwrap_err() == one)
        );
    }
    // A last line cut off within its last number, far behind rows with other digits.
    let mut text = text().join("\n");
    text.truncate(text.len() - 3);
    for threads in [1, 2, 8] {
        let log = read(&text, threads).unwrap();
        assert_eq!(log.report.truncated_tail, 1);
    }
}
