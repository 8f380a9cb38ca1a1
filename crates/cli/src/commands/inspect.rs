//! `dose3 inspect`

use super::{count, print, print_json, read_options, say};
use crate::args::Inspect;
use crate::explain::explain;
use anyhow::Result;
use dose3::logs::read_each;
use dose3_datasets::{RateSource, Trajectory, stretches};
use serde::Serialize;
use std::fmt::Write as _;

/// What `inspect --json` prints for one log.
#[derive(Serialize)]
struct Report {
    name: String,
    path: String,
    format: String,
    frame: String,
    poses: usize,
    rate_hz: f64,
    rate_is_nominal: bool,
    duration_s: f64,
    path_length_m: f64,
    extent_m: [f64; 3],
    mean_speed_m_s: f64,
    stretches: usize,
    sha256: String,
    repairs: Vec<String>,
}

pub fn run(args: &Inspect) -> Result<u8> {
    let (mut reports, mut failed) = (Vec::new(), false);
    for (_, log) in read_each(&args.logs, &read_options(&args.reading))? {
        match log {
            Ok(log) => reports.push(report(&log)),
            Err(error) => {
                say(&format!("error: {}", explain(&error.into())));
                failed = true;
            }
        }
    }
    if args.json {
        print_json(&reports)?;
    } else {
        print(&reports.iter().map(text).collect::<Vec<_>>().join("\n"))?;
    }
    Ok(if failed { 2 } else { 0 })
}

fn report(t: &Trajectory) -> Report {
    let bound = |axis: usize, pick: fn(f64, f64) -> f64, start: f64| {
        t.poses
            .iter()
            .map(|p| p.translation[axis])
            .fold(start, pick)
    };
    let extent = |axis| {
        let (low, high) = (
            bound(axis, f64::min, f64::INFINITY),
            bound(axis, f64::max, f64::NEG_INFINITY),
        );
        if high >= low { high - low } else { 0.0 }
    };
    let (duration, distance) = (t.duration(), t.distance());
    Report {
        name: t.name.clone(),
        path: t.path.display().to_string(),
        format: t.format.to_string(),
        frame: t.frame.to_string(),
        poses: t.poses.len(),
        rate_hz: t.rate.hertz,
        rate_is_nominal: t.rate.source == RateSource::Nominal,
        duration_s: duration,
        path_length_m: distance,
        extent_m: [extent(0), extent(1), extent(2)],
        mean_speed_m_s: if duration > 0.0 {
            distance / duration
        } else {
            0.0
        },
        stretches: stretches(t, t.max_gap).len(),
        sha256: t.fingerprint(),
        repairs: t.report.lines(),
    }
}

fn text(r: &Report) -> String {
    let mut out = String::new();
    let nominal = if r.rate_is_nominal {
        " (nominal, no stamps in the file)"
    } else {
        ""
    };
    // Writing to a String cannot fail.
    let _ = writeln!(out, "{}  {}", r.name, r.path);
    let _ = writeln!(out, "  format    {}, body frame {}", r.format, r.frame);
    let _ = writeln!(
        out,
        "  poses     {} at {:.2} Hz{nominal}, {:.1} s, {}",
        r.poses,
        r.rate_hz,
        r.duration_s,
        if r.stretches == 1 {
            "no gap".into()
        } else {
            count(r.stretches.saturating_sub(1), "gap")
        }
    );
    let [x, y, z] = r.extent_m;
    let _ = writeln!(
        out,
        "  motion    {:.2} m long, {:.3} m/s on average, extent {x:.2} x {y:.2} x {z:.2} m",
        r.path_length_m, r.mean_speed_m_s
    );
    for repair in &r.repairs {
        let _ = writeln!(out, "  repaired  {repair}");
    }
    out
}
