//! Reads any pose log and writes it as TUM (`timestamp tx ty tz qx qy qz qw`) to standard output, what was assumed to
//! standard error.
//!
//! `to_tum PATH [TOPIC | PARENT:CHILD]`

#![allow(clippy::print_stderr)]

use std::path::Path;

use dose3_datasets::{LoadOptions, load, write};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let path = arguments.first().ok_or("which log?")?;
    let mut options = LoadOptions::default();
    match arguments.get(1).map(|what| what.split_once(':')) {
        Some(Some((parent, child))) => options.tf = Some((parent.to_owned(), child.to_owned())),
        Some(None) => options.topics.push(arguments[1].clone()),
        None => {}
    }
    let log = load(Path::new(path), &options)?;
    for remark in &log.report.remarks {
        eprintln!("{remark}");
    }
    write::tum(&mut std::io::stdout().lock(), &log)?;
    Ok(())
}
