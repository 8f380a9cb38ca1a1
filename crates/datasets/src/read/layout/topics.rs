//! Tables with the poses of several bodies or topics, told apart by what stands before the names of their fields.

use std::path::Path;

use crate::read::columns::{Name, Role, by_header};
use crate::read::text::Line;
use crate::{Error, ReadOption};

/// The columns of one pose.
pub(super) struct Topic {
    /// What its names have in common.
    name: String,
    pub roles: Vec<(Role, usize)>,
    /// Whether rows may belong to other topics.
    pub shared: bool,
}

/// The one pose of a header that is meant, where names are paths (PlotJuggler), or where it is understood only without the words
/// before its fields; `None` for a header of one pose that is understood as it is.
///
/// # Errors
/// Several poses of which none is chosen, or none with the name chosen.
pub(super) fn of_header(
    path: &Path,
    line: Line<'_>,
    names: &[Name],
    chosen: &[String],
) -> Result<Option<Topic>, Error> {
    let mut topics = by_path(names);
    if topics.is_empty() {
        topics = by_words(names);
        // Understood as it is, and all of it of one body: nothing has to be chosen.
        let plain = is_complete(&by_header(names));
        let known = |topic: &Topic| {
            let columns = topic.roles.iter().filter(|(role, _)| !is_time(*role));
            columns
                .clone()
                .all(|(_, column)| names[*column].role().is_some())
        };
        if plain && chosen.is_empty() && topics.iter().filter(|topic| known(topic)).count() < 2 {
            return Ok(None);
        }
    }
    if topics.is_empty() {
        return Ok(None);
    }
    let fault = |found: String, hint| {
        let wanted = "the columns of one pose";
        Error::input(path, line.place(), wanted, found, hint).option(ReadOption::Topic)
    };
    let list = |topics: &[Topic]| {
        let names: Vec<&str> = topics.iter().map(|topic| topic.name.as_str()).collect();
        names.join(", ")
    };
    let all = list(&topics);
    if !chosen.is_empty() {
        topics.retain(|topic| chosen.iter().any(|chosen| is_below(&topic.name, chosen)));
    }
    match topics.len() {
        1 => Ok(topics.pop()),
        0 => Err(fault(format!("poses of {all}"), "choose one of these")),
        n => Err(fault(
            format!("{n} of them: {}", list(&topics)),
            "say which one is meant",
        )),
    }
}

fn is_time(role: Role) -> bool {
    matches!(role, Role::Stamp | Role::Seconds | Role::Nanoseconds)
}

/// Whether roles make a pose.
fn is_complete(roles: &[(Role, usize)]) -> bool {
    let count = |is: fn(&Role) -> bool| roles.iter().filter(|(role, _)| is(role)).count();
    count(|role| matches!(role, Role::Position(_))) == 3
        && (count(|role| matches!(role, Role::Quaternion(_))) == 4
            || count(|role| matches!(role, Role::Angle(_))) == 3
            || count(|role| matches!(role, Role::Matrix(_))) == 9)
}

/// Poses whose fields are `TOPIC/position/x`, with stamps of the same topic or of the table.
fn by_path(names: &[Name]) -> Vec<Topic> {
    let found = names
        .iter()
        .filter_map(|name| Some(pose_of(name)?.0.to_owned()));
    let roles = |topic: &str| {
        let own = names
            .iter()
            .map(|name| match (stamp_of(name), pose_of(name)) {
                (Some((above, stamp)), _) if is_below(topic, above) => Name::new(stamp),
                (None, Some((of, field))) if of == topic => Name::new(field),
                (None, None) if !name.text.contains('/') => name.clone(),
                _ => Name::nothing(),
            });
        by_header(&own.collect::<Vec<_>>())
    };
    complete(found, roles, true)
}

/// Poses whose fields have the same words before them: `tcp x`, `left_qw`, `gt.x`.
fn by_words(names: &[Name]) -> Vec<Topic> {
    // The longest name that says a field of a pose, so that the words are those of a body and not of its position.
    let split = |name: &Name| {
        name.parts()
            .find(|(_, field)| field.role().is_some_and(|(role, _)| !is_time(role)))
    };
    let found = names.iter().filter_map(|name| Some(split(name)?.0));
    let roles = |words: &str| {
        let own = names.iter().map(|name| match split(name) {
            Some((before, field)) if before == words => field,
            None if name.role().is_some_and(|(role, _)| is_time(role)) => name.clone(),
            _ => Name::nothing(),
        });
        by_header(&own.collect::<Vec<_>>())
    };
    complete(found, roles, false)
}

/// The topics that have all fields of a pose.
fn complete(
    found: impl Iterator<Item = String>,
    roles: impl Fn(&str) -> Vec<(Role, usize)>,
    shared: bool,
) -> Vec<Topic> {
    let mut topics: Vec<Topic> = Vec::new();
    for name in found {
        if topics.iter().all(|topic| topic.name != name) {
            let roles = roles(&name);
            topics.push(Topic {
                name,
                roles,
                shared,
            });
        }
    }
    topics.retain(|topic| is_complete(&topic.roles));
    topics
}

/// `/odom/pose/pose` and `position/x` of `/odom/pose/pose/position/x`.
fn pose_of(name: &Name) -> Option<(&str, &str)> {
    let (above, _) = name.text.rsplit_once('/')?;
    let (above, field) = above.rsplit_once('/')?;
    let fields = ["position", "orientation", "translation", "rotation"];
    let part = &name.text[above.len() + 1..];
    (fields.contains(&field) && Name::new(part).role().is_some()).then_some((above, part))
}

/// `/odom` and `header/stamp` of `/odom/header/stamp`.
fn stamp_of(name: &Name) -> Option<(&str, &str)> {
    let at = name.text.find("/header/stamp")?;
    Some((&name.text[..at], &name.text[at + 1..]))
}

/// Whether a topic is `above`, or a part of it.
fn is_below(topic: &str, above: &str) -> bool {
    let rest = topic.strip_prefix(above.trim_end_matches('/'));
    rest.is_some_and(|rest| rest.is_empty() || rest.starts_with(['/', ' ']))
}
