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

#[test]
fn several_transforms_in_a_message_are_refused() {
    let one = |child: &str, x: f64| {
        format!(
            "- header:\n    stamp:\n      sec: 1\n      nanosec: 0\n  child_frame_id: {child}\n  transform:\n    translation:\n      x: {x}\n      y: 0.0\n      z: 0.0\n    rotation:\n      x: 0.0\n      y: 0.0\n      z: 0.0\n      w: 1.0\n"
        )
    };
    let text = format!("transforms:\n{}{}---\n", one("a", 1.0), one("b", 2.0));
    refuse(
        &text.repeat(3),
        &["log.txt:19", "twice", "record a bag"],
        None,
    );
    refuse(
        "name: a\nposition:\n  u: 1\n---\nname: b\nposition:\n  u: 1\n---\n",
        &["echo with positions", "name, position.u"],
        Some(ReadOption::Columns),
    );
}
