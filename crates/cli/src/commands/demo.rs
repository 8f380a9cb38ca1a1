//! `dose3 demo`: from nothing to a verdict to look at, with generated logs and the commands that a user would give.

use super::dispatch;
use crate::args::{Args, Demo};
use crate::command_line::shell;
use crate::terminal::say;
use anyhow::{Result, bail};
use clap::Parser;
use dose3_datasets::faults::Fault;
use dose3_datasets::synthetic::{Platform, SUITE_HERTZ, trajectory};
use dose3_datasets::{Trajectory, write};
use std::ffi::OsStr;
use std::ops::Range;
use std::path::Path;

/// Trusted drives.
const TRUSTED: u64 = 8;
/// Poses of each log: two minutes.
const POSES: usize = 2400;
/// What is wrong with the faulty drive, and in which of its poses.
const FAULTS: [(&str, Range<usize>); 2] = [("freeze:1.5s", 640..760), ("slip:1.0m/s", 1500..1660)];

pub fn run(args: &Demo) -> Result<u8> {
    let folder = &args.out;
    let used = folder.symlink_metadata().is_ok();
    if used && !args.force {
        bail!(
            "{} is there already; hint: name another folder with --out, or replace what an earlier demo left with --force",
            folder.display()
        );
    }
    let at = |name: &str| folder.join(name);
    for seed in 0..TRUSTED {
        save(&at(&format!("trusted/drive_{seed}.txt")), &drive(seed))?;
    }
    save(&at("sound.txt"), &drive(TRUSTED))?;
    save(&at("faulty.txt"), &faulty()?)?;
    say(&format!(
        "{}: {TRUSTED} generated drives to trust, a sound one, and a faulty one: its poses are stuck for 1.5 s, \
         and it slips sideways by 1 m/s for 8 s",
        folder.display()
    ));
    let (trusted, detector) = (at("trusted"), at("drives.dose3"));
    let word = OsStr::new;
    // A TUM file does not say which way its axes point; a user who knows it says so.
    let frame = [word("--frame"), word("body-flu")];
    let fit = [
        word("fit"),
        word("--trusted"),
        trusted.as_ref(),
        word("--out"),
        detector.as_ref(),
    ];
    step(&[&fit[..], &frame].concat(), args.force)?;
    let score = |log: &str, page: &str| {
        let (log, page) = (at(log), at(page));
        let score = [
            word("score"),
            word("--detector"),
            detector.as_ref(),
            log.as_ref(),
            word("--html"),
            page.as_ref(),
        ];
        step(&[&score[..], &frame].concat(), args.force)
    };
    let codes = (
        score("sound.txt", "sound.html")?,
        score("faulty.txt", "faulty.html")?,
    );
    say(&format!(
        "\nopen {} in a browser",
        at("faulty.html").display()
    ));
    match codes {
        (0, 1) => Ok(0),
        _ => bail!("the verdicts are not those of the logs"),
    }
}

fn drive(seed: u64) -> Trajectory {
    trajectory(Platform::Vehicle, seed, POSES, SUITE_HERTZ)
}

fn faulty() -> Result<Trajectory> {
    let mut log = drive(TRUSTED + 1);
    for (fault, range) in FAULTS {
        log = fault.parse::<Fault>()?.inject(&log, range, 1)?.trajectory;
    }
    Ok(log)
}

/// As a TUM file, which has stamps.
fn save(path: &Path, log: &Trajectory) -> Result<()> {
    let mut bytes = Vec::new();
    write::tum(&mut bytes, log)?;
    dose3::atomic::write(path, &bytes)?;
    Ok(())
}

/// Says a command and runs it.
fn step(words: &[&OsStr], force: bool) -> Result<u8> {
    let mut all = vec![OsStr::new("dose3")];
    all.extend(words);
    if force {
        all.push(OsStr::new("--force"));
    }
    let line = shell(all.iter().copied());
    say(&format!("\n$ {line}"));
    dispatch(Args::try_parse_from(all)?.command, line)
}
