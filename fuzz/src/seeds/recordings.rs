//! Recordings of ROS.

// The writers of the readers' own tests.
#[path = "../../../crates/datasets/tests/recording/foxglove.rs"]
#[allow(missing_docs)]
mod foxglove;
#[path = "../../../crates/datasets/tests/recording/writers.rs"]
#[allow(missing_docs)]
mod writers;

use super::logs;
use dose3_lie::Pose;
use foxglove::Encoding;
use writers::{Channel, Message, Ros};

fn numbers(pose: &Pose) -> [f64; 7] {
    let q = dose3_lie::nalgebra::UnitQuaternion::from_rotation_matrix(&pose.rotation);
    let t = pose.translation;
    [t.x, t.y, t.z, q.i, q.j, q.k, q.w]
}

fn stamp(index: usize) -> i64 {
    1_600_000_000_000_000_000 + 100_000_000 * index as i64
}

/// Poses, odometry and transforms on three topics.
fn content(ros: Ros) -> (Vec<Channel>, Vec<Message>) {
    let channels = [
        ("/pose", "geometry_msgs/PoseStamped"),
        ("/odom", "nav_msgs/Odometry"),
        ("/tf", "tf2_msgs/TFMessage"),
    ];
    let channels = channels
        .iter()
        .enumerate()
        .map(|(index, (topic, kind))| Channel {
            id: index as u32 + 1,
            topic: (*topic).to_owned(),
            kind: (*kind).to_owned(),
        });
    let mut messages = Vec::new();
    for (index, pose) in logs()[0].poses.iter().enumerate() {
        let time = stamp(index);
        let mut add = |channel: u32, content: Vec<u8>| {
            messages.push(Message {
                channel,
                time,
                content,
            })
        };
        let mut message = ros.message();
        message.header(time, "map").numbers(&numbers(pose));
        add(1, message.done());
        let mut message = ros.message();
        message
            .header(time, "odom")
            .text("base_link")
            .numbers(&numbers(pose))
            .numbers(&[0.0; 78]);
        add(2, message.done());
        let mut message = ros.message();
        message.u32(2);
        message
            .header(time, "map")
            .text("odom")
            .numbers(&[1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]);
        message
            .header(time, "odom")
            .text("base_link")
            .numbers(&numbers(pose));
        add(3, message.done());
    }
    (channels.collect(), messages)
}

/// A pose, a transform and a list of transforms of Foxglove.
fn of_foxglove(encoding: Encoding, kind: &str, compression: &str) -> Vec<u8> {
    let channels = [Channel {
        id: 1,
        topic: "/tf".to_owned(),
        kind: kind.to_owned(),
    }];
    let message = |(index, pose): (usize, &Pose)| {
        let [x, y, z, q @ ..] = numbers(pose);
        let time = stamp(index);
        let transform =
            |parent: &str, child: &str| encoding.transform(time, parent, child, [x, y, z], q);
        let content = match kind {
            "foxglove.PoseInFrame" => encoding.pose(time, "odom", [x, y, z], q),
            "foxglove.FrameTransform" => transform("map", "base_link"),
            _ => encoding.transforms(&[transform("map", "odom"), transform("odom", "base_link")]),
        };
        Message {
            channel: 1,
            time,
            content,
        }
    };
    let log = &logs()[0];
    let messages: Vec<Message> = log.poses.iter().enumerate().map(message).collect();
    writers::mcap_of(encoding.name(), &channels, &messages, compression, 16, true)
}

/// MCAP of both profiles and of Foxglove, packed and plain, with an index and without.
pub fn mcap() -> Vec<Vec<u8>> {
    let (one, two) = (content(Ros::One), content(Ros::Two));
    vec![
        of_foxglove(Encoding::Protobuf, "foxglove.PoseInFrame", ""),
        of_foxglove(Encoding::Json, "foxglove.PoseInFrame", ""),
        of_foxglove(Encoding::Protobuf, "foxglove.FrameTransforms", "zstd"),
        of_foxglove(Encoding::Protobuf, "foxglove.FrameTransforms", ""),
        of_foxglove(Encoding::Json, "foxglove.FrameTransform", ""),
        writers::mcap(Ros::Two, &two.0, &two.1, "", 16, true),
        writers::mcap(Ros::Two, &two.0, &two.1, "lz4", 16, true),
        writers::mcap(Ros::Two, &two.0, &two.1, "zstd", 16, false),
        writers::mcap(Ros::One, &one.0, &one.1, "", 0, false),
    ]
}

/// ROS 1 bags.
pub fn bag() -> Vec<Vec<u8>> {
    let (channels, messages) = content(Ros::One);
    [("none", true), ("lz4", true), ("bz2", false)]
        .map(|(compression, index)| writers::bag(&channels, &messages, compression, 16, index))
        .to_vec()
}

/// A ROS 2 bag in SQLite.
pub fn rosbag2() -> Vec<Vec<u8>> {
    let (channels, messages) = content(Ros::Two);
    vec![writers::rosbag2(&channels, &messages)]
}

/// Every container that carries transforms.
pub fn transforms() -> Vec<Vec<u8>> {
    [mcap(), bag(), rosbag2()].concat()
}
