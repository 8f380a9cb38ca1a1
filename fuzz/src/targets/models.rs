//! Model files: two networks, a joint network, or both.

use crate::seeds::detectors::judged;
use crate::seeds::models::PARTS;
use dose3::joint::JointModel;
use dose3::{Model, Probe, ProbePlan};
use dose3_datasets::{Window, windows};
use dose3_diffusion::{NoiseSharing, Process};
use dose3_model::CONFIG_KEY;

/// Windows longer than this are not measured here.
const LONGEST: usize = 256;
/// Networks with more parameters than this are not run here.
const LARGEST: usize = 1 << 18;

/// A file as others send it.
pub fn file(bytes: &[u8]) {
    let _ = JointModel::from_bytes(bytes);
    if let Ok((model, _)) = Model::from_bytes(bytes) {
        measures(&model);
    }
}

/// What a model says of itself, in a file that is sound otherwise.
pub fn header(bytes: &[u8]) {
    let Ok(json) = std::str::from_utf8(bytes) else {
        return;
    };
    let keys = [CONFIG_KEY, dose3::model_file::KEY, dose3::joint::KEY];
    for key in keys {
        if let Ok((model, _)) = Model::from_bytes(&PARTS.with_entry(key, json)) {
            measures(&model);
        }
    }
}

/// A model that is accepted measures a window, or says why it does not; what it says is finite.
fn measures(model: &Model) {
    let header = &model.header;
    assert!(header.rate.is_finite() && header.rate > 0.0);
    let process = Process::new(header.process);
    let steps = process.unwrap_or_else(|error| panic!("{error}")).steps();
    let parameters = model.parameters.config().parameter_count();
    let joint = model
        .joint
        .as_ref()
        .map_or(0, |j| j.parameters.values.len());
    if header.window > LONGEST || parameters > LARGEST || joint > LARGEST {
        return;
    }
    let plan = ProbePlan {
        steps: steps.min(2),
        draws: 1,
        seed: 0,
        sharing: NoiseSharing::Shared,
    };
    let words = match &model.joint {
        Some(_) => "kinematic,residual,eps-mean",
        None => "kinematic,residual",
    };
    let set = words.parse().unwrap_or_else(|error| panic!("{error}"));
    let logs = std::slice::from_ref(judged());
    let Ok(mut probe) = Probe::new(model, &plan) else {
        return;
    };
    let cut: Vec<Window> = windows(logs, probe.poses(), LONGEST)
        .into_iter()
        .take(1)
        .collect();
    if let Ok(rows) = probe.rows(logs, &cut, &set) {
        assert!(rows.iter().flatten().all(|number| number.is_finite()));
    }
}
