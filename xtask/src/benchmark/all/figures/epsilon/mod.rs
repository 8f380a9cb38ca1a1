//! What the noise estimate is distributed like: its values on each rotation axis, and the paper's
//! statistics of it.

mod axes;
mod shape;
mod statistics;

use super::select::Selection;
use super::{Figure, FigureInput};
use anyhow::Result;
use dose3_diffusion::{NoiseSharing, ProbeConfig, Process};

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
fn probe(process: &Process, seed: u64) -> ProbeConfig {
    ProbeConfig {
        steps: process.steps(),
        draws: 1,
        seed,
        sharing: NoiseSharing::PerWindow,
    }
}

fn described(selections: &[Selection<'_>]) -> String {
    let parts: Vec<String> = selections.iter().map(Selection::describe).collect();
    parts.join("; ")
}
