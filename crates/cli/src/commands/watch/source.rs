//! Where poses come from: each source is a thread that fills a queue and waits while the queue is full, so nothing is
//! lost and memory does not grow.

use dose3::{Pose, Trajectory};
use std::fs::File;
use std::io::{self, BufRead, BufReader, Seek};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel};
use std::time::{Duration, Instant};

/// Poses that may wait: some minutes of a usual robot.
const QUEUE: usize = 4096;
/// How often a file is looked at that has not grown.
const POLL: Duration = Duration::from_millis(50);

/// What a source hands over.
pub enum Item {
    Line(String),
    Pose(i64, Pose),
    /// What follows does not continue what was before.
    Break,
    Failed(io::Error),
}

/// The reading end of a source.
pub struct Source {
    queue: Receiver<(Instant, Item)>,
    waiting: Arc<AtomicUsize>,
    /// Set when the program is to end.
    pub stop: Arc<AtomicBool>,
}

/// The end that fills the queue.
struct Filler {
    queue: SyncSender<(Instant, Item)>,
    waiting: Arc<AtomicUsize>,
    stop: Arc<AtomicBool>,
}

impl Filler {
    /// Answers whether anybody still listens.
    fn send(&self, item: Item) -> bool {
        self.waiting.fetch_add(1, Ordering::Relaxed);
        let heard = self.queue.send((Instant::now(), item)).is_ok();
        heard && !self.stop.load(Ordering::Relaxed)
    }
}

impl Source {
    fn start(stop: Arc<AtomicBool>, run: impl FnOnce(&Filler) + Send + 'static) -> Self {
        let (sender, queue) = sync_channel(QUEUE);
        let waiting = Arc::new(AtomicUsize::new(0));
        let filler = Filler {
            queue: sender,
            waiting: waiting.clone(),
            stop: stop.clone(),
        };
        std::thread::spawn(move || run(&filler));
        Self {
            queue,
            waiting,
            stop,
        }
    }

    /// Lines of standard input.
    pub fn stdin(stop: Arc<AtomicBool>) -> Self {
        Self::start(stop, |filler| {
            for line in io::stdin().lock().lines() {
                let item = line.map_or_else(Item::Failed, Item::Line);
                let failed = matches!(item, Item::Failed(_));
                if !filler.send(item) || failed {
                    return;
                }
            }
        })
    }

    /// Lines of a file, for ever.
    pub fn follow(path: PathBuf, stop: Arc<AtomicBool>) -> io::Result<Self> {
        let file = File::open(&path)?;
        Ok(Self::start(stop, move |filler| {
            if let Err(error) = follow(&path, file, filler) {
                filler.send(Item::Failed(error));
            }
        }))
    }

    /// Poses of a log at its own pace, `speed` times as fast.
    pub fn play(log: Trajectory, speed: f64, stop: Arc<AtomicBool>) -> Self {
        Self::start(stop, move |filler| {
            let begin = Instant::now();
            let first = log.stamps.first().copied().unwrap_or_default();
            for (i, (stamp, pose)) in log.stamps.iter().zip(&log.poses).enumerate() {
                let due = stamp.saturating_sub(first) as f64 * 1e-9 / speed;
                while let Some(left) = Duration::from_secs_f64(due).checked_sub(begin.elapsed()) {
                    if filler.stop.load(Ordering::Relaxed) {
                        return;
                    }
                    std::thread::sleep(left.min(POLL));
                }
                if log.breaks.binary_search(&i).is_ok() && !filler.send(Item::Break) {
                    return;
                }
                if !filler.send(Item::Pose(*stamp, *pose)) {
                    return;
                }
            }
        })
    }

    /// The next item with the time at which it came.
    pub fn next(&self, patience: Duration) -> Result<(Instant, Item), RecvTimeoutError> {
        let item = self.queue.recv_timeout(patience)?;
        self.waiting.fetch_sub(1, Ordering::Relaxed);
        Ok(item)
    }

    /// Items that wait.
    pub fn waiting(&self) -> usize {
        self.waiting.load(Ordering::Relaxed)
    }
}

/// Hands over whole lines as they come. A file that becomes shorter, or is replaced by another of its name, is read
/// from its beginning.
fn follow(path: &Path, file: File, filler: &Filler) -> io::Result<()> {
    let mut reader = BufReader::new(file);
    let mut line = String::new();
    loop {
        if reader.read_line(&mut line)? > 0 && line.ends_with('\n') {
            let whole = std::mem::take(&mut line);
            if !filler.send(Item::Line(whole)) {
                return Ok(());
            }
            continue;
        }
        if filler.stop.load(Ordering::Relaxed) {
            return Ok(());
        }
        std::thread::sleep(POLL);
        let here = reader.stream_position()?;
        let shorter = reader.get_ref().metadata()?.len() < here;
        if shorter || is_another(path, reader.get_ref()) {
            let Ok(file) = File::open(path) else {
                continue;
            };
            reader = BufReader::new(file);
            line.clear();
            if !filler.send(Item::Break) {
                return Ok(());
            }
        }
    }
}

#[cfg(unix)]
fn is_another(path: &Path, file: &File) -> bool {
    use std::os::unix::fs::MetadataExt;
    let id = |data: std::fs::Metadata| (data.dev(), data.ino());
    match (std::fs::metadata(path), file.metadata()) {
        (Ok(named), Ok(open)) => id(named) != id(open),
        _ => false,
    }
}

#[cfg(not(unix))]
fn is_another(_: &Path, _: &File) -> bool {
    false
}
