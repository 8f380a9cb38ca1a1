//! Files that are whole or not there.
//!
//! A file is written beside its place, under a name made from its own, and renamed when it is whole and on disk. The
//! writer holds a lock on it, which ends with the process however that ends: what a killed run left is known by its
//! name and by nobody holding the lock, and the next run that writes the same file removes it. Nothing of a running
//! process is touched.

use crate::error::{Error, Result};
use sha2::{Digest, Sha256};
use std::fs::{File, OpenOptions, TryLockError};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

/// Runs that may write the same file at once; the last that ends wins.
const SLOTS: usize = 16;
/// File systems take names of 255 bytes; this leaves room for what is put around a name.
const LONGEST: usize = 200;

/// Writes `bytes` to a temporary file beside `path` and renames it, so that a reader never sees
/// half a file and an interrupted run never destroys an old one.
///
/// # Errors
/// What the operating system answers, with the path.
pub fn write(path: &Path, bytes: &[u8]) -> Result<()> {
    let mut file = Unfinished::begin(path)?;
    file.file
        .write_all(bytes)
        .map_err(Error::io("write", path))?;
    file.end()
}

/// A file that is written bit by bit, beside its place until it ends. Errors of writing to it name the file.
#[derive(Debug)]
pub struct Unfinished {
    file: File,
    temporary: PathBuf,
    path: PathBuf,
    in_place: bool,
}

impl Unfinished {
    /// Begins a file that will be at `path`; makes its folder, and removes what killed runs left of the same file.
    ///
    /// # Errors
    /// What the operating system answers, with the path.
    pub fn begin(path: &Path) -> Result<Self> {
        let folder = match path.parent() {
            Some(p) if !p.as_os_str().is_empty() => p,
            _ => Path::new("."),
        };
        std::fs::create_dir_all(folder).map_err(Error::io("create", folder))?;
        let (file, temporary) = create(folder, path).map_err(Error::io("write", path))?;
        Ok(Self {
            file,
            temporary,
            path: path.to_path_buf(),
            in_place: false,
        })
    }

    /// Brings what was written to disk.
    ///
    /// # Errors
    /// What the operating system answers, with the path.
    pub fn sync(&self) -> Result<()> {
        let synced = self.file.sync_all();
        synced.map_err(Error::io("write", &self.path))
    }

    /// Puts the file in its place.
    ///
    /// # Errors
    /// What the operating system answers, with the path.
    pub fn end(mut self) -> Result<()> {
        self.put().map_err(Error::io("write", &self.path))
    }

    fn put(&mut self) -> io::Result<()> {
        self.file.sync_all()?;
        std::fs::rename(&self.temporary, &self.path)?;
        self.in_place = true;
        Ok(())
    }

    fn named(&self, reason: &io::Error) -> io::Error {
        let text = format!("cannot write {}: {reason}", self.path.display());
        io::Error::new(reason.kind(), text)
    }
}

impl Write for Unfinished {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        // An interrupted call is no fault: the caller repeats it.
        match self.file.write(bytes) {
            Err(e) if e.kind() != io::ErrorKind::Interrupted => Err(self.named(&e)),
            other => other,
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush().map_err(|e| self.named(&e))
    }
}

impl Drop for Unfinished {
    fn drop(&mut self) {
        if !self.in_place {
            // Where it cannot be removed now, the next run does it.
            let _ = std::fs::remove_file(&self.temporary);
        }
    }
}

/// A new file beside `path`, with its name.
fn create(folder: &Path, path: &Path) -> io::Result<(File, PathBuf)> {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let name = match name.len() {
        ..=LONGEST => name.into_owned(),
        _ => dose3_datasets::hex(Sha256::digest(name.as_bytes())),
    };
    let mut taken = None;
    // All names are looked at: several runs may have been killed.
    for slot in 0..SLOTS {
        let temporary = folder.join(format!(".{name}.{slot}.unfinished"));
        remove_abandoned(&temporary);
        if taken.is_none() {
            taken = take(&temporary)?.map(|file| (file, temporary));
        }
    }
    taken.ok_or_else(|| {
        let text = format!("{SLOTS} runs are writing it already");
        io::Error::new(io::ErrorKind::ResourceBusy, text)
    })
}

/// A new file of that name with a lock; none where another run has the name.
fn take(temporary: &Path) -> io::Result<Option<File>> {
    let file = match OpenOptions::new()
        .write(true)
        .create_new(true)
        .open(temporary)
    {
        Err(e) if e.kind() == io::ErrorKind::AlreadyExists => return Ok(None),
        other => other?,
    };
    match file.try_lock() {
        // Between creation and lock another run took it for abandoned.
        Err(TryLockError::WouldBlock) => Ok(None),
        Ok(()) => Ok(is_at(&file, temporary).then_some(file)),
        // Where a file system has no locks, nothing on it is taken for abandoned.
        Err(TryLockError::Error(_)) => Ok(Some(file)),
    }
}

/// Removes a file that a killed run left.
fn remove_abandoned(temporary: &Path) {
    let regular = temporary.symlink_metadata().is_ok_and(|m| m.is_file());
    let file = match regular {
        true => OpenOptions::new().write(true).open(temporary),
        false => return,
    };
    // What cannot be opened, locked or removed is left to its owner, and another name is taken.
    if let Ok(file) = file
        && file.try_lock().is_ok()
        && is_at(&file, temporary)
    {
        let _ = std::fs::remove_file(temporary);
    }
}

/// Whether that file still has that name, and not another one by now.
fn is_at(file: &File, path: &Path) -> bool {
    let (Ok(own), Ok(there)) = (file.metadata(), path.symlink_metadata()) else {
        return false;
    };
    #[cfg(unix)]
    {
        use std::os::unix::fs::MetadataExt;
        (own.dev(), own.ino()) == (there.dev(), there.ino())
    }
    #[cfg(not(unix))]
    {
        own.is_file() && there.is_file()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    fn names(folder: &Path) -> Vec<String> {
        let entries = fs::read_dir(folder).unwrap();
        let mut names: Vec<String> = entries
            .map(|entry| entry.unwrap().file_name().into_string().unwrap())
            .collect();
        names.sort();
        names
    }

    #[test]
    fn what_a_killed_run_left_is_removed_and_what_a_running_one_writes_is_not() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("out.json");
        fs::write(&path, "old").unwrap();
        for slot in [0, 3] {
            fs::write(
                folder.path().join(format!(".out.json.{slot}.unfinished")),
                "half",
            )
            .unwrap();
        }
        fs::write(folder.path().join(".other.json.0.unfinished"), "half").unwrap();
        let mut running = Unfinished::begin(&path).unwrap();
        running.write_all(b"first").unwrap();
        let mut second = Unfinished::begin(&path).unwrap();
        second.write_all(b"second").unwrap();
        assert_eq!(
            names(folder.path()),
            [
                ".other.json.0.unfinished",
                ".out.json.0.unfinished",
                ".out.json.1.unfinished",
                "out.json"
            ]
        );
        assert_eq!(fs::read(&path).unwrap(), b"old");
        second.end().unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"second");
        running.end().unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"first");
        assert_eq!(
            names(folder.path()),
            [".other.json.0.unfinished", "out.json"]
        );
    }

    #[test]
    fn one_that_is_dropped_leaves_nothing() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("deep/out");
        drop(Unfinished::begin(&path).unwrap());
        assert!(names(&folder.path().join("deep")).is_empty());
    }

    #[test]
    fn threads_that_write_the_same_file_leave_one_whole_and_nothing_beside() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("out");
        std::thread::scope(|scope| {
            for thread in 0..8_u8 {
                let path = &path;
                scope.spawn(move || {
                    for _ in 0..50 {
                        write(path, &[thread; 5000]).unwrap();
                    }
                });
            }
        });
        let bytes = fs::read(&path).unwrap();
        assert_eq!(bytes, [bytes[0]; 5000]);
        assert_eq!(names(folder.path()), ["out"]);
    }

    #[test]
    fn names_as_long_as_a_file_system_takes_are_written() {
        let folder = tempfile::tempdir().unwrap();
        let name = "n".repeat(255);
        write(&folder.path().join(&name), b"new").unwrap();
        assert_eq!(names(folder.path()), [name]);
    }

    #[cfg(unix)]
    #[test]
    fn a_link_or_a_folder_of_that_name_is_left_alone() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        fs::write(at("mine"), "mine").unwrap();
        std::os::unix::fs::symlink(at("mine"), at(".out.0.unfinished")).unwrap();
        fs::create_dir(at(".out.1.unfinished")).unwrap();
        write(&at("out"), b"new").unwrap();
        assert_eq!(fs::read(at("mine")).unwrap(), b"mine");
        assert_eq!(
            names(folder.path()),
            [".out.0.unfinished", ".out.1.unfinished", "mine", "out"]
        );
    }
}
