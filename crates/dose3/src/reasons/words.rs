//! Deviations as sentences.

use super::deviation::{Deviation, Side};
use crate::series::{Axis, Part, Quantity};

/// In plain words, with amount, unit and trusted range.
pub(super) fn sentence(found: &Deviation, named_axes: bool) -> String {
    let (unit, factor) = found.quantity.unit().readable();
    let number = |value: f64| digits(value * factor);
    let amount = number(found.amount);
    let letter = |axis: Axis| ["x", "y", "z"][axis as usize % 3];
    match found.quantity {
        Quantity::Repeats(Part::Position) => {
            format!(
                "position repeats for {amount} s{}",
                at_most(found, 1.0, "s")
            )
        }
        Quantity::Repeats(Part::Attitude) => {
            format!(
                "attitude repeats for {amount} s{}",
                at_most(found, 1.0, "s")
            )
        }
        Quantity::Steady => format!(
            "poses lie on a straight line for {amount} s, as interpolated ones do{}",
            at_most(found, 1.0, "s")
        ),
        Quantity::Frozen(axis) => {
            let what = match (axis, named_axes) {
                (Axis::Up, true) => "height".to_owned(),
                (axis, true) if axis.is_turn() => axis.name().to_owned(),
                (axis, _) if axis.is_turn() => format!("the angle about {}", letter(axis)),
                (axis, _) => format!("the {} coordinate", letter(axis)),
            };
            format!(
                "{what} does not change for {amount} s{}",
                at_most(found, 1.0, "s")
            )
        }
        Quantity::Noise(_) => {
            let label = found.quantity.label(named_axes);
            let usual = match found.side {
                Side::Low | Side::Below => found.trusted[0],
                Side::High | Side::Above => found.trusted[1],
            };
            let times = found.amount / usual.max(f64::MIN_POSITIVE);
            match found.side {
                Side::Low | Side::Below => format!(
                    "{label} {amount} {unit}, smoother than trusted (at least {} {unit})",
                    number(usual)
                ),
                _ if (2.0..1e4).contains(&times) => format!(
                    "{label} {amount} {unit}, {} times the trusted level (at most {} {unit})",
                    digits(times),
                    number(usual)
                ),
                _ => format!(
                    "{label} {amount} {unit} (trusted: at most {} {unit})",
                    number(usual)
                ),
            }
        }
        quantity => {
            let label = quantity.label(named_axes);
            let usually = match found.side {
                Side::High | Side::Low => "",
                Side::Above | Side::Below => " most of the time",
            };
            format!(
                "{label} {amount} {unit}{usually} (trusted: {} to {} {unit})",
                number(found.trusted[0]),
                number(found.trusted[1])
            )
        }
    }
}

fn at_most(found: &Deviation, factor: f64, unit: &str) -> String {
    match found.trusted[1] * factor {
        most if most > 0.0 => format!(" (trusted: at most {} {unit})", digits(most)),
        _ => " (trusted: never)".to_owned(),
    }
}

/// A number to two digits, three where it is 100 or more.
fn digits(value: f64) -> String {
    let size = value.abs();
    if size < 5e-7 {
        return "0".to_owned();
    }
    let places = (1.0 - size.log10().floor()).clamp(0.0, 7.0) as usize;
    let text = format!("{value:.places$}");
    // 0.0999 rounds to 0.100.
    match text
        .trim_start_matches('-')
        .trim_start_matches("0.")
        .trim_start_matches('0')
        .len()
    {
        3 if size < 1.0 => format!("{value:.*}", places - 1),
        _ => text,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_two_digits() {
        let cases = [
            (0.0, "0"),
            (1.04, "1.0"),
            (-0.1234, "-0.12"),
            (0.0999, "0.10"),
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
        let of = |quantity, side, amount, trusted| {
            let found = Deviation {
                quantity,
                side,
                amount,
                trusted,
                strength: 2.0,
                poses: 0..1,
            };
            sentence(&found, true)
        };
        assert_eq!(
            of(
                Quantity::Velocity(Axis::Left),
                Side::High,
                1.0,
                [-0.12, 0.1]
            ),
            "sideways speed 1.0 m/s (trusted: -0.12 to 0.10 m/s)"
        );
        assert_eq!(
            of(Quantity::Noise(Axis::Roll), Side::High, 0.12, [0.0, 0.01]),
            "roll rate noise 6.9 deg/s, 12 times the trusted level (at most 0.57 deg/s)"
        );
        assert_eq!(
            of(
                Quantity::Repeats(Part::Position),
                Side::High,
                1.0,
                [0.0, 0.0]
            ),
            "position repeats for 1.0 s (trusted: never)"
        );
        assert_eq!(
            of(Quantity::Frozen(Axis::Up), Side::High, 9.6, [0.0, 0.2]),
            "height does not change for 9.6 s (trusted: at most 0.20 s)"
        );
    }
}
