//! What streams cost: one alone as fast as it goes, many in step with the clock, and a long day of one.

use anyhow::{Result, ensure};
use clap::Args;
use dose3::atomic;
use dose3::stream::{Monitor, Stream, StreamOptions};
use dose3::{Detector, Trajectory};
use dose3_datasets::synthetic::{Platform, suite, trajectory};
use dose3_ood::statistics::quantile_sorted as quantile;
use dose3_study::live::soak::{self, Soak};
use dose3_study::provenance::{Provenance, Start};
use dose3_study::say;
use serde::Serialize;
use std::fmt::Write;
use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Poses a second.
const HERTZ: f64 = 20.0;
/// Poses that one stream alone is given.
const ALONE: usize = 60_000;
/// Poses before times count: the first window, and buffers.
const WARM: usize = 1000;
/// Streams begin one after the other within so many seconds, as robots do.
const SPREAD: f64 = 8.0;

/// Arguments of `bench --parts stream`.
#[derive(Clone, Debug, Args)]
pub struct StreamArgs {
    /// Streams in one process
    #[arg(long, value_name = "N", default_value_t = 1000)]
    pub streams: usize,
    /// Threads that serve them
    #[arg(long, value_name = "N", default_value_t = 2)]
    pub stream_threads: usize,
    /// Seconds for which they are served, each at 20 Hz; 0 leaves it out
    #[arg(long, value_name = "SECONDS", default_value_t = 60.0)]
    pub stream_seconds: f64,
    /// Simulated hours of the long day; 0 leaves it out
    #[arg(long, value_name = "HOURS", default_value_t = 2.0)]
    pub soak_hours: f64,
}

#[derive(Serialize)]
struct Report {
    provenance: Provenance,
    alone: Alone,
    many: Option<Many>,
    soak: Option<Soak>,
}

/// One stream, pushed as fast as it goes. Microseconds.
#[derive(Serialize)]
struct Alone {
    statistics: String,
    poses: usize,
    windows: u64,
    mean_us: f64,
    median_us: f64,
    p999_us: f64,
    worst_us: f64,
    memory_kb: Option<u64>,
}

/// Many streams in step with the clock: milliseconds from when a pose was due until it was judged.
#[derive(Serialize)]
struct Many {
    streams: usize,
    threads: usize,
    seconds: f64,
    poses: u64,
    windows: u64,
    median_ms: f64,
    p999_ms: f64,
    p99999_ms: f64,
    worst_ms: f64,
    /// Poses that were judged more than 50 ms after they were due.
    later_than_50_ms: u64,
    /// Share of the threads' time in pushes.
    busy: f64,
    /// Processes that were ready to run beside, at the beginning and at the end (one minute).
    load: [Option<f64>; 2],
    memory_kb: Option<u64>,
}

/// Measures and writes stream.json and stream.md.
///
/// # Errors
/// A failing fit, settings out of range.
pub fn run(args: &StreamArgs, out: &Path, command: &str) -> Result<()> {
    ensure!(
        args.stream_threads > 0 && args.stream_seconds >= 0.0 && args.soak_hours >= 0.0,
        "--stream-threads, --stream-seconds and --soak-hours want positive numbers"
    );
    let start = Start::now(command);
    let trusted = suite(Platform::Vehicle, 6, 1);
    let detector = Detector::builder().fit(&trusted)?;
    let options = StreamOptions {
        windows: false,
        ..StreamOptions::default()
    };
    let monitor = detector.monitor(&options)?;
    let alone = alone(&monitor)?;
    let many = match args.stream_seconds > 0.0 && args.streams > 0 {
        true => Some(many(&monitor, args)?),
        false => None,
    };
    let soak = match args.soak_hours > 0.0 {
        true => Some(soak::run((6.0 * args.soak_hours).ceil() as usize, 1)?),
        false => None,
    };
    let report = Report {
        provenance: start.finish(),
        alone,
        many,
        soak,
    };
    let markdown = markdown(&report);
    atomic::write(
        &out.join("stream.json"),
        serde_json::to_string_pretty(&report)?.as_bytes(),
    )?;
    atomic::write(&out.join("stream.md"), markdown.as_bytes())?;
    say!("\n{markdown}\nwrote {}", out.join("stream.json").display());
    Ok(())
}

fn drive() -> Trajectory {
    trajectory(Platform::Vehicle, 77, ALONE, HERTZ)
}

fn alone(monitor: &Arc<Monitor>) -> Result<Alone> {
    let drive = drive();
    let mut stream = monitor.stream(drive.frame)?;
    let mut times = Vec::with_capacity(ALONE);
    for (stamp, pose) in drive.stamps.iter().zip(&drive.poses) {
        let begin = Instant::now();
        stream.push(*stamp, *pose)?;
        times.push(begin.elapsed().as_secs_f64() * 1e6);
    }
    let mut times = times.split_off(WARM);
    let mean_us = times.iter().sum::<f64>() / times.len() as f64;
    times.sort_by(f64::total_cmp);
    Ok(Alone {
        statistics: dose3::detector::MOTION_STATISTICS.to_owned(),
        poses: ALONE,
        windows: stream.windows(),
        mean_us,
        median_us: quantile(&times, 0.5),
        p999_us: quantile(&times, 0.999),
        worst_us: quantile(&times, 1.0),
        memory_kb: soak::memory_kb(),
    })
}

/// One stream of many with its place in the log and in time.
struct Served {
    stream: Stream,
    next: usize,
    due: Duration,
}

fn many(monitor: &Arc<Monitor>, args: &StreamArgs) -> Result<Many> {
    let drive = drive();
    let step = Duration::from_secs_f64(1.0 / HERTZ);
    let length = Duration::from_secs_f64(args.stream_seconds);
    let count = args.streams;
    let served = |number: usize| -> Result<Served> {
        // Golden ratio: streams begin evenly spread, neighbours far apart.
        let phase = (number as f64 * 0.618_033_988_749_895).fract();
        Ok(Served {
            stream: monitor.stream(drive.frame)?,
            next: (number * 37) % (ALONE / 2),
            due: Duration::from_secs_f64(SPREAD * phase),
        })
    };
    let mut shares: Vec<Vec<Served>> = Vec::new();
    for thread in 0..args.stream_threads {
        let own = (thread..count).step_by(args.stream_threads);
        shares.push(own.map(served).collect::<Result<_>>()?);
    }
    let load_before = load();
    let begin = Instant::now();
    let results: Vec<Result<(Vec<f32>, Duration, u64)>> = std::thread::scope(|scope| {
        let drive = &drive;
        let threads: Vec<_> = shares
            .into_iter()
            .map(|own| scope.spawn(move || serve(own, drive, begin, (step, length))))
            .collect();
        let join = |thread: std::thread::ScopedJoinHandle<'_, _>| match thread.join() {
            Ok(result) => result,
            Err(panic) => std::panic::resume_unwind(panic),
        };
        threads.into_iter().map(join).collect()
    });
    let (mut late, mut busy, mut windows) = (Vec::new(), Duration::ZERO, 0);
    for result in results {
        let (own, own_busy, own_windows) = result?;
        late.extend(own.into_iter().map(f64::from));
        busy += own_busy;
        windows += own_windows;
    }
    late.sort_by(f64::total_cmp);
    Ok(Many {
        streams: count,
        threads: args.stream_threads,
        seconds: args.stream_seconds,
        poses: late.len() as u64,
        windows,
        median_ms: quantile(&late, 0.5),
        p999_ms: quantile(&late, 0.999),
        p99999_ms: quantile(&late, 0.99999),
        worst_ms: quantile(&late, 1.0),
        later_than_50_ms: late.iter().filter(|ms| **ms > 50.0).count() as u64,
        busy: busy.as_secs_f64() / args.stream_seconds / args.stream_threads as f64,
        load: [load_before, load()],
        memory_kb: soak::memory_kb(),
    })
}

/// Serves streams in the order in which their poses are due; answers how late each pose was judged, in milliseconds.
fn serve(
    mut own: Vec<Served>,
    drive: &Trajectory,
    begin: Instant,
    (step, length): (Duration, Duration),
) -> Result<(Vec<f32>, Duration, u64)> {
    let mut queue: std::collections::BinaryHeap<_> = own
        .iter()
        .enumerate()
        .map(|(i, served)| std::cmp::Reverse((served.due, i)))
        .collect();
    let mut late = Vec::with_capacity((length.as_secs_f64() * HERTZ) as usize * own.len());
    let mut busy = Duration::ZERO;
    while let Some(std::cmp::Reverse((due, i))) = queue.pop() {
        if due > length {
            continue;
        }
        if let Some(left) = due.checked_sub(begin.elapsed()) {
            std::thread::sleep(left);
        }
        let served = &mut own[i];
        let at = begin.elapsed();
        served
            .stream
            .push(drive.stamps[served.next], drive.poses[served.next])?;
        let done = begin.elapsed();
        busy += done - at;
        late.push((done.saturating_sub(due)).as_secs_f32() * 1e3);
        served.next = (served.next + 1) % drive.len();
        queue.push(std::cmp::Reverse((due + step, i)));
    }
    let windows = own.iter().map(|served| served.stream.windows()).sum();
    Ok((late, busy, windows))
}

/// Processes ready to run, averaged over a minute.
fn load() -> Option<f64> {
    let text = std::fs::read_to_string("/proc/loadavg").ok()?;
    text.split_whitespace().next()?.parse().ok()
}

fn markdown(report: &Report) -> String {
    let [command, where_from] = report.provenance.lines();
    let mut text = format!("{command}\n\n{where_from}\n\n");
    let kb = |kb: Option<u64>| kb.map_or("-".to_owned(), |kb| format!("{:.0}", kb as f64 / 1024.0));
    let alone = &report.alone;
    let _ = writeln!(
        text,
        "One stream, `{}`, {} poses at 20 Hz as fast as they go, {} windows: mean {:.1} us a pose, median {:.1}, one in \
         a thousand {:.0}, worst {:.0} us; process {} MB.\n",
        alone.statistics,
        alone.poses,
        alone.windows,
        alone.mean_us,
        alone.median_us,
        alone.p999_us,
        alone.worst_us,
        kb(alone.memory_kb)
    );
    if let Some(many) = &report.many {
        let number = |x: Option<f64>| x.map_or("-".to_owned(), |x| format!("{x:.1}"));
        let _ = writeln!(
            text,
            "{} streams at 20 Hz in one process on {} threads for {} s: {} poses, {} windows; a pose was judged {:.2} ms \
             after it was due (median), {:.1} ms (one in a thousand), {:.1} ms (one in 100 000), {:.1} ms (worst); {} \
             later than 50 ms; threads {:.0} % busy; load {} before, {} after; process {} MB.\n",
            many.streams,
            many.threads,
            many.seconds,
            many.poses,
            many.windows,
            many.median_ms,
            many.p999_ms,
            many.p99999_ms,
            many.worst_ms,
            many.later_than_50_ms,
            100.0 * many.busy,
            number(many.load[0]),
            number(many.load[1]),
            kb(many.memory_kb)
        );
    }
    if let Some(soak) = &report.soak {
        let _ = writeln!(
            text,
            "Soak: {:.1} simulated hours in {:.0} s: {} poses, {} windows, {} parts of ten minutes with a fault, {} alarms, \
             events {:?}; state {} bytes after the first part, at most {}; process {} MB after a tenth, {} MB in the end; \
             equal to a new stream after each of {} resets.",
            soak.hours,
            soak.seconds,
            soak.poses,
            soak.windows,
            soak.faults,
            soak.alarms,
            soak.events,
            soak.state_bytes[0],
            soak.state_bytes[1],
            kb(soak.memory_kb[0]),
            kb(soak.memory_kb[1]),
            soak.resets
        );
    }
    text
}
