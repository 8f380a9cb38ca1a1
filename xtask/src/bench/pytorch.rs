//! PyTorch on the same networks, in a process of its own that waits for its turns.

use super::Shape;
use anyhow::{Context, Result, bail};
use std::io::{BufRead, BufReader, Write};
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};

const SCRIPT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/pytorch/bench.py");

/// How PyTorch runs a network.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mode {
    /// Operation by operation.
    Eager,
    /// Through `torch.compile`.
    Compiled,
}

/// The running script.
pub struct Pytorch {
    child: Child,
    ask: Option<ChildStdin>,
    answer: BufReader<ChildStdout>,
}

impl Pytorch {
    /// Starts the script with `python`, on one of PyTorch's devices.
    ///
    /// # Errors
    /// No such program, or one without PyTorch.
    pub fn start(
        python: &str,
        shape: &Shape,
        threads: usize,
        seconds: f64,
        device: &str,
    ) -> Result<Self> {
        let multipliers: Vec<String> = shape.multipliers.iter().map(usize::to_string).collect();
        let mut child = Command::new(python)
            .arg(SCRIPT)
            .args(["--width", &shape.width.to_string()])
            .args(["--multipliers", &multipliers.join(",")])
            .args(["--batch", &shape.batch.to_string()])
            .args(["--length", &shape.length.to_string()])
            .args(["--threads", &threads.to_string()])
            .args(["--seconds", &seconds.to_string()])
            .args(["--device", device])
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .with_context(|| format!("cannot start {python}"))?;
        let ask = child.stdin.take();
        let answer = BufReader::new(child.stdout.take().context("no standard output")?);
        Ok(Self { child, ask, answer })
    }

    /// The version of PyTorch.
    ///
    /// # Errors
    /// A script that ended.
    pub fn version(&mut self) -> Result<String> {
        self.request("version")
    }

    /// The shortest time of `forward` or `train` within a turn, seconds.
    ///
    /// # Errors
    /// A script that ended.
    pub fn time(&mut self, what: &str, mode: Mode) -> Result<f64> {
        let mode = match mode {
            Mode::Eager => "eager",
            Mode::Compiled => "compiled",
        };
        Ok(self.request(&format!("{what} {mode}"))?.parse()?)
    }

    fn request(&mut self, line: &str) -> Result<String> {
        let ask = self.ask.as_mut().context("no standard input")?;
        writeln!(ask, "{line}")?;
        ask.flush()?;
        let mut line = String::new();
        if self.answer.read_line(&mut line)? == 0 {
            bail!("{SCRIPT} ended; its message is above");
        }
        Ok(line.trim().to_string())
    }
}

impl Drop for Pytorch {
    fn drop(&mut self) {
        // The end of its input ends the script.
        self.ask = None;
        let _ = self.child.wait();
    }
}
