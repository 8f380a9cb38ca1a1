//! The layout against the one that PyTorch derives from its own module definitions.

#[allow(dead_code)]
#[path = "../golden/golden.rs"]
mod golden;

use golden::Golden;

#[test]
fn names_shapes_and_order_are_those_of_the_pytorch_modules() {
    let golden = Golden::load();
    let layout = golden.config.layout();
    let found: Vec<_> = layout
        .entries()
        .iter()
        .map(|spec| (spec.name.clone(), spec.shape.clone()))
        .collect();
    assert_eq!(found, golden.layout);
    assert_eq!(layout.len(), golden.gradient.len());
}

#[test]
fn the_parameter_formula_is_reproduced() {
    let golden = Golden::load();
    let sum: f64 = golden
        .parameters()
        .values
        .iter()
        .map(|&value| f64::from(value))
        .sum();
    assert!(
        (sum - golden.parameter_sum).abs() < 1e-6,
        "{sum} against {}",
        golden.parameter_sum
    );
}
