//! Logs in another unit.
//!
//! With positions k times as large, what a turn does to the step is k times as large, and what goes with the step stays;
//! with turns k times as large, what goes with a turn is k times smaller. Such a log is not explained by a point of the
//! body far away, though one coefficient alone would look like it.

use super::piece::{Kind, Regressor, regressors_of};

/// What may be mistaken for what, and how many times as large it makes a log.
pub(super) const UNITS: [(Kind, f64, &str, &str); 12] = [
    (Kind::Length, 1.0 / 0.3048, "feet", "metres"),
    (Kind::Length, 0.3048, "metres", "feet"),
    (Kind::Length, 1.0 / 0.0254, "inches", "metres"),
    (Kind::Length, 0.0254, "metres", "inches"),
    (Kind::Length, 100.0, "centimetres", "metres"),
    (Kind::Length, 0.01, "metres", "centimetres"),
    (Kind::Length, 1000.0, "millimetres", "metres"),
    (Kind::Length, 0.001, "kilometres", "metres"),
    (Kind::Length, 1e-6, "kilometres", "millimetres"),
    (Kind::Length, 10.0, "decimetres", "metres"),
    (
        Kind::Turn,
        180.0 / std::f64::consts::PI,
        "degrees",
        "radians",
    ),
    (
        Kind::Turn,
        std::f64::consts::PI / 180.0,
        "radians",
        "degrees",
    ),
];

/// The unit of a factor.
pub(super) fn named(kind: Kind, factor: f64) -> Option<(&'static str, &'static str)> {
    let same = |(of, by, ..): &&(Kind, f64, &str, &str)| *of == kind && *by == factor;
    UNITS
        .iter()
        .find(same)
        .map(|(.., own, trusted)| (*own, *trusted))
}

/// Coefficients, or their errors, as they would be in the trusted unit.
pub(super) fn undone(kind: Kind, factor: f64, values: &[f64]) -> Vec<f64> {
    let by = |regressor: Regressor| match (kind, regressor) {
        (Kind::Length, Regressor::Turn) => factor.recip(),
        (Kind::Turn, Regressor::Turn | Regressor::ForwardTurn) => factor,
        _ => 1.0,
    };
    let all = values.iter().zip(regressors_of());
    all.map(|(value, regressor)| value * by(regressor))
        .collect()
}
