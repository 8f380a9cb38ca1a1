//! The stamps of KITTI odometry ground truth, which lie in a file of their own.

use std::path::{Path, PathBuf};

use super::table::{Row, Separator};
use super::text::Text;
use crate::{Error, LoadOptions, LoadReport, StampUnit};

/// The stamps of a times file in nanoseconds, with their line numbers.
pub(crate) fn read_times(path: &Path) -> Result<Vec<(usize, i64)>, Error> {
    let bytes = std::fs::read(path).map_err(|source| Error::io(path, source))?;
    let text = Text::new(path, &bytes, &mut LoadReport::default())?;
    let mut stamps = Vec::new();
    let mut fields = Vec::new();
    for line in text.lines() {
        Separator::Blanks.split(line.text, &mut fields);
        let row = Row::new(path, &line, &fields);
        if row.len() != 1 {
            return Err(row.wrong_length("one stamp in seconds", "this is not a KITTI times file"));
        }
        stamps.push((line.number, row.stamp(0, StampUnit::Seconds)?));
    }
    Ok(stamps)
}

/// The times file: the one named, else one that lies where KITTI and its users put it.
pub(crate) fn times_path(path: &Path, options: &LoadOptions) -> Option<PathBuf> {
    if options.times.is_some() {
        return options.times.clone();
    }
    let folder = path.parent()?;
    let stem = path.file_stem()?.to_str()?;
    let mut candidates = vec![folder.join(format!("{stem}_times.txt"))];
    if stem.bytes().all(|byte| byte.is_ascii_digit()) {
        // The official archive: poses/00.txt beside sequences/00/times.txt.
        candidates.extend(
            folder
                .parent()
                .map(|root| root.join("sequences").join(stem).join("times.txt")),
        );
    } else {
        candidates.push(folder.join("times.txt"));
    }
    candidates
        .into_iter()
        .find(|candidate| candidate != path && candidate.is_file())
}
