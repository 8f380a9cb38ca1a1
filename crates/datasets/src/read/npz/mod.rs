//! `.npz`: several `.npy` arrays in one file, each under a name.

mod zip;

use std::path::Path;

use super::columns::{Name, Role};
use super::iros20::npy_error;
use super::npy::{Stream, Structured, Values};
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
    let Ok(members) = members(path, bytes) else {
        return true;
    };
    Arrays::new(path, &members, options).map_or(true, |arrays| {
        let options = of_any_topic(options);
        arrays.plain.iter().any(Array::is_matrices) || records::any_poses(&arrays.lists(), &options)
    })
}

fn members<'a>(path: &Path, bytes: &'a [u8]) -> Result<Vec<zip::Member<'a>>, Error> {
    zip::members(path, bytes, |name| name.ends_with(".npy"))
}

/// The arrays of a file.
struct Arrays<'a> {
    plain: Vec<Array>,
    structured: Vec<(String, Structured<'a>)>,
}

impl<'a> Arrays<'a> {
    /// All that hold numbers, or those of the topics.
    fn new(
        path: &Path,
        members: &'a [zip::Member<'_>],
        options: &LoadOptions,
    ) -> Result<Self, Error> {
        let (mut plain, mut structured) = (Vec::new(), Vec::new());
        for member in members {
            let name = member.name.trim_end_matches(".npy").to_owned();
            let fault = |fault| in_array(npy_error(path, Place::File, fault), &name);
            let chosen = options.topics.is_empty() || options.topics.contains(&name);
            if let Some(records) = Structured::new(&member.content) {
                if chosen {
                    let records = records.map_err(fault)?;
                    structured.push((name, records));
                }
                continue;
            }
            let values = Stream::new(&member.content).take_any().map_err(fault)?;
            plain.extend(Array::new(name, values).filter(|array| chosen || array.is_stamps()));
        }
        Ok(Self { plain, structured })
    }

    /// The plain arrays of each length, side by side, and records, with the stamps beside them where they have none.
    fn lists(&self) -> Vec<List<'_>> {
        let mut lengths: Vec<usize> = self.plain.iter().map(|array| array.length).collect();
        lengths.sort_unstable();
        lengths.dedup();
        lengths.retain(|length| *length > 1);
        let plain = lengths.into_iter().map(|length| {
            let own = self.plain.iter().filter(|array| array.length == length);
            list(format!("arrays of length {length}"), length, own.collect())
        });
        let structured = self.structured.iter().map(|(name, records)| {
            let own = records.list(name);
            if records.has_stamps() {
                return own;
            }
            let stamps = self.plain.iter().filter(|array| array.is_stamps());
            let stamps = stamps.filter(|array| array.length == own.length);
            let beside = list(name.clone(), own.length, stamps.collect());
            List {
                record: Box::new(move |index| {
                    let mut parts = (own.record)(index);
                    parts.extend((beside.record)(index));
                    parts
                }),
                ..beside
            }
        });
        plain.chain(structured).collect()
    }
}

/// The one log in the arrays of a file: poses in one array, or in several side by side, with or without stamps.
pub(crate) fn read(path: &Path, bytes: &[u8], options: &LoadOptions) -> Result<Trajectory, Error> {
    let members = members(path, bytes)?;
    let arrays = Arrays::new(path, &members, options)?;
    // The one array of matrices is the pose, whatever its name.
    let matrices: Vec<&str> = arrays
        .plain
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
    if options.columns.is_none() {
        for (name, records) in &arrays.structured {
            let fault = |fault| in_array(npy_error(path, Place::File, fault), name);
            records.check().map_err(fault)?;
        }
    }
    let options = of_any_topic(options);
    let log = records::read(path, arrays.lists(), None, Format::Npz, &options)?;
    let mut stamps = arrays.plain.iter().filter(|array| array.is_stamps());
    match stamps.next() {
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

/// Without the topics, which have been chosen.
fn of_any_topic(options: &LoadOptions) -> LoadOptions {
    LoadOptions {
        topics: Vec::new(),
        ..options.clone()
    }
}

/// Arrays of one length, side by side.
fn list(name: String, length: usize, own: Vec<&Array>) -> List<'_> {
    let mut stamps = own.iter().filter(|array| array.is_stamps());
    let unit = stamps.find_map(|array| array.unit());
    List {
        name,
        length,
        record: Box::new(move |index| own.iter().map(|array| array.part(index)).collect()),
        stamps: None,
        unit,
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
