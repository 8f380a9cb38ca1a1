//! The harness finds what it is there to find: programs that write in place, and those that leave things behind.
#![cfg(target_os = "linux")]

use dose3_crash::fault::{Fault, Library};
use dose3_crash::folder::Contents;
use dose3_crash::scenario::{Call, Manner, Scenario};
use dose3_crash::trial::Trial;
use std::path::Path;
use std::time::Duration;

/// A shell script that writes `new` where `old` was.
fn script(text: &str, folder: &Path) -> Scenario {
    let of = |text: &str| Call {
        program: "sh".into(),
        arguments: vec!["-e".into(), "-c".into(), text.into()],
        input: None,
    };
    let older = of("printf old > out");
    Scenario::new("script", of(text), Some(&older), Manner::default(), folder).expect("runs")
}

fn killed(text: &str) -> Result<bool, String> {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path().join("out");
    let scenario = script(text, &folder);
    let trial = Trial {
        scenario: &scenario,
        folder: &folder,
        start: &scenario.before,
    };
    trial.begin()?;
    let struck = trial.kill_after(Duration::from_millis(300))?;
    trial.again()?;
    Ok(struck)
}

#[test]
fn a_program_that_writes_in_place_is_found() {
    let error = killed("printf n > out; sleep 1; printf ew >> out").unwrap_err();
    assert!(
        error.contains("neither the old file nor the new one"),
        "{error}"
    );
}

#[test]
fn a_file_beside_that_the_next_run_leaves_is_found() {
    let text =
        "touch .out.$$.unfinished; sleep 1; printf new > .new; mv .new out; rm .out.$$.unfinished";
    let error = killed(text).unwrap_err();
    assert!(error.contains("should not be there"), "{error}");
}

#[test]
fn a_program_that_takes_care_passes() {
    let text = "printf new > .out.0.unfinished; sleep 1; mv .out.0.unfinished out";
    assert_eq!(killed(text), Ok(true));
}

#[test]
fn calls_that_write_are_counted_and_can_be_struck() {
    let folder = tempfile::tempdir().expect("a folder");
    let library = Library::build(folder.path()).expect("a C compiler, which Rust needs too");
    let out = folder.path().join("out");
    let scenario = script(
        "printf new > .out.0.unfinished; mv -f .out.0.unfinished out",
        &out,
    );
    let calls = scenario.boundaries(&library, &out, &scenario.before);
    assert!(calls.as_ref().is_ok_and(|calls| *calls >= 1), "{calls:?}");
    let trial = Trial {
        scenario: &scenario,
        folder: &out,
        start: &Contents::new(),
    };
    assert_eq!(trial.strike(&library, Fault::Kill, 1), Ok(true));
}
