//! The environment chooses the vector instructions.

use dose3_engine::{INSTRUCTIONS_VARIABLE, Instructions};
use std::io::Write;
use std::process::Command;

/// Marks the process that is asked.
const ASKED: &str = "DOSE3_ENGINE_TEST_ASKED";

/// What a process detects where the variable has that value.
fn detected(value: Option<&str>) -> String {
    let mut command = Command::new(std::env::current_exe().expect("this test"));
    command
        .args(["--exact", "the_environment_chooses", "--nocapture"])
        .env(ASKED, "yes")
        .env_remove(INSTRUCTIONS_VARIABLE);
    if let Some(value) = value {
        command.env(INSTRUCTIONS_VARIABLE, value);
    }
    let output = command.output().expect("runs");
    let text = String::from_utf8(output.stdout).expect("text");
    let line = text.lines().find_map(|line| line.split("detected ").nth(1));
    line.expect("a line").to_owned()
}

#[test]
fn the_environment_chooses() {
    if std::env::var_os(ASKED).is_some() {
        let said = writeln!(
            std::io::stdout(),
            "detected {}",
            Instructions::detect().name()
        );
        return said.expect("a reader");
    }
    let widest = detected(None);
    for set in Instructions::ALL {
        let expected = match set.available() {
            true => set.name(),
            false => &widest,
        };
        assert_eq!(detected(Some(set.name())), expected);
    }
    assert_eq!(detected(Some("")), widest);
    assert_eq!(detected(Some("sse9")), widest);
}
