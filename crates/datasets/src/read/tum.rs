//! TUM RGB-D trajectories: `timestamp tx ty tz qx qy qz qw`, seconds and metres, `#` begins a comment.

use std::path::Path;

use super::collect::{Collector, pose};
use super::table::Row;
use super::text::Text;
use crate::{Error, Format, LoadOptions, StampUnit, Trajectory};

const COLUMNS: usize = 8;

pub(crate) fn read(path: &Path, options: &LoadOptions) -> Result<Trajectory, Error> {
    let mut collector = Collector::new(path, options);
    let text = Text::read(path, &mut collector.report)?;
    for line in text.lines().filter(|line| !line.text.starts_with('#')) {
        let row = Row::spaces(path, &line);
        if row.is_cut_off(COLUMNS) {
            collector.report.truncated_tail += 1;
            continue;
        }
        if row.len() != COLUMNS {
            let hint =
                "a TUM line is `timestamp tx ty tz qx qy qz qw`; --format chooses another format";
            return Err(row.wrong_length("8 numbers", hint));
        }
        let stamp = row.stamp(0, StampUnit::Seconds)?;
        let translation = [
            row.coordinate(1, "tx")?,
            row.coordinate(2, "ty")?,
            row.coordinate(3, "tz")?,
        ];
        let [x, y, z, w] = [
            row.number(4, "qx")?,
            row.number(5, "qy")?,
            row.number(6, "qz")?,
            row.number(7, "qw")?,
        ];
        let rotation = collector.quaternion(row.place(), w, x, y, z)?;
        collector.push(row.place(), stamp, pose(rotation, translation))?;
    }
    collector.stamps_in(StampUnit::Seconds);
    collector.finish(Format::Tum)
}
