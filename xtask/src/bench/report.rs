//! Results of `bench` as data and as tables.

use super::score::STRIDE;
use super::training::{self, TrainingRow};
use dose3_study::provenance::Provenance;
use serde::Serialize;
use std::fmt::Write as _;

/// What a build without burn says in burn's place.
const NOT_BUILT: &str = "burn-flex and sgemm: not built; run \
                         `cargo run --release -p xtask --features flex -- bench`.";

/// Everything that was measured, and what is needed to repeat it.
#[derive(Default, Serialize)]
pub struct Report {
    /// Command, commit, machine, time.
    #[serde(flatten)]
    pub provenance: Provenance,
    /// Vector instructions of the engine.
    pub instructions: String,
    /// Version of PyTorch, where it ran.
    pub pytorch: Option<String>,
    /// Whether burn-flex is built in.
    pub flex: bool,
    /// Width multipliers of the networks.
    pub multipliers: Vec<usize>,
    /// Windows of a batch.
    pub batch: usize,
    /// Poses of a window.
    pub length: usize,
    /// Forward passes and training steps.
    pub networks: Vec<NetworkRow>,
    /// Training steps.
    pub training: Vec<TrainingRow>,
    /// Statistics of the scoring detector.
    pub statistics: String,
    /// Poses of the scored log.
    pub score_poses: usize,
    /// Whole scores.
    pub scores: Vec<ScoreRow>,
}

/// A forward pass or a training step of a UNet pair; speeds in windows a second.
#[derive(Serialize)]
pub struct NetworkRow {
    /// Width of the first level.
    pub width: usize,
    /// Threads of every contestant.
    pub threads: usize,
    /// Which of the two.
    pub what: &'static str,
    /// The engine.
    pub engine: f64,
    /// Its GFLOP/s; a training step counts as three forward passes.
    pub gflops: f64,
    /// GFLOP/s of the gemm crate's sgemm on one thread.
    pub sgemm: Option<f64>,
    /// burn-flex.
    pub flex: Option<f64>,
    /// PyTorch, eager.
    pub eager: Option<f64>,
    /// PyTorch, compiled.
    pub compiled: Option<f64>,
    /// The engine's speed over that with the first number of threads.
    pub over_first: f64,
}

/// A whole score of one log.
#[derive(Serialize)]
pub struct ScoreRow {
    /// Width of the first level.
    pub width: usize,
    /// Threads.
    pub threads: usize,
    /// Diffusion steps visited.
    pub steps: usize,
    /// Noise draws a window.
    pub draws: usize,
    /// Windows of the log.
    pub windows: usize,
    /// The engine, seconds.
    pub seconds: f64,
    /// burn-flex on a log a tenth as long, windows a second.
    pub flex: Option<f64>,
}

impl Report {
    /// The report as Markdown.
    pub fn markdown(&self) -> String {
        // Writing to a String cannot fail.
        let mut out = String::new();
        let [command, origin] = self.provenance.lines();
        let pytorch = self.pytorch.as_ref();
        let _ = writeln!(
            out,
            "{command}\n{origin}{}{}; multipliers {}, batch {}, length {}; the shortest time \
             of several turns.",
            if self.instructions.is_empty() {
                String::new()
            } else {
                format!(", engine on {}", self.instructions)
            },
            pytorch.map_or(String::new(), |v| format!(", PyTorch {v}")),
            numbers(&self.multipliers),
            self.batch,
            self.length,
        );
        let engine_only = !(self.flex || self.networks.is_empty() && self.scores.is_empty());
        if engine_only {
            let _ = writeln!(out, "{NOT_BUILT}");
        }
        if !self.networks.is_empty() {
            self.network_table(&mut out);
        }
        if !self.training.is_empty() {
            training::table(&self.training, &mut out);
        }
        if !self.scores.is_empty() {
            self.score_table(&mut out);
        }
        out
    }

    fn network_table(&self, out: &mut String) {
        let _ = writeln!(
            out,
            "\nOne UNet pair, windows a second; in brackets how many times as fast the engine is.\n\
             \n| width | threads | | engine | over {}-thread engine | GFLOP/s (of sgemm) | burn-flex | \
             PyTorch eager | torch.compile |\n|---|---|---|---|---|---|---|---|---|",
            self.networks.first().map_or(1, |r| r.threads)
        );
        for r in &self.networks {
            let against = |other: Option<f64>| {
                other.map_or("–".to_string(), |o| {
                    format!("{} ({:.2}x)", speed(o), r.engine / o)
                })
            };
            let share = r.sgemm.map_or(String::new(), |s| {
                format!(" ({:.0} %)", 100.0 * r.gflops / (s * r.threads as f64))
            });
            let _ = writeln!(
                out,
                "| {} | {} | {} | {} | {:.2} | {:.0}{share} | {} | {} | {} |",
                r.width,
                r.threads,
                r.what,
                speed(r.engine),
                r.over_first,
                r.gflops,
                against(r.flex),
                against(r.eager),
                against(r.compiled),
            );
        }
        let peaks: Vec<f64> = self.networks.iter().filter_map(|r| r.sgemm).collect();
        if let Some(peak) = peaks.into_iter().reduce(f64::max) {
            let _ = writeln!(
                out,
                "\nsgemm of the gemm crate, 768 x 768, one thread: {peak:.0} GFLOP/s at best; the \
                 percentages take as much for every thread."
            );
        }
    }

    fn score_table(&self, out: &mut String) {
        let _ = writeln!(
            out,
            "\nA whole `score` of a synthetic log of {} poses at stride {STRIDE}, statistics \
             `{}`: reading the file, noise, networks, densities, verdict. burn-flex judges a tenth \
             of the log.\n\n| width | threads | steps | draws | windows | seconds | windows a \
             second | burn-flex |\n|---|---|---|---|---|---|---|---|",
            self.score_poses, self.statistics
        );
        for r in &self.scores {
            let rate = r.windows as f64 / r.seconds;
            let flex = r.flex.map_or("–".to_string(), |f| {
                format!("{} ({:.1}x)", speed(f), rate / f)
            });
            let _ = writeln!(
                out,
                "| {} | {} | {} | {} | {} | {:.2} | {} | {flex} |",
                r.width,
                r.threads,
                r.steps,
                r.draws,
                r.windows,
                r.seconds,
                speed(rate),
            );
        }
    }
}

/// Three digits or the whole number.
fn speed(value: f64) -> String {
    if value < 99.95 {
        format!("{value:.1}")
    } else {
        format!("{value:.0}")
    }
}

fn numbers(values: &[usize]) -> String {
    let texts: Vec<String> = values.iter().map(usize::to_string).collect();
    texts.join(",")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_tables_hold_ratios_and_shares() {
        let report = Report {
            networks: vec![NetworkRow {
                width: 16,
                threads: 2,
                what: "forward",
                engine: 300.0,
                gflops: 90.0,
                sgemm: Some(60.0),
                flex: None,
                eager: Some(60.0),
                compiled: None,
                over_first: 1.9,
            }],
            scores: vec![ScoreRow {
                width: 16,
                threads: 1,
                steps: 10,
                draws: 2,
                windows: 1000,
                seconds: 5.0,
                flex: Some(20.0),
            }],
            ..Report::default()
        };
        let text = report.markdown();
        let row = "| 16 | 2 | forward | 300 | 1.90 | 90 (75 %) | – | 60.0 (5.00x) | – |";
        assert!(text.contains(row), "{text}");
        let row = "| 16 | 1 | 10 | 2 | 1000 | 5.00 | 200 | 20.0 (10.0x) |";
        assert!(text.contains(row), "{text}");
        assert!(text.contains("not built"));
    }
}
