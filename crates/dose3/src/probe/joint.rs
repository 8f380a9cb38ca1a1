//! What the joint network gets wrong of windows.

use crate::error::{Error, Result};
use crate::model_file::Model;
use dose3_datasets::Trajectory;
use dose3_diffusion::joint::{AXES, JointProcess, Levels, Noised, standard_normal};
use dose3_engine::{EngineOptions, JointEngine};
use dose3_model::joint::{CONDITIONS, JointInput, JointNoiseModel};
use dose3_ood::statistics::{JointErrors, JointScore, SCORE_VIEW, VIEWS, halfway};
use rayon::prelude::*;

/// The joint network, ready to be asked.
pub(crate) struct JointProbe {
    engine: JointEngine,
    levels: Vec<Levels>,
    seed: u64,
    draws: usize,
    /// Of one length, `[draws][views][length * 6]`: shared by all windows.
    noise: Vec<Vec<Vec<f32>>>,
}

impl JointProbe {
    /// On the engine, whatever backend the pair runs on.
    pub fn new(model: &Model, threads: usize, (seed, draws): (u64, usize)) -> Result<Self> {
        let joint = model.joint.as_ref().ok_or(Error::NoJointNetwork)?;
        let options = EngineOptions {
            threads,
            ..EngineOptions::default()
        };
        let noised = VIEWS.iter();
        let levels = noised.map(|view| Levels::only(view.sigma, |axis| view.noised[axis]));
        Ok(Self {
            engine: JointEngine::new(&joint.parameters, options)?,
            levels: levels.collect(),
            seed,
            draws,
            noise: Vec::new(),
        })
    }

    /// Draws noise for windows of `length`. The second of two draws is the first with the other sign, which leaves less
    /// of the chance in their mean.
    fn draw(&mut self, length: usize) {
        let drawn = self.noise.first().and_then(|views| views.first());
        if drawn.is_some_and(|noise| noise.len() == length * AXES) {
            return;
        }
        let of = |draw: usize, view: usize| {
            let stream = (draw / 2 * VIEWS.len() + view) as u64;
            let mut noise = standard_normal(self.seed, stream, length * AXES);
            if draw % 2 == 1 {
                noise.iter_mut().for_each(|x| *x = -*x);
            }
            noise
        };
        let views = |draw| (0..VIEWS.len()).map(|view| of(draw, view)).collect();
        self.noise = (0..self.draws).map(views).collect();
    }

    /// Of windows of one length: their increments `[length, 6]` and the logs they are of.
    pub fn errors(
        &mut self,
        windows: &[(Vec<f64>, &Trajectory)],
        scale: [f64; AXES],
    ) -> Result<Vec<JointErrors>> {
        let Some((first, _)) = windows.first() else {
            return Ok(Vec::new());
        };
        let length = first.len() / AXES;
        self.draw(length);
        let processes: Vec<JointProcess> = windows
            .par_iter()
            .map(|(increments, _)| Ok(JointProcess::new(&halfway(increments)?, scale)?))
            .collect::<Result<_>>()?;
        let size = length * AXES;
        let (views, batch) = (VIEWS.len(), windows.len() * VIEWS.len());
        let mut conditions = Vec::with_capacity(batch * CONDITIONS);
        for (_, log) in windows {
            let told = self.levels.iter();
            conditions.extend(told.flat_map(|l| l.conditions(1.0 / log.rate.hertz)));
        }
        let mut squares = vec![0.0; batch * size];
        let mut output = vec![0.0; batch * size];
        for noise in &self.noise {
            let noised: Vec<Noised> = (0..batch)
                .into_par_iter()
                .map(|i| {
                    let mut to = Noised::default();
                    let (window, view) = (i / views, i % views);
                    processes[window].noised(&self.levels[view], &noise[view], &mut to)?;
                    Ok(to)
                })
                .collect::<Result<_>>()?;
            let x: Vec<f32> = noised.iter().flat_map(|n| &n.input).copied().collect();
            let input = JointInput {
                x: &x,
                conditions: &conditions,
                batch,
                length,
            };
            self.engine.forward(input, &mut output)?;
            let target = noised.iter().flat_map(|n| &n.target);
            for ((sum, f), t) in squares.iter_mut().zip(&output).zip(target) {
                *sum += (f - t) * (f - t);
            }
        }
        let draws = self.noise.len() as f32;
        squares.iter_mut().for_each(|sum| *sum /= draws);
        let signed = self.signed(windows, &processes)?;
        let of_window = squares
            .chunks_exact(views * size)
            .zip(signed.chunks_exact(size));
        let of_window = of_window.zip(&processes);
        of_window
            .map(|((squares, signed), process)| {
                let score = JointScore::new(signed.to_vec(), process.steps().to_vec())?;
                Ok(JointErrors::new(length, squares.to_vec())?.with_score(score))
            })
            .collect()
    }

    /// Signed errors in [`SCORE_VIEW`], `[windows, length * 6]`: means over the first draw and the same with the other
    /// sign, which leaves of them what does not depend on the sign of the noise.
    fn signed(
        &mut self,
        windows: &[(Vec<f64>, &Trajectory)],
        processes: &[JointProcess],
    ) -> Result<Vec<f32>> {
        let length = processes.first().map_or(0, JointProcess::len);
        let levels = self.levels[SCORE_VIEW];
        let told = windows
            .iter()
            .flat_map(|(_, log)| levels.conditions(1.0 / log.rate.hertz));
        let conditions: Vec<f32> = told.collect();
        let mut signed = vec![0.0; windows.len() * length * AXES];
        let mut output = vec![0.0; signed.len()];
        for sign in [1.0, -1.0] {
            let drawn = self
                .noise
                .iter()
                .take(1)
                .flat_map(|views| &views[SCORE_VIEW]);
            let noise: Vec<f32> = drawn.map(|x| sign * x).collect();
            let noised: Vec<Noised> = processes
                .par_iter()
                .map(|process| {
                    let mut to = Noised::default();
                    process.noised(&levels, &noise, &mut to)?;
                    Ok(to)
                })
                .collect::<Result<_>>()?;
            let x: Vec<f32> = noised.iter().flat_map(|n| &n.input).copied().collect();
            let input = JointInput {
                x: &x,
                conditions: &conditions,
                batch: windows.len(),
                length,
            };
            self.engine.forward(input, &mut output)?;
            let target = noised.iter().flat_map(|n| &n.target);
            for ((sum, f), t) in signed.iter_mut().zip(&output).zip(target) {
                *sum += 0.5 * (f - t);
            }
        }
        Ok(signed)
    }
}
