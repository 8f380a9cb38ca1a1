//! The page of a log: `cargo run --release --example page DETECTOR LOG PAGE`.

use dose3::Detector;
use dose3_page::{Page, Told};
use std::error::Error;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [detector_file, log, page] = &arguments[..] else {
        return Err("expected a detector, a log and the page to write".into());
    };
    let detector = Detector::load(detector_file)?;
    for log in dose3::load([log])? {
        let report = detector.judge(&log)?;
        let told = Told {
            detector: Some(detector_file.clone()),
            ..Told::default()
        };
        let html = Page::new(&detector, &log, &report, told)?.html();
        std::fs::write(page, html)?;
    }
    Ok(())
}
