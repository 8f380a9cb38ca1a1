//! Fits a detector to a folder of trusted logs and judges a file: `judge_file TRUSTED LOG`.

// An example prints.
#![allow(clippy::print_stdout)]

use dose3::Detector;
use std::error::Error;

fn main() -> Result<(), Box<dyn Error>> {
    let mut args = std::env::args().skip(1);
    let (Some(trusted), Some(log)) = (args.next(), args.next()) else {
        return Err("usage: judge_file TRUSTED LOG".into());
    };
    let detector = Detector::fit(&dose3::load([trusted])?)?;
    for log in dose3::load([log])? {
        let report = detector.judge(&log)?;
        println!("{report}");
        for segment in &report.segments {
            let place = &segment.place;
            println!(
                "unlike the trusted logs from {:.1} s on ({} {})",
                place.start_s, report.log.row_kind, place.first_row
            );
        }
    }
    Ok(())
}
