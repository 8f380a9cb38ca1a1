//! Model files with networks that learnt nothing.

use super::detectors::Parts;
use dose3::Model;
use dose3::joint::{self, JointHeader, JointModel};
use dose3_diffusion::joint::JointTrainConfig;
use dose3_model::joint::{JointConfig, JointParameters};
use dose3_model::{PairConfig, PairParameters, Precision, UNetConfig};
use std::fmt::Display;
use std::sync::LazyLock;

/// Two networks, and what is said of them.
static PAIR: LazyLock<Model> = LazyLock::new(|| {
    let mut header = expect(dose3::built_in::motion()).header;
    header.training.logs.truncate(2);
    header.training.validation.truncate(1);
    let small = |channels| UNetConfig {
        heads: 1,
        head_dim: 4,
        groups: 2,
        ..UNetConfig::new(channels, 3, 4, &[1])
    };
    let network = PairConfig {
        translation: small(3),
        rotation: small(9),
    };
    Model {
        header,
        parameters: expect(PairParameters::init(&network, 1)),
        joint: None,
    }
});

static JOINT: LazyLock<JointModel> = LazyLock::new(|| {
    let network = JointConfig::new(4, &[1, 2]);
    JointModel {
        parameters: expect(JointParameters::init(&network, 1)),
        header: JointHeader {
            format_version: joint::VERSION,
            network,
            training: JointTrainConfig::default(),
            sets: Vec::new(),
            validation: Some(0.25),
            version: "0".into(),
        },
    }
});

/// The file whose words of itself are altered: three networks.
pub static PARTS: LazyLock<Parts> = LazyLock::new(|| {
    let both = PAIR.clone().with_joint(JOINT.clone());
    Parts::of(&expect(both.to_bytes(Precision::F16, &[])))
});

fn expect<T, E: Display>(result: Result<T, E>) -> T {
    result.unwrap_or_else(|error| panic!("{error}"))
}

/// A model, a joint network alone, both in one file.
pub fn files() -> Vec<Vec<u8>> {
    let both = PAIR.clone().with_joint(JOINT.clone());
    vec![
        expect(PAIR.to_bytes(Precision::F16, &[])),
        expect(JOINT.to_bytes(Precision::F32)),
        expect(both.to_bytes(Precision::F16, &[])),
    ]
}

/// What they say of themselves, JSON: the networks, the model, the joint network.
pub fn headers() -> Vec<Vec<u8>> {
    [dose3_model::CONFIG_KEY, dose3::model_file::KEY, joint::KEY]
        .map(|key| PARTS.entry(key).as_bytes().to_vec())
        .to_vec()
}
