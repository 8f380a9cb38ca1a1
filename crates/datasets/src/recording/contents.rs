//! What a recording holds, for a listing.

use std::collections::BTreeMap;
use std::path::Path;

use serde::Serialize;

use super::message::{self, Kind};
use super::open;
use crate::{Error, LoadOptions, detect, stretch};

/// What is in a recording.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Contents {
    /// All topics, sorted by name.
    pub topics: Vec<Topic>,
    /// The chains of frames from each root to each leaf.
    pub chains: Vec<Chain>,
    /// What is damaged.
    pub damage: Vec<String>,
}

/// One topic.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Topic {
    /// Its name.
    pub name: String,
    /// The type of its messages, like `nav_msgs/Odometry`.
    pub kind: String,
    /// Number of messages, where the recording says it or they were read.
    pub messages: Option<u64>,
    /// Messages a second by the stamps of their headers, for topics of poses.
    pub hertz: Option<f64>,
    /// The frame that poses are given in.
    pub frame: Option<String>,
    /// The frame of the body.
    pub child_frame: Option<String>,
    /// True for a topic whose poses can be judged.
    pub poses: bool,
    /// Why not, for a topic that looks as if it could.
    pub refused: Option<&'static str>,
}

/// Frames from a root down, each with the rate of its transform in the one before; 0 for a fixed one.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Chain {
    /// Names of the frames.
    pub frames: Vec<String>,
    /// Transforms a second; `None` for a static one. One less than frames.
    pub hertz: Vec<Option<f64>>,
}

/// Messages of a topic that are looked at.
const SEEN: u64 = 200;

#[derive(Default)]
struct Seen {
    stamps: Vec<i64>,
    frame: Option<String>,
    child: Option<String>,
}

/// Lists what a recording holds; `None` for a path that is none.
///
/// # Errors
/// Those of opening and reading it.
pub fn contents(path: &Path, options: &LoadOptions) -> Result<Option<Contents>, Error> {
    let format = match options.format {
        Some(format) => format,
        None => match detect(path) {
            Ok(format) => format,
            Err(Error::Io { path, source }) => return Err(Error::Io { path, source }),
            Err(_) => return Ok(None),
        },
    };
    if !format.is_recording() {
        return Ok(None);
    }
    let recording = open(path, format)?;
    let mut counts: BTreeMap<&str, u64> = BTreeMap::new();
    let parts: Vec<_> = recording
        .parts
        .iter()
        .map(|part| (part, part.counts()))
        .collect();
    for (part, known) in &parts {
        for channel in part.channels() {
            let count = known.get(&channel.id).copied().unwrap_or(0);
            *counts.entry(&channel.topic).or_default() += count;
        }
    }
    let is_poses = |kind: &str| matches!(message::kind(kind), Kind::Pose(_) | Kind::Path);
    let channels = || parts.iter().flat_map(|(part, _)| part.channels());
    // Topics of which more messages are to be seen: the first ones tell rate and frames.
    let mut open: BTreeMap<&str, u64> = channels()
        .filter(|channel| is_poses(&channel.kind))
        .map(|channel| {
            (
                channel.topic.as_str(),
                counts[channel.topic.as_str()].min(SEEN),
            )
        })
        .collect();
    open.retain(|_, left| *left > 0);
    let mut seen: BTreeMap<String, Seen> = BTreeMap::new();
    recording.messages(
        |channel| is_poses(&channel.kind),
        &mut |channel, time, content| {
            let entry = seen.entry(channel.topic.clone()).or_default();
            if let Kind::Pose(shape) = message::kind(&channel.kind)
                && let Some(pose) = message::pose(content, channel.encoding, shape)
            {
                entry.stamps.push(pose.stamp.unwrap_or(time));
                entry.frame.get_or_insert(pose.parent);
                entry.child.get_or_insert(pose.child);
            }
            if let Some(left) = open.get_mut(channel.topic.as_str()) {
                *left -= 1;
                if *left == 0 {
                    open.remove(channel.topic.as_str());
                }
            }
            Ok(!open.is_empty())
        },
    )?;
    let mut topics: BTreeMap<String, Topic> = BTreeMap::new();
    for channel in channels() {
        topics.entry(channel.topic.clone()).or_insert_with(|| {
            let found = seen.get(&channel.topic);
            let named = |name: Option<&String>| name.filter(|name| !name.is_empty()).cloned();
            let kind = message::kind(&channel.kind);
            Topic {
                name: channel.topic.clone(),
                kind: channel.kind.clone(),
                messages: counts.get(channel.topic.as_str()).copied(),
                hertz: found
                    .and_then(|seen| stretch::median_step(&seen.stamps))
                    .map(|step| 1.0 / step),
                frame: named(found.and_then(|seen| seen.frame.as_ref())),
                child_frame: named(found.and_then(|seen| seen.child.as_ref())),
                poses: matches!(kind, Kind::Pose(_) | Kind::Path),
                refused: match kind {
                    Kind::Refused(reason) => Some(reason),
                    _ => None,
                },
            }
        });
    }
    let chains = recording.tree()?.chains().into_iter().map(|chain| Chain {
        hertz: chain.iter().skip(1).map(|link| link.hertz).collect(),
        frames: chain.into_iter().map(|link| link.frame).collect(),
    });
    Ok(Some(Contents {
        topics: topics.into_values().collect(),
        chains: chains.collect(),
        damage: recording
            .remarks
            .iter()
            .map(|remark| remark.text.clone())
            .collect(),
    }))
}
