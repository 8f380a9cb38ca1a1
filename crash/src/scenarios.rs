//! The programs of this repository that write, with generated logs to read.

use crate::Result;
use crate::folder::{self, Contents};
use crate::scenario::{Call, Manner, Scenario};
use dose3_datasets::synthetic::{Platform, trajectory};
use dose3_datasets::write;
use serde_json::Value;
use std::path::PathBuf;

/// Where the programs are, and where they are tried.
pub struct Place {
    /// Folder of `dose3` and `xtask`.
    pub programs: PathBuf,
    /// Python with the package, where there is one.
    pub python: Option<PathBuf>,
    /// Folder of inputs and of what is written.
    pub work: PathBuf,
}

/// Names of all scenarios.
pub const NAMES: [&str; 7] = [
    "fit",
    "score",
    "score-one",
    "train",
    "watch",
    "fleet",
    "benchmark",
];

const HERTZ: f64 = 20.0;
const POSES: usize = 600;

impl Place {
    /// The folder that programs write into; inputs lie beside it.
    pub fn folder(&self) -> PathBuf {
        self.work.join("out")
    }

    fn dose3(&self, arguments: &str) -> Call {
        self.call("dose3", arguments)
    }

    fn call(&self, program: &str, arguments: &str) -> Call {
        let name = format!("{program}{}", std::env::consts::EXE_SUFFIX);
        Call {
            program: self.programs.join(name),
            arguments: arguments.split(' ').map(str::to_owned).collect(),
            input: None,
        }
    }

    /// Writes the inputs: logs to trust, two sets of logs to judge, a stream, a detector.
    ///
    /// # Errors
    /// A folder that cannot be written to.
    pub fn prepare(&self) -> Result<()> {
        let mut inputs = Contents::new();
        let mut put = |name: &str, platform, seed| -> Result<()> {
            let mut bytes = Vec::new();
            write::tum(&mut bytes, &trajectory(platform, seed, POSES, HERTZ))
                .map_err(|error| error.to_string())?;
            inputs.insert(name.to_owned(), bytes);
            Ok(())
        };
        for seed in 0..4 {
            put(
                &format!("trusted/drive_{seed}.txt"),
                Platform::Vehicle,
                seed,
            )?;
        }
        for seed in 0..2 {
            put(
                &format!("logs/drive_{seed}.txt"),
                Platform::Vehicle,
                10 + seed,
            )?;
            put(
                &format!("other/drive_{seed}.txt"),
                Platform::Vehicle,
                20 + seed,
            )?;
        }
        put("logs/flight.txt", Platform::Drone, 30)?;
        put("stream.txt", Platform::Vehicle, 40)?;
        put("older-stream.txt", Platform::Vehicle, 41)?;
        folder::set(&self.work.join("in"), &inputs)?;
        folder::set(&self.folder(), &Contents::new())?;
        let fit = self.dose3(FIT).run(&self.folder())?;
        if !fit.status.success() {
            return Err(String::from_utf8_lossy(&fit.stderr).into_owned());
        }
        let detector = self.work.join("in/detector.dose3");
        std::fs::rename(self.folder().join("detector.dose3"), detector)
            .map_err(|error| error.to_string())
    }

    /// The scenario of that name, or why there is none here.
    ///
    /// # Errors
    /// A program that fails when nothing happens to it.
    pub fn scenario(&self, name: &str) -> Result<Result<Scenario>> {
        let usual = Manner::default();
        let [judge, judge_older] = ["../in/logs", "../in/other"]
            .map(|logs| format!("score --detector ../in/detector.dose3 {logs} {RESULTS}"));
        let [one, one_older] = [0, 1].map(|log| {
            format!(
                "score --detector ../in/detector.dose3 ../in/logs/drive_{log}.txt --out one.json --html one.html \
                 --mcap one.mcap"
            )
        });
        let made = match name {
            "fit" => self.made("fit", FIT, &format!("{FIT} --seed 1"), usual),
            "score" => self.made("score", &judge, &judge_older, usual),
            "score-one" => self.made("score-one", &one, &one_older, usual),
            "train" => {
                let manner = Manner {
                    progress: |name| name == "model.checkpoint",
                    goes_on: true,
                    ..usual
                };
                self.made("train", TRAIN, &format!("{TRAIN} --seed 1"), manner)
            }
            "watch" => {
                let of = |stream: &str| Call {
                    input: Some(self.work.join("in").join(stream)),
                    ..self.dose3("watch --detector ../in/detector.dose3 --state state.json --quiet")
                };
                let manner = Manner {
                    goes_beyond: true,
                    ..usual
                };
                let older = of("older-stream.txt");
                Scenario::new(
                    "watch",
                    of("stream.txt"),
                    Some(&older),
                    manner,
                    &self.folder(),
                )
            }
            "fleet" => {
                let Some(python) = &self.python else {
                    return Ok(Err(
                        "no Python with the package dose3 was named (--python)".into()
                    ));
                };
                let script = concat!(env!("CARGO_MANIFEST_DIR"), "/../examples/fleet/folder.py");
                let of = |logs: &str| Call {
                    program: python.clone(),
                    arguments: [script, "../in/detector.dose3", logs, "results.parquet"]
                        .map(str::to_owned)
                        .to_vec(),
                    input: None,
                };
                let manner = Manner {
                    program: false,
                    ..usual
                };
                let (call, older) = (of("../in/logs"), of("../in/other"));
                Scenario::new("fleet", call, Some(&older), manner, &self.folder())
            }
            "benchmark" => {
                let manner = Manner {
                    essence: without_times,
                    goes_on: true,
                    ..usual
                };
                let call = self.call("xtask", BENCHMARK);
                Scenario::new("benchmark", call, None, manner, &self.folder())
            }
            _ => {
                return Ok(Err(format!(
                    "no scenario {name:?}, there are {}",
                    NAMES.join(", ")
                )));
            }
        };
        made.map(Ok)
    }

    fn made(
        &self,
        name: &'static str,
        call: &str,
        older: &str,
        manner: Manner,
    ) -> Result<Scenario> {
        let older = self.dose3(older);
        Scenario::new(name, self.dose3(call), Some(&older), manner, &self.folder())
    }
}

const FIT: &str = "fit --trusted ../in/trusted --steps 3 --out detector.dose3";
const RESULTS: &str = "--out r.json --out r.jsonl --out r.csv --out r.xml --out r.parquet --html pages.html --mcap \
                       recordings.mcap";
/// Three checkpoints, one every 250 steps.
const TRAIN: &str = "train --data ../in/trusted --out model.dose3 --width 8 --multipliers 1 --window 32 --steps 800 \
                     --batch 4 --diffusion-steps 8";
const BENCHMARK: &str =
    "benchmark --all --synthetic --quick --without-baselines --resamples 20 --out results";

/// A result without the numbers that a clock measured; pages and documents of them only where they begin and end.
fn without_times(bytes: &[u8]) -> Vec<u8> {
    let Ok(mut value) = serde_json::from_slice::<Value>(bytes) else {
        let (head, tail) = (bytes.len().min(8), bytes.len().saturating_sub(2));
        return [&bytes[..head], &bytes[tail..]].concat();
    };
    clear(&mut value);
    value.to_string().into_bytes()
}

fn clear(value: &mut Value) {
    match value {
        Value::Object(entries) => {
            for key in ["seconds", "milliseconds", "cost", "resumed", "machine"] {
                entries.remove(key);
            }
            entries.values_mut().for_each(clear);
        }
        Value::Array(values) => values.iter_mut().for_each(clear),
        _ => {}
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_left_out_and_nothing_else() {
        let of = |text: &str| without_times(text.as_bytes());
        assert_eq!(
            of(r#"{"a": [{"seconds": 1, "b": 2}]}"#),
            of(r#"{"a": [{"seconds": 3, "b": 2}]}"#)
        );
        assert_ne!(
            of(r#"{"seconds": 1, "b": 2}"#),
            of(r#"{"seconds": 1, "b": 3}"#)
        );
        assert_ne!(of("<html>  </html>"), of("<html>  </ht"));
    }
}
