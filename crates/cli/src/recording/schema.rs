//! The messages of a recording, and their descriptions, which a recording holds, so that any reader understands it.
//!
//! Those of `foxglove` are subsets of the published schemas (<https://docs.foxglove.dev/docs/sdk/schemas>) with their
//! names and numbers: Foxglove, PlotJuggler and rerun know them. Those of `dose3` are numbers to plot.

use super::wire::Wire;

/// What a field holds.
#[derive(Clone, Copy)]
enum Holds {
    Double,
    /// int64, int32, uint64, uint32 or bool by the number of its type.
    Whole(u64),
    Text,
    /// A message by its full name.
    Message(&'static str),
    /// An enum by its full name.
    Name(&'static str),
}

const INT64: Holds = Holds::Whole(3);
const UINT64: Holds = Holds::Whole(4);
const INT32: Holds = Holds::Whole(5);
const BOOL: Holds = Holds::Whole(8);
const UINT32: Holds = Holds::Whole(13);
const TIME: Holds = Holds::Message(".google.protobuf.Timestamp");

/// A message: its name, and its fields, whose numbers count from 1.
struct Message(&'static str, &'static [(&'static str, Holds)]);

/// A file of messages: its name, package, the files that it refers to, its messages.
struct File {
    name: &'static str,
    package: &'static str,
    uses: &'static [&'static File],
    messages: &'static [Message],
}

static TIMESTAMP: File = File {
    name: "google/protobuf/timestamp.proto",
    package: "google.protobuf",
    uses: &[],
    messages: &[Message(
        "Timestamp",
        &[("seconds", INT64), ("nanos", INT32)],
    )],
};

const VECTOR: Holds = Holds::Message(".foxglove.Vector3");
const QUATERNION: Holds = Holds::Message(".foxglove.Quaternion");

static FOXGLOVE: File = File {
    name: "foxglove/dose3_subset.proto",
    package: "foxglove",
    uses: &[&TIMESTAMP],
    messages: &[
        Message(
            "Vector3",
            &[
                ("x", Holds::Double),
                ("y", Holds::Double),
                ("z", Holds::Double),
            ],
        ),
        Message(
            "Quaternion",
            &[
                ("x", Holds::Double),
                ("y", Holds::Double),
                ("z", Holds::Double),
                ("w", Holds::Double),
            ],
        ),
        Message("Pose", &[("position", VECTOR), ("orientation", QUATERNION)]),
        Message(
            "PoseInFrame",
            &[
                ("timestamp", TIME),
                ("frame_id", Holds::Text),
                ("pose", Holds::Message(".foxglove.Pose")),
            ],
        ),
        Message(
            "FrameTransform",
            &[
                ("timestamp", TIME),
                ("parent_frame_id", Holds::Text),
                ("child_frame_id", Holds::Text),
                ("translation", VECTOR),
                ("rotation", QUATERNION),
            ],
        ),
        Message(
            "Log",
            &[
                ("timestamp", TIME),
                ("level", Holds::Name(".foxglove.Log.Level")),
                ("message", Holds::Text),
                ("name", Holds::Text),
                ("file", Holds::Text),
                ("line", UINT32),
            ],
        ),
    ],
};

const AXIS: Holds = Holds::Message(".dose3.Axis");

static DOSE3: File = File {
    name: "dose3/score.proto",
    package: "dose3",
    uses: &[&TIMESTAMP],
    messages: &[
        // Of a pose: the score of the window in whose middle it lies, and its own; each with its threshold.
        Message(
            "Score",
            &[
                ("timestamp", TIME),
                ("window_score", Holds::Double),
                ("window_threshold", Holds::Double),
                ("pose_score", Holds::Double),
                ("pose_threshold", Holds::Double),
                ("beyond", BOOL),
                ("row", UINT64),
            ],
        ),
        // m/s or rad/s; what all but two of a thousand trusted poses keep to; how far beyond that (1: its end).
        Message(
            "Axis",
            &[
                ("value", Holds::Double),
                ("trusted_low", Holds::Double),
                ("trusted_high", Holds::Double),
                ("excess", Holds::Double),
            ],
        ),
        Message(
            "Motion",
            &[
                ("timestamp", TIME),
                ("forward", AXIS),
                ("left", AXIS),
                ("up", AXIS),
                ("roll", AXIS),
                ("pitch", AXIS),
                ("yaw", AXIS),
            ],
        ),
    ],
};

/// The description of a message by its full name: a `FileDescriptorSet`, whole with all that it refers to.
pub fn description(full_name: &str) -> Vec<u8> {
    let file = if full_name.starts_with("dose3.") {
        &DOSE3
    } else {
        &FOXGLOVE
    };
    let files = file.uses.iter().copied().chain([file]);
    Wire::default()
        .messages(1, files.map(file_descriptor))
        .bytes()
}

fn file_descriptor(file: &File) -> Wire {
    let head = Wire::default().text(1, file.name).text(2, file.package);
    let uses = file.uses.iter();
    uses.fold(head, |wire, file| wire.text(3, file.name))
        .messages(4, file.messages.iter().map(descriptor))
        .text(12, "proto3")
}

fn descriptor(Message(name, fields): &Message) -> Wire {
    let fields = fields.iter().zip(1..).map(|((name, holds), number)| {
        let field = Wire::default().text(1, name).whole(3, number);
        const OPTIONAL: u64 = 1;
        let typed = |kind| field.whole(4, OPTIONAL).whole(5, kind);
        match holds {
            Holds::Double => typed(1),
            Holds::Whole(kind) => typed(*kind),
            Holds::Text => typed(9),
            Holds::Message(of) => typed(11).text(6, of),
            Holds::Name(of) => typed(14).text(6, of),
        }
    });
    let message = Wire::default().text(1, name).messages(2, fields);
    match *name {
        "Log" => message.message(4, levels()),
        _ => message,
    }
}

fn levels() -> Wire {
    let names = ["UNKNOWN", "DEBUG", "INFO", "WARNING", "ERROR", "FATAL"];
    let values = names.iter().zip(0..);
    let value = |(name, number): (&&str, u64)| Wire::default().text(1, name).whole(2, number);
    Wire::default()
        .text(1, "Level")
        .messages(2, values.map(value))
}
