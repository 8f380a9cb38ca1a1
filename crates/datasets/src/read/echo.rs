//! Messages as `rostopic echo` and `ros2 topic echo` print them: YAML, `---` between messages.

use std::path::Path;

use super::records::{self, Cell, List, MOST, Part};
use super::text::Text;
use crate::error::Place;
use crate::{Error, Format, LoadOptions, LoadReport, Trajectory};

/// Lines looked at for what such a text has.
const SAMPLE: usize = 400;

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

/// One message.
#[derive(Default)]
struct Message<'a> {
    line: usize,
    /// Names joined by points, and values.
    values: Vec<(String, &'a str)>,
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
    let lines: Vec<usize> = messages.iter().map(|message| message.line).collect();
    let list = List {
        name: String::new(),
        length: messages.len(),
        record: Box::new(|index| messages[index].values.iter().map(part).collect()),
        stamps: None,
    };
    let mut log = records::read(path, vec![list], Some(&lines), Format::Echo, options)?;
    log.report.truncated_tail += usize::from(cut_off);
    Ok(log)
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
        // Entries of lists are no part of a pose, but for those of transforms.
        let content = content.trim_start_matches("- ").trim_start();
        let indent = line.len() - line.trim_start_matches([' ', '-']).len();
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
                "several transforms are in one message: record a bag and look a pose up in it";
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
