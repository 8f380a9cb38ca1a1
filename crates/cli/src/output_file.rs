//! Files that the program writes: checked before any work, and nothing of the user's is replaced unasked.

use anyhow::{Context, Result, bail};
use dose3::atomic::Unfinished;
use std::fs;
use std::io::{self, BufWriter, Read, Write};
use std::path::{Path, PathBuf};

/// A kind of file that may be replaced by a newer one of its kind.
#[derive(Clone, Copy, Debug)]
pub struct Kind {
    /// As people say it.
    pub name: &'static str,
    /// Whether a file that begins so is of this kind.
    pub begins: fn(&[u8]) -> bool,
}

/// Models and detectors are safetensors files: the length of a header, then JSON.
pub const DETECTOR: Kind = Kind {
    name: "model or detector",
    begins: |start| start.get(8) == Some(&b'{'),
};

/// A file to write.
#[derive(Clone, Debug)]
pub struct OutputFile {
    path: PathBuf,
}

/// Bytes of a file that tell its kind.
const START: u64 = 256;

impl OutputFile {
    /// Checks, before hours of work, that a file can be written there and that what lies there may be replaced: nothing,
    /// an empty file, one of the same kind, or with `force` anything but a folder. With `force` the file behind a link
    /// is replaced, not the link, and a device is written to.
    ///
    /// # Errors
    /// Says what is in the way.
    pub fn new(path: &Path, kind: Kind, force: bool) -> Result<Self> {
        let shown = path.display();
        if path.is_dir() {
            bail!("{shown} is a folder, expected the name of a file to write");
        }
        let there = path.symlink_metadata().ok();
        let special = there.as_ref().is_some_and(|found| !found.is_file());
        if special && !force {
            bail!(
                "{shown} is a link or a device, expected the name of a file to write (--force writes to what is \
                 behind it)"
            );
        }
        if there.is_some() && !special && !force && !is_of(path, kind) {
            bail!(
                "{shown} is there and is no {}; hint: it is not replaced, name another file or use --force",
                kind.name
            );
        }
        // A link that leads nowhere yet leads to where the file will be.
        let path = match special {
            true => fs::canonicalize(path).unwrap_or_else(|_| path.to_path_buf()),
            false => path.to_path_buf(),
        };
        if !is_device(&path) {
            drop(Unfinished::begin(&path)?);
        }
        Ok(Self { path })
    }

    /// Writes the file, whole or not at all; into a device as far as it takes it.
    ///
    /// # Errors
    /// What the operating system answers, with the path.
    pub fn save(&self, bytes: &[u8]) -> Result<()> {
        let mut writing = self.begin()?;
        writing.write(bytes)?;
        writing.end()
    }

    /// Begins to write the file bit by bit; it is there when the writing ends.
    ///
    /// # Errors
    /// What the operating system answers, with the path.
    pub fn begin(&self) -> Result<Writing> {
        let to = match is_device(&self.path) {
            true => {
                let device = fs::OpenOptions::new().write(true).open(&self.path);
                let device = device.with_context(|| cannot_write(&self.path))?;
                To::Device(device, self.path.clone())
            }
            false => To::File(Unfinished::begin(&self.path)?),
        };
        Ok(Writing {
            to: BufWriter::new(to),
        })
    }

    /// Where it is written.
    pub fn path(&self) -> &Path {
        &self.path
    }
}

/// A file that is being written, beside its place until it ends.
#[derive(Debug)]
pub struct Writing {
    to: BufWriter<To>,
}

/// Errors of both name what is written.
#[derive(Debug)]
enum To {
    File(Unfinished),
    Device(fs::File, PathBuf),
}

impl Write for To {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        match self {
            Self::File(file) => file.write(bytes),
            Self::Device(file, path) => match file.write(bytes) {
                Err(e) if e.kind() != io::ErrorKind::Interrupted => Err(io::Error::new(
                    e.kind(),
                    format!("{}: {e}", cannot_write(path)),
                )),
                other => other,
            },
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        match self {
            Self::File(file) => file.flush(),
            Self::Device(file, _) => file.flush(),
        }
    }
}

impl Writing {
    /// Writes the next bytes.
    ///
    /// # Errors
    /// What the operating system answers, with the path.
    pub fn write(&mut self, bytes: &[u8]) -> Result<()> {
        Ok(self.to.write_all(bytes)?)
    }

    /// Puts the file in its place.
    ///
    /// # Errors
    /// What the operating system answers, with the path.
    pub fn end(self) -> Result<()> {
        match self
            .to
            .into_inner()
            .map_err(io::IntoInnerError::into_error)?
        {
            To::Device(..) => Ok(()),
            To::File(file) => Ok(file.end()?),
        }
    }
}

/// For writers that take any sink.
#[cfg(feature = "parquet")]
impl Write for Writing {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.to.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.to.flush()
    }
}

fn cannot_write(path: &Path) -> String {
    format!("cannot write {}", path.display())
}

/// Whether there is something that is neither a file nor a folder: a terminal, a pipe.
fn is_device(path: &Path) -> bool {
    path.metadata()
        .is_ok_and(|found| !found.is_file() && !found.is_dir())
}

/// Whether a file is empty or begins as one of that kind.
fn is_of(path: &Path, kind: Kind) -> bool {
    let mut start = Vec::new();
    let read = fs::File::open(path).and_then(|file| file.take(START).read_to_end(&mut start));
    read.is_ok_and(|length| length == 0 || (kind.begins)(&start))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_a_file_of_its_kind_is_replaced_unasked() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        let new = |path: &Path, force| OutputFile::new(path, DETECTOR, force);
        fs::write(at("old.dose3"), b"\x02\0\0\0\0\0\0\0{}").unwrap();
        fs::write(at("empty"), b"").unwrap();
        fs::write(at("log.txt"), b"0 0 0 0 0 0 0 1\n").unwrap();
        for name in ["old.dose3", "empty", "deep/new.dose3"] {
            new(&at(name), false).unwrap().save(b"new").unwrap();
            assert_eq!(fs::read(at(name)).unwrap(), b"new");
        }
        let error = new(&at("log.txt"), false).unwrap_err().to_string();
        assert!(
            error.contains("no model or detector") && error.contains("--force"),
            "{error}"
        );
        assert_eq!(fs::read(at("log.txt")).unwrap(), b"0 0 0 0 0 0 0 1\n");
        new(&at("log.txt"), true).unwrap().save(b"asked").unwrap();
        assert_eq!(fs::read(at("log.txt")).unwrap(), b"asked");
        assert!(
            new(folder.path(), true)
                .unwrap_err()
                .to_string()
                .contains("is a folder")
        );
    }

    #[cfg(unix)]
    #[test]
    fn the_file_behind_a_link_is_written_only_when_asked() {
        let folder = tempfile::tempdir().unwrap();
        let (file, link) = (folder.path().join("file"), folder.path().join("link"));
        fs::write(&file, b"old").unwrap();
        std::os::unix::fs::symlink(&file, &link).unwrap();
        let error = OutputFile::new(&link, DETECTOR, false).unwrap_err();
        assert!(error.to_string().contains("a link or a device"), "{error}");
        OutputFile::new(&link, DETECTOR, true)
            .unwrap()
            .save(b"new")
            .unwrap();
        assert_eq!(fs::read(&file).unwrap(), b"new");
        assert!(link.symlink_metadata().unwrap().is_symlink());
    }
}
