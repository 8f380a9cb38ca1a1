//! Short names of logs, from where their files lie.

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use crate::{Format, Trajectory};

/// Names of files and folders that data sets use for every log, so that they say nothing.
const GENERIC: [&str; 18] = [
    "annotated_poses",
    "data",
    "gps",
    "gt",
    "ground_truth",
    "groundtruth",
    "ins",
    "leica0",
    "mav0",
    "odometry",
    "pose",
    "poses",
    "rtk",
    "state_groundtruth_estimate0",
    "traj",
    "trajectory",
    "vicon0",
    "vo",
];

/// Name and group of the log in a file: the last part of the path that is not the same for all logs.
///
/// RobotCar's INS, RTK and odometry of one traversal have the traversal as their group; `rtk` and `vo` are
/// marked in the name. Elsewhere the group is the name.
pub(crate) fn name(path: &Path, format: Format) -> (String, String) {
    if path == Path::new("-") {
        return ("stdin".to_owned(), "stdin".to_owned());
    }
    let absolute = std::path::absolute(path).unwrap_or_else(|_| path.to_path_buf());
    let mut parts: Vec<&str> = Vec::new();
    let mut own = absolute.as_path();
    if let Some(stem) = own.file_stem().and_then(|stem| stem.to_str()) {
        // `00.txt.gz` is the log 00.
        let packed = own
            .extension()
            .is_some_and(|end| end == "gz" || end == "zst");
        let known = [
            ".txt", ".csv", ".tum", ".tsv", ".log", ".json", ".g2o", ".npy",
        ];
        let inner = known.iter().find_map(|end| stem.strip_suffix(end));
        parts.push(inner.filter(|_| packed).unwrap_or(stem));
    }
    while let Some(parent) = own.parent() {
        parts.extend(parent.file_name().and_then(|name| name.to_str()));
        own = parent;
    }
    let is_generic = |part: &&str| GENERIC.contains(&part.to_ascii_lowercase().as_str());
    let group = parts
        .iter()
        .find(|part| !is_generic(part))
        .or(parts.first())
        .copied()
        .unwrap_or("log");
    let stem = parts.first().copied().unwrap_or("log");
    let name = match (format, stem) {
        (Format::RobotCar, "rtk" | "vo") if group != stem => format!("{group}-{stem}"),
        _ => group.to_owned(),
    };
    (name, group.to_owned())
}

/// Makes names unique by putting folders before those that occur twice.
///
/// The group follows the name for formats where equal file names in two folders mean two logs; a RobotCar
/// traversal or a EuRoC sequence is the same one wherever it lies.
pub fn make_unique<'a>(trajectories: impl IntoIterator<Item = &'a mut Trajectory>) {
    let mut trajectories: Vec<&mut Trajectory> = trajectories.into_iter().collect();
    for depth in 1.. {
        let mut count: HashMap<String, usize> = HashMap::new();
        for trajectory in trajectories.iter() {
            *count.entry(trajectory.name.clone()).or_default() += 1;
        }
        if count.values().all(|count| *count == 1) {
            break;
        }
        for (index, trajectory) in trajectories.iter_mut().enumerate() {
            if count[&trajectory.name] == 1 {
                continue;
            }
            // Where the folders end, the position among the logs tells them apart.
            let prefix = folder_above(&trajectory.path, depth).unwrap_or_else(|| index.to_string());
            put_before(trajectory, &prefix);
        }
    }
}

/// Puts a folder before the name of a log, and of its group where that follows the name.
fn put_before(trajectory: &mut Trajectory, folder: &str) {
    let name = format!("{folder}/{}", trajectory.name);
    if trajectory.group == trajectory.name
        && !matches!(trajectory.format, Format::RobotCar | Format::Euroc)
    {
        trajectory.group.clone_from(&name);
    }
    trajectory.name = name;
}

/// The folders, the innermost last, that tell logs with equal names apart, for files that are read one at a time: what
/// [`make_unique`] finds out when all of them are read. Put to use by [`put_folders_before`].
#[must_use]
pub fn telling_folders(paths: &[PathBuf]) -> Vec<Vec<String>> {
    let mut names: Vec<String> = paths
        .iter()
        .map(
            |path| match path.file_stem().and_then(|stem| stem.to_str()) {
                // RobotCar marks these in its logs' names.
                Some(stem @ ("rtk" | "vo")) => format!("{}-{stem}", name(path, Format::Csv).0),
                _ => name(path, Format::Csv).0,
            },
        )
        .collect();
    let mut folders = vec![Vec::new(); paths.len()];
    for depth in 1.. {
        let mut count: HashMap<String, usize> = HashMap::new();
        for name in &names {
            *count.entry(name.clone()).or_default() += 1;
        }
        if count.values().all(|count| *count == 1) {
            break;
        }
        for (index, path) in paths.iter().enumerate() {
            if count[&names[index]] == 1 {
                continue;
            }
            let folder = folder_above(path, depth).unwrap_or_else(|| index.to_string());
            names[index] = format!("{folder}/{}", names[index]);
            folders[index].insert(0, folder);
        }
    }
    folders
}

/// Puts the folders of [`telling_folders`] before the name of a log of that file.
pub fn put_folders_before(trajectory: &mut Trajectory, folders: &[String]) {
    for folder in folders.iter().rev() {
        put_before(trajectory, folder);
    }
}

/// The name of the folder that lies `depth` levels above a file.
fn folder_above(path: &Path, depth: usize) -> Option<String> {
    let folder = path.ancestors().nth(depth)?.file_name()?.to_str()?;
    Some(folder.to_owned())
}

/// Puts logs of equal length of the IROS20 data into one group: they come from the same video.
///
/// Logs of other formats keep their groups. Grouping two videos that happen to be equally long costs a little
/// data in a split; taking one video for two would leak it from one side to the other.
pub fn group_logs(trajectories: &mut [Trajectory]) {
    let from_video =
        |trajectory: &Trajectory| matches!(trajectory.format, Format::Iros20 | Format::Iros20Poses);
    for index in 0..trajectories.len() {
        if !from_video(&trajectories[index]) {
            continue;
        }
        let twin = trajectories[..index]
            .iter()
            .find(|other| from_video(other) && other.len() == trajectories[index].len())
            .map(|other| other.group.clone());
        if let Some(group) = twin {
            trajectories[index].group = group;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::synthetic::{Platform, trajectory};

    #[test]
    fn files_read_one_at_a_time_get_the_names_of_files_read_together() {
        let paths = [
            "a/run/x.txt",
            "b/run/x.txt",
            "b/y.txt",
            "c/2015/gps/ins.csv",
            "c/2015/gps/rtk.csv",
            "d/poses.txt",
            "e/poses.txt",
        ];
        let paths = paths.map(|path| PathBuf::from("/data").join(path));
        let read = |path: &PathBuf| {
            let mut log = trajectory(Platform::Vehicle, 1, 3, 10.0);
            log.path.clone_from(path);
            (log.name, log.group) = name(
                path,
                if path.starts_with("/data/c") {
                    Format::RobotCar
                } else {
                    Format::Tum
                },
            );
            log.format = if path.starts_with("/data/c") {
                Format::RobotCar
            } else {
                Format::Tum
            };
            log
        };
        let mut together: Vec<Trajectory> = paths.iter().map(read).collect();
        make_unique(&mut together);
        let folders = telling_folders(&paths);
        for ((path, folders), expected) in paths.iter().zip(&folders).zip(&together) {
            let mut alone = read(path);
            put_folders_before(&mut alone, folders);
            assert_eq!(
                (&alone.name, &alone.group),
                (&expected.name, &expected.group)
            );
        }
        assert_eq!(together[0].name, "a/run/x");
    }
}
