//! Fits a detector with settings of one's own to folders and keeps it as a file:
//! `fit_folders OUT TRUSTED...`.

// An example prints.
#![allow(clippy::print_stdout)]

use dose3::progress::OnWindow;
use dose3::{Detector, FitOptions};
use std::error::Error;

fn main() -> Result<(), Box<dyn Error>> {
    let mut args = std::env::args().skip(1);
    let out = args.next().ok_or("usage: fit_folders OUT TRUSTED...")?;
    let trusted = dose3::load(args)?;
    let options = FitOptions {
        statistics: Some("kinematic,differences".parse()?),
        alpha: 0.01,
        ..FitOptions::default()
    };
    let mut measured = 0;
    let fitted = Detector::builder()
        .options(options)
        .run(&trusted, &mut OnWindow(|done, _| measured = done))?;
    for note in &fitted.notes {
        println!("note: {note}");
    }
    fitted.detector.save(&out)?;
    let again = Detector::load(&out)?;
    println!(
        "{measured} windows of {} logs; wrote {out}",
        again.header().trusted.len()
    );
    Ok(())
}
