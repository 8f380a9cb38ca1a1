//! The library that strikes a chosen call of a program.

use crate::Result;
use std::path::{Path, PathBuf};
use std::process::Command;

/// What happens at a call.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fault {
    /// Killed before it.
    Kill,
    /// Killed behind it.
    After,
    /// Killed when half of a write is done.
    Half,
    /// It fails: a disk that is broken.
    Eio,
    /// It and all that need space fail from there on: a disk that is full.
    Enospc,
    /// A write takes half of the bytes.
    Short,
    /// A signal interrupts it.
    Eintr,
}

impl Fault {
    /// All of them.
    pub const ALL: [Self; 7] = [
        Self::Kill,
        Self::After,
        Self::Half,
        Self::Eio,
        Self::Enospc,
        Self::Short,
        Self::Eintr,
    ];

    /// As the library takes it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Kill => "kill",
            Self::After => "after",
            Self::Half => "half",
            Self::Eio => "eio",
            Self::Enospc => "enospc",
            Self::Short => "short",
            Self::Eintr => "eintr",
        }
    }

    /// What a program says of it; none where it should not notice or cannot say anything.
    pub fn said(self) -> Option<&'static str> {
        match self {
            Self::Eio => Some("Input/output error"),
            Self::Enospc => Some("No space left on device"),
            _ => None,
        }
    }

    /// Whether the program is killed.
    pub fn kills(self) -> bool {
        matches!(self, Self::Kill | Self::After | Self::Half)
    }
}

/// The library, compiled.
pub struct Library {
    path: PathBuf,
}

impl Library {
    /// Compiles it with `cc` into `folder`.
    ///
    /// # Errors
    /// No compiler, or another system than Linux.
    pub fn build(folder: &Path) -> Result<Self> {
        let (source, path) = (folder.join("fault.c"), folder.join("fault.so"));
        std::fs::write(&source, include_str!("fault.c")).map_err(|error| error.to_string())?;
        let output = Command::new("cc")
            .args(["-shared", "-fPIC", "-O1", "-o"])
            .args([&path, &source])
            .output()
            .map_err(|error| format!("cannot start cc: {error}"))?;
        match output.status.success() {
            true => Ok(Self { path }),
            false => Err(format!("cc: {}", String::from_utf8_lossy(&output.stderr))),
        }
    }

    /// Has `command`, which works in `folder`, count its calls into `log`.
    pub fn count(&self, command: &mut Command, folder: &Path, log: &Path) {
        command
            .env("LD_PRELOAD", &self.path)
            .env("DOSE3_FAULT_FOLDER", folder)
            .env("DOSE3_FAULT_LOG", log);
    }

    /// Has `fault` strike the call `at` of `command`.
    pub fn strike(&self, command: &mut Command, folder: &Path, fault: Fault, at: usize) {
        command
            .env("LD_PRELOAD", &self.path)
            .env("DOSE3_FAULT_FOLDER", folder)
            .env("DOSE3_FAULT", fault.name())
            .env("DOSE3_FAULT_AT", at.to_string());
    }
}
