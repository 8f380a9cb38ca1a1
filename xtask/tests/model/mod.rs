//! An untrained tiny model.

use dose3::model_file::{Model, ModelHeader, TrainingRecord, VERSION};
use dose3_datasets::{Frame, Kind, Representation, Scaling};
use dose3_diffusion::ProcessConfig;
use dose3_diffusion::trainer::TrainConfig;
use dose3_model::{PairConfig, PairParameters, Precision};
use std::path::Path;

/// Writes it to a file.
pub fn write_model(path: &Path, kind: Kind) {
    let shape = PairConfig::new(8, &[1]);
    let model = Model {
        header: ModelHeader {
            format_version: VERSION,
            representation: Representation {
                kind,
                scaling: Scaling::Stored {
                    translation: 0.5,
                    rotation: 20.0,
                },
            },
            window: 32,
            rate: 10.0,
            frame: Frame::BodyFlu,
            process: ProcessConfig {
                steps: 12,
                ..ProcessConfig::default()
            },
            training: TrainingRecord {
                config: TrainConfig::default(),
                logs: Vec::new(),
                validation: Vec::new(),
                version: "test".into(),
                translation_validation: None,
                rotation_validation: None,
            },
        },
        parameters: PairParameters::init(&shape, 1).expect("a shape"),
        joint: None,
    };
    model.write(path, Precision::F32).expect("written");
}
