//! `dose3 fit`

use super::{computing, model, read_options, read_set};
use crate::args::Fit;
use crate::explain::with_flag;
use crate::list;
use crate::output_file::{DETECTOR, OutputFile};
use crate::terminal::{Bar, count, progress, say};
use anyhow::Result;
use dose3::datasets::make_unique;
use dose3::detector::LeftOut;
use dose3::{Detector, FitOptions, StreamOptions, Trajectory};

pub fn run(args: &Fit) -> Result<()> {
    let out = OutputFile::new(&args.out, DETECTOR, args.force)?;
    let builder = Detector::builder()
        .model(model(&args.model)?)
        .options(options(args)?)
        .computing(computing(&args.computing))
        .leave_out(!args.reading.strict);
    let trusted = trusted(args)?;
    let mut bar = Bar(progress(0, "statistics", false)?);
    let fitted = builder.run(&trusted, &mut bar)?;
    bar.0.finish_and_clear();
    say_left_out(&fitted.left_out, &trusted);
    out.save(&fitted.detector.to_bytes()?)?;
    for note in &fitted.notes {
        say(&format!("note: {}", with_flag(note)));
    }
    // Whether streams by it keep what they promise; a detector that counts poses has none.
    if let Ok(monitor) = fitted.detector.monitor(&StreamOptions::default()) {
        let apart = monitor.apart();
        if apart.breaks_the_promise() {
            say(&format!("note: for `dose3 watch`: {apart}"));
        }
    }
    let statistics = &fitted.detector.header().statistics;
    let calibration = statistics.calibration();
    say(&format!(
        "fitted {} on {} of {} ({} told apart); window threshold {:.3}",
        statistics.config().statistics,
        count(fitted.windows, "window"),
        count(trusted.len() - fitted.left_out.len(), "log"),
        calibration.logs,
        calibration.threshold.value()
    ));
    say(&format!("wrote {}", args.out.display()));
    Ok(())
}

fn options(args: &Fit) -> Result<FitOptions> {
    Ok(FitOptions {
        statistics: args.statistics.as_deref().map(str::parse).transpose()?,
        density: args.density.parse()?,
        combination: args.combination.as_deref().map(str::parse).transpose()?,
        shares: args.shares.clone(),
        join_overlapping: !args.no_overlap,
        timing: !args.no_timing,
        calibration: !args.no_calibration,
        keep_all: args.keep_all,
        alpha: args.alpha,
        stride: args.stride,
        rate: args.resample,
        window: args.window,
        steps: args.steps,
        draws: args.draws,
        noise: args.noise(),
        seed: args.seed,
    })
}

/// Names the logs that the fit is not of.
fn say_left_out(left_out: &[LeftOut], trusted: &[Trajectory]) {
    for left in left_out {
        let log = &trusted[left.index];
        let name = match log.path.as_os_str().is_empty() {
            true => log.name.clone(),
            false => log.path.display().to_string(),
        };
        say(&format!("left out {name}: {}", left.reason));
    }
    if !left_out.is_empty() {
        let logs = count(left_out.len(), "log");
        say(&format!("{logs} left out (--strict stops instead)"));
    }
}

/// The logs that paths and list name, in the groups that the user wants.
fn trusted(args: &Fit) -> Result<Vec<Trajectory>> {
    let options = read_options(&args.reading);
    let mut logs = read_set(&args.trusted, &options)?;
    if let Some(group) = &args.group {
        group.apply(&mut logs)?;
    }
    if let Some(list) = &args.list {
        logs.extend(list::read(list, &options)?);
        make_unique(&mut logs);
    }
    Ok(logs)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::args::{Args, Command};
    use clap::Parser;
    use dose3::logs::ReadOptions;

    #[test]
    fn the_defaults_of_the_program_are_those_of_the_library() {
        let line = ["dose3", "fit", "--trusted", "logs", "--out", "d.dose3"];
        let Command::Fit(args) = Args::parse_from(line).command else {
            panic!("no fit");
        };
        assert_eq!(options(&args).unwrap(), FitOptions::default());
        assert_eq!(read_options(&args.reading), ReadOptions::default());
    }
}
