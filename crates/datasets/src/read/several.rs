//! Several logs in one table, told apart by a column.

use std::collections::HashMap;
use std::path::Path;

use super::collect::Collector;
use super::layout::{Layout, Stamp};
use super::numbers::{StampFault, decimal};
use super::sheet::{self, Sample};
use super::table::shorten;
use super::text::{Line, Text};
use crate::error::Place;
use crate::{Error, Format, LoadOptions, ReadOption, Remark, RemarkKind, StampUnit, Trajectory};

/// The rows of one log.
struct Part<'a> {
    value: &'a str,
    lines: Vec<Line<'a>>,
    /// A last line of the file behind it that is cut off before the end of its value.
    cut_off: bool,
}

/// Reads one log for each value of a column, in the order in which the values come first; its name is the value, its
/// rows are those of the file. A log that cannot be read does not stop the others.
///
/// Units and orders that the file leaves open are those of one table: the longest log decides them for all.
pub(crate) fn read(
    path: &Path,
    bytes: &[u8],
    format: Option<Format>,
    column: &str,
    options: &LoadOptions,
) -> Result<Vec<Result<Trajectory, Error>>, Error> {
    let mut shared = Collector::new(path, options);
    let text = Text::new(path, bytes, &mut shared.report)?;
    let mut layout = sheet::named_layout(path, &text, format, options)?;
    let at = position(path, &layout, column)?;
    let mut parts = split(
        path,
        &sheet::data_lines(&text, &layout).collect::<Vec<_>>(),
        &layout,
        at,
        column,
    )?;
    let unsorted: Vec<Option<usize>> = parts
        .iter_mut()
        .map(|part| sort(&mut part.lines, &layout))
        .collect();
    let longest = parts.iter().max_by_key(|part| part.lines.len());
    let longest = longest.map_or(&[][..], |part| &part.lines);
    let sample = Sample::new(path, longest, &layout);
    let clock = sheet::settle(path, &mut layout, &sample, options, &mut shared)?;
    shared.report.length_unit = (layout.metres != 1.0).then_some(layout.metres);
    let logs = parts.iter().zip(unsorted).map(|(part, unsorted)| {
        let mut collector = Collector::new(path, options);
        collector.report.clone_from(&shared.report);
        collector.report.truncated_tail += usize::from(part.cut_off);
        let mut remark = |kind, text: String| {
            let remark = Remark::new(kind, text).option(ReadOption::LogColumn);
            collector.report.remarks.push(remark);
        };
        let rows = part.lines.len();
        let text = format!("{rows} rows with `{}` in the column `{column}`", part.value);
        remark(RemarkKind::Columns, text);
        if let Some(line) = unsorted {
            let text = format!(
                "rows were not in the order of their stamps (line {line} goes back): sorted by stamp"
            );
            remark(RemarkKind::Sorted, text);
        }
        let log = sheet::read_lines(path, &part.lines, &layout, clock, collector);
        let mut log = log.map_err(|fault| of_log(fault, part.value))?;
        log.name = part.value.to_owned();
        log.group.clone_from(&log.name);
        Ok(log)
    });
    Ok(logs.collect())
}

/// The column of that name, else of that number, counted from 1.
fn position(path: &Path, layout: &Layout, column: &str) -> Result<usize, Error> {
    let named = |name: &String| name.eq_ignore_ascii_case(column);
    let numbered = || column.parse::<usize>().ok()?.checked_sub(1);
    layout
        .names
        .iter()
        .position(|name| name == column)
        .or_else(|| layout.names.iter().position(named))
        .or_else(numbered)
        .ok_or_else(|| {
            let found = if layout.names.is_empty() {
                "no header".to_owned()
            } else {
                format!("`{}`", shorten(&layout.names.join(",")))
            };
            Error::input(
                path,
                Place::File,
                format!("a column `{column}` that names the logs"),
                found,
                "say the column by its name in the header or by its number from 1",
            )
            .option(ReadOption::LogColumn)
        })
}

/// The lines of each value.
fn split<'a>(
    path: &Path,
    lines: &[Line<'a>],
    layout: &Layout,
    at: usize,
    column: &str,
) -> Result<Vec<Part<'a>>, Error> {
    let mut parts: Vec<Part<'a>> = Vec::new();
    let mut places: HashMap<&str, usize> = HashMap::new();
    let (mut fields, mut last): (_, Option<usize>) = (Vec::new(), None);
    for line in lines {
        layout.separator.split(line.text, &mut fields);
        let value = fields.get(at).copied().filter(|value| !value.is_empty());
        let known = value.and_then(|value| places.get(value).copied());
        // A last line that ends within its value, or before it, is cut off; nobody knows whose it was.
        let cut = line.unterminated
            && known.is_none()
            && (value.is_none() || at + 1 == fields.len() && parts.len() > 1);
        let place = match (known, value) {
            (Some(place), _) => place,
            (None, Some(value)) if !cut => {
                places.insert(value, parts.len());
                parts.push(Part {
                    value,
                    lines: Vec::new(),
                    cut_off: false,
                });
                parts.len() - 1
            }
            _ => match last {
                Some(place) if cut => {
                    parts[place].cut_off = true;
                    break;
                }
                _ => {
                    let fault = Error::input(
                        path,
                        Place::Line(line.number),
                        format!("the name of a log in the column `{column}`"),
                        "nothing",
                        "each row says which log it belongs to",
                    );
                    return Err(fault.option(ReadOption::LogColumn));
                }
            },
        };
        parts[place].lines.push(*line);
        last = Some(place);
    }
    Ok(parts)
}

/// Sorts the lines of a log by their stamps; the number of the first line whose stamp goes back, where one does.
fn sort(lines: &mut Vec<Line<'_>>, layout: &Layout) -> Option<usize> {
    let columns = match layout.stamp {
        Stamp::None => return None,
        Stamp::Column(column, _) | Stamp::Index(column) => (column, None),
        Stamp::Pair(seconds, part, unit) => (seconds, Some((part, unit))),
    };
    let mut fields = Vec::new();
    // A row without a stamp stays behind the row before it.
    let mut before = i128::MIN;
    let mut keyed: Vec<(i128, Line<'_>)> = Vec::with_capacity(lines.len());
    for line in lines.iter() {
        layout.separator.split(line.text, &mut fields);
        let number = |column: usize| fields.get(column).and_then(|field| key(field));
        let part = |(column, unit): (usize, StampUnit)| {
            Some(number(column)? * 10_i128.pow(unit.shift().unsigned_abs()) / NANO)
        };
        let part = columns.1.and_then(part).unwrap_or(0);
        before = number(columns.0).map_or(before, |key| key + part);
        keyed.push((before, *line));
    }
    let back = keyed.windows(2).find(|pair| pair[1].0 < pair[0].0)?[1]
        .1
        .number;
    keyed.sort_by_key(|(key, _)| *key);
    lines.clear();
    lines.extend(keyed.into_iter().map(|(_, line)| line));
    Some(back)
}

const NANO: i128 = 1_000_000_000;

/// A number in billionths of its unit, exactly where it has at most nine decimals.
fn key(field: &str) -> Option<i128> {
    match decimal(field, 9) {
        Ok(value) => Some(i128::from(value)),
        Err(StampFault::OutOfRange) => Some(i128::from(decimal(field, 0).ok()?) * NANO),
        Err(StampFault::NotANumber) => None,
    }
}

/// Says in which log of the table a fault is.
fn of_log(mut fault: Error, value: &str) -> Error {
    if let Error::Input(input) = &mut fault {
        input.found = format!("{} (log `{value}`)", input.found);
    }
    fault
}
