//! Tables with the poses of several bodies or topics, told apart by what stands before the names of their fields.

use std::collections::HashMap;

use crate::read::columns::{Name, Role, by_header};

/// Topics that a message lists.
const LISTED: usize = 8;

/// The columns of one pose.
pub(crate) struct Topic {
    /// What its names have in common.
    name: String,
    pub roles: Vec<(Role, usize)>,
    /// Whether rows may belong to other topics.
    pub shared: bool,
}

/// The one pose among named columns that is meant, where names are paths (PlotJuggler), or where it is understood only without
/// the words before its fields; `None` for columns of one pose that are understood as they are.
///
/// # Errors
/// Several poses of which none is chosen, or none with the name chosen: what was found, and what to do.
pub(crate) fn choose(
    names: &[Name],
    chosen: &[String],
) -> Result<Option<Topic>, (String, &'static str)> {
    let mut topics = by_path(names);
    if topics.is_empty() {
        topics = by_words(names);
        // Understood as it is, and of one body, or by names without a word before them: nothing has to be chosen.
        let plain = by_header(names);
        let known = topics.iter().filter(|topic| {
            let mut columns = topic.roles.iter().filter(|(role, _)| !role.is_time());
            columns.all(|(_, column)| names[*column].role().is_some())
        });
        let has_words = |topic: &Topic| {
            let mut columns = topic.roles.iter().filter(|(role, _)| !role.is_time());
            columns.any(|column| plain.contains(column))
        };
        let one = known.count() < 2 || !topics.iter().any(has_words);
        if is_complete(&plain) && chosen.is_empty() && one {
            return Ok(None);
        }
    }
    if topics.is_empty() {
        return Ok(None);
    }
    let list = |topics: &[Topic]| {
        let names = topics.iter().map(|topic| topic.name.as_str());
        let listed: Vec<&str> = names.take(LISTED).collect();
        match topics.len().saturating_sub(LISTED) {
            0 => listed.join(", "),
            more => format!("{} and {more} more", listed.join(", ")),
        }
    };
    let all = list(&topics);
    if !chosen.is_empty() {
        topics.retain(|topic| chosen.iter().any(|chosen| is_below(&topic.name, chosen)));
    }
    match topics.len() {
        1 => Ok(topics.pop()),
        0 => Err((format!("poses of {all}"), "choose one of these")),
        n => Err((
            format!("{n} of them: {}", list(&topics)),
            "say which one is meant",
        )),
    }
}

/// Whether roles make a pose.
fn is_complete(roles: &[(Role, usize)]) -> bool {
    let count = |is: fn(&Role) -> bool| roles.iter().filter(|(role, _)| is(role)).count();
    count(|role| matches!(role, Role::Position(_))) == 3
        && (count(|role| matches!(role, Role::Quaternion(_))) == 4
            || count(|role| matches!(role, Role::Angle(_))) == 3
            || count(|role| matches!(role, Role::Matrix(_))) == 9)
}

/// The columns of one topic, and their names without it.
struct Group {
    name: String,
    columns: Vec<usize>,
    fields: Vec<Name>,
}

/// Columns by what stands before the names of their fields, in the order in which that comes first.
fn groups(names: &[Name], split: impl Fn(&Name) -> Option<(String, Name)>) -> Vec<Group> {
    let mut places: HashMap<String, usize> = HashMap::new();
    let mut groups: Vec<Group> = Vec::new();
    for (column, name) in names.iter().enumerate() {
        let Some((topic, field)) = split(name) else {
            continue;
        };
        let place = *places.entry(topic).or_insert_with_key(|topic| {
            groups.push(Group {
                name: topic.clone(),
                columns: Vec::new(),
                fields: Vec::new(),
            });
            groups.len() - 1
        });
        groups[place].columns.push(column);
        groups[place].fields.push(field);
    }
    groups
}

/// Roles among some columns.
fn roles_of(columns: &[usize], fields: &[Name]) -> Vec<(Role, usize)> {
    let roles = by_header(fields).into_iter();
    roles.map(|(role, at)| (role, columns[at])).collect()
}

/// Topics that have all fields of a pose, with the stamps that belong to each.
fn complete(
    groups: Vec<Group>,
    stamps: impl Fn(&str) -> Vec<(Role, usize)>,
    shared: bool,
) -> Vec<Topic> {
    let topics = groups.into_iter().filter_map(|group| {
        let mut roles = roles_of(&group.columns, &group.fields);
        is_complete(&roles).then(|| {
            roles.extend(stamps(&group.name));
            Topic {
                name: group.name,
                roles,
                shared,
            }
        })
    });
    topics.collect()
}

/// Poses whose fields are `TOPIC/position/x`, with stamps of the same topic or of the table.
fn by_path(names: &[Name]) -> Vec<Topic> {
    let poses = groups(names, |name| {
        let (topic, field) = pose_of(name)?;
        Some((topic.to_owned(), Name::new(field)))
    });
    let stamps: HashMap<String, Group> = groups(names, |name| {
        let (topic, stamp) = stamp_of(name)?;
        Some((topic.to_owned(), Name::new(stamp)))
    })
    .into_iter()
    .map(|group| (group.name.clone(), group))
    .collect();
    let table = times(names, |name| !name.text.contains('/'));
    let of = |topic: &str| {
        // Those of the topic, of what it is a part of, and of the table, the nearest first.
        let ends = topic
            .match_indices('/')
            .map(|(at, _)| at)
            .chain([topic.len()]);
        let own = ends.rev().find_map(|end| stamps.get(&topic[..end]));
        match own {
            Some(group) => roles_of(&group.columns, &group.fields),
            None => table.clone(),
        }
    };
    complete(poses, of, true)
}

/// Poses whose fields have the same words before them: `tcp x`, `left_qw`, `gt.x`.
fn by_words(names: &[Name]) -> Vec<Topic> {
    let poses = groups(names, |name| {
        // The longest name that says a field of a pose, so that the words are those of a body and not of its position.
        let is_field = |field: &Name| field.role().is_some_and(|(role, _)| !role.is_time());
        name.parts().find(|(_, field)| is_field(field))
    });
    let table = times(names, |_| true);
    complete(poses, |_| table.clone(), false)
}

/// Roles of stamps among the names that `of` takes.
fn times(names: &[Name], of: impl Fn(&Name) -> bool) -> Vec<(Role, usize)> {
    let is = |name: &Name| of(name) && name.role().is_some_and(|(role, _)| role.is_time());
    let found = names.iter().enumerate().filter(|(_, name)| is(name));
    let (columns, fields): (Vec<usize>, Vec<Name>) =
        found.map(|(column, name)| (column, name.clone())).unzip();
    roles_of(&columns, &fields)
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
