//! Messages as `rostopic echo` and `ros2 topic echo` print them: YAML, `---` between messages.

use std::path::Path;

use super::records::{self, Cell, List, MOST, Part};
use super::text::Text;
use crate::error::Place;
use crate::{Error, Format, LoadOptions, LoadReport, ReadOption, Trajectory};

/// Lines looked at for what such a text has.
const SAMPLE: usize = 400;
/// Pairs of frames that a message lists.
const LISTED: usize = 8;

/// True for a text that looks like printed messages with poses.
pub(crate) fn detect(text: &str) -> bool {
    let lines = || text.lines().take(SAMPLE).map(str::trim);
    let first = lines().find(|line| !line.is_empty() && *line != "---");
    let begins = first.is_some_and(|line| {
        let key = line.split(':').next().unwrap_or_default();
        line.contains(':') && key.bytes().all(|b| b.is_ascii_lowercase() || b == b'_')
    });
    begins
        && lines().any(|line| line == "---")
        && lines().any(|line| matches!(line, "position:" | "translation:"))
}

/// One message, or one transform of a message with a list of them.
#[derive(Default)]
struct Message<'a> {
    line: usize,
    /// Names joined by points, and values.
    values: Vec<(String, &'a str)>,
}

impl Message<'_> {
    /// The frames of a transform.
    fn frames(&self) -> (&str, &str) {
        let value = |name: &str| {
            let mut values = self.values.iter();
            let found = values.find(|(known, _)| known == name);
            found.map_or("", |(_, frame)| frame.trim_start_matches('/'))
        };
        (
            value("transforms.header.frame_id"),
            value("transforms.child_frame_id"),
        )
    }
}

/// The poses of the messages in a text.
pub(crate) fn read(path: &Path, bytes: &[u8], options: &LoadOptions) -> Result<Trajectory, Error> {
    let text = Text::new(path, bytes, &mut LoadReport::default())?;
    let (mut messages, cut_off) = messages(path, text.as_str())?;
    let fields = messages.first().map_or(0, |message| message.values.len());
    let cut_off = cut_off
        && messages
            .last()
            .is_some_and(|last| last.values.len() < fields);
    if cut_off {
        messages.pop();
    }
    choose(path, &mut messages, options)?;
    let lines: Vec<usize> = messages.iter().map(|message| message.line).collect();
    let list = List {
        name: String::new(),
        length: messages.len(),
        record: Box::new(|index| messages[index].values.iter().map(part).collect()),
        stamps: None,
        unit: None,
    };
    // Which topic was printed is not in the text.
    let options = LoadOptions {
        topics: Vec::new(),
        ..options.clone()
    };
    let mut log = records::read(path, vec![list], Some(&lines), Format::Echo, &options)?;
    log.report.truncated_tail += usize::from(cut_off);
    Ok(log)
}

/// Leaves the transforms between the two frames that are meant.
fn choose(
    path: &Path,
    messages: &mut Vec<Message<'_>>,
    options: &LoadOptions,
) -> Result<(), Error> {
    let pair = |message: &Message<'_>| {
        let (parent, child) = message.frames();
        format!("{parent}:{child}")
    };
    let mut pairs: Vec<String> = messages.iter().map(pair).collect();
    pairs.sort_unstable();
    pairs.dedup();
    pairs.retain(|pair| pair != ":");
    let chosen = match (&options.tf, &pairs[..]) {
        (_, []) | (None, [_]) => return Ok(()),
        (Some((parent, child)), pairs) => {
            let plain = |frame: &str| frame.trim_start_matches('/').to_owned();
            let wanted = format!("{}:{}", plain(parent), plain(child));
            pairs.iter().find(|pair| **pair == wanted)
        }
        (None, _) => None,
    };
    let Some(chosen) = chosen else {
        let found = match pairs.len().saturating_sub(LISTED) {
            0 => pairs.join(", "),
            more => format!("{} and {more} more", pairs[..LISTED].join(", ")),
        };
        let hint = "name one pair of frames; a pose over several transforms is looked up in a bag";
        let fault = Error::input(
            path,
            Place::File,
            "transforms between the two frames",
            found,
            hint,
        );
        return Err(fault.option(ReadOption::Tf));
    };
    messages.retain(|message| pair(message) == *chosen);
    Ok(())
}

fn part<'a>((name, value): &(String, &'a str)) -> Part<'a> {
    Part {
        name: name.clone(),
        cells: vec![Cell::Word(value)],
        is_pose: false,
    }
}

/// All messages, and whether the last one has no end.
fn messages<'a>(path: &Path, text: &'a str) -> Result<(Vec<Message<'a>>, bool), Error> {
    let (mut messages, mut message) = (Vec::new(), Message::default());
    // Names above, with the blanks before each.
    let mut above: Vec<(usize, &str)> = Vec::new();
    let mut ended = true;
    for (number, line) in text.lines().enumerate().map(|(at, line)| (at + 1, line)) {
        let content = line.trim();
        if content == "---" {
            if !message.values.is_empty() {
                messages.push(std::mem::take(&mut message));
            }
            above.clear();
            ended = true;
            continue;
        }
        let indent = line.len() - line.trim_start_matches([' ', '-']).len();
        let is_entry = content == "-" || content.starts_with("- ");
        if is_entry {
            above.retain(|(before, _)| *before < indent);
        }
        if is_entry && matches!(above[..], [(_, "transforms")]) && !message.values.is_empty() {
            messages.push(std::mem::take(&mut message));
        }
        // Entries of other lists are no part of a pose.
        let content = content.trim_start_matches("- ").trim_start();
        let (key, value) = match content.split_once(": ") {
            Some((key, value)) => (key, value.trim()),
            None => match content.strip_suffix(':') {
                Some(key) => (key, ""),
                None => continue,
            },
        };
        above.retain(|(before, _)| *before < indent);
        if value.is_empty() {
            above.push((indent, key));
            continue;
        }
        ended = false;
        if message.values.is_empty() {
            message.line = number;
        }
        let names = above.iter().map(|(_, name)| *name).chain([key]);
        let name = names.collect::<Vec<_>>().join(".");
        if message.values.iter().any(|(known, _)| *known == name) {
            let found = format!("`{name}` twice");
            let hint =
                "several poses are in one message: record a bag, or write its poses one a line";
            let wanted = "one pose in each message";
            return Err(Error::input(path, Place::Line(number), wanted, found, hint));
        }
        if message.values.len() < MOST {
            let value = value.trim_matches(|c| c == '"' || c == '\'');
            message.values.push((name, value));
        }
    }
    if !message.values.is_empty() {
        messages.push(message);
    }
    Ok((messages, !ended))
}
