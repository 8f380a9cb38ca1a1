//! The same altered inputs in every run, or one input again, or the seeds and dictionaries as files.
#![allow(clippy::print_stdout, clippy::print_stderr)]

use clap::Parser;
use dose3_fuzz::{Target, check, mutate, target, targets};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::collections::hash_map::DefaultHasher;
use std::fs;
use std::hash::{Hash, Hasher};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::sync::{Arc, Mutex};
use std::thread;
use std::time::Duration;

/// A case longer than this hangs; ordinary ones take milliseconds.
const HANGS: Duration = Duration::from_secs(60);

/// Folder of inputs that broke something.
const FINDS: &str = "fuzz-finds";

/// Every reader is given altered inputs, the same in every run.
#[derive(Parser)]
struct Settings {
    /// Altered inputs for each target
    #[arg(long, default_value_t = 2000)]
    cases: usize,
    /// Seed of the alterations
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// This target alone
    #[arg(long, value_name = "NAME", value_parser = named)]
    target: Option<&'static Target>,
    /// Folder with more inputs to alter
    #[arg(long, value_name = "FOLDER")]
    seeds: Option<PathBuf>,
    /// Try this input alone
    #[arg(long, value_name = "FILE")]
    replay: Option<PathBuf>,
    /// Write the seeds and dictionaries as files, and try nothing
    #[arg(long, value_name = "FOLDER")]
    write: Option<PathBuf>,
}

impl Settings {
    fn targets(&self) -> impl Iterator<Item = &'static Target> {
        let all = targets::ALL.iter();
        all.filter(|target| self.target.is_none_or(|one| one.name == target.name))
    }
}

fn named(name: &str) -> Result<&'static Target, String> {
    target(name).ok_or_else(|| {
        let names: Vec<&str> = targets::ALL.iter().map(|target| target.name).collect();
        format!("there are {}", names.join(", "))
    })
}

fn main() -> ExitCode {
    match run(&Settings::parse()) {
        Ok(0) => ExitCode::SUCCESS,
        Ok(finds) => {
            eprintln!("{finds} finds, in {FINDS}");
            ExitCode::FAILURE
        }
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::from(2)
        }
    }
}

fn run(settings: &Settings) -> Result<usize, String> {
    if let Some(folder) = &settings.write {
        for target in settings.targets() {
            let folder = folder.join(target.name);
            fs::create_dir_all(&folder).map_err(|error| error.to_string())?;
            fs::write(folder.with_extension("dict"), dictionary(target))
                .map_err(|error| error.to_string())?;
            for (index, seed) in (target.seeds)().iter().enumerate() {
                fs::write(folder.join(format!("seed-{index}")), seed)
                    .map_err(|error| error.to_string())?;
            }
        }
        return Ok(0);
    }
    if let Some(file) = &settings.replay {
        let bytes = fs::read(file).map_err(|error| format!("{}: {error}", file.display()))?;
        settings.targets().for_each(|target| check(target, &bytes));
        return Ok(0);
    }
    let extra = settings
        .seeds
        .as_deref()
        .map(files)
        .transpose()?
        .unwrap_or_default();
    let mut finds = 0;
    for target in settings.targets() {
        finds += search(target, settings, &extra);
    }
    Ok(finds)
}

/// The words of a target as libFuzzer takes them.
fn dictionary(target: &Target) -> String {
    let byte = |byte: &u8| format!("\\x{byte:02x}");
    let word = |word: &&[u8]| format!("\"{}\"\n", word.iter().map(byte).collect::<String>());
    target.dictionary.iter().map(word).collect()
}

/// All files below a folder, sorted by path.
fn files(folder: &Path) -> Result<Vec<Vec<u8>>, String> {
    let mut paths = vec![folder.to_path_buf()];
    let mut found = Vec::new();
    while let Some(path) = paths.pop() {
        let fault = |error: std::io::Error| format!("{}: {error}", path.display());
        if path.is_dir() {
            let entries = fs::read_dir(&path).map_err(fault)?;
            paths.extend(entries.filter_map(|entry| Some(entry.ok()?.path())));
        } else {
            found.push((path.clone(), fs::read(&path).map_err(fault)?));
        }
    }
    found.sort();
    Ok(found.into_iter().map(|(_, bytes)| bytes).collect())
}

fn search(target: &'static Target, settings: &Settings, extra: &[Vec<u8>]) -> usize {
    let mut seeds = (target.seeds)();
    seeds.extend_from_slice(extra);
    let mut rng = ChaCha8Rng::seed_from_u64(settings.seed);
    let current = Arc::new(Mutex::new(Vec::new()));
    let (beat, heard) = channel::<()>();
    let watched = Arc::clone(&current);
    let watch = thread::spawn(move || {
        loop {
            match heard.recv_timeout(HANGS) {
                Ok(()) => {}
                Err(RecvTimeoutError::Disconnected) => return,
                Err(RecvTimeoutError::Timeout) => {
                    let bytes = watched
                        .lock()
                        .map(|bytes| bytes.clone())
                        .unwrap_or_default();
                    eprintln!("{}: hangs on {}", target.name, keep(target, &bytes));
                    std::process::exit(1);
                }
            }
        }
    });
    let mut finds = 0;
    let cases = settings.cases + seeds.len();
    for case in 0..cases {
        let bytes = match seeds.get(case) {
            Some(seed) => seed.clone(),
            None => {
                let [one, other] = [0, 1].map(|_| rng.random_range(0..seeds.len()));
                mutate::mutate(&mut rng, &seeds[one], &seeds[other], target.dictionary)
            }
        };
        if let Ok(mut slot) = current.lock() {
            slot.clone_from(&bytes);
        }
        let _ = beat.send(());
        if catch_unwind(AssertUnwindSafe(|| check(target, &bytes))).is_err() {
            finds += 1;
            eprintln!(
                "{}: case {case}, kept as {}",
                target.name,
                keep(target, &bytes)
            );
        }
    }
    drop(beat);
    let _ = watch.join();
    println!("{}: {cases} cases, {finds} finds", target.name);
    finds
}

/// Writes an input that broke something and answers its path.
fn keep(target: &Target, bytes: &[u8]) -> String {
    let mut hash = DefaultHasher::new();
    bytes.hash(&mut hash);
    let path = Path::new(FINDS).join(format!("{}-{:016x}", target.name, hash.finish()));
    let _ = fs::create_dir_all(FINDS);
    let _ = fs::write(&path, bytes);
    path.display().to_string()
}
