//! How a user says which logs belong together.

use std::path::Path;
use std::str::FromStr;

use crate::{Error, Trajectory};

/// What makes logs one group.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum GroupBy {
    /// The folder that the file lies in.
    Folder,
    /// A part of the file's name: what `{}` of the pattern stands for, `*` being anything.
    Pattern {
        /// What comes before, between and after; exactly one `{}`.
        pattern: String,
    },
}

impl GroupBy {
    /// Sets the groups of `logs` by their paths.
    ///
    /// # Errors
    /// [`Error::Parameter`] with the first log whose name the pattern does not fit.
    pub fn apply(&self, logs: &mut [Trajectory]) -> Result<(), Error> {
        for log in logs {
            log.group = self.group(&log.path, &log.name)?;
        }
        Ok(())
    }

    fn group(&self, path: &Path, name: &str) -> Result<String, Error> {
        match self {
            Self::Folder => Ok(path
                .parent()
                .filter(|folder| !folder.as_os_str().is_empty())
                .map_or_else(|| ".".to_owned(), |folder| folder.display().to_string())),
            Self::Pattern { pattern } => {
                let file = path.file_name().map(|f| f.to_string_lossy().into_owned());
                let text = file.unwrap_or_else(|| name.to_owned());
                captured(pattern, &text).ok_or_else(|| Error::Parameter {
                    what: "pattern of groups",
                    expected: "a pattern that every log's file name fits",
                    found: format!("{pattern}, which {text} does not fit"),
                })
            }
        }
    }
}

/// `folder`, or a pattern with one `{}`.
impl FromStr for GroupBy {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self, Error> {
        if text == "folder" {
            return Ok(Self::Folder);
        }
        if text.matches("{}").count() == 1 {
            let pattern = text.to_owned();
            return Ok(Self::Pattern { pattern });
        }
        Err(Error::Parameter {
            what: "grouping of logs",
            expected: "`folder`, or a pattern with one {} for the part of the file name that names the group, such as {}_run*",
            found: text.to_owned(),
        })
    }
}

/// What `{}` stands for where `pattern` fits all of `text`: the shortest that fits, not empty.
fn captured(pattern: &str, text: &str) -> Option<String> {
    let (before, after) = pattern.split_once("{}")?;
    let starts = (0..text.len()).filter(|i| text.is_char_boundary(*i));
    for start in starts.filter(|i| fits(before, &text[..*i])) {
        for end in (start + 1..=text.len()).filter(|i| text.is_char_boundary(*i)) {
            if fits(after, &text[end..]) {
                return Some(text[start..end].to_owned());
            }
        }
    }
    None
}

/// Whether `pattern`, in which `*` is anything, fits all of `text`.
fn fits(pattern: &str, text: &str) -> bool {
    let Some((first, rest)) = pattern.split_once('*') else {
        return pattern == text;
    };
    let Some(mut left) = text.strip_prefix(first) else {
        return false;
    };
    let parts: Vec<&str> = rest.split('*').collect();
    let (last, middle) = parts.split_last().expect("a split has parts");
    for part in middle {
        let Some(at) = left.find(part) else {
            return false;
        };
        left = &left[at + part.len()..];
    }
    left.ends_with(last)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::PathBuf;

    #[test]
    fn a_pattern_names_the_group() {
        let of = |pattern: &str, file: &str| {
            let by: GroupBy = pattern.parse().unwrap();
            by.group(&PathBuf::from("logs/day1").join(file), "log").ok()
        };
        let some = |s: &str| Some(s.to_owned());
        assert_eq!(of("{}_run*", "hall_run3.txt"), some("hall"));
        assert_eq!(of("{}_run*", "hall_2.txt"), None);
        assert_eq!(of("*-{}.txt", "2024-01-05-b.txt"), some("01-05-b"));
        assert_eq!(of("*_{}_*.*", "a_b_c_d.txt"), some("b"));
        assert_eq!(of("{}", "x.txt"), some("x.txt"));
        assert_eq!(of("ä{}ö*", "äüö.txt"), some("ü"));
        assert_eq!(of("folder", "x.txt"), some("logs/day1"));
    }

    #[test]
    fn what_names_no_group_is_refused() {
        for text in ["", "run*", "{}{}", "Folder"] {
            assert!(text.parse::<GroupBy>().is_err(), "{text}");
        }
    }
}
