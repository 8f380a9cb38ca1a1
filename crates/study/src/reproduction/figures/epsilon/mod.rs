//! What the noise estimate is distributed like: its values on each rotation axis, and the paper's
//! statistics of it.

mod axes;
mod shape;
mod statistics;

use super::select::Selection;
use super::{Figure, FigureInput};
use anyhow::Result;
use dose3::{Model, ProbePlan};
use dose3_datasets::Frame;
use dose3_diffusion::NoiseSharing;

/// Width of both figures, display pixels.
const WIDTH: f64 = 960.0;

/// The values on each rotation axis, where there is a network trained on RobotCar, and the statistics.
///
/// # Errors
/// No sets, sets without windows, a model that does not fit them, a failing network.
pub fn epsilon(input: &FigureInput<'_>) -> Result<Vec<Figure>> {
    let mut figures = Vec::new();
    if let Some(oxford) = input.oxford {
        figures.push(axes::figure(input, oxford)?);
    }
    figures.push(statistics::figure(input)?);
    Ok(figures)
}

/// The noise of the paper's evaluation: one draw of its own for each window, at all steps.
fn plan(model: &Model, seed: u64) -> ProbePlan {
    ProbePlan {
        steps: model.header.process.steps,
        draws: 1,
        seed,
        sharing: NoiseSharing::Own,
    }
}

/// What x, y and z are in each set, so that nobody takes them for the same motion.
fn axes_of_bodies(selections: &[Selection<'_>]) -> String {
    let of_set = |s: &Selection<'_>| {
        let axes = match s.set.trajectories.first().map(|t| t.frame) {
            Some(Frame::CameraRdf) => "right, down and forward",
            Some(Frame::BodyFrd) => "forward, right and down",
            Some(Frame::BodyFlu) => "forward, left and up",
            Some(Frame::Object) => "axes of the object's model",
            Some(Frame::Sensor) | None => "axes of the sensor",
        };
        format!("{axes} in {}", s.set.name)
    };
    let sets: Vec<String> = selections.iter().map(of_set).collect();
    format!(
        "Rotation axes x, y and z are the body's own: {}",
        sets.join("; ")
    )
}

fn described(selections: &[Selection<'_>]) -> String {
    let parts: Vec<String> = selections.iter().map(Selection::describe).collect();
    parts.join("; ")
}
