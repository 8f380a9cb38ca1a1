//! Recordings by their paths: files, and the folders of ROS 2 bags.

use std::fs::File;
use std::path::{Component, Path, PathBuf};

use super::Recording;
use super::data::Data;
use crate::error::Place;
use crate::{Error, Format, Remark, RemarkKind};

/// The description in a folder of a ROS 2 bag.
const METADATA: &str = "metadata.yaml";

/// What packed files of one recording may become together, bytes: they are held in memory.
const MOST_HELD: u64 = 4 << 30;

/// True for a folder that holds a ROS 2 bag.
pub(crate) fn is_folder(path: &Path) -> bool {
    path.join(METADATA).is_file()
}

/// Opens a recording by its path: a file that is read only where poses are, or a folder of a ROS 2 bag.
pub(crate) fn open(path: &Path, format: Format) -> Result<Recording<'static>, Error> {
    let mut recording = Recording::new(path, format);
    let files = if path.is_dir() {
        folder_files(path)?
    } else {
        vec![path.to_path_buf()]
    };
    if !path.is_dir() && has_log(path) {
        let text = "a write-ahead log lies beside the file: the recording was not closed, its last messages are missing";
        recording
            .remarks
            .push(Remark::new(RemarkKind::DamagedRecording, text));
    }
    let mut held = 0_u64;
    for file in files {
        let packed = ["zstd", "zst"]
            .iter()
            .any(|end| file.extension().is_some_and(|own| own == *end));
        let data = if packed {
            let bytes = std::fs::read(&file).map_err(|source| Error::io(&file, source))?;
            let unpacked = crate::read::unpack(&file, &bytes)?.into_owned();
            held += unpacked.len() as u64;
            if held > MOST_HELD {
                let found = format!("more than {} GiB", MOST_HELD >> 30);
                let hint = "unpack the files first: of plain ones only the poses are read";
                let expected = "packed files that fit into memory together";
                return Err(Error::input(&file, Place::File, expected, found, hint));
            }
            Data::Owned(unpacked)
        } else {
            let open = File::open(&file).map_err(|source| Error::io(&file, source))?;
            let length = open
                .metadata()
                .map_err(|source| Error::io(&file, source))?
                .len();
            Data::File(open, length)
        };
        recording.add(&file, data)?;
    }
    Ok(recording)
}

fn has_log(path: &Path) -> bool {
    let mut beside = path.as_os_str().to_owned();
    beside.push("-wal");
    std::fs::metadata(beside).is_ok_and(|data| data.len() > 0)
}

/// The files that `metadata.yaml` lists, in its order; those of the folder where it lists none.
fn folder_files(folder: &Path) -> Result<Vec<PathBuf>, Error> {
    let path = folder.join(METADATA);
    let text = std::fs::read_to_string(&path).map_err(|source| Error::io(&path, source))?;
    let mut files = Vec::new();
    let mut within = false;
    for line in text.lines() {
        let item = line.trim();
        if item.starts_with("relative_file_paths:") {
            within = true;
        } else if let Some(name) = item.strip_prefix("- ").filter(|_| within) {
            let name = Path::new(name.trim_matches(['"', '\'']));
            // A recording from elsewhere must not have other files of this machine read.
            if !name
                .components()
                .all(|part| matches!(part, Component::Normal(_) | Component::CurDir))
            {
                return Err(Error::input(
                    &path,
                    Place::File,
                    "names of files in the folder of the recording",
                    name.display().to_string(),
                    "a recording lies in one folder",
                ));
            }
            files.push(folder.join(name));
        } else {
            within = false;
        }
    }
    if files.is_empty() {
        return Err(Error::input(
            &path,
            Place::File,
            "a list `relative_file_paths`",
            "none",
            "the recording has no files",
        ));
    }
    // Tools that unpack leave the name with the ending in the list.
    for file in &mut files {
        if !file.is_file() {
            let without = file.with_extension("");
            if without.is_file() {
                *file = without;
            }
        }
    }
    Ok(files)
}
