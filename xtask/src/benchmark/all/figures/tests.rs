//! The figures of synthetic sets and an untrained network.

use super::*;
use crate::benchmark::sets::synthetic;
use dose3::model_file::{ModelHeader, TrainingRecord};
use dose3_datasets::{Frame, Representation};
use dose3_diffusion::ProcessConfig;
use dose3_model::{PairConfig, PairParameters};

fn example() {}
