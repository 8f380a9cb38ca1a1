//! Reads pose logs and says of each what it is, how many poses it has, and how many seconds reading took, best of `ROUNDS`.
//!
//! `read PATH [ROUNDS]`

#![allow(clippy::print_stdout)]

use std::path::Path;
use std::time::Instant;

use dose3_datasets::{LoadOptions, load};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let path = arguments.next().ok_or("which log?")?;
    let rounds: usize = arguments.next().map_or(Ok(1), |rounds| rounds.parse())?;
    let mut best = f64::INFINITY;
    let mut found = String::new();
    for _ in 0..rounds.max(1) {
        let begin = Instant::now();
        let log = load(Path::new(&path), &LoadOptions::default())?;
        best = best.min(begin.elapsed().as_secs_f64());
        found = format!("{} {} poses", log.format, log.len());
    }
    println!("{found} {best:.4} s");
    Ok(())
}
