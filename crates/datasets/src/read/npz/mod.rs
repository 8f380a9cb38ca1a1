//! `.npz`: several `.npy` arrays in one file, each under a name.

mod zip;

use std::path::Path;

use super::columns::{Name, Role};
use super::iros20::npy_error;
use super::npy::{Stream, Values};
use super::records::{self, Cell, List, MOST, Part};
use crate::error::Place;
use crate::{Error, Format, LoadOptions, RateSource, ReadOption, StampUnit, Trajectory};

/// True for a zip file whose first member is an array.
pub(crate) fn is_npz(bytes: &[u8]) -> bool {
    zip::first_name(bytes).is_some_and(|name| name.ends_with(".npy"))
}

/// One array.
struct Array {
    name: String,
    /// Sizes of its dimensions behind the first.
    rest: Vec<u64>,
    length: usize,
    values: Values,
}

/// Whether a file among others is a log; one that is damaged is.
pub(crate) fn has_poses(path: &Path, bytes: &[u8], options: &LoadOptions) -> bool {
    arrays(path, bytes).map_or(true, |arrays| {
        let lists: Vec<List<'_>> = lists(&arrays).collect();
        arrays.iter().any(Array::is_matrices) || records::any_poses(&lists, options)
    })
}

/// All arrays of numbers in a file.
fn arrays(path: &Path, bytes: &[u8]) -> Result<Vec<Array>, Error> {
    let members = zip::members(path, bytes, |name| name.ends_with(".npy"))?;
    let mut arrays = Vec::new();
    for member in &members {
        let name = member.name.trim_end_matches(".npy").to_owned();
        let values = Stream::new(&member.content).take_any();
        let values =
            values.map_err(|fault| in_array(npy_error(path, Place::File, fault), &name))?;
        arrays.extend(Array::new(name, values));
    }
    Ok(arrays)
}

/// The arrays of each length, side by side.
fn lists(arrays: &[Array]) -> impl Iterator<Item = List<'_>> {
    let mut lengths: Vec<usize> = arrays.iter().map(|array| array.length).collect();
    lengths.sort_unstable();
    lengths.dedup();
    lengths.retain(|length| *length > 1);
    lengths.into_iter().map(|length| list(arrays, length))
}

/// The one log in the arrays of a file: poses in one array, or in several side by side, with or without stamps.
pub(crate) fn read(path: &Path, bytes: &[u8], options: &LoadOptions) -> Result<Trajectory, Error> {
    let mut arrays = arrays(path, bytes)?;
    if !options.topics.is_empty() {
        arrays.retain(|array| array.is_stamps() || options.topics.contains(&array.name));
    }
    // The one array of matrices is the pose, whatever its name.
    let matrices: Vec<&str> = arrays
        .iter()
        .filter(|array| array.is_matrices())
        .map(|array| array.name.as_str())
        .collect();
    if matrices.len() > 1 && options.columns.is_none() {
        let found = format!(
            "{} arrays of matrices: {}",
            matrices.len(),
            matrices.join(", ")
        );
        let hint = "say which one is meant";
        let fault = Error::input(path, Place::File, "one array of poses", found, hint);
        return Err(fault.option(ReadOption::Topic));
    }
    let stamps: Vec<&Array> = arrays.iter().filter(|array| array.is_stamps()).collect();
    let unit = stamps.iter().find_map(|array| array.unit());
    let mut options = options.clone();
    options.stamp_unit = options.stamp_unit.or(unit);
    let log = records::read(path, lists(&arrays).collect(), None, Format::Npz, &options)?;
    match stamps.first() {
        Some(array) if log.rate.source == RateSource::Unknown => {
            let found = format!("{} stamps in `{}`", array.length, array.name);
            let wanted = format!(
                "a stamp for each of {} poses",
                log.len() + log.report.lost_rows()
            );
            let hint = "save poses and stamps of one length";
            Err(Error::input(path, Place::File, wanted, found, hint))
        }
        _ => Ok(log),
    }
}

/// The arrays of one length, side by side.
fn list(arrays: &[Array], length: usize) -> List<'_> {
    let own: Vec<&Array> = arrays
        .iter()
        .filter(|array| array.length == length)
        .collect();
    List {
        name: format!("arrays of length {length}"),
        length,
        record: Box::new(move |index| own.iter().map(|array| array.part(index)).collect()),
        stamps: None,
    }
}

impl Array {
    /// An array of numbers, no more of them under one index than a pose has; `None` for another.
    fn new(name: String, values: Values) -> Option<Self> {
        let shape = match &values {
            Values::Floats(array) => array.shape(),
            Values::Whole(array) => &array.shape,
            Values::Other => return None,
        };
        let (length, rest) = shape.split_first()?;
        let rest = rest.to_vec();
        let size = rest
            .iter()
            .try_fold(1_u64, |size, next| size.checked_mul(*next))?;
        (1..=MOST as u64).contains(&size).then_some(())?;
        Some(Self {
            name,
            length: usize::try_from(*length).ok()?,
            rest,
            values,
        })
    }

    fn is_stamps(&self) -> bool {
        matches!(self.rest[..], [] | [1])
            && Name::new(&self.name)
                .role()
                .is_some_and(|(role, _)| role == Role::Stamp)
    }

    fn is_matrices(&self) -> bool {
        matches!(self.values, Values::Floats(_)) && matches!(self.rest[..], [3 | 4, 4])
    }

    fn unit(&self) -> Option<StampUnit> {
        match &self.values {
            Values::Whole(array) => array.unit,
            _ => None,
        }
    }

    fn part(&self, index: usize) -> Part<'_> {
        let size: u64 = self.rest.iter().product();
        let cells = 0..size as usize;
        let cells = match &self.values {
            Values::Floats(array) => cells
                .map(|at| Cell::Number(array.get(&self.place(index, at))))
                .collect(),
            Values::Whole(array) => cells
                .map(|at| {
                    let value = array.values.get(index * size as usize + at).copied();
                    value.flatten().map_or(Cell::Nothing, Cell::Whole)
                })
                .collect(),
            Values::Other => Vec::new(),
        };
        Part {
            name: self.name.clone(),
            cells,
            is_pose: self.is_matrices(),
        }
    }

    /// The index of the entry `at` below `index`, counted by rows.
    fn place(&self, index: usize, mut at: usize) -> Vec<usize> {
        let mut place = vec![0; self.rest.len() + 1];
        for (entry, size) in place.iter_mut().skip(1).zip(&self.rest).rev() {
            *entry = at % *size as usize;
            at /= *size as usize;
        }
        place[0] = index;
        place
    }
}

/// Says which array a fault is of.
fn in_array(error: Error, name: &str) -> Error {
    match error {
        Error::Input(mut fault) => {
            fault.found = format!("{} in the array `{name}`", fault.found);
            Error::Input(fault)
        }
        other => other,
    }
}
