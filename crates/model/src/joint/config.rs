//! The shape of the joint network.

use serde::{Deserialize, Serialize};
use std::f64::consts::FRAC_PI_4;

use crate::layout::Visit;
use crate::{Init, ModelError, NetworkConfig, ParameterLayout};

/// Channels in and out: translation x, y, z, then rotation tangent x, y, z.
pub const JOINT_AXES: usize = 6;
/// What a sequence is told beside its values: the noise level of each axis, and the time between two steps.
pub const CONDITIONS: usize = JOINT_AXES + 1;
/// Frequencies of the features of a condition.
const FREQUENCIES: usize = 4;
/// Numbers that [`condition_features`] makes of all conditions.
pub const FEATURES: usize = 2 * FREQUENCIES * CONDITIONS;
/// A bound on every single size, so that sizes read from a file cannot overflow a product.
const MAX_SIZE: usize = 4096;
const MAX_BLOCKS: usize = 64;

/// The shape of a joint network.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct JointConfig {
    /// Channels of every block.
    pub width: usize,
    /// Channels of the embedding of the conditions.
    pub embedding: usize,
    /// For every block, the steps between its three taps.
    pub dilations: Vec<usize>,
}

impl JointConfig {
    /// A network of this width with an embedding of 64.
    pub fn new(width: usize, dilations: &[usize]) -> Self {
        Self {
            width,
            embedding: 64,
            dilations: dilations.to_vec(),
        }
    }

    /// Checks that the network can be built.
    ///
    /// # Errors
    /// [`ModelError::Config`] with the field and the rule it breaks.
    pub fn validate(&self) -> Result<(), ModelError> {
        let dilations = self.dilations.iter().map(|&d| ("a dilation", d));
        let sizes = [("width", self.width), ("embedding", self.embedding)];
        for (name, size) in sizes.into_iter().chain(dilations) {
            if !(1..=MAX_SIZE).contains(&size) {
                let reason = format!("{name} is {size}, it must be 1 to {MAX_SIZE}");
                return Err(ModelError::Config(reason));
            }
        }
        let blocks = self.blocks();
        if !(1..=MAX_BLOCKS).contains(&blocks) {
            let reason = format!("{blocks} dilations, there must be 1 to {MAX_BLOCKS}");
            return Err(ModelError::Config(reason));
        }
        Ok(())
    }

    /// Number of blocks.
    pub fn blocks(&self) -> usize {
        self.dilations.len()
    }

    /// How many steps before and after a step its output depends on.
    pub fn reach(&self) -> usize {
        1 + self.dilations.iter().sum::<usize>()
    }

    /// Every parameter with name, shape and place in the flat vector.
    pub fn layout(&self) -> ParameterLayout {
        ParameterLayout::of(|visit| self.walk(visit))
    }

    fn walk(&self, visit: Visit<'_>) {
        let Self {
            width, embedding, ..
        } = *self;
        linear("condition.linear1", FEATURES, embedding, visit);
        linear("condition.linear2", embedding, embedding, visit);
        linear("film", embedding, 2 * width * self.blocks(), visit);
        weight("stem", &[width, JOINT_AXES, 3], visit);
        bias("stem", width, JOINT_AXES * 3, visit);
        for i in 0..self.blocks() {
            weight(&format!("blocks.{i}.conv"), &[width, width, 3], visit);
            linear(&format!("blocks.{i}.out"), width, width, visit);
        }
        linear("last", width, JOINT_AXES, visit);
    }
}

impl NetworkConfig for JointConfig {
    fn validate(&self) -> Result<(), ModelError> {
        self.validate()
    }

    fn layout(&self) -> ParameterLayout {
        self.layout()
    }
}

fn linear(name: &str, from: usize, to: usize, visit: Visit<'_>) {
    weight(name, &[to, from], visit);
    bias(name, to, from, visit);
}

fn weight(name: &str, shape: &[usize], visit: Visit<'_>) {
    let fan_in = shape[1..].iter().product();
    visit(format!("{name}.weight"), shape.to_vec(), uniform(fan_in));
}

fn bias(name: &str, size: usize, fan_in: usize, visit: Visit<'_>) {
    visit(format!("{name}.bias"), vec![size], uniform(fan_in));
}

fn uniform(fan_in: usize) -> Init {
    Init::Uniform {
        bound: (1.0 / (fan_in as f64).sqrt()) as f32,
    }
}

/// Sines and cosines of the conditions of one sequence, [`CONDITIONS`] to [`FEATURES`] numbers; conditions between -4
/// and 4 are told apart.
pub fn condition_features(conditions: &[f32], features: &mut [f32]) {
    for (v, row) in conditions
        .iter()
        .zip(features.chunks_exact_mut(2 * FREQUENCIES))
    {
        for (k, pair) in row.chunks_exact_mut(2).enumerate() {
            let angle = f64::from(1_u32 << k) * FRAC_PI_4 * f64::from(*v);
            pair[0] = angle.sin() as f32;
            pair[1] = angle.cos() as f32;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shapes_by_hand() {
        let config = JointConfig::new(16, &[1, 2, 4]);
        config.validate().unwrap();
        assert_eq!((config.blocks(), config.reach()), (3, 8));
        let layout = config.layout();
        let block = 16 * 16 * 3 + 16 * 16 + 16;
        let condition = 56 * 64 + 64 + 64 * 64 + 64 + 64 * 96 + 96;
        let ends = 16 * 6 * 3 + 16 + 6 * 16 + 6;
        assert_eq!(layout.len(), condition + ends + 3 * block);
        assert_eq!(
            layout.find("blocks.2.conv.weight").unwrap().shape,
            [16, 16, 3]
        );
    }

    #[test]
    fn what_cannot_be_is_refused() {
        for bad in [
            JointConfig::new(0, &[1]),
            JointConfig::new(16, &[]),
            JointConfig::new(16, &[0]),
            JointConfig::new(1 << 40, &[1]),
        ] {
            assert!(bad.validate().is_err(), "{bad:?}");
        }
    }

    #[test]
    fn features_tell_levels_apart() {
        let of = |v: f32| {
            let mut features = [0.0; FEATURES];
            condition_features(&[v; CONDITIONS], &mut features);
            features
        };
        assert_eq!(of(0.0)[..4], [0.0, 1.0, 0.0, 1.0]);
        assert!((of(2.0)[0] - 1.0).abs() < 1e-6);
        let all: Vec<_> = (-35..35).map(|i| of(i as f32 * 0.1)).collect();
        for (i, a) in all.iter().enumerate() {
            for b in &all[..i] {
                let apart: f32 = a.iter().zip(b).map(|(x, y)| (x - y).abs()).sum();
                assert!(apart > 0.5);
            }
        }
    }
}
