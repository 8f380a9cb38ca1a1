//! Tables of several topics, a column for each of their fields, as PlotJuggler writes them.

use std::path::Path;

use crate::read::columns::{Name, Role, by_header};
use crate::read::text::Line;
use crate::{Error, ReadOption};

/// The roles of the columns of the one topic with poses that is meant; `None` for a header without topics.
///
/// # Errors
/// Several topics with poses of which none is chosen, or none with the name chosen.
pub(super) fn of_header(
    path: &Path,
    line: Line<'_>,
    names: &[Name],
    chosen: &[String],
) -> Result<Option<Vec<(Role, usize)>>, Error> {
    let mut topics: Vec<&str> = Vec::new();
    for name in names {
        if let Some((topic, _)) = pose_of(name)
            && !topics.contains(&topic)
        {
            topics.push(topic);
        }
    }
    // All fields of one pose, and stamps of the same topic or of the table, without the names of topics.
    let roles = |topic: &str| {
        let own = names
            .iter()
            .map(|name| match (stamp_of(name), pose_of(name)) {
                (Some((above, stamp)), _) if is_below(topic, above) => Name::new(stamp),
                (None, Some((of, field))) if of == topic => Name::new(field),
                (None, None) if !name.text.contains('/') => name.clone(),
                _ => Name::new("-"),
            });
        by_header(&own.collect::<Vec<_>>())
    };
    topics.retain(|topic| {
        let roles = roles(topic);
        let count = |is: fn(&Role) -> bool| roles.iter().filter(|(role, _)| is(role)).count();
        count(|role| matches!(role, Role::Position(_))) == 3
            && (count(|role| matches!(role, Role::Quaternion(_))) == 4
                || count(|role| matches!(role, Role::Angle(_))) == 3)
    });
    if topics.is_empty() {
        return Ok(None);
    }
    let fault = |found: String, hint| {
        let wanted = "one topic with poses";
        Error::input(path, line.place(), wanted, found, hint).option(ReadOption::Topic)
    };
    let all = topics.join(", ");
    if !chosen.is_empty() {
        topics.retain(|topic| chosen.iter().any(|chosen| is_below(topic, chosen)));
    }
    match topics[..] {
        [topic] => Ok(Some(roles(topic))),
        [] => Err(fault(format!("poses of {all}"), "choose one of these")),
        _ => Err(fault(
            format!("{} topics: {}", topics.len(), topics.join(", ")),
            "say which one is meant",
        )),
    }
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
    rest.is_some_and(|rest| rest.is_empty() || rest.starts_with('/'))
}
