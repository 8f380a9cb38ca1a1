//! From paths to trajectories.

use std::collections::HashSet;
use std::fs;
use std::io::Read;
use std::path::{Path, PathBuf};

use crate::detect::{detect_bytes, detect_with, is_pose_folder};
use crate::{Error, Format, LoadOptions, Trajectory, naming, read};

/// The path that stands for standard input.
const STANDARD_INPUT: &str = "-";

/// Folders are searched this deep; deeper is a loop of links.
const DEEPEST: usize = 16;

/// What a search of a folder met.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Survey {
    /// The logs, sorted by path.
    pub logs: Vec<PathBuf>,
    /// Visible files that are none, sorted by path.
    pub ignored: Vec<PathBuf>,
    /// Why, one for each of [`Self::ignored`].
    pub reasons: Vec<String>,
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
        [log] => one(log, load_file(log, options)?),
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
                "a format or columns can be given for a file that is not recognised"
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
    let mut survey = Survey::default();
    if path == Path::new(STANDARD_INPUT) {
        survey.logs.push(path.to_path_buf());
        return Ok(survey);
    }
    let data = fs::metadata(path).map_err(|source| Error::io(path, source))?;
    if data.is_dir() {
        let mut ignored = Vec::new();
        search(path, options, DEEPEST, &mut survey.logs, &mut ignored)?;
        survey.logs.sort();
        ignored.sort();
        (survey.ignored, survey.reasons) = ignored.into_iter().unzip();
    } else {
        survey.logs.push(path.to_path_buf());
    }
    Ok(survey)
}

fn search(
    folder: &Path,
    options: &LoadOptions,
    depth: usize,
    logs: &mut Vec<PathBuf>,
    ignored: &mut Vec<(PathBuf, String)>,
) -> Result<(), Error> {
    let format = options.format;
    if format.is_none_or(|format| format == Format::Iros20Poses) && is_pose_folder(folder) {
        logs.push(folder.to_path_buf());
        return Ok(());
    }
    #[cfg(feature = "recordings")]
    if format.is_none_or(|format| format == Format::Rosbag2) && crate::recording::is_folder(folder)
    {
        logs.push(folder.to_path_buf());
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
                search(&path, options, depth - 1, logs, ignored)?;
            }
            continue;
        }
        match detect_with(&path, options) {
            Ok(found) if format.is_none_or(|wanted| wanted == found) => {
                match has_poses(&path, found, options) {
                    true => logs.push(path),
                    false if options.topics.is_empty() => {
                        ignored.push((path, format!("{found} without poses")));
                    }
                    false => {
                        let topics = options.topics.join(", ");
                        ignored.push((path, format!("{found} without poses of {topics}")));
                    }
                }
            }
            Ok(found) => ignored.push((path, format!("its format is {found}"))),
            Err(fault) => {
                let reason = reason(&fault);
                ignored.push((path, reason));
            }
        }
    }
    Ok(())
}

/// Whether a file of a folder holds poses; where it cannot be read that is said when it is.
fn has_poses(path: &Path, format: Format, options: &LoadOptions) -> bool {
    if !matches!(format, Format::Json | Format::Npz) {
        return true;
    }
    let Ok(packed) = fs::read(path) else {
        return true;
    };
    match read::unpack(path, &packed) {
        Ok(bytes) => read::has_poses(path, &bytes, format, options),
        Err(_) => true,
    }
}

/// What is wrong with a file, without its path.
fn reason(fault: &Error) -> String {
    match fault {
        Error::Input(fault) => {
            let place = match fault.place {
                crate::Place::Line(line) => format!("line {line}: "),
                _ => String::new(),
            };
            let hint = if fault.hint.is_empty() {
                String::new()
            } else {
                format!("; {}", fault.hint)
            };
            format!("{place}{}{hint}", fault.found)
        }
        Error::Io { source, .. } => source.to_string(),
        other => other.to_string(),
    }
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
            let hint = "a log holds poses as text, npy or a recording; a format or columns can be given for other files";
            return Err(Error::NoLog {
                path: path.clone(),
                hint,
            });
        }
        for log in logs {
            // A log named twice, or by its folder and by itself, counts once.
            if seen.insert(fs::canonicalize(&log).unwrap_or_else(|_| log.clone())) {
                trajectories.extend(load_file(&log, options)?);
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

/// Reads the logs of exactly one file or folder of a recording: one, but for a recording of which several topics were
/// asked for and for a table with a column that names its logs ([`LoadOptions::log_column`]).
///
/// # Errors
/// As [`load`].
pub fn load_several(path: &Path, options: &LoadOptions) -> Result<Vec<Trajectory>, Error> {
    load_each(path, options)?.into_iter().collect()
}

/// As [`load_several`], each log of a table on its own: one that cannot be read does not stop the others. What is wrong
/// with it names it.
///
/// # Errors
/// What is wrong with the file as a whole.
pub fn load_each(
    path: &Path,
    options: &LoadOptions,
) -> Result<Vec<Result<Trajectory, Error>>, Error> {
    match discover(path, options)?.as_slice() {
        [log] => load_file_each(log, options),
        _ => load(path, options).map(|log| vec![Ok(log)]),
    }
}

/// The only log of a file; a recording of which several topics were asked for has more, and so has a table whose
/// column names the logs.
fn one(path: &Path, mut logs: Vec<Trajectory>) -> Result<Trajectory, Error> {
    match (logs.pop(), logs.len()) {
        (Some(log), 0) => Ok(log),
        (_, more) => Err(Error::NotOneLog {
            path: path.to_path_buf(),
            found: more + 1,
            names: String::new(),
            hint: "read them as several logs, or name one topic of a recording",
        }),
    }
}

/// As [`load_file_each`], up to the first log that cannot be read.
fn load_file(path: &Path, options: &LoadOptions) -> Result<Vec<Trajectory>, Error> {
    load_file_each(path, options)?.into_iter().collect()
}

/// The logs of one file: one, but for a recording of which several topics were asked for and for a table with a column
/// that names its logs.
fn load_file_each(
    path: &Path,
    options: &LoadOptions,
) -> Result<Vec<Result<Trajectory, Error>>, Error> {
    #[cfg(feature = "recordings")]
    let sound = |logs: Vec<Trajectory>| logs.into_iter().map(Ok).collect();
    options.check()?;
    if path != Path::new(STANDARD_INPUT) && path.is_dir() {
        let format = match options.format {
            Some(format) => format,
            None => detect_with(path, options)?,
        };
        return match format {
            Format::Iros20Poses => Ok(vec![read::read_folder(path, options)]),
            #[cfg(feature = "recordings")]
            Format::Rosbag2 => crate::recording::open(path, format)?
                .read(options)
                .map(sound),
            _ => Err(Error::io(path, std::io::ErrorKind::IsADirectory.into())),
        };
    }
    #[cfg(feature = "recordings")]
    if let Some(format) = recording_file(path, options)? {
        return crate::recording::open(path, format)?
            .read(options)
            .map(sound);
    }
    let mut bytes = Vec::new();
    // A pipe can be read once: the format is found in what was read.
    let read = if path == Path::new(STANDARD_INPUT) {
        std::io::stdin().lock().read_to_end(&mut bytes)
    } else {
        fs::File::open(path).and_then(|mut file| file.read_to_end(&mut bytes))
    };
    read.map_err(|source| Error::io(path, source))?;
    parse_each(path, &bytes, options)
}

/// The format of a file that is a recording, which is not read into memory; `None` for anything else, pipes too.
#[cfg(feature = "recordings")]
fn recording_file(path: &Path, options: &LoadOptions) -> Result<Option<Format>, Error> {
    let regular = path != Path::new(STANDARD_INPUT) && path.is_file();
    if !regular || options.format.is_some_and(|format| !format.is_recording()) {
        return Ok(None);
    }
    let mut head = Vec::new();
    fs::File::open(path)
        .and_then(|file| file.take(16).read_to_end(&mut head))
        .map_err(|source| Error::io(path, source))?;
    let found = crate::detect::recording(&head);
    Ok(options
        .format
        .or(found)
        .filter(|format| format.is_recording()))
}

/// Reads the one log in the bytes of a file, without a file system; `name` is what messages and the log's name say.
///
/// # Errors
/// What is wrong with the content.
///
/// ```
/// use dose3_datasets::{LoadOptions, load_bytes};
///
/// let text = b"0.0 0 0 0 0 0 0 1\n0.1 0.5 0 0 0 0 0 1\n";
/// let log = load_bytes("drive.tum", text, &LoadOptions::default())?;
/// assert_eq!((log.name.as_str(), log.len()), ("drive", 2));
/// # Ok::<(), dose3_datasets::Error>(())
/// ```
pub fn load_bytes(name: &str, bytes: &[u8], options: &LoadOptions) -> Result<Trajectory, Error> {
    options.check()?;
    let path = Path::new(name);
    one(path, parse(path, bytes, options)?)
}

/// As [`load_bytes`], for files that hold several logs, as [`load_several`] reads them.
///
/// # Errors
/// What is wrong with the content.
///
/// ```
/// use dose3_datasets::{LoadOptions, load_several_bytes};
///
/// let text = b"run,t,x,y,z,qw,qx,qy,qz\na,0.0,0,0,0,1,0,0,0\na,0.1,1,0,0,1,0,0,0\n\
///     b,0.0,0,0,0,1,0,0,0\nb,0.1,0,2,0,1,0,0,0\n";
/// let options = LoadOptions { log_column: Some("run".to_owned()), ..LoadOptions::default() };
/// let logs = load_several_bytes("runs.csv", text, &options)?;
/// assert_eq!((logs[1].name.as_str(), logs[1].poses[1].translation.y), ("b", 2.0));
/// # Ok::<(), dose3_datasets::Error>(())
/// ```
pub fn load_several_bytes(
    name: &str,
    bytes: &[u8],
    options: &LoadOptions,
) -> Result<Vec<Trajectory>, Error> {
    options.check()?;
    parse(Path::new(name), bytes, options)
}

fn parse(path: &Path, bytes: &[u8], options: &LoadOptions) -> Result<Vec<Trajectory>, Error> {
    parse_each(path, bytes, options)?.into_iter().collect()
}

fn parse_each(
    path: &Path,
    bytes: &[u8],
    options: &LoadOptions,
) -> Result<Vec<Result<Trajectory, Error>>, Error> {
    let bytes = read::unpack(path, bytes)?;
    let format = match options.format {
        Some(format) => format,
        None => detect_bytes(path, &bytes, true, options)?,
    };
    #[cfg(feature = "recordings")]
    if format.is_recording() {
        let logs = crate::recording::Recording::from_bytes(path, &bytes, format)?.read(options)?;
        return Ok(logs.into_iter().map(Ok).collect());
    }
    read::read_all(path, &bytes, format, options.format.is_some(), options)
}
