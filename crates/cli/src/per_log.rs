//! Where a file for each log goes: `out.html` for a single log; of several logs each has its own in the folder `out`.

use crate::output_file::{Kind, OutputFile};
use anyhow::{Context, Result, bail};
use std::collections::HashSet;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

/// A name is cut after so many characters.
const LONGEST: usize = 80;

/// The files of the logs of a call.
pub struct PerLog {
    path: PathBuf,
    kind: Kind,
    force: bool,
    single: OutputFile,
    taken: HashSet<String>,
}

impl PerLog {
    /// `path` ends with `.` and the ending; whether it can be written is checked before hours of work.
    ///
    /// # Errors
    /// Another ending; what lies there and must not be replaced.
    pub fn new(path: &Path, ending: &str, kind: Kind, force: bool) -> Result<Self> {
        if path.extension().is_none_or(|found| found != ending) {
            bail!(
                "{}: expected a name that ends with .{ending}",
                path.display()
            );
        }
        Ok(Self {
            path: path.to_path_buf(),
            kind,
            force,
            single: OutputFile::new(path, kind, force)?,
            taken: HashSet::new(),
        })
    }

    /// The path itself.
    pub fn single(&self) -> &OutputFile {
        &self.single
    }

    /// The file of the log of that name, where there are several.
    ///
    /// # Errors
    /// What lies there and must not be replaced; a folder that cannot be made.
    pub fn of(&mut self, log: &str) -> Result<OutputFile> {
        let folder = self.path.with_extension("");
        let ending = self.path.extension().unwrap_or_default().to_string_lossy();
        let path = folder.join(format!(
            "{}.{ending}",
            free(&file_name(log), &mut self.taken)
        ));
        OutputFile::new(&path, self.kind, self.force)
    }

    /// The address of such a file from the path itself, as links have it.
    ///
    /// # Errors
    /// A file without a name.
    pub fn address(&self, file: &OutputFile) -> Result<String> {
        let name = |path: &Path| {
            path.file_name()
                .map(|name| name.to_string_lossy().into_owned())
        };
        let folder = name(&self.path.with_extension(""));
        let (folder, file) = folder
            .zip(name(file.path()))
            .context("a file without a name")?;
        Ok(format!("{}/{}", escaped(&folder), escaped(&file)))
    }

    /// The address of the path itself from the files in the folder.
    pub fn back(&self) -> String {
        let name = self.path.file_name().unwrap_or_default();
        format!("../{}", escaped(&name.to_string_lossy()))
    }
}

/// A name that every file system takes.
fn file_name(log: &str) -> String {
    let keep = |c: char| c.is_alphanumeric() || "-_.".contains(c);
    let name: String = log
        .chars()
        .take(LONGEST)
        .map(|c| if keep(c) { c } else { '_' })
        .collect();
    match name.trim_start_matches('.') {
        "" => "log".to_owned(),
        name => name.to_owned(),
    }
}

/// The name, or with a number behind it where it is taken; file systems may not tell capitals apart.
fn free(name: &str, taken: &mut HashSet<String>) -> String {
    let mut free = name.to_owned();
    let mut number = 1;
    while !taken.insert(free.to_lowercase()) {
        number += 1;
        free = format!("{name}-{number}");
    }
    free
}

/// As a part of an address.
fn escaped(name: &str) -> String {
    let mut out = String::new();
    for byte in name.bytes() {
        match byte.is_ascii_alphanumeric() || b"-_.~".contains(&byte) {
            true => out.push(char::from(byte)),
            false => {
                let _ = write!(out, "%{byte:02X}");
            }
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn any_name_of_a_log_is_a_file_and_an_address() {
        assert_eq!(file_name("../<b>.txt"), "__b_.txt");
        assert_eq!(file_name("..."), "log");
        let mut taken = HashSet::new();
        let names = ["a", "A", "a"].map(|name| free(name, &mut taken));
        assert_eq!(names, ["a", "A-2", "a-3"]);
        assert_eq!(escaped("a b/ä"), "a%20b%2F%C3%A4");
    }

    #[test]
    fn several_logs_lie_in_a_folder_beside_the_path() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("my run.html");
        let page = Kind {
            name: "page",
            begins: |start| start.starts_with(b"<"),
        };
        assert!(PerLog::new(&folder.path().join("run.txt"), "html", page, false).is_err());
        let mut files = PerLog::new(&path, "html", page, false).unwrap();
        assert_eq!(files.single().path(), path);
        let first = files.of("07").unwrap();
        assert_eq!(first.path(), folder.path().join("my run/07.html"));
        assert_eq!(files.address(&first).unwrap(), "my%20run/07.html");
        assert_eq!(files.back(), "../my%20run.html");
    }
}
