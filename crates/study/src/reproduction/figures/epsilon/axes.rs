//! The values of the noise estimate on each rotation axis.

use super::super::canvas::page;
use super::super::kde::mean_and_deviation;
use super::super::legend::legend;
use super::super::panel::Panel;
use super::super::select::{Selection, check, network};
use super::super::{Figure, FigureInput};
use super::shape::{Shape, draw, legend_entries};
use super::{WIDTH, axes_of_bodies, described, plan};
use anyhow::Result;
use dose3::model_file::Model;
use dose3_diffusion::{Branches, Process, trace};
use dose3_ood::statistics::CHANNELS;
use std::ops::Range;

/// Windows that are estimated at once.
const BATCH: usize = 8;
/// What is shown of the values, radians.
const VALUES: Range<f64> = -4.0..4.0;
const AXES: [&str; 3] = ["x", "y", "z"];

pub fn figure(input: &FigureInput<'_>, model: &Model) -> Result<Figure> {
    check(input.sets, model)?;
    let process = Process::new(model.header.process)?;
    let selections = pair(input)
        .into_iter()
        .map(|i| Selection::new(input.sets, i, model, input.max_windows))
        .collect::<Result<Vec<_>>>()?;
    let values = selections
        .iter()
        .map(|s| rotation_values(input, model, &process, s))
        .collect::<Result<Vec<_>>>()?;
    let panels: Vec<Vec<Shape>> = (0..AXES.len())
        .map(|axis| {
            let of_sets = selections.iter().zip(&values);
            of_sets
                .map(|(s, v)| Shape::of_set(&v[axis], &VALUES, s.index))
                .chain([Shape::normal(0.0, 1.0, &VALUES)])
                .collect()
        })
        .collect();
    let caption = format!(
        "Noise estimate of a {}: all its values on each axis of the rotation's tangent space, pooled over the \
         {} poses of a window and all {} diffusion steps, one noise draw for each window (seed {}); {}. Curves \
         are kernel density estimates; dashed is N(0, 1), the distribution of the noise itself. Mean ± standard \
         deviation: {}. {}.",
        network(input.sets, model),
        model.header.window,
        process.steps(),
        input.seed,
        described(&selections),
        moments(&selections, &values),
        axes_of_bodies(&selections),
    );
    Ok(Figure {
        key: "epsilon-axes",
        title: "Distribution of the noise estimate on each rotation axis".into(),
        caption,
        svg: drawing(&selections, &panels)?,
    })
}

fn drawing(selections: &[Selection<'_>], panels: &[Vec<Shape>]) -> Result<String> {
    let peak = panels.iter().flatten().map(Shape::peak).fold(0.0, f64::max);
    page(WIDTH, 330.0, |canvas| {
        legend(
            canvas,
            (0.0, WIDTH),
            16.0,
            &legend_entries(selections, "N(0, 1)"),
        )?;
        for (i, (shapes, axis)) in panels.iter().zip(AXES).enumerate() {
            let panel = Panel {
                left: 62.0 + 302.0 * i as f64,
                top: 58.0,
                width: 278.0,
                height: 222.0,
                x: VALUES,
                y: 0.0..1.06 * peak,
            };
            draw(canvas, &panel, shapes, &format!("Rotation {axis}"))?;
            panel.x_axis(canvas, &format!("noise estimate, rotation {axis} (rad)"), 8)?;
            if i == 0 {
                panel.y_axis(canvas, "probability density (1/rad)", 5)?;
            }
        }
        Ok(())
    })
}

/// Oxford and KITTI; where they are not both there, the first two sets.
fn pair(input: &FigureInput<'_>) -> Vec<usize> {
    let of = |letter| input.sets.iter().position(|s| s.letter == letter);
    match (of('O'), of('K')) {
        (Some(oxford), Some(kitti)) => vec![oxford, kitti],
        _ => (0..input.sets.len().min(2)).collect(),
    }
}

/// All values of the estimate on each rotation axis.
fn rotation_values(
    input: &FigureInput<'_>,
    model: &Model,
    process: &Process,
    selection: &Selection<'_>,
) -> Result<[Vec<f64>; 3]> {
    let mut models = input.computing.load(&model.parameters)?;
    let plan = plan(model, input.seed);
    let representation = model.header.representation;
    let mut values: [Vec<f64>; 3] = Default::default();
    for chunk in selection.windows.chunks(BATCH) {
        let tensors = chunk
            .iter()
            .map(|w| representation.represent_window(w, &selection.set.trajectories))
            .collect::<Result<Vec<_>, _>>()?;
        let views: Vec<_> = tensors
            .iter()
            .map(|t| dose3_diffusion::Window {
                translation: &t.translation,
                rotation: &t.rotation,
            })
            .collect();
        let traces = trace(&mut models, process, &plan, &views, 0..1, Branches::Both)?;
        for estimate in traces.eps_hat.chunks_exact(CHANNELS) {
            for (values, value) in values.iter_mut().zip(&estimate[3..]) {
                values.push(f64::from(*value));
            }
        }
    }
    Ok(values)
}

/// `KITTI x −0.012 ± 0.934, y ...; Oxford RobotCar x ...`.
fn moments(selections: &[Selection<'_>], values: &[[Vec<f64>; 3]]) -> String {
    let of_set = |(selection, values): (&Selection<'_>, &[Vec<f64>; 3])| {
        let axes = AXES.iter().zip(values).map(|(axis, values)| {
            let (mean, deviation) = mean_and_deviation(values);
            format!("{axis} {mean:+.3} ± {deviation:.3}")
        });
        let axes: Vec<String> = axes.collect();
        format!("{} {}", selection.set.name, axes.join(", "))
    };
    let sets: Vec<String> = selections.iter().zip(values).map(of_set).collect();
    sets.join("; ")
}
