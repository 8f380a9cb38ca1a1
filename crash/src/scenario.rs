//! A program that writes, and what it writes when nothing happens to it.

use crate::folder::{self, Contents};
use crate::{Result, fault::Library};
use std::fs::File;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::time::{Duration, Instant};

/// A command line.
#[derive(Clone, Debug)]
pub struct Call {
    /// The program.
    pub program: PathBuf,
    /// Its arguments; paths are as seen from the folder that it writes into.
    pub arguments: Vec<String>,
    /// What it reads from standard input.
    pub input: Option<PathBuf>,
}

impl Call {
    /// The command in `folder`.
    ///
    /// # Errors
    /// An input that cannot be read.
    pub fn command(&self, folder: &Path) -> Result<Command> {
        let input = match &self.input {
            None => Stdio::null(),
            Some(path) => File::open(path)
                .map_err(|error| format!("{}: {error}", path.display()))?
                .into(),
        };
        let mut command = Command::new(&self.program);
        command
            .args(&self.arguments)
            .current_dir(folder)
            .stdin(input)
            .env_remove("DOSE3_DATA");
        Ok(command)
    }

    /// Runs it to its end.
    ///
    /// # Errors
    /// A program that cannot be started.
    pub fn run(&self, folder: &Path) -> Result<Output> {
        output(&mut self.command(folder)?)
    }
}

/// Runs a command to its end.
///
/// # Errors
/// A program that cannot be started.
pub fn output(command: &mut Command) -> Result<Output> {
    command
        .output()
        .map_err(|error| format!("cannot start {}: {error}", command.get_program().display()))
}

/// How a scenario differs from a program that writes the same files whenever it runs.
#[derive(Clone, Copy)]
pub struct Manner {
    /// Whether a file says how far a run came: it may be in any whole state, and the next run takes it up.
    pub progress: fn(&str) -> bool,
    /// What of a file does not depend on the clock.
    pub essence: fn(&[u8]) -> Vec<u8>,
    /// The next run goes on from the results of this one instead of making them again.
    pub goes_beyond: bool,
    /// What a run has done is not done again: several kills may follow each other.
    pub goes_on: bool,
    /// It is a program, whose standard output may be closed; not an example that prints in passing.
    pub program: bool,
}

impl Default for Manner {
    fn default() -> Self {
        Self {
            progress: |_| false,
            essence: <[u8]>::to_vec,
            goes_beyond: false,
            goes_on: false,
            program: true,
        }
    }
}

/// A program that writes.
pub struct Scenario {
    /// What it is called.
    pub name: &'static str,
    /// How it is called.
    pub call: Call,
    /// The folder before it ran, with older results.
    pub before: Contents,
    /// The folder after an unbroken run.
    pub after: Contents,
    /// The exit code of that.
    pub code: i32,
    /// Whether it wrote to standard output.
    pub prints: bool,
    /// Its time.
    pub time: Duration,
    /// What is particular to it.
    pub manner: Manner,
}

impl Scenario {
    /// Measures an unbroken run in `folder` of `call`, after one of `older` whose progress is forgotten.
    ///
    /// # Errors
    /// A program that fails, or that writes something else the second time.
    pub fn new(
        name: &'static str,
        call: Call,
        older: Option<&Call>,
        manner: Manner,
        folder: &Path,
    ) -> Result<Self> {
        folder::set(folder, &Contents::new())?;
        if let Some(older) = older {
            ended(name, &older.run(folder)?)?;
        }
        let mut before = folder::read(folder)?;
        before.retain(|name, _| !(manner.progress)(name));
        let run = || {
            folder::set(folder, &before)?;
            let begin = Instant::now();
            let output = call.run(folder)?;
            let code = ended(name, &output)?;
            Ok::<_, String>((folder::read(folder)?, code, output, begin.elapsed()))
        };
        let (after, code, output, time) = run()?;
        let scenario = Self {
            name,
            call: call.clone(),
            before: before.clone(),
            after,
            code,
            prints: !output.stdout.is_empty(),
            time,
            manner,
        };
        if !manner.goes_on {
            let again = run()?.0;
            scenario.differs(&again).map_or(Ok(()), |what| {
                Err(format!("{name} is not repeatable: {what}"))
            })?;
        }
        Ok(scenario)
    }

    /// What of a folder is not as after an unbroken run.
    pub fn differs(&self, found: &Contents) -> Option<String> {
        let essence = self.manner.essence;
        let other = found
            .iter()
            .find_map(|(name, bytes)| match self.after.get(name) {
                None => Some(format!("{name} should not be there")),
                Some(new) => (essence(new) != essence(bytes))
                    .then(|| format!("{name} is not what it should be")),
            });
        let missing = || self.after.keys().find(|name| !found.contains_key(*name));
        other.or_else(|| missing().map(|name| format!("{name} is missing")))
    }

    /// The calls by which it writes, from `start`.
    ///
    /// # Errors
    /// A program that fails.
    pub fn boundaries(&self, library: &Library, folder: &Path, start: &Contents) -> Result<usize> {
        folder::set(folder, start)?;
        let log = folder.with_extension("calls");
        let _ = std::fs::remove_file(&log);
        let mut command = self.call.command(folder)?;
        library.count(&mut command, folder, &log);
        ended(self.name, &output(&mut command)?)?;
        let calls = std::fs::read_to_string(&log).map_err(|error| error.to_string())?;
        Ok(calls.lines().count())
    }
}

/// The exit code of a run that did what it should.
fn ended(name: &str, output: &Output) -> Result<i32> {
    match output.status.code() {
        Some(code @ (0 | 1)) => Ok(code),
        _ => Err(format!(
            "{name}: {}\n{}",
            output.status,
            String::from_utf8_lossy(&output.stderr)
        )),
    }
}
