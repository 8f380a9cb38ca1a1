//! Checks a folder of logs that the user already has.

use std::fmt;
use std::path::{Path, PathBuf};

use anyhow::{Result, ensure};
use dose3_datasets::{Format, LoadOptions, Survey, load, survey};

/// The traversals of the Oxford Radar RobotCar data set that the benchmark uses.
pub const TRAVERSALS: [&str; 4] = [
    "2019-01-11-14-02-26",
    "2019-01-14-12-05-52",
    "2019-01-14-14-48-55",
    "2019-01-15-13-06-37",
];

/// The nine videos of YCBInEOAT.
pub const VIDEOS: [&str; 9] = [
    "bleach0",
    "bleach_hard_00_03_chaitanya",
    "cracker_box_reorient",
    "cracker_box_yalehand0",
    "mustard0",
    "mustard_easy_00_02",
    "sugar_box1",
    "sugar_box_yalehand0",
    "tomato_soup_can_yalehand0",
];

/// Numbers N of the 42 files `traj_N.npy` that the paper used.
#[rustfmt::skip]
pub const TRAJECTORIES: [u32; 42] = [
    3, 4, 5, 6, 7, 8, 9, 11, 12, 15, 16, 17, 18, 19,
    20, 21, 22, 23, 24, 25, 26, 27, 28, 29, 30, 31, 32, 33,
    34, 38, 39, 40, 41, 42, 43, 48, 49, 50, 51, 52, 53, 54,
];

/// A log that loads.
#[derive(Debug, Clone, PartialEq)]
pub struct Log {
    /// Where it is.
    pub path: PathBuf,
    /// Number of poses.
    pub poses: usize,
    /// Its rate in words, `20.00 Hz`.
    pub rate: String,
    /// What was repaired while reading.
    pub repairs: Vec<String>,
}

/// What a folder holds of one data set.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Report {
    /// Logs that load, sorted by path.
    pub logs: Vec<Log>,
    /// Logs that do not, with the reason.
    pub failed: Vec<(PathBuf, String)>,
    /// Names of logs of the data set that are not there.
    pub missing: Vec<String>,
}

impl Report {
    /// True where every log of the data set is there and every one that is there loads.
    pub fn is_complete(&self) -> bool {
        self.failed.is_empty() && self.missing.is_empty()
    }

    fn load(&mut self, paths: &[PathBuf], format: Format) {
        let options = LoadOptions {
            format: Some(format),
            ..LoadOptions::default()
        };
        for path in paths {
            match load(path, &options) {
                Ok(log) => self.logs.push(Log {
                    path: path.clone(),
                    poses: log.poses.len(),
                    rate: log.rate.to_string(),
                    repairs: log.report.lines(),
                }),
                Err(error) => self.failed.push((path.clone(), error.to_string())),
            }
        }
    }
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for log in &self.logs {
            writeln!(
                f,
                "found     {}: {} poses, {}",
                log.path.display(),
                log.poses,
                log.rate
            )?;
            for repair in &log.repairs {
                writeln!(f, "          {repair}")?;
            }
        }
        for (_, reason) in &self.failed {
            writeln!(f, "broken    {reason}")?;
        }
        for name in &self.missing {
            writeln!(f, "missing   {name}")?;
        }
        let poses: usize = self.logs.iter().map(|log| log.poses).sum();
        writeln!(f, "{} log(s) load, {poses} poses", self.logs.len())
    }
}

/// Looks for `gps/ins.csv` of the four traversals.
///
/// # Errors
/// A folder that cannot be read.
pub fn robotcar(folder: &Path) -> Result<Report> {
    let found = look(folder, Format::RobotCar)?;
    // A damaged file is not recognised as a log, but is still the log that the user put there.
    let ins = sorted(found.logs.into_iter().chain(found.ignored), |path| {
        path.file_name().is_some_and(|name| name == "ins.csv")
    });
    let mut report = Report::default();
    report.load(&ins, Format::RobotCar);
    report.missing = absent(
        TRAVERSALS.iter().map(|name| (*name).to_owned()),
        &ins,
        |part, name| part.starts_with(name),
    );
    Ok(report)
}

/// Looks for the nine `annotated_poses` folders or the 42 `.npy` files; either set is complete.
///
/// # Errors
/// A folder that cannot be read.
pub fn iros20(folder: &Path) -> Result<Report> {
    let found = look(folder, Format::Iros20)?;
    let streams = sorted(found.logs.into_iter().chain(found.ignored), |path| {
        path.extension().is_some_and(|extension| extension == "npy")
    });
    let videos = look(folder, Format::Iros20Poses)?.logs;
    let mut report = Report::default();
    report.load(&streams, Format::Iros20);
    report.load(&videos, Format::Iros20Poses);
    let trajectories = TRAJECTORIES
        .iter()
        .map(|number| format!("traj_{number}.npy"));
    let no_stream = absent(trajectories, &streams, |part, name| part == name);
    let no_video = absent(
        VIDEOS.iter().map(|name| (*name).to_owned()),
        &videos,
        |part, name| part == name,
    );
    // What is missing is told of the set that the user began with.
    report.missing = match (no_stream.is_empty(), no_video.is_empty()) {
        (true, _) | (_, true) => Vec::new(),
        _ if streams.is_empty() => no_video,
        _ => no_stream,
    };
    Ok(report)
}

fn look(folder: &Path, format: Format) -> Result<Survey> {
    ensure!(folder.is_dir(), "this is no folder");
    let options = LoadOptions {
        format: Some(format),
        ..LoadOptions::default()
    };
    Ok(survey(folder, &options)?)
}

fn sorted(paths: impl Iterator<Item = PathBuf>, keep: impl Fn(&PathBuf) -> bool) -> Vec<PathBuf> {
    let mut kept: Vec<PathBuf> = paths.filter(keep).collect();
    kept.sort();
    kept
}

/// The names that fit no part of any path. Parts above the folder count too: the user may have
/// given the folder of a single log.
fn absent(
    names: impl Iterator<Item = String>,
    paths: &[PathBuf],
    fits: impl Fn(&str, &str) -> bool,
) -> Vec<String> {
    let paths: Vec<PathBuf> = paths
        .iter()
        .map(|path| std::path::absolute(path).unwrap_or_else(|_| path.clone()))
        .collect();
    names
        .filter(|name| {
            !paths.iter().any(|path| {
                path.components()
                    .any(|part| fits(&part.as_os_str().to_string_lossy(), name))
            })
        })
        .collect()
}
