//! Training steps as `train` makes them, on one backend or another: batches, losses, Adam, averaged weights.

use super::network::{parameters, pool};
use super::pytorch::{Mode, Pytorch};
use super::{BenchArgs, Shape, shorter};
use anyhow::{Context, Result};
use dose3::backend::{Backend, Computing};
use dose3_diffusion::trainer::{LearnerPair, LogRow, TrainConfig, Trainer, WindowSource};
use dose3_diffusion::{Error, ProcessConfig};
use dose3_model::PairConfig;
use dose3_study::say;
use serde::Serialize;
use std::fmt::Write as _;
use std::time::Instant;

/// Steps between two looks at the losses, which wait for the device.
const BLOCK: usize = 5;
/// Gradients are clipped to this norm.
const CLIP: f64 = 1.0;

/// Training steps of one backend.
#[derive(Serialize)]
pub struct TrainingRow {
    /// Width of the first level.
    pub width: usize,
    /// Parameters of both networks.
    pub parameters: usize,
    /// Backend, and where the optimiser is.
    pub what: String,
    /// Steps a second in the best turn.
    pub speed: f64,
    /// Largest difference of a loss from the engine's over the first steps, relative to the engine's.
    pub off_by: Option<f64>,
}

/// Arcs of different curvature.
struct Arcs(usize);

impl WindowSource for Arcs {
    fn len(&self) -> usize {
        256
    }

    fn length(&self) -> usize {
        self.0
    }

    fn read(
        &self,
        index: usize,
        translation: &mut [f32],
        rotation: &mut [f32],
    ) -> Result<(), Error> {
        let curvature = index as f32 / 128.0 - 1.0;
        let poses = translation.chunks_mut(3).zip(rotation.chunks_mut(9));
        for (i, (translation, rotation)) in poses.enumerate() {
            let u = i as f32 / self.0 as f32;
            let (sin, cos) = (curvature * u).sin_cos();
            translation.copy_from_slice(&[u, 0.5 * curvature * u * u, 0.0]);
            rotation.copy_from_slice(&[cos, -sin, 0.0, sin, cos, 0.0, 0.0, 0.0, 1.0]);
        }
        Ok(())
    }
}

/// A run that takes turns with others.
struct Contestant<'a> {
    what: String,
    trainer: Trainer<'a>,
    /// The others are held to it, and its steps are done when they return.
    is_engine: bool,
    first: LogRow,
    best: Option<f64>,
}

impl Contestant<'_> {
    /// The first steps: kernels are compiled, buffers made.
    fn warm_up(&mut self) -> Result<()> {
        say!("  first steps: {}", self.what);
        for _ in 0..BLOCK {
            self.trainer.advance()?;
        }
        let log = self.trainer.log();
        self.first = *log.last().context("a row of the log")?;
        Ok(())
    }

    fn turn(&mut self, seconds: f64) -> Result<()> {
        let (start, mut steps) = (Instant::now(), 0);
        loop {
            self.trainer.advance()?;
            steps += 1;
            let elapsed = start.elapsed().as_secs_f64();
            if elapsed >= seconds && (self.is_engine || steps % BLOCK == 0) {
                shorter(&mut self.best, elapsed / steps as f64);
                return Ok(());
            }
        }
    }
}

/// Measures all backends of `args` at one width.
///
/// # Errors
/// A backend that cannot be had; PyTorch where it is asked for and not there.
pub fn run(args: &BenchArgs, shape: &Shape) -> Result<(Vec<TrainingRow>, Option<String>)> {
    say!("width {}: training", shape.width);
    let threads = args.threads.iter().copied().max().unwrap_or(1);
    let initial = parameters(shape)?;
    let network = PairConfig::new(shape.width, &shape.multipliers);
    let count = network.translation.parameter_count() + network.rotation.parameter_count();
    let config = TrainConfig {
        // No end: the learning rate stays near its peak.
        steps: 1_000_000,
        batch: shape.batch,
        clip: CLIP,
        log_every: BLOCK,
        validate_every: 0,
        checkpoint_every: 0,
        ..TrainConfig::default()
    };
    let (source, none) = (Arcs(shape.length), Arcs(shape.length));
    let mut pytorch = None;
    if args.with_pytorch {
        let (python, device) = (&args.python, &args.pytorch_device);
        pytorch = Some(Pytorch::start(
            python,
            shape,
            threads,
            args.seconds,
            device,
        )?);
    }
    let mut contestants = Vec::new();
    for &backend in &args.backends {
        let computing = Computing { backend, threads };
        let mut enter = |what: String, is_engine: bool, learners: LearnerPair| -> Result<()> {
            let (process, data) = (ProcessConfig::default(), String::new());
            let trainer = Trainer::new(
                config,
                process,
                network.clone(),
                data,
                learners,
                &source,
                &none,
            );
            contestants.push(Contestant {
                what,
                trainer: trainer?,
                is_engine,
                first: LogRow::default(),
                best: None,
            });
            Ok(())
        };
        let learners = computing.learners(initial.clone(), CLIP)?;
        match backend {
            Backend::Engine => enter(format!("engine, {threads} threads"), true, learners)?,
            _ => {
                enter(backend.to_string(), false, learners)?;
                let models = computing.load(&initial)?;
                let carried = LearnerPair::on_host(models, initial.clone(), CLIP);
                enter(format!("{backend}, optimiser on the host"), true, carried)?;
            }
        }
    }
    let mut torch = [(Mode::Eager, None), (Mode::Compiled, None)];
    pool(threads)?.install(|| -> Result<()> {
        for contestant in &mut contestants {
            contestant.warm_up()?;
        }
        for round in 0..args.rounds {
            say!("  turn {} of {}", round + 1, args.rounds);
            for contestant in &mut contestants {
                contestant.turn(args.seconds)?;
            }
            if let Some(pytorch) = &mut pytorch {
                for (mode, best) in &mut torch {
                    shorter(best, pytorch.time("train", *mode)?);
                }
            }
        }
        Ok(())
    })?;
    let engine = contestants.iter().find(|c| c.is_engine).map(|c| c.first);
    let row = |what: String, best: Option<f64>, off_by| TrainingRow {
        width: shape.width,
        parameters: count,
        what,
        speed: best.map_or(0.0, f64::recip),
        off_by,
    };
    let mut rows: Vec<TrainingRow> = contestants
        .iter()
        .map(|c| {
            let engine = engine.filter(|_| !c.is_engine);
            row(c.what.clone(), c.best, engine.map(|e| off_by(&c.first, &e)))
        })
        .collect();
    let version = pytorch.as_mut().map(Pytorch::version).transpose()?;
    for (mode, best) in torch.into_iter().filter(|(_, best)| best.is_some()) {
        let device = &args.pytorch_device;
        rows.push(row(format!("PyTorch {mode:?}, {device}"), best, None));
    }
    Ok((rows, version))
}

/// Largest relative difference of a loss or a gradient's norm.
fn off_by(found: &LogRow, engine: &LogRow) -> f64 {
    let losses = |row: &LogRow| {
        [
            row.translation_eps,
            row.translation_x0,
            row.rotation_eps,
            row.rotation_x0,
            row.translation_gradient,
            row.rotation_gradient,
        ]
    };
    let pairs = losses(found).into_iter().zip(losses(engine));
    pairs.map(|(a, b)| (a - b).abs() / b).fold(0.0, f64::max)
}

/// The rows as Markdown.
pub fn table(rows: &[TrainingRow], out: &mut String) {
    // Writing to a String cannot fail.
    let _ = writeln!(
        out,
        "\nTraining steps of both networks a second, in the best turn. `off by`: the largest relative difference of a \
         loss or a gradient's norm from the engine's, over the first {BLOCK} steps. PyTorch's step has a simpler \
         loss, no averaged weights and the same batch each time.\n\n\
         | width | parameters | | steps/s | off by |\n|---|---|---|---|---|"
    );
    for r in rows {
        let off_by = r.off_by.map_or("–".to_owned(), |a| format!("{a:.0e}"));
        let millions = r.parameters as f64 / 1e6;
        let _ = writeln!(
            out,
            "| {} | {millions:.1} M | {} | {:.3} | {off_by} |",
            r.width, r.what, r.speed
        );
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_says_how_fast_and_how_far_apart() {
        let row = |eps, norm| LogRow {
            translation_eps: eps,
            translation_x0: 1.0,
            rotation_eps: 2.0,
            rotation_x0: 1.0,
            translation_gradient: norm,
            rotation_gradient: 4.0,
            ..LogRow::default()
        };
        let off_by = off_by(&row(0.5, 2.002), &row(0.5001, 2.0));
        assert!((off_by - 1e-3).abs() < 1e-9, "{off_by}");
        let row = |what: &str, off_by| TrainingRow {
            width: 16,
            parameters: 2_254_918,
            what: what.to_owned(),
            speed: 12.5,
            off_by,
        };
        let mut out = String::new();
        table(&[row("engine", None), row("wgpu", Some(off_by))], &mut out);
        let lines = "| 16 | 2.3 M | engine | 12.500 | – |\n| 16 | 2.3 M | wgpu | 12.500 | 1e-3 |";
        assert!(out.contains(lines), "{out}");
    }
}
