//! A small run: arcs to learn, two small networks, few steps.

use dose3_diffusion::trainer::{TrainConfig, WindowSource};
use dose3_diffusion::{Error, ModelPair};
use dose3_engine::{Engine, EngineOptions};
use dose3_lie::{Vector, so3};
use dose3_model::{PairConfig, PairParameters};

pub const LENGTH: usize = 32;

/// Arcs of different curvature: something a small network learns in a few steps.
pub struct Arcs(pub usize);

impl WindowSource for Arcs {
    fn len(&self) -> usize {
        self.0
    }

    fn length(&self) -> usize {
        LENGTH
    }

    fn read(
        &self,
        index: usize,
        translation: &mut [f32],
        rotation: &mut [f32],
    ) -> Result<(), Error> {
        let curvature = (index as f64 - self.0 as f64 / 2.0) / self.0 as f64;
        for i in 0..LENGTH {
            let u = i as f64 / (LENGTH - 1) as f64;
            let angle = curvature * u;
            let t = [u, 0.5 * angle * u, 0.0];
            let r = so3::exp(&Vector::new(0.0, 0.0, angle));
            for (k, t) in t.iter().enumerate() {
                translation[i * 3 + k] = *t as f32;
            }
            for k in 0..9 {
                rotation[i * 9 + k] = r.matrix()[(k / 3, k % 3)] as f32;
            }
        }
        Ok(())
    }
}

pub fn network() -> PairConfig {
    PairConfig::new(8, &[1, 2])
}

pub fn models() -> ModelPair {
    let p = PairParameters::init(&network(), 0).unwrap();
    let options = EngineOptions::default;
    ModelPair {
        translation: Box::new(Engine::new(&p.translation, options()).unwrap()),
        rotation: Box::new(Engine::new(&p.rotation, options()).unwrap()),
    }
}

pub fn config(steps: usize) -> TrainConfig {
    TrainConfig {
        steps,
        batch: 8,
        learning_rate: 3e-3,
        warmup: 5,
        log_every: 5,
        validate_every: 10,
        validation_windows: 8,
        checkpoint_every: 10,
        ..TrainConfig::default()
    }
}
