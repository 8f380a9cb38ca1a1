//! What the columns of a text file hold: as a user says it, and by their names.

mod header;

use std::str::FromStr;

use serde::{Deserialize, Serialize};

use crate::{Error, StampUnit};

pub(crate) use header::{Name, by_header, is_heading, length_unit, stamp_unit};

/// What one column holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) enum Role {
    Stamp,
    /// Whole seconds.
    Seconds,
    /// What is more than those, in this unit.
    Part(StampUnit),
    /// Axis 0 to 2.
    Position(usize),
    /// w, x, y, z as 0 to 3.
    Quaternion(usize),
    /// Roll, pitch, yaw as 0 to 2.
    Angle(usize),
    /// Axis 0 to 2 of a rotation vector, radians.
    Vector(usize),
    /// Row-major entry of the rotation matrix, 0 to 8.
    Matrix(usize),
}

impl Role {
    pub fn is_time(self) -> bool {
        matches!(self, Self::Stamp | Self::Seconds | Self::Part(_))
    }
}

/// Which columns of a text file hold the pose, as a user says it.
///
/// One of `t,x,y,z,qw,qx,qy,qz` as roles in the order of the file's columns (`-` skips one); as many column numbers
/// (from 1) or names in that order of roles (seven without the stamp); or pairs like `t=stamp,x=3,yaw=heading`.
/// Roles: `t`, `sec` with `nsec`, `usec` or `msec`, `x`, `y`, `z`, `qw`, `qx`, `qy`, `qz`, `roll`, `pitch`, `yaw`, and `rx`, `ry`, `rz`, a rotation
/// vector in radians. `x`, `y` and `yaw` alone are a body in the plane.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Columns {
    entries: Vec<(String, String)>,
    written: String,
}

const ROLES: [(&str, Role); 18] = [
    ("t", Role::Stamp),
    ("x", Role::Position(0)),
    ("y", Role::Position(1)),
    ("z", Role::Position(2)),
    ("qw", Role::Quaternion(0)),
    ("qx", Role::Quaternion(1)),
    ("qy", Role::Quaternion(2)),
    ("qz", Role::Quaternion(3)),
    ("sec", Role::Seconds),
    ("nsec", Role::Part(StampUnit::Nanoseconds)),
    ("usec", Role::Part(StampUnit::Microseconds)),
    ("msec", Role::Part(StampUnit::Milliseconds)),
    ("roll", Role::Angle(0)),
    ("pitch", Role::Angle(1)),
    ("yaw", Role::Angle(2)),
    ("rx", Role::Vector(0)),
    ("ry", Role::Vector(1)),
    ("rz", Role::Vector(2)),
];

fn role(word: &str) -> Option<Role> {
    ROLES
        .iter()
        .find(|(name, _)| name.eq_ignore_ascii_case(word))
        .map(|(_, role)| *role)
}

impl FromStr for Columns {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self, Error> {
        let fault = |expected| Error::Parameter {
            what: "columns",
            expected,
            found: text.to_owned(),
        };
        let words: Vec<&str> = text.split(',').map(str::trim).collect();
        if words.iter().any(|word| word.is_empty()) {
            return Err(fault("names or numbers separated by commas"));
        }
        let pair = |role: &str, column: &str| (role.to_owned(), column.to_owned());
        let entries: Vec<(String, String)> = if words.iter().all(|word| word.contains('=')) {
            words
                .iter()
                .filter_map(|word| word.split_once('='))
                .map(|(role, column)| pair(role.trim(), column.trim()))
                .collect()
        } else if words
            .iter()
            .all(|word| *word == "-" || role(word).is_some())
        {
            let named = words.iter().enumerate().filter(|(_, word)| **word != "-");
            // A name that the header has wins over the place in this list.
            named
                .map(|(index, word)| pair(word, &format!("{word}|{}", index + 1)))
                .collect()
        } else {
            let roles = match words.len() {
                8 => &ROLES[..8],
                7 => &ROLES[1..8],
                _ => {
                    return Err(fault(
                        "7 or 8 names or numbers, or pairs like t=1,x=2,yaw=heading",
                    ));
                }
            };
            roles
                .iter()
                .zip(&words)
                .map(|((role, _), word)| pair(role, word))
                .collect()
        };
        for (name, column) in &entries {
            if role(name).is_none() || column == "0" {
                return Err(fault(
                    "roles t, sec, nsec, x, y, z, qw, qx, qy, qz, roll, pitch, yaw, rx, ry, rz and columns from 1",
                ));
            }
        }
        Ok(Self {
            entries,
            written: text.to_owned(),
        })
    }
}

impl std::fmt::Display for Columns {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.written)
    }
}

impl Columns {
    /// Roles and column indices from 0, given the names in the header; the name that is missing otherwise.
    pub(crate) fn resolve(&self, header: &[String]) -> Result<Vec<(Role, usize)>, String> {
        let by_name = |wanted: &str| {
            header
                .iter()
                .position(|name| name.trim().eq_ignore_ascii_case(wanted))
        };
        let mut found = Vec::new();
        for (name, column) in &self.entries {
            let choices = column.split('|');
            let index = choices
                .clone()
                .find_map(by_name)
                .or_else(|| {
                    choices
                        .clone()
                        .find_map(|word| word.parse::<usize>().ok()?.checked_sub(1))
                })
                .ok_or_else(|| column.clone())?;
            found.extend(role(name).map(|role| (role, index)));
        }
        Ok(found)
    }
}

#[cfg(test)]
mod tests {
    use super::header::tests::pose;
    use super::*;

    #[test]
    fn users_may_say_columns_in_three_ways() {
        let wanted = |order: [usize; 4]| [vec![(Role::Stamp, 0)], pose(1, order)].concat();
        let resolve = |text: &str, header: &[&str]| {
            let header: Vec<String> = header.iter().map(ToString::to_string).collect();
            let mut found = text.parse::<Columns>().unwrap().resolve(&header).unwrap();
            found.sort_by_key(|(_, column)| *column);
            found
        };
        assert_eq!(resolve("t,x,y,z,qx,qy,qz,qw", &[]), wanted([1, 2, 3, 0]));
        assert_eq!(resolve("1,2,3,4,8,5,6,7", &[]), wanted([1, 2, 3, 0]));
        assert_eq!(
            resolve("t=1,x=2,y=3,z=4,qw=5,qx=6,qy=7,qz=8", &[]),
            wanted([0, 1, 2, 3])
        );
        let header = ["t", "x", "y", "z", "qx", "qy", "qz", "qw"];
        assert_eq!(
            resolve("t,x,y,z,qw,qx,qy,qz", &header),
            wanted([1, 2, 3, 0])
        );
        assert_eq!(
            resolve("s,a,b,c,d,e,f,g", &["s", "a", "b", "c", "d", "e", "f", "g"]),
            wanted([0, 1, 2, 3])
        );
        for bad in ["", "t,,x", "a=1", "0,1,2,3,4,5,6,7", "x=0"] {
            assert!(bad.parse::<Columns>().is_err(), "{bad}");
        }
        assert!(
            "s,a,b,c,d,e,f,g"
                .parse::<Columns>()
                .unwrap()
                .resolve(&[])
                .is_err()
        );
    }
}
