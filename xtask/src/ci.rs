//! `cargo xtask ci`: the whole check of this repository, cheapest first.

use anyhow::{Context, Result, ensure};
use dose3_study::say;
use std::path::Path;
use std::process::Command;

/// The root of the workspace.
const ROOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/..");
/// Real data for those tests that can use it, where a checkout of the data lies beside that of the code.
const DATA: &str = "../shared/data";

/// The checks, as arguments of cargo. Tests come before clippy, which then finds every build script and proc macro of
/// the same profile built.
const CHECKS: [&[&str]; 4] = [
    &["fmt", "--all", "--check"],
    &["test", "--release", "--workspace"],
    &[
        "clippy",
        "--release",
        "--workspace",
        "--all-targets",
        "--",
        "--deny",
        "warnings",
    ],
    &["doc", "--release", "--workspace", "--no-deps"],
];

/// Runs all checks; the first that fails ends it.
///
/// # Errors
/// A check that fails.
pub fn run() -> Result<()> {
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let data = Path::new(ROOT).join(DATA);
    for check in CHECKS {
        say!("cargo {}", check.join(" "));
        let mut command = Command::new(&cargo);
        command
            .args(check)
            .current_dir(ROOT)
            .env("RUSTDOCFLAGS", "--deny warnings");
        if let (None, Ok(data)) = (std::env::var_os("DOSE3_DATA"), data.canonicalize()) {
            command.env("DOSE3_DATA", data);
        }
        let status = command.status().context("cannot start cargo")?;
        ensure!(status.success(), "cargo {}: {status}", check.join(" "));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_script_of_ci_runs_the_same_checks() {
        let script = include_str!("../../.ci/run");
        for check in CHECKS {
            let line = format!("cargo {}", check.join(" "));
            assert!(script.contains(&line), "{line}");
        }
    }
}
