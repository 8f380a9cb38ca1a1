//! One blow, and what must hold afterwards.

use crate::Result;
use crate::fault::{Fault, Library};
use crate::folder::{self, Contents};
use crate::scenario::{Scenario, output};
use std::fs::File;
use std::path::Path;
use std::process::{Child, Command, Output, Stdio};
use std::time::Duration;

/// A folder that a scenario is tried in.
pub struct Trial<'a> {
    /// The program.
    pub scenario: &'a Scenario,
    /// Where it runs.
    pub folder: &'a Path,
    /// The files it began with.
    pub start: &'a Contents,
}

/// The end of the names of files that are being written.
const UNFINISHED: &str = ".unfinished";

impl Trial<'_> {
    /// Sets the folder to its start.
    ///
    /// # Errors
    /// A folder that cannot be written to.
    pub fn begin(&self) -> Result<()> {
        folder::set(self.folder, self.start)
    }

    /// Runs the program and kills it after `wait`; whether it was still running.
    ///
    /// # Errors
    /// A program that cannot be started; a file that is neither the old nor the new one.
    pub fn kill_after(&self, wait: Duration) -> Result<bool> {
        let mut command = self.scenario.call.command(self.folder)?;
        let mut child = spawn(command.stdout(Stdio::null()).stderr(Stdio::null()))?;
        std::thread::sleep(wait);
        // A program that has ended cannot be killed: not a fault.
        let _ = child.kill();
        let status = child.wait().map_err(|error| error.to_string())?;
        self.check()?;
        Ok(status.code().is_none())
    }

    /// Runs the program with `fault` at the call `at`; whether it was struck, and whether something was left beside.
    ///
    /// # Errors
    /// A file that is neither the old nor the new one, a program that says not what happened, a next run that fails.
    pub fn strike(&self, library: &Library, fault: Fault, at: usize) -> Result<bool> {
        self.begin()?;
        let mut command = self.scenario.call.command(self.folder)?;
        library.strike(&mut command, self.folder, fault, at);
        let output = output(&mut command)?;
        let left = self.check()?;
        let answer = self.answer(fault, &output, left);
        let answer = answer.map_err(|what| format!("{what}\n{}", said(&output)))?;
        self.again()?;
        Ok(answer)
    }

    /// Whether the exit code and the words of a struck program are right.
    fn answer(&self, fault: Fault, output: &Output, left: bool) -> Result<bool> {
        let text = said(output);
        if text.contains("panicked") {
            return Err("it panics".into());
        }
        let Some(code) = output.status.code() else {
            return match fault.kills() {
                true => Ok(true),
                false => Err(format!("{}", output.status)),
            };
        };
        // A kill that does not come: the call was not made this time.
        let stays = left && fault == Fault::Eio;
        let done = code == self.scenario.code && self.whole_but(stays)?.is_none();
        match fault.said() {
            _ if done => Ok(fault.said().is_none() && !fault.kills()),
            None => Err(format!("exit code {code}, not everything is written")),
            Some(_) if code == self.scenario.code => {
                Err(format!("exit code {code}, and not everything is written"))
            }
            Some(_) if left && !stays => Err("it ended by itself and left something beside".into()),
            Some(cause) if !text.contains(cause) => Err(format!("it does not say {cause:?}")),
            Some(_) if !self.names(&text) => Err("it does not say which file".into()),
            Some(_) => Ok(true),
        }
    }

    /// What of the results is missing.
    fn whole(&self) -> Result<Option<String>> {
        Ok(self.scenario.differs(&folder::read(self.folder)?))
    }

    /// The same, where what is left beside may stay until the next run: a disk may refuse to remove it.
    fn whole_but(&self, left: bool) -> Result<Option<String>> {
        let mut found = folder::read(self.folder)?;
        found.retain(|name, _| !(left && is_unfinished(name)));
        Ok(self.scenario.differs(&found))
    }

    /// Whether a text names one of the files, or a folder of them.
    fn names(&self, text: &str) -> bool {
        let parts = |name: &String| -> Vec<String> { name.split('/').map(str::to_owned).collect() };
        self.scenario
            .after
            .keys()
            .flat_map(parts)
            .any(|part| text.contains(&part))
    }

    /// Checks that each file is the old or the new one, and none is missing; whether something is left beside.
    ///
    /// # Errors
    /// Which file is not.
    pub fn check(&self) -> Result<bool> {
        let (scenario, found) = (self.scenario, folder::read(self.folder)?);
        let mut left = false;
        for (name, bytes) in &found {
            if (scenario.manner.progress)(name) {
                continue;
            }
            if is_unfinished(name) {
                left = true;
                continue;
            }
            let essence = scenario.manner.essence;
            let old = self.start.get(name).is_some_and(|old| old == bytes);
            let new = scenario.after.get(name);
            if !old && new.is_none_or(|new| essence(new) != essence(bytes)) {
                return Err(format!(
                    "{name} ({} bytes) is neither the old file nor the new one",
                    bytes.len()
                ));
            }
        }
        match self.start.keys().find(|name| !found.contains_key(*name)) {
            Some(name) => Err(format!("{name} is gone")),
            None => Ok(left),
        }
    }

    /// Runs the program unbroken: everything must be as if nothing had happened.
    ///
    /// # Errors
    /// What is not.
    pub fn again(&self) -> Result<()> {
        let scenario = self.scenario;
        if scenario.manner.goes_beyond {
            for (name, bytes) in self.start {
                std::fs::write(self.folder.join(name), bytes).map_err(|error| error.to_string())?;
            }
        }
        let output = scenario.call.run(self.folder)?;
        if output.status.code() != Some(scenario.code) {
            let words = said(&output);
            return Err(format!("the next run fails: {}\n{words}", output.status));
        }
        match self.whole()? {
            Some(what) => Err(format!("after the next run: {what}")),
            None => Ok(()),
        }
    }

    /// Runs the program where nobody reads its standard output, and where that is a full disk.
    ///
    /// # Errors
    /// An exit code that is not right, a file that is not whole.
    pub fn closed_output(&self) -> Result<()> {
        self.begin()?;
        let mut command = self.scenario.call.command(self.folder)?;
        let mut child = spawn(command.stdout(Stdio::piped()).stderr(Stdio::piped()))?;
        drop(child.stdout.take());
        let output = child
            .wait_with_output()
            .map_err(|error| error.to_string())?;
        let (code, whole) = (output.status.code(), self.whole()?);
        if code != Some(self.scenario.code) || whole.is_some() {
            let what = format!("nobody reads: {}, {whole:?}", output.status);
            return Err(format!("{what}\n{}", said(&output)));
        }
        self.begin()?;
        let full = File::options().write(true).open("/dev/full");
        let mut command = self.scenario.call.command(self.folder)?;
        command.stdout(full.map_err(|error| error.to_string())?);
        let output = finish(command.stderr(Stdio::piped()))?;
        let (code, text) = (output.status.code(), said(&output));
        self.check()?;
        let told = text.contains("No space left on device") && !text.contains("panicked");
        match self.scenario.prints {
            true if code == Some(self.scenario.code) || !told => Err(format!(
                "standard output is full: {}\n{text}",
                output.status
            )),
            false if code != Some(self.scenario.code) => {
                Err(format!("it prints nothing, but: {}\n{text}", output.status))
            }
            _ => self.again(),
        }
    }
}

/// Whether a file is one that is being written, by its name.
fn is_unfinished(name: &str) -> bool {
    let file = name.rsplit('/').next().unwrap_or(name);
    file.starts_with('.') && file.ends_with(UNFINISHED)
}

fn spawn(command: &mut Command) -> Result<Child> {
    command
        .spawn()
        .map_err(|error| format!("cannot start {}: {error}", command.get_program().display()))
}

fn finish(command: &mut Command) -> Result<Output> {
    spawn(command)?
        .wait_with_output()
        .map_err(|error| error.to_string())
}

fn said(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}
