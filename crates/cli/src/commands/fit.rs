//! `dose3 fit`

use super::{check_output, count, model, progress, read_options, say};
use crate::args::Fit;
use anyhow::Result;
use dose3::fit::{Defaults, FitOptions, combination, fit};
use dose3::logs;
use dose3_diffusion::NoiseSharing;
use dose3_ood::StatisticsSet;

pub fn run(args: &Fit) -> Result<()> {
    check_output(&args.out)?;
    let model = model(&args.model)?;
    let defaults = Defaults::of(&model);
    let statistics: StatisticsSet = args
        .statistics
        .as_deref()
        .unwrap_or(defaults.statistics)
        .parse()?;
    let options = FitOptions {
        combination: combination(args.combination.as_deref(), &statistics)?,
        statistics: statistics.clone(),
        density: args.density.parse()?,
        alpha: args.alpha,
        stride: args.stride,
        steps: args.steps.or(defaults.steps),
        draws: args.draws.unwrap_or(defaults.draws),
        sharing: if args.own_noise {
            NoiseSharing::PerWindow
        } else {
            NoiseSharing::Common
        },
        seed: args.seed,
        backend: args.computing.backend,
        threads: args.computing.threads,
    };
    let trusted = logs::read(&args.trusted, &read_options(&args.reading))?;
    let logs = trusted.len();
    let bar = progress(0, "statistics")?;
    let fitted = fit(&model, trusted, &options, &|done, total| {
        bar.set_length(total as u64);
        bar.set_position(done as u64);
    })?;
    bar.finish_and_clear();
    fitted.detector.write(&args.out)?;
    for note in &fitted.notes {
        say(&format!("note: {note}"));
    }
    let calibration = fitted.detector.header.statistics.calibration();
    say(&format!(
        "fitted {statistics} on {} of {} ({} told apart); window threshold {:.3}",
        count(fitted.windows, "window"),
        count(logs, "log"),
        calibration.logs,
        calibration.threshold.value()
    ));
    say(&format!("wrote {}", args.out.display()));
    Ok(())
}
