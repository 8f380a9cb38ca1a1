//! Where poses come from: each source is a thread that fills a queue and waits while the queue is full, so nothing is
//! lost and memory does not grow.

use crate::pose_line::LONGEST;
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
            let mut input = io::stdin().lock();
            let mut line = Vec::new();
            loop {
                let (item, last) = match read_line(&mut input, &mut line) {
                    Ok(whole) => (Item::Line(take_text(&mut line)), !whole),
                    Err(error) => (Item::Failed(error), true),
                };
                if !filler.send(item) || last {
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
    let mut line = Vec::new();
    loop {
        if read_line(&mut reader, &mut line)? {
            if !filler.send(Item::Line(take_text(&mut line))) {
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

/// Appends what comes up to the end of the line to `line`, of an endless one no more than tells that it is too long.
/// Answers whether the line has ended; if not, the input has.
fn read_line(input: &mut impl BufRead, line: &mut Vec<u8>) -> io::Result<bool> {
    loop {
        let here = match input.fill_buf() {
            Err(error) if error.kind() == io::ErrorKind::Interrupted => continue,
            here => here?,
        };
        let end = here.iter().position(|byte| *byte == b'\n');
        let part = &here[..end.unwrap_or(here.len())];
        let room = (LONGEST + 1).saturating_sub(line.len());
        line.extend(&part[..part.len().min(room)]);
        let read = end.map_or(part.len(), |end| end + 1);
        input.consume(read);
        if end.is_some() || read == 0 {
            return Ok(end.is_some());
        }
    }
}

/// A line as text. Bytes that are none become characters that no pose has.
fn take_text(line: &mut Vec<u8>) -> String {
    let text = String::from_utf8_lossy(line).into_owned();
    line.clear();
    text
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_read_whole_and_endless_ones_in_part() {
        let endless = vec![b'0'; 3 * LONGEST];
        let text = [b"a\r\n\n\xff1\n", &endless[..], b"\nend"].concat();
        // Buffers of any size.
        for size in [1, 7, 1 << 20] {
            let mut input = BufReader::with_capacity(size, &text[..]);
            let mut line = Vec::new();
            let mut next = || {
                let whole = read_line(&mut input, &mut line).unwrap();
                (whole, take_text(&mut line))
            };
            assert_eq!(next(), (true, "a\r".into()));
            assert_eq!(next(), (true, String::new()));
            assert_eq!(next(), (true, "\u{fffd}1".into()));
            assert_eq!(next(), (true, "0".repeat(LONGEST + 1)));
            assert_eq!(next(), (false, "end".into()));
            assert_eq!(next(), (false, String::new()));
        }
    }
}
