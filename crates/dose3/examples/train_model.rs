//! Trains a small model on logs, then fits a detector with it: `train_model OUT LOGS...`.

// An example prints.
#![allow(clippy::print_stdout)]

use dose3::datasets::Kind;
use dose3::diffusion::trainer::LogRow;
use dose3::model::{PairConfig, Precision};
use dose3::progress::OnStep;
use dose3::train::{HoldOut, TrainOptions, train};
use dose3::{Detector, Model};
use std::error::Error;

fn main() -> Result<(), Box<dyn Error>> {
    let mut args = std::env::args().skip(1);
    let out = args.next().ok_or("usage: train_model OUT LOGS...")?;
    let logs = dose3::load(args)?;
    // Far too small and too short to be of use, but it takes a second. The defaults take minutes.
    let mut options = TrainOptions {
        window: 32,
        network: PairConfig::new(8, &[1, 2]),
        hold_out: HoldOut::Fraction(0.0),
        ..TrainOptions::of(Kind::Motion)
    };
    options.config.steps = 10;
    options.config.batch = 4;
    let mut last = None;
    let trained = train(
        &logs,
        &options,
        &mut OnStep(|row: &LogRow| last = Some(row.step)),
    )?;
    trained.model.write(out.as_ref(), Precision::F32)?;
    println!("trained {} steps, wrote {out}", last.unwrap_or(0));

    let detector = Detector::builder()
        .model(Model::read(out.as_ref())?)
        .fit(&logs)?;
    println!("{}", detector.judge(&logs[0])?);
    Ok(())
}
