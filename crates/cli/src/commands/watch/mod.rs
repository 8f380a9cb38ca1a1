//! `dose3 watch`: judges poses as they come, and raises an alarm.

mod source;

use crate::args::Watch;
use crate::output_file::{Kind, OutputFile};
use crate::pose_line;
use crate::recording::{Live, is_own};
use crate::terminal::say;
use anyhow::{Context, Result, bail};
use dose3::logs::ReadOptions;
use dose3::nalgebra::UnitQuaternion;
use dose3::stream::{Said, StreamState};
use dose3::{Detector, Stream, StreamOptions, atomic};
use serde::Serialize;
use signal_hook::consts::{SIGINT, SIGTERM};
use source::{Item, Source};
use std::io::{self, Write};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::RecvTimeoutError;
use std::time::{Duration, Instant};

/// Only what this program wrote is replaced unasked.
const RECORDING: Kind = Kind {
    name: "recording of an earlier run",
    begins: is_own,
};
/// Longest wait for a pose before signals and the heartbeat are looked at.
const PATIENCE: Duration = Duration::from_millis(50);
/// A pose that waited longer is a lag to be told.
const LAG: Duration = Duration::from_secs(1);

/// How things stand.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
enum State {
    /// No window has been judged.
    Waiting,
    /// The motion is like the trusted logs.
    Sound,
    /// An alarm stands.
    Alarm,
}

/// Lines of this program, beside what the stream says.
#[derive(Serialize)]
#[serde(tag = "kind", rename_all = "kebab-case")]
enum Note<'a> {
    /// A sign of life.
    Heartbeat(Standing<'a>),
    /// Poses wait longer than they should: the reader of this program, or the machine, is too slow. None is lost.
    Lag { behind_s: f64, waiting: usize },
    /// A line that holds no pose.
    BadLine { line: u64, what: &'a str },
    /// The last line.
    End(Standing<'a>),
}

#[derive(Serialize)]
struct Standing<'a> {
    state: State,
    /// Why it ended.
    #[serde(skip_serializing_if = "Option::is_none")]
    reason: Option<&'a str>,
    stamp_ns: Option<i64>,
    poses: u64,
    windows: u64,
    alarms: u64,
    bad_lines: u64,
    /// Lines or poses that wait.
    waiting: usize,
    #[serde(skip_serializing_if = "Option::is_none")]
    alarm: Option<dose3::stream::Alarm>,
}

struct Watcher<'a> {
    args: &'a Watch,
    /// The recording, where one is kept.
    live: Option<Live>,
    stream: Stream,
    out: io::StdoutLock<'static>,
    lines: u64,
    bad_lines: u64,
    alarms: u64,
    last_stamp: Option<i64>,
    told_lag: Option<Instant>,
}

/// Runs it; answers the exit code.
pub fn run(args: &Watch) -> Result<u8> {
    if !(args.heartbeat >= 0.0 && args.heartbeat.is_finite()) {
        bail!("--heartbeat {}: expected seconds, or 0", args.heartbeat);
    }
    if !(args.speed > 0.0 && args.speed.is_finite()) {
        bail!("--speed {}: expected a number above 0", args.speed);
    }
    let detector = Detector::load(&args.detector)?;
    let monitor = detector.monitor(&StreamOptions {
        alarms_per_hour: args.alarms_per_hour,
        every: args.every,
        rate_hz: args.rate,
        max_gap_s: args.max_gap,
        reset_m: args.reset,
        windows: args.windows || args.mcap.is_some(),
    })?;
    let apart = monitor.apart();
    if apart.breaks_the_promise() && !args.quiet {
        say(&format!("note: {apart}"));
    }
    let stop = Arc::new(AtomicBool::new(false));
    let (source, frame) = match (&args.realtime, &args.follow) {
        (Some(path), _) => {
            let options = ReadOptions {
                // As of lines: what does not say its axes has those of the trusted logs.
                frame: args.frame.or(Some(monitor.frame())),
                ..ReadOptions::default()
            };
            let mut logs = dose3::logs::read(std::slice::from_ref(path), &options)?;
            let log = match logs.len() {
                1 => logs.swap_remove(0),
                n => bail!("{} holds {n} logs, expected one", path.display()),
            };
            let frame = log.frame;
            (Source::play(log, args.speed, stop.clone()), frame)
        }
        (None, Some(path)) => {
            let source = Source::follow(path.clone(), stop.clone());
            let source = source.with_context(|| format!("cannot read {}", path.display()))?;
            (source, args.frame.unwrap_or(monitor.frame()))
        }
        (None, None) => (
            Source::stdin(stop.clone()),
            args.frame.unwrap_or(monitor.frame()),
        ),
    };
    let stream = match args.state.as_deref().filter(|path| path.exists()) {
        Some(path) => monitor.resume(read_state(path)?)?,
        None => monitor.stream(frame)?,
    };
    let live = match &args.mcap {
        Some(path) => {
            let file = OutputFile::new(path, RECORDING, args.force)?;
            let calibration = detector.header().statistics.calibration();
            Some(Live::begin(file.path(), calibration.threshold.value())?)
        }
        None => None,
    };
    for signal in [SIGTERM, SIGINT] {
        // The second one ends the program, even where nobody takes its last line.
        signal_hook::flag::register_conditional_shutdown(signal, 2, stop.clone())
            .and_then(|_| signal_hook::flag::register(signal, stop.clone()))
            .context("cannot listen to signals")?;
    }
    let mut watcher = Watcher {
        args,
        live,
        stream,
        out: io::stdout().lock(),
        lines: 0,
        bad_lines: 0,
        alarms: 0,
        last_stamp: None,
        told_lag: None,
    };
    let reason = match watcher.watch(&source) {
        Ok(reason) => reason,
        // Nobody is left to tell.
        Err(error) if is_broken_pipe(&error) => "closed",
        Err(error) => return Err(error),
    };
    if let Some(path) = &args.state {
        atomic::write(path, &serde_json::to_vec(&watcher.stream.state())?)?;
    }
    let ending = watcher.standing(&source, Some(reason));
    let state = ending.state;
    if let Some(live) = watcher.live.take() {
        live.end(&format!("the recording ends: {reason}"))?;
    }
    match watcher.write(&Note::End(ending)) {
        Err(error) if !is_broken_pipe(&error) => return Err(error),
        _ => {}
    }
    if state == State::Waiting && !args.quiet {
        say("error: too few poses came for one window: nothing can be said of them");
    }
    Ok(match state {
        State::Sound => 0,
        State::Alarm => 1,
        State::Waiting => 2,
    })
}

fn read_state(path: &Path) -> Result<StreamState> {
    let text = std::fs::read(path).with_context(|| format!("cannot read {}", path.display()))?;
    serde_json::from_slice(&text)
        .with_context(|| format!("{} is no state of a stream", path.display()))
}

fn is_broken_pipe(error: &anyhow::Error) -> bool {
    let io = error.downcast_ref::<io::Error>();
    io.is_some_and(|error| error.kind() == io::ErrorKind::BrokenPipe)
}

impl Watcher<'_> {
    /// Until the source ends or a signal comes; answers which.
    fn watch(&mut self, source: &Source) -> Result<&'static str> {
        let pause = Duration::from_secs_f64(self.args.heartbeat);
        let mut heartbeat = Instant::now();
        loop {
            if source.stop.load(Ordering::Relaxed) {
                return Ok("terminated");
            }
            match source.next(PATIENCE) {
                Ok((came, item)) => {
                    self.lag(came, source)?;
                    self.take(item)?;
                }
                Err(RecvTimeoutError::Timeout) => {}
                // A source that was told to stop has not ended: the log may go on.
                Err(RecvTimeoutError::Disconnected) if source.stop.load(Ordering::Relaxed) => {
                    return Ok("terminated");
                }
                Err(RecvTimeoutError::Disconnected) => {
                    let said = self.stream.finish()?.to_vec();
                    self.tell(&said)?;
                    return Ok("end of input");
                }
            }
            if let Some(live) = &mut self.live {
                live.tick()?;
            }
            if !pause.is_zero() && heartbeat.elapsed() >= pause {
                heartbeat = Instant::now();
                let standing = self.standing(source, None);
                self.write(&Note::Heartbeat(standing))?;
            }
        }
    }

    fn take(&mut self, item: Item) -> Result<()> {
        let said = match item {
            Item::Failed(error) => return Err(error).context("the poses cannot be read"),
            Item::Break => self.stream.finish()?.to_vec(),
            Item::Pose(stamp, pose) => {
                self.last_stamp = Some(stamp);
                if let Some(live) = &mut self.live {
                    let turn = UnitQuaternion::from_rotation_matrix(&pose.rotation);
                    live.pose(stamp, pose.translation.into(), turn.coords.into());
                }
                self.stream.push(stamp, pose)?.to_vec()
            }
            Item::Line(line) => {
                self.lines += 1;
                match pose_line::parse(&line, self.args.stamp_unit) {
                    Ok(None) => return Ok(()),
                    Ok(Some(pose)) => {
                        self.last_stamp = Some(pose.stamp_ns);
                        let (position, orientation) = (pose.position, pose.orientation);
                        if let Some(live) = &mut self.live {
                            live.pose(pose.stamp_ns, position, orientation);
                        }
                        let said =
                            self.stream
                                .push_quaternion(pose.stamp_ns, position, orientation);
                        said?.to_vec()
                    }
                    Err(what) => return self.bad_line(&what),
                }
            }
        };
        self.tell(&said)
    }

    /// The first, the tenth, the hundredth and so on are told.
    fn bad_line(&mut self, what: &str) -> Result<()> {
        self.bad_lines += 1;
        let power = 10_u64.pow(self.bad_lines.ilog10());
        if self.bad_lines != power {
            return Ok(());
        }
        let line = self.lines;
        self.words(&format!("line {line} holds no pose: {what}"));
        self.write(&Note::BadLine { line, what })
    }

    fn lag(&mut self, came: Instant, source: &Source) -> Result<()> {
        let behind = came.elapsed();
        let told = self.told_lag.is_some_and(|told| told.elapsed() < LAG);
        if behind < LAG || told {
            return Ok(());
        }
        self.told_lag = Some(Instant::now());
        let (behind_s, waiting) = (behind.as_secs_f64(), source.waiting());
        self.words(&format!(
            "{behind_s:.1} s behind: {waiting} poses wait, none is lost"
        ));
        self.write(&Note::Lag { behind_s, waiting })
    }

    fn tell(&mut self, all: &[Said]) -> Result<()> {
        for said in all {
            match said {
                Said::Window(_) => {}
                Said::Event(event) => self.words(&event.to_string()),
                Said::Alarm(alarm) => {
                    self.alarms = alarm.number;
                    self.words(&alarm.to_string());
                }
            }
            if let Some(live) = &mut self.live {
                live.said(said)?;
            }
            // A recording wants windows that nobody asked to be told of.
            if self.args.windows || !matches!(said, Said::Window(_)) {
                self.write(said)?;
            }
        }
        Ok(())
    }

    fn words(&self, text: &str) {
        if !self.args.quiet {
            say(text);
        }
    }

    /// One line, at once: whoever reads wants to know now.
    fn write(&mut self, value: &impl Serialize) -> Result<()> {
        let mut line = serde_json::to_vec(value)?;
        line.push(b'\n');
        self.out.write_all(&line)?;
        Ok(self.out.flush()?)
    }

    fn standing<'r>(&self, source: &Source, reason: Option<&'r str>) -> Standing<'r> {
        let alarm = self.stream.alarm();
        Standing {
            state: match (&alarm, self.stream.windows()) {
                (Some(_), _) => State::Alarm,
                (None, 0) => State::Waiting,
                (None, _) => State::Sound,
            },
            reason,
            stamp_ns: self.last_stamp,
            poses: self.stream.pushed(),
            windows: self.stream.windows(),
            alarms: self.alarms,
            bad_lines: self.bad_lines,
            waiting: source.waiting(),
            alarm,
        }
    }
}
