//! EuRoC MAV ground truth: comma-separated, nanoseconds, position in metres, quaternion with w first.

use std::path::Path;

use super::collect::{Collector, pose};
use super::records::Records;
use super::table::{Row, shorten};
use super::text::Text;
use crate::{Error, Format, LoadOptions, StampUnit, Trajectory};

/// Column names as the header has them, in the order used here; the files also carry velocities and biases.
const NAMES: [&str; 8] = [
    "timestamp",
    "p_rs_r_x",
    "p_rs_r_y",
    "p_rs_r_z",
    "q_rs_w",
    "q_rs_x",
    "q_rs_y",
    "q_rs_z",
];

pub(crate) fn read(path: &Path, options: &LoadOptions) -> Result<Trajectory, Error> {
    let mut collector = Collector::new(path, options);
    let text = Text::read(path, &mut collector.report)?;
    // Without a header the columns are those of the published files.
    let mut column = [0, 1, 2, 3, 4, 5, 6, 7];
    let mut records = Records::new(path, &text);
    while let Some(row) = records.next_row()? {
        if row.fields()[0].starts_with('#') {
            if row.len() > 1 {
                column = columns(path, &row)?;
            }
            continue;
        }
        let needed = 1 + column.iter().copied().max().unwrap_or(0);
        if row.is_cut_off(needed) {
            collector.report.truncated_tail += 1;
            continue;
        }
        if row.len() < needed {
            let hint = "a EuRoC line is `timestamp,px,py,pz,qw,qx,qy,qz,...`; --format chooses another format";
            return Err(row.wrong_length(format!("at least {needed} numbers"), hint));
        }
        let stamp = row.stamp(column[0], StampUnit::Nanoseconds)?;
        let mut translation = [0.0; 3];
        for axis in 0..3 {
            translation[axis] = row.coordinate(column[1 + axis], NAMES[1 + axis])?;
        }
        let mut quaternion = [0.0; 4];
        for part in 0..4 {
            quaternion[part] = row.number(column[4 + part], NAMES[4 + part])?;
        }
        let [w, x, y, z] = quaternion;
        let rotation = collector.quaternion(row.place(), w, x, y, z)?;
        collector.push(row.place(), stamp, pose(rotation, translation))?;
    }
    collector.stamps_in(StampUnit::Nanoseconds);
    collector.finish(Format::Euroc)
}

/// Finds the columns in the header; units in brackets are ignored.
fn columns(path: &Path, header: &Row<'_>) -> Result<[usize; 8], Error> {
    let fields = header.fields().iter();
    let names: Vec<String> = fields
        .map(|name| {
            name.trim_start_matches('#')
                .split('[')
                .next()
                .unwrap_or("")
                .trim()
                .to_ascii_lowercase()
        })
        .collect();
    let mut column = [0; 8];
    for (wanted, column) in NAMES.iter().zip(&mut column) {
        *column = names.iter().position(|name| name == wanted).ok_or_else(|| {
            Error::input(
                path,
                header.place(),
                format!("a column `{wanted}`"),
                shorten(&header.fields().join(",")),
                "EuRoC poses are in state_groundtruth_estimate0/data.csv; sensor files have no orientation",
            )
        })?;
    }
    Ok(column)
}
