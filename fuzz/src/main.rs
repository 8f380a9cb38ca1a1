//! The same altered inputs in every run: `dose3-fuzz [--cases N] [--seed S] [--target NAME] [--seeds FOLDER]`, or
//! `dose3-fuzz --replay FILE --target NAME`, or `dose3-fuzz --write FOLDER` for the seeds and dictionaries
//! as files.
#![allow(clippy::print_stdout, clippy::print_stderr)]

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

struct Settings {
    cases: usize,
    seed: u64,
    targets: Vec<&'static Target>,
    folder: Option<PathBuf>,
    replay: Option<PathBuf>,
    write: Option<PathBuf>,
}

fn settings() -> Result<Settings, String> {
    let mut settings = Settings {
        cases: 2000,
        seed: 0,
        targets: targets::ALL.iter().collect(),
        folder: None,
        replay: None,
        write: None,
    };
    let mut words = std::env::args().skip(1);
    while let Some(word) = words.next() {
        let value = words.next().ok_or(format!("{word} needs a value"))?;
        let number = || {
            value
                .parse::<u64>()
                .map_err(|_| format!("{word} needs a number, found {value:?}"))
        };
        match word.as_str() {
            "--cases" => settings.cases = number()? as usize,
            "--seed" => settings.seed = number()?,
            "--target" => {
                let names: Vec<&str> = targets::ALL.iter().map(|target| target.name).collect();
                let known = target(&value).ok_or(format!(
                    "no target {value:?}; there are {}",
                    names.join(", ")
                ))?;
                settings.targets = vec![known];
            }
            "--seeds" => settings.folder = Some(value.into()),
            "--replay" => settings.replay = Some(value.into()),
            "--write" => settings.write = Some(value.into()),
            _ => return Err(format!("unknown word {word:?}")),
        }
    }
    Ok(settings)
}

fn main() -> ExitCode {
    match settings().and_then(|settings| run(&settings)) {
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
        for target in &settings.targets {
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
        settings
            .targets
            .iter()
            .for_each(|target| check(target, &bytes));
        return Ok(0);
    }
    let extra = settings
        .folder
        .as_deref()
        .map(files)
        .transpose()?
        .unwrap_or_default();
    let mut finds = 0;
    for target in &settings.targets {
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
