//! The `dose3` program: results to standard output, words to standard error, exit code 0 (in
//! distribution, or done), 1 (a log is out of distribution), 2 (an error).

mod commands;
mod explain;
mod ordered;
mod output_file;
mod per_log;
mod recording;
#[cfg(all(test, feature = "schema"))]
mod schema;
mod terminal;

use clap::Parser;
use dose3_cli::{args, command_line, list, pose_line};
use std::process::ExitCode;

fn main() -> ExitCode {
    let args = match args::Args::try_parse() {
        Ok(args) => args,
        Err(error) => {
            // Help and version are no errors; everything else is exit code 2.
            let code = if error.use_stderr() { 2 } else { 0 };
            let _ = error.print();
            return ExitCode::from(code);
        }
    };
    match commands::run(args) {
        Ok(code) => ExitCode::from(code),
        Err(error) => {
            terminal::say(&format!("error: {}", explain::explain(&error)));
            ExitCode::from(2)
        }
    }
}
