//! The figures of synthetic sets and a small network that was never trained.

use super::*;
use crate::sets::synthetic;
use anyhow::Result;
use dose3::backend::Backend;
use dose3_model::{PairConfig, PairParameters};

const WINDOW: usize = 32;

/// Sets with a few windows each, and the shipped model's header over another network.
fn sets_and_model() -> (Vec<DataSet>, Model) {
    let mut model = dose3::built_in::paper().unwrap();
    model.header.window = WINDOW;
    model.header.process.steps = 6;
    model.parameters = PairParameters::init(&PairConfig::new(8, &[1, 2]), 3).unwrap();
    let mut sets = synthetic(1, 4).unwrap();
    for set in &mut sets {
        set.prepare(WINDOW, 100, &[], &[]);
    }
    (sets, model)
}

fn input<'a>(sets: &'a [DataSet], model: &'a Model, density: &'a DensityConfig) -> FigureInput<'a> {
    FigureInput {
        sets,
        kitti: model,
        oxford: Some(model),
        density,
        seed: 5,
        computing: Computing {
            backend: Backend::Engine,
            threads: 1,
        },
        max_windows: 24,
    }
}

fn all(input: &FigureInput<'_>) -> Result<Vec<Figure>> {
    let mut figures = epsilon(input)?;
    figures.push(trajectories(input)?);
    figures.push(reverse_diffusion(input)?);
    Ok(figures)
}

#[test]
fn synthetic_sets_give_every_figure_and_the_same_bytes_again() {
    let (sets, model) = sets_and_model();
    let density = "mixture:1:diagonal".parse().unwrap();
    let input = input(&sets, &model, &density);
    let figures = all(&input).unwrap();
    let keys: Vec<&str> = figures.iter().map(|f| f.key).collect();
    let expected = [
        "epsilon-axes",
        "epsilon-statistics",
        "trajectories",
        "reverse-diffusion",
    ];
    assert_eq!(keys, expected);
    for (figure, again) in figures.iter().zip(all(&input).unwrap()) {
        assert!(
            figure.svg == again.svg,
            "{} differs in a second run",
            figure.key
        );
        assert_eq!(figure.caption, again.caption);
        assert!(figure.svg.ends_with("</svg>\n"), "{}", figure.key);
        assert!(
            figure.svg.len() < 400_000,
            "{}: {}",
            figure.key,
            figure.svg.len()
        );
        assert!(
            !figure.svg.contains("NaN") && !figure.caption.contains("NaN"),
            "{}",
            figure.key
        );
        assert!(
            figure.caption.contains("synthetic vehicle"),
            "{}",
            figure.caption
        );
        assert!(figure.caption.contains("seed"), "{}", figure.caption);
    }
    let other = FigureInput { seed: 6, ..input };
    let changed = all(&other).unwrap();
    assert!(figures.iter().zip(&changed).all(|(a, b)| a.svg != b.svg));
}

#[test]
fn without_an_oxford_model_its_figure_is_left_out() {
    let (sets, model) = sets_and_model();
    let density = DensityConfig::default();
    let input = FigureInput {
        oxford: None,
        max_windows: 2,
        ..input(&sets, &model, &density)
    };
    let keys: Vec<&str> = epsilon(&input).unwrap().iter().map(|f| f.key).collect();
    assert_eq!(keys, ["epsilon-statistics"]);
}

#[test]
fn what_no_figure_can_be_made_of_is_an_error() {
    let (mut sets, model) = sets_and_model();
    let density = DensityConfig::default();
    let none = input(&[], &model, &density);
    assert!(all(&none).is_err() && reverse_diffusion(&none).is_err());
    // Too few windows for a density.
    let few = FigureInput {
        max_windows: 1,
        ..input(&sets, &model, &density)
    };
    assert!(trajectories(&few).is_err());
    for set in &mut sets {
        set.windows.clear();
    }
    let empty = input(&sets, &model, &density);
    assert!(epsilon(&empty).is_err());
    assert!(trajectories(&empty).is_err());
    assert!(reverse_diffusion(&empty).is_err());
    let (mut sets, _) = sets_and_model();
    for set in &mut sets {
        set.prepare(WINDOW + 8, 100, &[], &[]);
    }
    let other_length = input(&sets, &model, &density);
    let error = reverse_diffusion(&other_length).err().unwrap().to_string();
    assert!(error.contains("40 poses"), "{error}");
}

#[test]
fn one_set_alone_can_be_drawn() {
    let (mut sets, model) = sets_and_model();
    sets.truncate(1);
    let density = "mixture:1:diagonal".parse().unwrap();
    let figures = all(&input(&sets, &model, &density)).unwrap();
    assert!(figures.iter().all(|f| !f.svg.contains("NaN")));
}
