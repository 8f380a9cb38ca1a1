//! Messages as `rostopic echo` and `ros2 topic echo` print them.

use super::*;

fn message(i: usize, [x, y, z]: [f64; 3], [w, a, b, c]: [f64; 4]) -> String {
    format!(
        "header:\n  stamp:\n    sec: {}\n    nanosec: {}\n  frame_id: map\nchild_frame_id: base_link\npose:\n  pose:\n    position:\n      x: {x}\n      y: {y}\n      z: {z}\n    orientation:\n      x: {a}\n      y: {b}\n      z: {c}\n      w: {w}\n  covariance:\n  - 0.0\n  - 0.5\n  - '...'\ntwist:\n  twist:\n    linear:\n      x: 8.0\n---",
        1_600_000_000 + i / 10,
        100_000_000 * (i % 10)
    )
}

#[test]
fn printed_messages_are_a_log() {
    let text = lines(message);
    let log = read(&text);
    check(&log);
    assert_eq!((log.format, log.row_kind), (Format::Echo, RowKind::Line));
    assert_eq!((log.rows[0], log.rows[1]), (3, 29));
    assert_eq!(log.stamps[3], 1_600_000_000_300_000_000);
    // ROS 1 calls the parts of a stamp otherwise, and pads them.
    let ros1 = text
        .replace("sec: ", "secs: ")
        .replace("nanosecs: ", "nsecs:   ");
    let ros1 = ros1
        .replace("  - 0.0\n  - 0.5\n  - '...'\n", "")
        .replace("covariance:", "covariance: [0.0, 0.5]");
    check(&read(&ros1));
    check(&read(&format!("---\n{text}").replace('\n', "\r\n")));
    // What the tool says between messages.
    let said = text.replacen(
        "---\n",
        "---\nA message was lost!!!\n\ttotal count change:1\n\ttotal count: 1---\n",
        1,
    );
    check(&read(&said.replacen(
        "total count: 1---",
        "total count:1",
        1,
    )));
    // The last message is cut off.
    let log = read(&text[..text.len() - 120]);
    check_poses(&log, &(0..POSES - 1).collect::<Vec<_>>());
    assert_eq!(log.report.truncated_tail, 1);
    // A value that is none is lost tracking, at its message.
    let lost = text.replacen("x: 0.8", "x: .nan", 1);
    let log = read(&lost);
    assert_eq!(log.report.lost[0].first_row, 29);
}

/// The messages of a topic of transforms: in each that of the body, and one of a frame that moves otherwise.
fn transforms() -> String {
    let one = |i: usize, frames: [&str; 2], [x, y, z]: [f64; 3], [w, a, b, c]: [f64; 4]| {
        let [parent, child] = frames;
        let (seconds, part) = (1_600_000_000 + i / 10, 100_000_000 * (i % 10));
        format!(
            "- header:\n    stamp:\n      sec: {seconds}\n      nanosec: {part}\n    frame_id: {parent}\n  child_frame_id: {child}\n  transform:\n    translation:\n      x: {x}\n      y: {y}\n      z: {z}\n    rotation:\n      x: {a}\n      y: {b}\n      z: {c}\n      w: {w}\n"
        )
    };
    lines(|i, p, q| {
        let body = one(i, ["odom", "base_link"], p, q);
        let other = one(i, ["/map", "odom"], [7.0, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0]);
        // The tree of a robot comes from several nodes, some of them send one transform alone.
        match i % 3 {
            0 => format!("transforms:\n{body}{other}---"),
            1 => format!("transforms:\n{other}{body}---"),
            _ => format!("transforms:\n{other}---\ntransforms:\n{body}---"),
        }
    })
}

#[test]
fn transforms_are_told_apart_by_their_frames() {
    let of = |parent: &str, child: &str| LoadOptions {
        tf: Some((parent.to_owned(), child.to_owned())),
        ..LoadOptions::default()
    };
    let ros2 = transforms();
    let ros1 = ros2
        .replace("- header", "- \n  header")
        .replace('\n', "\n  ")
        .replace("  transforms:", "transforms: ")
        .replace("  ---", "---")
        .replace("sec: ", "secs: ")
        .replace("nanosecs: ", "nsecs: ");
    for text in [&ros2, &ros1] {
        let log = read_with(text, &of("/odom", "base_link"));
        check(&log);
        assert_eq!(
            read_with(text, &of("map", "odom")).poses[3].translation.x,
            7.0
        );
        let pairs = ["log.txt: expected transforms", "map:odom, odom:base_link"];
        refuse(text, &pairs, Some(ReadOption::Tf));
        let fault = load_bytes("log.txt", text.as_bytes(), &of("map", "base_link")).unwrap_err();
        assert!(
            fault.to_string().contains("map:odom, odom:base_link"),
            "{fault}"
        );
    }
    assert_eq!(read_with(&ros2, &of("odom", "base_link")).rows[1], 54);
    // The only pair is taken.
    let parts = ros2
        .split("- header")
        .filter(|part| part.contains(": base_link"));
    let own: Vec<String> = parts
        .map(|part| part.replace("transforms:\n", "").replace("---\n", ""))
        .map(|part| format!("transforms:\n- header{part}---\n"))
        .collect();
    let own = own.concat();
    check(&read(&own));
}

#[test]
fn lists_of_poses_and_messages_without_any_are_refused() {
    let pose = "- pose:\n    position:\n      x: 0.5\n      y: 0.0\n";
    let path = format!("header:\n  frame_id: map\nposes:\n{pose}{pose}---\n");
    refuse(&path, &["log.txt:10", "twice", "record a bag"], None);
    refuse(
        "name: a\nposition:\n  u: 1\n---\nname: b\nposition:\n  u: 1\n---\n",
        &["echo with positions", "name, position.u"],
        Some(ReadOption::Columns),
    );
}
