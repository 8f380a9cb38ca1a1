//! Poses from a text file with a pose a line.

mod arrangement;
mod parts;
mod plain;
mod rows;
mod sample;
mod settle;

use std::path::{Path, PathBuf};

use super::collect::Collector;
use super::kitti;
use super::layout::{Layout, Order, Stamp, is_comment};
use super::table::Separator;
use super::text::{Line, Text};
use crate::error::Place;
use crate::{Error, Format, LoadOptions, ReadOption, Remark, RemarkKind, Trajectory};
use parts::{Reader, Rows};
use sample::{SAMPLE, coarseness};

pub(super) use sample::Sample;
pub(super) use settle::{Clock, settle};

/// Reads a text whose layout is found from its content, or that of `format` where the user named it.
pub(crate) fn read(
    path: &Path,
    bytes: &[u8],
    format: Option<Format>,
    times: Option<PathBuf>,
    options: &LoadOptions,
) -> Result<Trajectory, Error> {
    let mut collector = Collector::new(path, options);
    let text = Text::new(path, bytes, &mut collector.report)?;
    let mut layout = named_layout(path, &text, format, options)?;
    if let Some(times) = times
        && layout.stamp == Stamp::None
    {
        let stamps = kitti::read_times(&times)?;
        collector.take_times(times, stamps);
    }
    let first: Vec<Line<'_>> = data_lines(&text, &layout).take(SAMPLE).collect();
    let sample = Sample::new(path, &first, &layout);
    let clock = settle(path, &mut layout, &sample, options, &mut collector)?;
    collector.report.length_unit = (layout.metres != 1.0).then_some(layout.metres);
    let before = layout.header_line.unwrap_or(0);
    let rows = Rows::Text(text.behind(before), before);
    read_rows(path, rows, &first, &layout, clock, collector)
}

/// The lines that hold data.
pub(super) fn data_lines<'a>(
    text: &'a Text<'_>,
    layout: &Layout,
) -> impl Iterator<Item = Line<'a>> {
    let header = layout.header_line.unwrap_or(0);
    text.lines()
        .filter(move |line| line.number > header && !is_comment(line.text))
}

/// The layout found in the text; where the user named a format that it does not suit, the usual one of that format.
pub(super) fn named_layout(
    path: &Path,
    text: &Text<'_>,
    format: Option<Format>,
    options: &LoadOptions,
) -> Result<Layout, Error> {
    let found = Layout::find(path, text, options);
    let Some(format) = format else {
        return found;
    };
    match found {
        Ok(layout) if suits(format, &layout) => Ok(Layout { format, ..layout }),
        Err(fault) if options.columns.is_some() => Err(fault),
        _ if matches!(format, Format::Kitti | Format::Tum | Format::Euroc) => {
            let first = text.lines().find(|line| !is_comment(line.text));
            let separator = first.map_or(Separator::Blanks, |line| Separator::of(line.text));
            Ok(Layout::of_format(format, separator))
        }
        Err(fault) => Err(fault),
        Ok(layout) => Err(Error::input(
            path,
            Place::File,
            format!("the format {format}"),
            format!("what looks like {}", layout.format),
            "leave the format to be found, or choose another one",
        )
        .option(ReadOption::Format)),
    }
}

fn suits(format: Format, layout: &Layout) -> bool {
    let headed = layout.order != Order::Habit;
    format == layout.format
        || matches!(
            format,
            Format::Csv | Format::Npy | Format::Npz | Format::Json | Format::Echo
        )
        || matches!((format, layout.format), (Format::Matrix, Format::Kitti))
        || headed && matches!(format, Format::Tum | Format::Euroc)
}

/// Reads the poses of some lines of data.
pub(super) fn read_lines(
    path: &Path,
    lines: &[Line<'_>],
    layout: &Layout,
    clock: Clock,
    collector: Collector<'_>,
) -> Result<Trajectory, Error> {
    read_rows(path, Rows::Lines(lines), lines, layout, clock, collector)
}

/// Reads the poses of rows, of which some of the first are at hand as lines.
fn read_rows(
    path: &Path,
    rows: Rows<'_>,
    first: &[Line<'_>],
    layout: &Layout,
    clock: Clock,
    mut collector: Collector<'_>,
) -> Result<Trajectory, Error> {
    if let Some((decimals, deviation)) = coarseness(first, layout) {
        collector.matrices_are_coarse(deviation);
        let words = format!(
            "the matrices are written with {decimals} decimals: replaced by the nearest rotations"
        );
        collector
            .report
            .remarks
            .push(Remark::new(RemarkKind::Encoding, words));
    }
    if let Clock::Unit(unit) = clock {
        collector.stamps_in(unit);
    }
    let reader = Reader {
        path,
        layout,
        clock,
    };
    reader.read(rows, &mut collector)?;
    match clock {
        Clock::Unit(_) => collector.finish(layout.format),
        Clock::Index | Clock::Rows => collector.finish_without_stamps(layout.format),
    }
}
