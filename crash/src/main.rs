//! Kills at random moments, and faults at the calls by which the programs write.
#![allow(clippy::print_stdout, clippy::print_stderr)]

use clap::Parser;
use dose3_crash::Result;
use dose3_crash::fault::{Fault, Library};
use dose3_crash::folder::Contents;
use dose3_crash::scenario::Scenario;
use dose3_crash::scenarios::{NAMES, Place};
use dose3_crash::trial::Trial;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::num::NonZeroUsize;
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Instant;

/// Kills the programs at random moments, and refuses them calls by which they write.
#[derive(Parser)]
struct Settings {
    /// Kills at random moments, of all programs together
    #[arg(long, default_value_t = 200)]
    kills: usize,
    /// One in so many calls is struck
    #[arg(long, default_value = "1")]
    every: NonZeroUsize,
    /// These programs alone
    #[arg(long, value_name = "NAME,...", value_delimiter = ',', default_values = NAMES)]
    only: Vec<String>,
    /// Seed of the moments
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Python with the package, for the programs that need it
    #[arg(long, value_name = "PROGRAM")]
    python: Option<PathBuf>,
}

fn main() -> ExitCode {
    match run(&Settings::parse()) {
        Ok(0) => ExitCode::SUCCESS,
        Ok(finds) => {
            eprintln!("{finds} finds");
            ExitCode::FAILURE
        }
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::from(2)
        }
    }
}

fn run(settings: &Settings) -> Result<usize> {
    let work = tempfile::tempdir().map_err(|error| error.to_string())?;
    let own = std::env::current_exe().map_err(|error| error.to_string())?;
    let place = Place {
        programs: own.parent().ok_or("a program without a folder")?.into(),
        python: settings.python.clone(),
        work: work.path().into(),
    };
    place.prepare()?;
    let library = match cfg!(target_os = "linux") {
        true => Library::build(work.path()),
        false => Err("LD_PRELOAD is of Linux".into()),
    };
    if let Err(why) = &library {
        println!("calls are not struck one by one: {why}");
    }
    let mut scenarios = Vec::new();
    for name in &settings.only {
        match place.scenario(name)? {
            Ok(scenario) => scenarios.push(scenario),
            Err(why) => println!("{name}: not run: {why}"),
        }
    }
    let (mut finds, mut kills, mut rng) = (0, 0, ChaCha8Rng::seed_from_u64(settings.seed));
    let folder = place.folder();
    let count = scenarios.len();
    for (index, scenario) in scenarios.iter().enumerate() {
        let share = settings.kills * (index + 1) / count - settings.kills * index / count;
        let mut tried = Tried {
            scenario,
            folder: &folder,
            finds: 0,
        };
        let begin = Instant::now();
        kills += tried.kills(share, &mut rng);
        if scenario.manner.program {
            tried.output();
        }
        let strikes = match &library {
            Ok(library) => tried.strikes(library, settings.every.get()),
            Err(_) => "none".into(),
        };
        println!(
            "{}: {share} kills, {strikes}, {} finds, {:.0} s",
            scenario.name,
            tried.finds,
            begin.elapsed().as_secs_f64()
        );
        finds += tried.finds;
    }
    println!("{kills} of {} kills lost nothing", settings.kills);
    Ok(finds)
}

struct Tried<'a> {
    scenario: &'a Scenario,
    folder: &'a PathBuf,
    finds: usize,
}

impl Tried<'_> {
    fn find(&mut self, what: &str, error: &str) {
        self.finds += 1;
        eprintln!("{}: {what}: {error}", self.scenario.name);
    }

    /// Where a run begins: with older results, or in an empty folder where a run makes the same then.
    fn start(&self, empty: bool) -> Contents {
        match empty && !self.scenario.manner.goes_beyond {
            true => Contents::new(),
            false => self.scenario.before.clone(),
        }
    }

    /// Kills at random moments; answers how many lost nothing.
    fn kills(&mut self, number: usize, rng: &mut ChaCha8Rng) -> usize {
        let (mut done, mut good, mut running) = (0, 0, false);
        let mut start = self.start(false);
        // A run that goes on where it was is killed several times on its way.
        let part = match self.scenario.manner.goes_on {
            true => 0.3,
            false => 1.0,
        };
        while done < number {
            let (scenario, folder) = (self.scenario, self.folder);
            let trial = Trial {
                scenario,
                folder,
                start: &start,
            };
            let wait = scenario.time.mul_f64(part * rng.random::<f64>());
            let mut outcome = || -> Result<(bool, bool)> {
                if !running {
                    trial.begin()?;
                }
                let struck = trial.kill_after(wait)?;
                let goes_on =
                    struck && scenario.manner.goes_on && done + 1 < number && rng.random_bool(0.75);
                if !goes_on {
                    trial.again()?;
                }
                Ok((struck, goes_on))
            };
            match outcome() {
                Ok((struck, goes_on)) => {
                    done += usize::from(struck);
                    good += usize::from(struck);
                    running = goes_on;
                }
                Err(error) => {
                    done += 1;
                    running = false;
                    self.find(&format!("killed after {:.3} s", wait.as_secs_f64()), &error);
                }
            }
            if !running {
                start = self.start(done % 2 == 1);
            }
        }
        good
    }

    fn output(&mut self) {
        let start = self.start(true);
        let trial = Trial {
            scenario: self.scenario,
            folder: self.folder,
            start: &start,
        };
        if let Err(error) = trial.closed_output() {
            self.find("standard output", &error);
        }
    }

    /// Strikes every `every`-th call with every fault; answers how many there were, in words.
    fn strikes(&mut self, library: &Library, every: usize) -> String {
        let (mut calls, mut faults) = (0, 0);
        for empty in [false, true] {
            if empty && self.scenario.manner.goes_beyond {
                continue;
            }
            let start = self.start(empty);
            let (scenario, folder) = (self.scenario, self.folder);
            let trial = Trial {
                scenario,
                folder,
                start: &start,
            };
            let number = match scenario.boundaries(library, folder, &start) {
                Ok(number) => number,
                Err(error) => {
                    self.find("counting calls", &error);
                    continue;
                }
            };
            // Every call is met by some fault, also where not every call is struck.
            for (index, fault) in Fault::ALL.into_iter().enumerate() {
                let first = 1 + index * every / Fault::ALL.len();
                for at in (first..=number).step_by(every) {
                    calls += 1;
                    match trial.strike(library, fault, at) {
                        Ok(struck) => faults += usize::from(struck),
                        Err(error) => self.find(&format!("{} at call {at}", fault.name()), &error),
                    }
                }
            }
        }
        format!("{calls} calls struck ({faults} of them noticed)")
    }
}
