//! Short names of logs, from where their files lie.

use std::collections::HashMap;
use std::path::Path;

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
            let folder = trajectory
                .path
                .ancestors()
                .nth(depth)
                .and_then(Path::file_name);
            // Where the folders end, the position among the logs tells them apart.
            let prefix = folder
                .and_then(|name| name.to_str())
                .map_or_else(|| index.to_string(), str::to_owned);
            let name = format!("{prefix}/{}", trajectory.name);
            if trajectory.group == trajectory.name
                && !matches!(trajectory.format, Format::RobotCar | Format::Euroc)
            {
                trajectory.group.clone_from(&name);
            }
            trajectory.name = name;
        }
    }
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
