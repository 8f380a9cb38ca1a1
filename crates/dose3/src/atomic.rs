//! Files that are whole or not there.

use crate::error::{Error, Result};
use std::io::Write;
use std::path::{Path, PathBuf};
use tempfile::NamedTempFile;

/// Writes `bytes` to a temporary file beside `path` and renames it, so that a reader never sees
/// half a file and an interrupted run never destroys an old one.
///
/// # Errors
/// What the operating system answers, with the path.
pub fn write(path: &Path, bytes: &[u8]) -> Result<()> {
    let mut file = Unfinished::begin(path)?;
    file.write_all(bytes).map_err(Error::io("write", path))?;
    file.end()
}

/// A file that is written bit by bit, beside its place until it ends.
#[derive(Debug)]
pub struct Unfinished {
    file: NamedTempFile,
    path: PathBuf,
}

impl Unfinished {
    /// Begins a file that will be at `path`; makes its folder.
    ///
    /// # Errors
    /// What the operating system answers, with the path.
    pub fn begin(path: &Path) -> Result<Self> {
        let folder = match path.parent() {
            Some(p) if !p.as_os_str().is_empty() => p,
            _ => Path::new("."),
        };
        std::fs::create_dir_all(folder).map_err(Error::io("create", folder))?;
        let file = temporary(folder).map_err(Error::io("write", path))?;
        Ok(Self {
            file,
            path: path.to_path_buf(),
        })
    }

    /// Puts the file in its place.
    ///
    /// # Errors
    /// What the operating system answers, with the path.
    pub fn end(self) -> Result<()> {
        let path = self.path;
        put(self.file, &path).map_err(Error::io("write", &path))
    }
}

impl Write for Unfinished {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        self.file.write(bytes)
    }

    fn flush(&mut self) -> std::io::Result<()> {
        self.file.flush()
    }
}

/// A temporary file in `folder` that is to become one of its files: others may do with it what they may with any file
/// that the user makes (the umask).
///
/// # Errors
/// What the operating system answers.
pub fn temporary(folder: &Path) -> std::io::Result<NamedTempFile> {
    let mut builder = tempfile::Builder::new();
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    builder.tempfile_in(folder)
}

fn put(file: NamedTempFile, path: &Path) -> std::io::Result<()> {
    file.as_file().sync_all()?;
    file.persist(path)?;
    Ok(())
}
