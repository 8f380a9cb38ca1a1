//! Files that hold logs, read one at a time: for more logs than memory holds.

use super::{ReadOptions, apply};
use crate::error::{Error, Result};
use dose3_datasets::{Trajectory, load_each, put_folders_before, survey, telling_folders};
use std::collections::HashSet;
use std::fs::canonicalize;
use std::path::{Path, PathBuf};

/// The files under some paths, not yet read.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Listing {
    /// Files with logs, each once, in the order of the paths; and paths that turn out wrong when they are read.
    pub files: Vec<LogFile>,
    /// Files in folders that are no logs, and why.
    pub skipped: Vec<(PathBuf, String)>,
}

/// A file, or a folder that is one recording, with one log or several.
#[derive(Clone, Debug, PartialEq)]
pub struct LogFile {
    /// Where it is; `-` is standard input.
    pub path: PathBuf,
    /// Folders that tell its logs from those of the other files.
    folders: Vec<String>,
    /// Whether it is a folder without a log.
    empty: bool,
}

/// Lists the files with logs under `paths`: folders are searched, nothing else is read. A file that two paths name
/// is listed once.
///
/// # Errors
/// Options out of range.
pub fn list(paths: &[PathBuf], options: &ReadOptions) -> Result<Listing> {
    options.check()?;
    let (mut found, mut skipped) = (Vec::new(), Vec::new());
    let mut seen = HashSet::new();
    for path in paths {
        // A path that cannot be searched fails in the same way when it is read.
        let Ok(survey) = survey(path, &options.load) else {
            found.push((path.clone(), false));
            continue;
        };
        skipped.extend(survey.ignored.into_iter().zip(survey.reasons));
        if survey.logs.is_empty() {
            found.push((path.clone(), true));
        }
        let new = |file: &PathBuf| seen.insert(canonicalize(file).unwrap_or_else(|_| file.clone()));
        found.extend(
            survey
                .logs
                .into_iter()
                .filter(new)
                .map(|file| (file, false)),
        );
    }
    let (paths, empty): (Vec<PathBuf>, Vec<bool>) = found.into_iter().unzip();
    let folders = telling_folders(&paths);
    let files = paths.into_iter().zip(folders).zip(empty);
    Ok(Listing {
        files: files
            .map(|((path, folders), empty)| LogFile {
                path,
                folders,
                empty,
            })
            .collect(),
        skipped,
    })
}

impl LogFile {
    /// Reads its logs: one, but for a recording of which several topics were asked for and for a table with a column
    /// that names its logs. At least one result.
    #[must_use]
    pub fn read(&self, options: &ReadOptions) -> Vec<Result<Trajectory>> {
        if self.empty {
            let path = self.path.clone();
            return vec![Err(Error::NoLogIn { path })];
        }
        let logs = match load_each(&self.path, &options.load) {
            Ok(logs) => logs,
            Err(error) => return vec![Err(error.into())],
        };
        let finish = |log: std::result::Result<Trajectory, dose3_datasets::Error>| {
            let mut log = log?;
            apply(&mut log, options)?;
            put_folders_before(&mut log, &self.folders);
            Ok(log)
        };
        logs.into_iter().map(finish).collect()
    }

    /// Whether it is standard input, which can be read once.
    #[must_use]
    pub fn is_standard_input(&self) -> bool {
        self.path == Path::new("-")
    }
}
