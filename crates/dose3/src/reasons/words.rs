//! Sentences that a robotics engineer says: what, how much, where from, and what is trusted.

use super::candidate::Stretch;
use super::deviation::Beyond;
use crate::report::{ReasonAxis, ReasonKind};
use crate::series::{Axis, Part, Quantity};
use std::ops::Range;

/// A body that turns faster than this (rad/s) in most poses of a reason is turning: five degrees a second.
const TURNING: f64 = 0.087;

/// A quantity beyond its range.
pub(super) fn deviation(
    stretch: &Stretch<'_>,
    quantity: Quantity,
    kind: ReasonKind,
    beyond: &Beyond,
    poses: &Range<usize>,
) -> String {
    let amount = beyond.amount;
    let (unit, factor) = quantity.unit().readable();
    let number = |value: f64| format!("{} {unit}", digits(value.abs() * factor));
    let end = match beyond.side.is_up() {
        true => beyond.trusted[1],
        false => beyond.trusted[0],
    };
    let label = quantity.label(stretch.named);
    match quantity {
        Quantity::Noise(_) => return noise(&label, unit, factor, beyond),
        Quantity::Velocity(_) if kind == ReasonKind::Backwards => {
            let usual = match end < 0.0 {
                true => format!("at most {}", number(end)),
                false => "never".to_owned(),
            };
            let seconds = poses.len() as f64 / stretch.hertz;
            return format!(
                "path runs backwards at {} for {} s (trusted: {usual})",
                number(amount),
                digits(seconds)
            );
        }
        _ => {}
    }
    let often = if beyond.side.is_of_window() {
        " most of the time"
    } else {
        ""
    };
    let context = match quantity {
        Quantity::Velocity(axis) | Quantity::Unexplained(axis) if axis != Axis::Yaw => {
            turning(stretch, poses)
        }
        _ => "",
    };
    let farther_out = beyond.side.is_up() == (amount > 0.0) && amount * end >= 0.0;
    let trusted = match farther_out {
        _ if end > 0.0 && !beyond.side.is_up() => format!("at least {}", number(end)),
        true => format!("at most {}", number(end)),
        false => format!(
            "{} to {} {unit}",
            digits(beyond.trusted[0] * factor),
            digits(beyond.trusted[1] * factor)
        ),
    };
    let side = side(quantity, amount, stretch.named);
    match quantity {
        Quantity::Sideslip if stretch.named => format!(
            "moves {} to the {} of where it points{often} (trusted: {trusted})",
            number(amount),
            if amount > 0.0 { "left" } else { "right" }
        ),
        Quantity::Climb if stretch.named => format!(
            "moves {} {} where it points{often} (trusted: {trusted})",
            number(amount),
            if amount > 0.0 { "above" } else { "below" }
        ),
        Quantity::Unexplained(axis) => format!(
            "{} differs by {}{side} from what the other axes say{context}{often} (trusted: {trusted})",
            Quantity::Velocity(axis).label(stretch.named),
            number(amount)
        ),
        _ => format!(
            "{label} {}{side}{context}{often} (trusted: {trusted})",
            number(amount)
        ),
    }
}

fn noise(label: &str, unit: &str, factor: f64, beyond: &Beyond) -> String {
    let number = |value: f64| format!("{} {unit}", digits(value * factor));
    let (amount, [least, most]) = (beyond.amount, beyond.trusted);
    if !beyond.side.is_up() {
        return format!(
            "{label} only {}, smoother than trusted (at least {})",
            number(amount),
            number(least)
        );
    }
    let times = amount / most.max(1e-9);
    match (2.0..1e4).contains(&times) {
        true => format!(
            "{label} {} times the trusted level ({}, trusted: at most {})",
            digits(times),
            number(amount),
            number(most)
        ),
        false => format!(
            "{label} {} (trusted: at most {})",
            number(amount),
            number(most)
        ),
    }
}

/// To which side a signed quantity points, where its sign has a name.
fn side(quantity: Quantity, amount: f64, named: bool) -> &'static str {
    let (Quantity::Velocity(axis) | Quantity::Unexplained(axis) | Quantity::Acceleration(axis)) =
        quantity
    else {
        return "";
    };
    match (axis, named, amount > 0.0) {
        (_, false, true) => "",
        (_, false, false) => " in the negative direction",
        (Axis::Forward, _, true) => "",
        (Axis::Forward, _, false) => " backward",
        (Axis::Left | Axis::Yaw, _, true) => " to the left",
        (Axis::Left | Axis::Yaw, _, false) => " to the right",
        (Axis::Up, _, true) => " upward",
        (Axis::Up, _, false) => " downward",
        (Axis::Roll, _, true) => " to the right",
        (Axis::Roll, _, false) => " to the left",
        (Axis::Pitch, _, true) => " nose down",
        (Axis::Pitch, _, false) => " nose up",
    }
}

/// Whether the body turns in most of `poses`.
fn turning(stretch: &Stretch<'_>, poses: &Range<usize>) -> &'static str {
    let yaw = stretch.motion.column(Quantity::Velocity(Axis::Yaw));
    let of = |is: &dyn Fn(f64) -> bool| {
        let all = yaw[poses.clone()].iter().flatten();
        10 * all.filter(|rate| is(**rate)).count() >= 7 * poses.len()
    };
    if !stretch.named {
        ""
    } else if of(&|rate| rate > TURNING) {
        " while turning left"
    } else if of(&|rate| rate < -TURNING) {
        " while turning right"
    } else {
        ""
    }
}

pub(super) fn repeats(
    axis: ReasonAxis,
    seconds: f64,
    scattered: bool,
    times: usize,
    trusted: f64,
) -> String {
    let what = match axis {
        ReasonAxis::Position => "position",
        ReasonAxis::Attitude => "attitude",
        _ => "pose",
    };
    let seconds = digits(seconds);
    let said = match scattered {
        true => format!("{what} repeats {times} times, for up to {seconds} s"),
        false => format!("{what} repeats for {seconds} s"),
    };
    format!("{said} (trusted: {})", at_most(trusted, "s"))
}

pub(super) fn steady(seconds: f64, trusted: f64) -> String {
    format!(
        "poses lie on one straight line at even steps for {} s, as interpolated ones do (trusted: {})",
        digits(seconds),
        at_most(trusted, "s")
    )
}

pub(super) fn between(share: f64, trusted: f64) -> String {
    format!(
        "{} % of poses lie half-way between their neighbours, as interpolated ones do (trusted: {})",
        digits(100.0 * share),
        at_most(100.0 * trusted, "%")
    )
}

pub(super) fn frozen(axis: Axis, seconds: f64, trusted: f64, named: bool) -> String {
    let letter = ["x", "y", "z"][axis as usize % 3];
    let what = match (axis, named) {
        (Axis::Up, true) => "height".to_owned(),
        (axis, true) if axis.is_turn() => axis.name().to_owned(),
        (axis, _) if axis.is_turn() => format!("the angle about {letter}"),
        _ => format!("the {letter} coordinate of the position"),
    };
    format!(
        "{what} does not change for {} s while the body moves (trusted: {})",
        digits(seconds),
        at_most(trusted, "s")
    )
}

pub(super) fn grid(metres: f64, trusted: f64) -> String {
    let metres = digits(metres);
    format!(
        "positions come in steps of {metres} m, as rounded ones do (trusted: {})",
        at_most(trusted, "m")
    )
}

pub(super) fn jump(part: Part, amount: f64, seconds: f64, trusted: f64) -> String {
    let degrees = amount.to_degrees();
    let seconds = digits(seconds);
    match part {
        Part::Position => format!(
            "position jumps {} m in {seconds} s (trusted: {})",
            digits(amount),
            at_most(trusted, "m")
        ),
        Part::Attitude => format!(
            "attitude jumps {} degrees in {seconds} s (trusted: {})",
            digits(degrees),
            at_most(trusted.to_degrees(), "degrees")
        ),
    }
}

fn at_most(value: f64, unit: &str) -> String {
    match value > 0.0 {
        true => format!("at most {} {unit}", digits(value)),
        false => "never".to_owned(),
    }
}

/// A number to two digits, whole from 10 on.
pub(super) fn digits(value: f64) -> String {
    let size = value.abs();
    if size < 5e-7 {
        return "0".to_owned();
    }
    let places = |size: f64| (1.0 - size.log10().floor()).clamp(0.0, 7.0) as usize;
    let unit = 10_f64.powi(places(size) as i32);
    // 0.0999 rounds to 0.10, 9.96 to 10.
    let rounded = (value * unit).round() / unit;
    format!("{rounded:.*}", places(rounded.abs()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reasons::deviation::Side;

    #[test]
    fn numbers_have_two_digits() {
        let cases = [
            (0.0, "0"),
            (1.04, "1.0"),
            (-0.1234, "-0.12"),
            (0.0999, "0.10"),
            (9.96, "10"),
            (12.3, "12"),
            (345.6, "346"),
            (0.000_012, "0.000012"),
        ];
        for (value, text) in cases {
            assert_eq!(digits(value), text);
        }
    }

    #[test]
    fn sentences() {
        let noise = |side, amount, trusted| {
            let beyond = Beyond {
                side,
                amount,
                trusted,
                strength: 2.0,
            };
            super::noise("roll rate noise", "deg/s", 1_f64.to_degrees(), &beyond)
        };
        assert_eq!(
            noise(Side::Above, 0.12, [0.0, 0.01]),
            "roll rate noise 12 times the trusted level (6.9 deg/s, trusted: at most 0.57 deg/s)"
        );
        assert_eq!(
            noise(Side::Below, 0.001, [0.01, 0.02]),
            "roll rate noise only 0.057 deg/s, smoother than trusted (at least 0.57 deg/s)"
        );
        assert_eq!(
            repeats(ReasonAxis::Position, 1.0, false, 10, 0.0),
            "position repeats for 1.0 s (trusted: never)"
        );
        assert_eq!(
            repeats(ReasonAxis::Pose, 0.1, true, 14, 0.0),
            "pose repeats 14 times, for up to 0.10 s (trusted: never)"
        );
        assert_eq!(
            frozen(Axis::Up, 9.6, 0.2, true),
            "height does not change for 9.6 s while the body moves (trusted: at most 0.20 s)"
        );
        assert_eq!(
            jump(Part::Position, 3.02, 0.1, 0.4),
            "position jumps 3.0 m in 0.10 s (trusted: at most 0.40 m)"
        );
    }
}
