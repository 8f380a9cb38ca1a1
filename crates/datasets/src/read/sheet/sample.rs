//! The numbers of the first rows of a text, from which units and orders are told.

use std::path::Path;

use dose3_lie::Vector;

use super::rows::number;
use crate::read::dates;
use crate::read::layout::{Layout, Rotation, Stamp};
use crate::read::table::{Row, after_point};
use crate::read::text::Line;

/// Rows looked at to tell units and orders.
pub(crate) const SAMPLE: usize = 5000;
/// Rows whose digits are counted.
const ROWS_FOR_DIGITS: usize = 100;

/// The numbers of the first rows.
pub(crate) struct Sample {
    pub stamps: Vec<f64>,
    /// Whether all stamps are whole numbers.
    pub whole: bool,
    /// Whether there are stamps that are dates.
    pub dates: bool,
    pub positions: Vec<Vector>,
    /// The numbers of the rotation, in the order of its columns.
    pub rotations: Vec<[f64; 4]>,
}

impl Sample {
    /// The numbers of the first lines of data.
    pub fn new(path: &Path, lines: &[Line<'_>], layout: &Layout) -> Self {
        let mut sample = Self {
            stamps: Vec::new(),
            whole: true,
            dates: false,
            positions: Vec::new(),
            rotations: Vec::new(),
        };
        let columns: &[usize] = match &layout.rotation {
            Rotation::Quaternion(columns) => columns,
            Rotation::Angles(columns, _) | Rotation::Heading(columns, _) => columns,
            Rotation::Yaw(column, ..) => column,
            Rotation::Matrix(_) | Rotation::Vector(_) => &[],
        };
        let mut fields = Vec::new();
        for line in lines.iter().take(SAMPLE) {
            layout.separator.split(line.text, &mut fields);
            let row = Row::new(path, line, &fields);
            let number = |column: usize| number(&row, column);
            if let Stamp::Column(column, _) = layout.stamp {
                if let Some(value) = number(column) {
                    sample.whole &= value.fract() == 0.0;
                    sample.stamps.push(value);
                } else {
                    let field = row.fields().get(column);
                    sample.dates |= field.is_some_and(|field| dates::nanoseconds(field).is_some());
                }
            }
            let mut place = Vector::zeros();
            let axes = layout.axes().iter().zip(place.iter_mut());
            let complete = axes.fold(true, |complete, (column, value)| {
                let found = number(*column);
                *value = found.unwrap_or(0.0);
                complete && found.is_some()
            });
            if !complete {
                continue;
            }
            let mut values = [0.0; 4];
            let all =
                columns
                    .iter()
                    .zip(&mut values)
                    .all(|(column, value)| match number(*column) {
                        Some(found) => {
                            *value = found;
                            true
                        }
                        None => false,
                    });
            if all && (columns.len() != 4 || values.iter().any(|value| *value != 0.0)) {
                if columns.len() == 1 {
                    values.swap(0, 2); // roll and pitch are zero
                }
                sample.positions.push(place);
                sample.rotations.push(values);
            }
        }
        sample
    }
}

/// Decimals of the matrices of a file that has only two or three, and the deviation from orthogonality that follows:
/// an entry of R^T R is off by at most half a last digit times twice the norm of a row, the root of three.
pub(super) fn coarseness(lines: &[Line<'_>], layout: &Layout) -> Option<(usize, f64)> {
    let Rotation::Matrix(columns) = &layout.rotation else {
        return None;
    };
    let mut fields = Vec::new();
    let mut decimals = 0;
    for line in lines.iter().take(ROWS_FOR_DIGITS) {
        layout.separator.split(line.text, &mut fields);
        for field in columns.iter().filter_map(|column| fields.get(*column)) {
            if field.contains(['e', 'E']) {
                return None;
            }
            decimals = decimals.max(after_point(field));
        }
    }
    matches!(decimals, 2 | 3).then(|| (decimals, 2.0 * 10_f64.powi(-(decimals as i32))))
}
