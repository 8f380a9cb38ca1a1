//! Samples on their way from noise to poses, beside real windows.

mod drawing;

use super::plane::{Plane, forward};
use super::select::{Selection, check, network, trained_on};
use super::{Figure, FigureInput};
use anyhow::Result;
use dose3_datasets::Frame;
use dose3_diffusion::{Process, SampleConfig, State, rotation_logs, sample};
use dose3_lie::{Vector, so3};

const ROWS: usize = 3;
/// States of a sample that are shown, over the number of steps: sequences take shape late.
const SHOWN: [f64; 6] = [1.0, 0.6, 0.4, 0.2, 0.1, 0.0];
/// Real windows in a row.
const REAL: usize = 2;
/// Translations of `paper` windows lie in [-1, 1].
const CLIP: f64 = 1.0;
/// Poses from one heading tick to the next.
const TICK_EVERY: usize = 8;

/// A sequence as drawn: points of the plane, and where the body looks at each.
struct Sequence {
    points: Vec<(f64, f64)>,
    headings: Vec<(f64, f64)>,
}

/// One column: its title and its sequences from top to bottom.
struct Column {
    title: String,
    sequences: Vec<Sequence>,
}

/// Columns that belong together.
struct Strip {
    heading: &'static str,
    /// What stands below the heading where the columns have no titles.
    name: String,
    /// Names of the horizontal and the vertical axis.
    axes: [String; 2],
    columns: Vec<Column>,
}

/// Three sequences sampled by ancestral sampling at several steps, and real windows.
///
/// # Errors
/// No sets, a set without windows, a model that does not fit, a failing network.
pub fn reverse_diffusion(input: &FigureInput<'_>) -> Result<Figure> {
    let model = input.kitti;
    check(input.sets, model)?;
    let view = View::new(model.header.frame);
    let steps = model.header.process.steps;
    let samples = samples(input, &view)?;
    let source = trained_on(input.sets, model).unwrap_or(0);
    let selection = Selection::new(input.sets, source, model, ROWS * REAL)?;
    // A network trained elsewhere leaves only logs of another body.
    let frame = selection.set.trajectories.first().map(|t| t.frame);
    let real_view = View::new(frame.unwrap_or(model.header.frame));
    let real = Strip {
        heading: "real windows",
        name: selection.set.name.into(),
        axes: real_view.plane.names.clone(),
        columns: real(input, &selection, &real_view)?,
    };
    let caption = format!(
        "Reverse diffusion of a {}: {ROWS} sequences of {} poses drawn by ancestral sampling (seeds {} to {}, \
         translations of the estimated clean sequence clipped to ±{CLIP}) at steps t = {} of {steps}, t = 0 \
         being the result; to the right, in the same normalised units (positions from the window's first, over \
         its largest displacement), {}. Drawn: the plane of {} for samples, of \
         {} for real windows; every column has its own scale. Colour: \
         place in the window, first to last; ticks: where the body looks, one of {TICK_EVERY} poses, shorter \
         where it looks out of the plane. Positions and rotations are sampled by a network each, which do not \
         see one another.",
        network(input.sets, model),
        model.header.window,
        input.seed,
        input.seed + ROWS as u64 - 1,
        shown(steps)
            .iter()
            .map(ToString::to_string)
            .collect::<Vec<_>>()
            .join(", "),
        selection.describe(),
        samples.axes.join(" and "),
        real.axes.join(" and "),
    );
    Ok(Figure {
        key: "reverse-diffusion",
        title: "Reverse diffusion, from noise to a pose sequence".into(),
        caption,
        svg: drawing::draw(&samples, &real)?,
    })
}

/// Samples in rows, their states in columns.
fn samples(input: &FigureInput<'_>, view: &View) -> Result<Strip> {
    let steps = input.kitti.header.process.steps;
    let mut columns: Vec<Column> = shown(steps)
        .iter()
        .map(|t| Column {
            title: format!("t = {t}"),
            sequences: Vec::new(),
        })
        .collect();
    for row in 0..ROWS {
        let states = states(input, input.seed + row as u64)?;
        for (column, t) in columns.iter_mut().zip(shown(steps)) {
            column.sequences.push(view.sequence(&states[steps - t]));
        }
    }
    Ok(Strip {
        heading: "sampled, from noise (left) to the result (right)",
        name: String::new(),
        axes: view.plane.names.clone(),
        columns,
    })
}

/// The steps that are shown, noisiest first.
fn shown(steps: usize) -> Vec<usize> {
    let at = |share: f64| (share * steps as f64).round() as usize;
    let mut shown = SHOWN.map(at).to_vec();
    shown.dedup();
    shown
}

/// All states of one sample: noise first, the result last.
fn states(input: &FigureInput<'_>, seed: u64) -> Result<Vec<State>> {
    let header = &input.kitti.header;
    let mut models = input.computing.load(&input.kitti.parameters)?;
    let config = SampleConfig {
        length: header.window,
        seed,
        clip: CLIP,
    };
    let process = Process::new(header.process)?;
    let mut states = Vec::with_capacity(process.steps() + 1);
    sample(&mut models, &process, &config, &mut |_, state| {
        states.push(state.clone());
    })?;
    Ok(states)
}

/// Real windows in columns.
fn real(input: &FigureInput<'_>, selection: &Selection<'_>, view: &View) -> Result<Vec<Column>> {
    let representation = input.kitti.header.representation;
    let mut sequences = Vec::new();
    for window in &selection.windows {
        let tensor = representation.represent_window(window, &selection.set.trajectories)?;
        sequences.push(view.sequence(&State {
            translation: tensor.translation,
            rotation: tensor.rotation,
        }));
    }
    let mut columns = Vec::new();
    let mut rest = sequences.into_iter();
    for _ in 0..REAL {
        let sequences: Vec<Sequence> = rest.by_ref().take(ROWS).collect();
        if !sequences.is_empty() {
            columns.push(Column {
                title: String::new(),
                sequences,
            });
        }
    }
    Ok(columns)
}

/// From where sequences are seen.
struct View {
    plane: Plane,
    forward: Vector,
}

impl View {
    fn new(frame: Frame) -> Self {
        // Sampled sequences of objects have no poses yet to take a plane from: any will do.
        let frame = if frame.has_forward() {
            frame
        } else {
            Frame::BodyFlu
        };
        Self {
            plane: Plane::of_motion(frame, &[]),
            forward: forward(frame),
        }
    }

    fn sequence(&self, state: &State) -> Sequence {
        let points = state.translation.chunks_exact(3).map(|t| {
            let t = Vector::new(t[0].into(), t[1].into(), t[2].into());
            self.plane.project(&t)
        });
        let headings = rotation_logs(&state.rotation).into_iter();
        let headings = headings.map(|log| self.plane.project(&(so3::exp(&log) * self.forward)));
        Sequence {
            points: points.collect(),
            headings: headings.collect(),
        }
    }
}
