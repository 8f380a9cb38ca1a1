//! From paths to trajectories.

use std::collections::HashSet;
use std::fs;
use std::path::{Path, PathBuf};

use crate::detect::{detect, is_pose_folder};
use crate::{Error, Format, LoadOptions, Trajectory, naming, read};

/// Folders are searched this deep; deeper is a loop of links.
const DEEPEST: usize = 16;

/// What a search of a folder met.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Survey {
    /// The logs, sorted by path.
    pub logs: Vec<PathBuf>,
    /// Visible files that are none, sorted by path.
    pub ignored: Vec<PathBuf>,
}

/// Reads exactly one log: a file, or a folder that holds one.
///
/// # Errors
/// [`Error::NotOneLog`] for a folder with none or several; otherwise what is wrong with the file.
///
/// ```
/// use dose3_datasets::{LoadOptions, load, synthetic, write};
///
/// let folder = tempfile::tempdir()?;
/// let file = folder.path().join("00.txt");
/// let drive = synthetic::trajectory(synthetic::Platform::Vehicle, 1, 200, 10.0);
/// write::kitti(&mut std::fs::File::create(&file)?, &drive)?;
/// let log = load(&file, &LoadOptions::default())?;
/// assert_eq!((log.name.as_str(), log.len()), ("00", 200));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn load(path: &Path, options: &LoadOptions) -> Result<Trajectory, Error> {
    let logs = discover(path, options)?;
    match logs.as_slice() {
        [log] => load_file(log, options),
        _ => {
            let first: Vec<String> = logs
                .iter()
                .take(3)
                .map(|log| log.display().to_string())
                .collect();
            let names = if logs.is_empty() {
                String::new()
            } else {
                format!(" ({}, ...)", first.join(", "))
            };
            let hint = if logs.is_empty() {
                "--format says how to read a file that is not recognised"
            } else {
                "name one of them"
            };
            Err(Error::NotOneLog {
                path: path.to_path_buf(),
                found: logs.len(),
                names,
                hint,
            })
        }
    }
}

/// The logs in a file (itself) or a folder (recursive), sorted by path.
///
/// In a folder, hidden files are skipped, and so are files that are no log of any format, or not of
/// `options.format` where that is given; [`survey`] also tells which. A folder of one-pose files counts as one log.
///
/// # Errors
/// [`Error::Io`] where the path or a folder in it cannot be read.
pub fn discover(path: &Path, options: &LoadOptions) -> Result<Vec<PathBuf>, Error> {
    Ok(survey(path, options)?.logs)
}

/// As [`discover`], with the files that were passed over.
///
/// # Errors
/// As [`discover`].
pub fn survey(path: &Path, options: &LoadOptions) -> Result<Survey, Error> {
    options.check()?;
    let data = fs::metadata(path).map_err(|source| Error::io(path, source))?;
    let mut survey = Survey::default();
    if data.is_dir() {
        search(path, options.format, DEEPEST, &mut survey)?;
        survey.logs.sort();
        survey.ignored.sort();
    } else {
        survey.logs.push(path.to_path_buf());
    }
    Ok(survey)
}

fn search(
    folder: &Path,
    format: Option<Format>,
    depth: usize,
    survey: &mut Survey,
) -> Result<(), Error> {
    if format.is_none_or(|format| format == Format::Iros20Poses) && is_pose_folder(folder) {
        survey.logs.push(folder.to_path_buf());
        return Ok(());
    }
    for entry in fs::read_dir(folder).map_err(|source| Error::io(folder, source))? {
        let path = entry.map_err(|source| Error::io(folder, source))?.path();
        if path
            .file_name()
            .is_some_and(|name| name.to_string_lossy().starts_with('.'))
        {
            continue;
        }
        if path.is_dir() {
            if depth > 0 {
                search(&path, format, depth - 1, survey)?;
            }
        } else if detect(&path).is_ok_and(|found| format.is_none_or(|wanted| wanted == found)) {
            survey.logs.push(path);
        } else {
            survey.ignored.push(path);
        }
    }
    Ok(())
}

/// Reads every log under the paths, in the order of the paths, with unique names and groups
/// ([`crate::group_logs`]).
///
/// # Errors
/// [`Error::NoLog`] where a path holds none; the first fault of any log otherwise.
pub fn load_all(paths: &[PathBuf], options: &LoadOptions) -> Result<Vec<Trajectory>, Error> {
    let mut trajectories = Vec::new();
    let mut seen = HashSet::new();
    for path in paths {
        let logs = discover(path, options)?;
        if logs.is_empty() {
            let hint = "a log is KITTI, RobotCar, IROS20, TUM or EuRoC poses; --format says how to read other files";
            return Err(Error::NoLog {
                path: path.clone(),
                hint,
            });
        }
        for log in logs {
            // A log named twice, or by its folder and by itself, counts once.
            if seen.insert(fs::canonicalize(&log).unwrap_or_else(|_| log.clone())) {
                trajectories.push(load_file(&log, options)?);
            }
        }
    }
    if options.times.is_some() && trajectories.len() > 1 {
        return Err(Error::Parameter {
            what: "times",
            expected: "given for exactly one log",
            found: format!("{} logs", trajectories.len()),
        });
    }
    naming::make_unique(&mut trajectories);
    naming::group_logs(&mut trajectories);
    Ok(trajectories)
}

fn load_file(path: &Path, options: &LoadOptions) -> Result<Trajectory, Error> {
    let format = match options.format {
        Some(format) => format,
        None => detect(path)?,
    };
    read::read(path, format, options)
}
