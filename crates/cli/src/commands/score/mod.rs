//! `dose3 score`: which logs ([`files`]), judged on several threads, shown one after the other ([`sink`]).

mod judge;
pub mod output;
mod sink;
mod summary;

use super::{computing, read_options, say_skipped};
use crate::args::{OutputName, Score};
use crate::list;
use crate::ordered::ordered;
use crate::terminal::{progress, say};
use anyhow::{Result, bail};
use dose3::Detector;
use dose3::logs::{Listing, list as list_files};
use judge::Judge;
use output::Head;
use summary::Summary;

pub fn run(args: &Score) -> Result<u8> {
    check(args)?;
    let detector = Detector::load(&args.detector)?.on(computing(&args.computing));
    let mut sinks = sink::all(args, &Head::new(args, &detector), &detector)?;
    let found = files(args)?;
    let quiet = args.showing.quiet;
    if !quiet {
        say_skipped(&found.skipped);
    }
    let n = found.files.len();
    let bar = progress(n as u64, "scoring", quiet)?;
    let judge = Judge::new(args, &bar, n == 1);
    let mut summary = Summary::new(&found.skipped);
    ordered(
        n,
        workers(args),
        || detector.clone(),
        |detector, index| judge.file(detector, &found.files[index]),
        |logs| {
            let many = n > 1 || logs.len() > 1;
            for log in &logs {
                summary.add(log, many);
                bar.suspend(|| {
                    if let Err(error) = &log.outcome {
                        say(&format!("error: {error}"));
                    }
                    sinks.iter_mut().try_for_each(|sink| sink.log(log, many))
                })?;
            }
            if n > 1 {
                bar.inc(1);
            }
            Ok(())
        },
    )?;
    bar.finish_and_clear();
    summary.end(args.fdr);
    for sink in sinks {
        sink.end(&summary)?;
    }
    if !quiet {
        // Documents for programs have the notes of each log.
        summary.say(args.showing.form() == OutputName::Table && !args.showing.verbose);
    }
    Ok(summary.exit_code())
}

fn check(args: &Score) -> Result<()> {
    for (flag, share) in [("--alpha", args.alpha), ("--fdr", args.fdr)] {
        if let Some(share) = share.filter(|share| !(*share > 0.0 && *share < 1.0)) {
            bail!("{flag} {share}: expected a share between 0 and 1");
        }
    }
    let standard_input = args
        .logs
        .iter()
        .filter(|path| path.as_os_str() == "-")
        .count();
    let listed = args
        .list
        .iter()
        .filter(|path| path.as_os_str() == "-")
        .count();
    if standard_input + listed > 1 {
        bail!(
            "standard input (-) can be read once, it is named {} times",
            standard_input + listed
        );
    }
    Ok(())
}

/// The files that paths and list name.
fn files(args: &Score) -> Result<Listing> {
    let mut paths = args.logs.clone();
    if let Some(list) = &args.list {
        paths.extend(list::rows(list)?.into_iter().map(|row| row.path));
    }
    Ok(list_files(&paths, &read_options(&args.reading))?)
}

/// Logs at once: while some are read, others are measured.
fn workers(args: &Score) -> usize {
    match args.computing.threads {
        0 => rayon::current_num_threads(),
        threads => threads,
    }
}
