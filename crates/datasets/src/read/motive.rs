//! Tables of OptiTrack's Motive: several lines of header above the columns of every rigid body, bone and marker.

use std::collections::HashSet;
use std::path::Path;

use super::columns::length_unit;
use super::table::Separator;
use crate::error::Place;
use crate::{Error, LoadOptions, ReadOption};

/// Lines of header at most.
const LINES: usize = 16;

/// A table of Motive with one line of header, in the place of the last of its own.
pub(crate) struct Table {
    /// Blank lines, the header and the data, each where it was.
    pub text: String,
    /// The rigid body that was taken.
    pub body: String,
}

/// True for a text that begins as Motive's tables do.
pub(crate) fn detect(text: &str) -> bool {
    text.trim_start_matches('\u{feff}')
        .starts_with("Format Version,")
}

/// The columns of the one rigid body that is meant.
///
/// # Errors
/// Several bodies of which none is chosen, rotations that are no quaternions, a header that is cut off.
pub(crate) fn table(path: &Path, text: &str, options: &LoadOptions) -> Result<Table, Error> {
    let text = text.trim_start_matches('\u{feff}');
    let rows: Vec<Vec<&str>> = text.lines().take(LINES).map(fields).collect();
    let fault = |line: usize, wanted: &str, found: String, hint: &str| {
        Error::input(path, Place::Line(line), wanted, found, hint)
    };
    let Some(last) = rows.iter().position(|row| row.first() == Some(&"Frame")) else {
        let found = "none in the first lines".to_owned();
        let hint = "is the file cut off? Export it again";
        return Err(fault(
            1,
            "a line of column names that begins with Frame",
            found,
            hint,
        ));
    };
    let row = |name: &str| rows[..last].iter().find(|row| row.get(1) == Some(&name));
    let kinds = rows[..last].last().filter(|row| row.contains(&"Position"));
    let (Some(types), Some(names), Some(kinds)) = (row("Type"), row("Name"), kinds) else {
        let found = "a header without Type, Name or Position".to_owned();
        let hint = "export the take with header information";
        return Err(fault(last + 1, "a table of Motive", found, hint));
    };
    let is_body = |column: &usize| types.get(*column) == Some(&"Rigid Body");
    let name = |column: usize| names.get(column).copied().unwrap_or_default();
    let mut known = HashSet::new();
    let columns = (0..types.len()).filter(is_body);
    let mut bodies: Vec<&str> = columns
        .map(name)
        .filter(|body| known.insert(*body))
        .collect();
    let all = bodies.join(", ");
    if !options.topics.is_empty() {
        bodies.retain(|body| options.topics.iter().any(|topic| topic == body));
    }
    let body = match bodies[..] {
        [body] => body,
        [] => {
            let found = match all.as_str() {
                "" => "none".to_owned(),
                all => format!("the bodies {all}"),
            };
            let fault = fault(last + 1, "a rigid body", found, "choose one of these");
            return Err(fault.option(ReadOption::Topic));
        }
        _ => {
            let found = format!("{} bodies: {all}", bodies.len());
            let fault = fault(last + 1, "one rigid body", found, "say which one is meant");
            return Err(fault.option(ReadOption::Topic));
        }
    };
    let axes = &rows[last];
    let own = |column: usize| is_body(&column) && name(column) == body;
    let is_rotation = |column: usize| own(column) && kinds.get(column) == Some(&"Rotation");
    if !(0..axes.len()).any(|column| is_rotation(column) && axes[column] == "W") {
        let found = format!("angles of `{body}`");
        let hint = "export the take with Rotation Type Quaternion";
        return Err(fault(last + 1, "rotations as quaternions", found, hint));
    }
    let first = &rows[0];
    let unit = first.iter().position(|field| *field == "Length Units");
    let unit = unit
        .and_then(|at| first.get(at + 1))
        .copied()
        .unwrap_or("Meters");
    let unit = unit.to_ascii_lowercase();
    if length_unit(&unit).is_none() {
        let hint = "export the take in meters";
        return Err(fault(1, "a unit of length", format!("`{unit}`"), hint));
    }
    let header = axes.iter().enumerate().map(|(column, axis)| {
        let axis = axis.to_ascii_lowercase();
        match (axis.as_str(), kinds.get(column)) {
            ("x" | "y" | "z" | "w", Some(&"Rotation")) if own(column) => format!("q{axis}"),
            ("x" | "y" | "z", Some(&"Position")) if own(column) => format!("{axis} [{unit}]"),
            (time, _) if time.starts_with("time") => "time [s]".to_owned(),
            _ => format!("other {column}"),
        }
    });
    let header: Vec<String> = header.collect();
    let mut table = "\n".repeat(last);
    table.push_str(&header.join(","));
    for line in text.split_inclusive('\n').skip(last + 1) {
        if !table.ends_with('\n') {
            table.push('\n');
        }
        table.push_str(line);
    }
    Ok(Table {
        text: table,
        body: body.to_owned(),
    })
}

fn fields(line: &str) -> Vec<&str> {
    let mut fields = Vec::new();
    Separator::Character(',').split(line, &mut fields);
    fields
}
