//! The paper's statistics of the noise estimate, a distribution over windows.

use super::super::canvas::page;
use super::super::legend::legend;
use super::super::panel::Panel;
use super::super::select::{Selection, check, network};
use super::super::{Figure, FigureInput};
use super::shape::{Shape, draw, legend_entries};
use super::{WIDTH, axes_of_bodies, described, plan};
use anyhow::{Context, Result};
use dose3::Probe;
use dose3_ood::statistics::{StatisticsSet, quantile_sorted};
use std::ops::Range;

/// What lies between these quantiles of some set is shown.
const SHOWN: [f64; 2] = [0.005, 0.995];

/// A column of `paper24`.
struct Column {
    name: &'static str,
    title: &'static str,
    axis: &'static str,
    power: i32,
    /// Axes it pools.
    axes: usize,
}

const COLUMNS: [Column; 4] = [
    Column {
        name: "translation.sum_eps^1",
        title: "Translation, first moment",
        axis: "sum over steps of the mean estimate",
        power: 1,
        axes: 3,
    },
    Column {
        name: "rotation_z.sum_eps^1",
        title: "Rotation z, first moment",
        axis: "sum over steps of the mean estimate (rad)",
        power: 1,
        axes: 1,
    },
    Column {
        name: "translation.sum_eps^2",
        title: "Translation, second moment",
        axis: "sum over steps of the mean squared estimate",
        power: 2,
        axes: 3,
    },
    Column {
        name: "rotation_z.sum_eps^2",
        title: "Rotation z, second moment",
        axis: "sum over steps of the mean squared estimate (rad²)",
        power: 2,
        axes: 1,
    },
];

impl Column {
    /// Mean and standard deviation of the statistic of the noise itself, the same at all `steps`, over `length`
    /// poses: that of a mean of `length` N(0, 1) or of their squares.
    fn of_noise(&self, steps: usize, length: usize) -> (f64, f64) {
        let (steps, values) = (steps as f64, (length * self.axes) as f64);
        match self.power {
            1 => (0.0, steps / values.sqrt()),
            _ => (steps, steps * (2.0 / values).sqrt()),
        }
    }
}

/// One column of all sets.
struct Distributions {
    column: &'static Column,
    range: Range<f64>,
    shapes: Vec<Shape>,
    /// Values beyond the range.
    outside: usize,
}

pub fn figure(input: &FigureInput<'_>) -> Result<Figure> {
    let model = input.kitti;
    check(input.sets, model)?;
    let steps = model.header.process.steps;
    let selections = (0..input.sets.len())
        .map(|i| Selection::new(input.sets, i, model, input.max_windows))
        .collect::<Result<Vec<_>>>()?;
    let set: StatisticsSet = "paper24".parse()?;
    let rows = selections
        .iter()
        .map(|s| rows(input, s, &set))
        .collect::<Result<Vec<_>>>()?;
    let names = set.names();
    let panels = COLUMNS
        .iter()
        .map(|column| {
            let position = names.iter().position(|n| n == column.name);
            let position = position.with_context(|| format!("no statistic {}", column.name))?;
            let values = rows
                .iter()
                .map(|rows| rows.iter().map(|r| r[position]).collect());
            let noise = column.of_noise(steps, model.header.window);
            Ok(distributions(column, values.collect(), &selections, noise))
        })
        .collect::<Result<Vec<_>>>()?;
    let caption = format!(
        "Statistics of the paper's metric group, one value a window: {}, all {} diffusion steps, one noise draw \
         for each window (seed {}); {}. Curves are kernel density estimates. Dashed: what a network would give \
         that returns exactly the noise drawn. Axes span the {} to {} % quantiles of all sets; {} of {} values \
         lie beyond. {}.",
        network(input.sets, model),
        steps,
        input.seed,
        described(&selections),
        100.0 * SHOWN[0],
        100.0 * SHOWN[1],
        panels.iter().map(|p| p.outside).sum::<usize>(),
        COLUMNS.len() * rows.iter().map(Vec::len).sum::<usize>(),
        axes_of_bodies(&selections),
    );
    Ok(Figure {
        key: "epsilon-statistics",
        title: "Statistics of the noise estimate: translation against rotation z".into(),
        caption,
        svg: drawing(&selections, &panels)?,
    })
}

fn rows(
    input: &FigureInput<'_>,
    selection: &Selection<'_>,
    set: &StatisticsSet,
) -> Result<Vec<Vec<f64>>> {
    let plan = plan(input.kitti, input.seed);
    let mut probe = Probe::for_sets(input.kitti, &plan, [set], input.computing)?;
    Ok(probe.rows(&selection.set.trajectories, &selection.windows, set)?)
}

fn distributions(
    column: &'static Column,
    values: Vec<Vec<f64>>,
    selections: &[Selection<'_>],
    (mean, deviation): (f64, f64),
) -> Distributions {
    let range = shown(&values);
    let outside = values.iter().flatten().filter(|v| !range.contains(v));
    Distributions {
        column,
        outside: outside.count(),
        shapes: values
            .iter()
            .zip(selections)
            .map(|(v, s)| Shape::of_set(v, &range, s.index))
            .chain([Shape::normal(mean, deviation, &range)])
            .collect(),
        range,
    }
}

/// From the smallest lower to the largest upper quantile of a set, and a little more.
fn shown(values: &[Vec<f64>]) -> Range<f64> {
    let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
    for values in values {
        let mut sorted = values.clone();
        sorted.sort_by(f64::total_cmp);
        low = low.min(quantile_sorted(&sorted, SHOWN[0]));
        high = high.max(quantile_sorted(&sorted, SHOWN[1]));
    }
    let margin = (0.06 * (high - low)).max(1e-6);
    low - margin..high + margin
}

fn drawing(selections: &[Selection<'_>], panels: &[Distributions]) -> Result<String> {
    page(WIDTH, 634.0, |canvas| {
        let dashed = "a network that returns the noise drawn";
        legend(
            canvas,
            (0.0, WIDTH),
            16.0,
            &legend_entries(selections, dashed),
        )?;
        for (i, distributions) in panels.iter().enumerate() {
            let shapes = &distributions.shapes;
            let panel = Panel {
                left: 76.0 + 470.0 * (i % 2) as f64,
                top: 58.0 + 304.0 * (i / 2) as f64,
                width: 396.0,
                height: 220.0,
                x: distributions.range.clone(),
                y: 0.0..1.06 * shapes.iter().map(Shape::peak).fold(0.0, f64::max),
            };
            draw(canvas, &panel, shapes, distributions.column.title)?;
            panel.x_axis(canvas, distributions.column.axis, 9)?;
            panel.y_axis(canvas, "probability density", 5)?;
        }
        Ok(())
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_by_hand() {
        // 30 steps of the same 100 values: the sum is 30 times their mean.
        let translation = Column {
            axes: 1,
            ..COLUMNS[0]
        };
        assert_eq!(translation.of_noise(30, 100), (0.0, 3.0));
        let squares = Column {
            axes: 1,
            ..COLUMNS[3]
        };
        assert_eq!(squares.of_noise(10, 200), (10.0, 1.0));
    }

    #[test]
    fn the_range_covers_every_set_without_its_extremes() {
        let mut far = vec![0.0; 1000];
        far[0] = 1e6;
        let range = shown(&[far, vec![-1.0, 1.0]]);
        assert!(range.start < -0.99 && range.start > -1.2, "{range:?}");
        assert!(range.end > 0.99 && range.end < 1.2, "{range:?}");
    }
}
