//! Folders: copied, emptied, and read whole.

use crate::Result;
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

/// Files by their path below a folder.
pub type Contents = BTreeMap<String, Vec<u8>>;

/// All files below `folder`.
///
/// # Errors
/// What cannot be read.
pub fn read(folder: &Path) -> Result<Contents> {
    let mut found = Contents::new();
    let mut folders = vec![folder.to_path_buf()];
    while let Some(now) = folders.pop() {
        let fault = |error: std::io::Error| format!("{}: {error}", now.display());
        for entry in fs::read_dir(&now).map_err(fault)? {
            let path = entry.map_err(fault)?.path();
            if path.is_dir() {
                folders.push(path);
            } else {
                let bytes = fs::read(&path).map_err(fault)?;
                let below = path.strip_prefix(folder).unwrap_or(&path);
                found.insert(below.display().to_string(), bytes);
            }
        }
    }
    Ok(found)
}

/// Makes `folder` hold these files and no others.
///
/// # Errors
/// What cannot be written.
pub fn set(folder: &Path, contents: &Contents) -> Result<()> {
    let fault = |error: std::io::Error| format!("{}: {error}", folder.display());
    if folder.exists() {
        fs::remove_dir_all(folder).map_err(fault)?;
    }
    fs::create_dir_all(folder).map_err(fault)?;
    for (name, bytes) in contents {
        let path = folder.join(name);
        fs::create_dir_all(path.parent().unwrap_or(folder)).map_err(fault)?;
        fs::write(path, bytes).map_err(fault)?;
    }
    Ok(())
}
