//! `dose3 fit`

use super::{check_output, count, model_or_built_in, progress, read_options, say};
use crate::args::Fit;
use anyhow::Result;
use dose3::fit::{FitOptions, fit};
use dose3::logs;
use dose3_diffusion::NoiseSharing;

pub fn run(args: &Fit) -> Result<()> {
    check_output(&args.out)?;
    let model = model_or_built_in(args.model.as_deref())?;
    let options = FitOptions {
        statistics: args.statistics.parse()?,
        density: args.density.parse()?,
        alpha: args.alpha,
        stride: args.stride,
        steps: args.steps,
        draws: args.draws,
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
        "fitted {} on {} of {} ({} told apart); window threshold {:.3}",
        args.statistics,
        count(fitted.windows, "window"),
        count(logs, "log"),
        calibration.logs,
        calibration.threshold.value()
    ));
    say(&format!("wrote {}", args.out.display()));
    Ok(())
}
