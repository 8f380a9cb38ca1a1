//! `dose3 inspect`

use super::{read_options, say_skipped};
use crate::args::Inspect;
use crate::explain::{explain, remark_with_flag};
use crate::terminal::{count, print, print_json, say};
use anyhow::Result;
use dose3::Detector;
use dose3::detector::DetectorSummary;
use dose3::logs::find_each;
use dose3::model_file::ModelSummary;
use dose3_datasets::{Contents, LostSpan, RateSource, Remark, Trajectory, contents, stretches};
use serde::Serialize;
use std::fmt::Write as _;

/// What `inspect --json` prints for one log.
#[derive(Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
struct Report {
    name: String,
    path: String,
    format: String,
    frame: String,
    poses: usize,
    rate_hz: f64,
    rate_is_nominal: bool,
    rate_source: RateSource,
    duration_s: f64,
    path_length_m: f64,
    extent_m: [f64; 3],
    mean_speed_m_s: f64,
    stretches: usize,
    sha256: String,
    repairs: Vec<String>,
    lost: Vec<LostSpan>,
    remarks: Vec<Remark>,
}

/// What `inspect --json` prints for a recording of which no topic was asked for.
#[derive(Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
struct Recording {
    path: String,
    #[serde(flatten)]
    contents: Contents,
}

/// What `inspect --json` prints for a detector.
#[derive(Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
struct Fitted {
    path: String,
    detector: DetectorSummary,
}

/// What `inspect --json` prints for a model.
#[derive(Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
struct Trained {
    path: String,
    model: ModelSummary,
}

/// One path of `inspect`.
#[derive(Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(untagged)]
enum Entry {
    Detector(Box<Fitted>),
    Model(Box<Trained>),
    Recording(Recording),
    Log(Report),
}

/// Schema of what `--json` prints.
#[cfg(all(test, feature = "schema"))]
pub fn schema() -> schemars::Schema {
    schemars::schema_for!(Vec<Entry>)
}

pub fn run(args: &Inspect) -> Result<u8> {
    let options = read_options(&args.reading);
    let (mut entries, mut failed) = (Vec::new(), false);
    let mut logs = Vec::new();
    for file in &args.logs {
        let path = file.display().to_string();
        let entry = if Detector::is_file(file) {
            Detector::load(file)
                .and_then(|detector| detector.summary())
                .map(|detector| Entry::Detector(Box::new(Fitted { path, detector })))
        } else if ModelSummary::is_model(file) {
            ModelSummary::read(file).map(|model| Entry::Model(Box::new(Trained { path, model })))
        } else {
            logs.push(file.clone());
            continue;
        };
        match entry {
            Ok(entry) => entries.push(entry),
            Err(error) => {
                say(&format!("error: {}", explain(&error.into())));
                failed = true;
            }
        }
    }
    let found = find_each(&logs, &options)?;
    say_skipped(&found.skipped);
    let listing = options.load.topics.is_empty() && options.load.tf.is_none();
    for (path, log) in found.logs {
        let listed = if listing {
            contents(&path, &options.load).unwrap_or_default()
        } else {
            None
        };
        let is_recording = listed.is_some();
        entries.extend(listed.map(|contents| {
            Entry::Recording(Recording {
                path: path.display().to_string(),
                contents,
            })
        }));
        match log {
            Ok(log) => entries.push(Entry::Log(report(&log))),
            // The listing says what can be asked for.
            Err(_) if is_recording => {}
            Err(error) => {
                say(&format!("error: {}", explain(&error.into())));
                failed = true;
            }
        }
    }
    if args.json {
        print_json(&entries)?;
    } else {
        let texts = entries.iter().map(|entry| match entry {
            Entry::Detector(fitted) => format!("{}\n{}", fitted.path, fitted.detector),
            Entry::Model(trained) => format!("{}\n{}", trained.path, trained.model),
            Entry::Recording(recording) => listing_text(recording),
            Entry::Log(report) => text(report),
        });
        print(&texts.collect::<Vec<_>>().join("\n"))?;
    }
    Ok(if failed { 2 } else { 0 })
}

/// Topics and frames of a recording.
fn listing_text(recording: &Recording) -> String {
    let mut out = format!("{}\n", recording.path);
    let contents = &recording.contents;
    let width = |field: fn(&dose3_datasets::Topic) -> usize| {
        contents.topics.iter().map(field).max().unwrap_or(0)
    };
    let (name, kind) = (
        width(|topic| topic.name.len()),
        width(|topic| topic.kind.len()),
    );
    for topic in &contents.topics {
        let messages = topic.messages.map_or("?".to_owned(), |n| n.to_string());
        let rate = topic
            .hertz
            .map_or(String::new(), |hertz| format!(", {hertz:.1} Hz"));
        let frames = match (&topic.frame, &topic.child_frame) {
            (Some(frame), Some(child)) => format!(", {child} in {frame}"),
            (Some(frame), None) => format!(", in {frame}"),
            _ => String::new(),
        };
        let judged = match (topic.poses, topic.refused) {
            (true, _) => format!("  (--topic {})", topic.name),
            (false, Some(reason)) => format!("  (cannot be judged: {reason})"),
            (false, None) => String::new(),
        };
        let _ = writeln!(
            out,
            "  {:<name$}  {:<kind$}  {messages}{rate}{frames}{judged}",
            topic.name, topic.kind
        );
    }
    // Many frames hang fixed below one that moves: one line for all of them.
    let mut shown: Vec<(String, Vec<&str>)> = Vec::new();
    for chain in &contents.chains {
        let moving = chain
            .hertz
            .iter()
            .rposition(Option::is_some)
            .map_or(0, |at| at + 1);
        let mut path = chain.frames[0].clone();
        for (frame, hertz) in chain.frames[1..].iter().zip(&chain.hertz).take(moving) {
            let rate = hertz.map_or("static".to_owned(), |hertz| format!("{hertz:.1} Hz"));
            let _ = write!(path, " -> {frame} ({rate})");
        }
        let fixed = chain.frames[moving + 1..].iter().map(String::as_str);
        match shown.iter_mut().find(|(known, _)| *known == path) {
            Some((_, below)) => below.extend(fixed),
            None => shown.push((path, fixed.collect())),
        }
    }
    for (path, mut below) in shown {
        below.sort_unstable();
        below.dedup();
        let more = match below.len() {
            0 => String::new(),
            1..=4 => format!(", fixed below: {}", below.join(", ")),
            n => format!(
                ", fixed below: {} and {} more",
                below[..3].join(", "),
                n - 3
            ),
        };
        let _ = writeln!(out, "  tf        {path}{more}  (--tf PARENT:CHILD)");
    }
    for damage in &contents.damage {
        let _ = writeln!(out, "  damaged   {damage}");
    }
    out
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
    // A pause is no time in which the path was travelled.
    let (duration, distance, moving) = (t.duration(), t.distance(), t.time_in_stretches());
    Report {
        name: t.name.clone(),
        path: t.path.display().to_string(),
        format: t.format.to_string(),
        frame: t.frame.to_string(),
        poses: t.poses.len(),
        rate_hz: t.rate.hertz,
        rate_source: t.rate.source,
        rate_is_nominal: t.rate.source == RateSource::Nominal,
        duration_s: duration,
        path_length_m: distance,
        extent_m: [extent(0), extent(1), extent(2)],
        mean_speed_m_s: if moving > 0.0 { distance / moving } else { 0.0 },
        stretches: stretches(t, t.max_gap).len(),
        sha256: t.fingerprint(),
        repairs: t.report.lines(),
        lost: t.report.lost.clone(),
        remarks: t.report.remarks.clone(),
    }
}

fn text(r: &Report) -> String {
    let mut out = String::new();
    let nominal = match r.rate_source {
        RateSource::Stamps => "",
        RateSource::Nominal => " (nominal, no stamps in the file)",
        RateSource::Given => " (as given)",
        RateSource::Unknown => " (unknown, put in: no stamps in the file)",
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
    for remark in &r.remarks {
        let word = if remark.is_warning() {
            "warning"
        } else {
            "assumed"
        };
        let _ = writeln!(out, "  {word:<9} {}", remark_with_flag(remark));
    }
    out
}
