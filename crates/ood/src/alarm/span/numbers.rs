//! The numbers of a span.

use crate::error::{Error, expect_len};
use crate::statistics::twist::{Twist, halfway_into};
use crate::statistics::{AXES, CHANNELS};

/// Numbers of a span.
pub const SPAN_NUMBERS: usize = 3 * CHANNELS + 2;
/// The numbers, in the order of [`span_name`].
pub type SpanRow = [f64; SPAN_NUMBERS];
/// Fewest steps that have second differences with a median.
const FEWEST: usize = 5;
/// A difference below this, metres or radians, counts as this.
const FLOOR: f64 = 1e-5;
/// A body slower than this, metres a second, has no direction of motion.
const MOVING: f64 = 0.5;

/// Buffers of [`span_row`].
#[derive(Clone, Debug, Default)]
pub struct SpanWorkspace {
    twists: Vec<Twist>,
    sorted: Vec<f64>,
}

/// Name of a number: `change`, `rough` or `smooth` with an axis, `sideslip`, `climb`.
///
/// ```
/// use dose3_ood::alarm::{SPAN_NUMBERS, span_name};
///
/// assert_eq!(span_name(6), "rough.translation_x");
/// assert_eq!(span_name(SPAN_NUMBERS - 1), "climb");
/// ```
#[must_use]
pub fn span_name(number: usize) -> String {
    let kind = ["change", "rough", "smooth"].get(number / CHANNELS);
    match (kind, number % CHANNELS) {
        (Some(kind), axis) => format!("{kind}.{}", AXES[axis]),
        (None, 0) => "sideslip".to_owned(),
        (None, _) => "climb".to_owned(),
    }
}

/// Whether a number is a logarithm; the others are angles.
pub(super) fn is_logarithm(number: usize) -> bool {
    number < 3 * CHANNELS
}

/// Of the steps of a span, `[n, 6]` body-frame increments at `hertz`, by axis of their twists: the logarithm of the
/// largest difference between two steps that follow each other (`change`), of the median second difference (`rough`),
/// and the same with the other sign (`smooth`); the angle between the median step and the body's first axis, sideways
/// and upward, radians, 0 below 0.5 m/s (`sideslip`, `climb`).
///
/// # Errors
/// [`Error::Shape`] for fewer than five steps, [`Error::NotFinite`].
pub fn span_row(
    increments: &[f64],
    hertz: f64,
    work: &mut SpanWorkspace,
) -> Result<SpanRow, Error> {
    halfway_into(increments, &mut work.twists)?;
    let twists = &work.twists;
    if twists.len() < FEWEST {
        expect_len("steps of a span", FEWEST, twists.len())?;
    }
    let sorted = &mut work.sorted;
    let mut row = [0.0; SPAN_NUMBERS];
    let mut middle = [0.0; CHANNELS];
    for axis in 0..CHANNELS {
        let steps = twists.iter().map(|twist| twist[axis]);
        let differences = || twists.windows(2).map(|pair| pair[1][axis] - pair[0][axis]);
        let largest = differences().fold(0.0, |most: f64, x| most.max(x.abs()));
        let second = twists
            .windows(3)
            .map(|t| ((t[2][axis] - t[1][axis]) - (t[1][axis] - t[0][axis])).abs());
        let rough = (median(second, sorted) + FLOOR).ln();
        row[axis] = (largest + FLOOR).ln();
        row[CHANNELS + axis] = rough;
        row[2 * CHANNELS + axis] = -rough;
        middle[axis] = median(steps, sorted);
    }
    let [x, y, z, ..] = middle;
    if x.hypot(y).hypot(z) * hertz >= MOVING {
        row[3 * CHANNELS] = y.atan2(x).abs();
        row[3 * CHANNELS + 1] = z.atan2(x).abs();
    }
    Ok(row)
}

/// The middle value, the mean of the two middle ones of an even number.
fn median(values: impl Iterator<Item = f64>, sorted: &mut Vec<f64>) -> f64 {
    sorted.clear();
    sorted.extend(values);
    sorted.sort_unstable_by(f64::total_cmp);
    let middle = sorted.len() / 2;
    match sorted.len() % 2 {
        1 => sorted[middle],
        _ => f64::midpoint(sorted[middle - 1], sorted[middle]),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(steps: &[[f64; 6]]) -> SpanRow {
        span_row(&steps.concat(), 10.0, &mut SpanWorkspace::default()).unwrap()
    }

    #[test]
    fn numbers_by_hand() {
        let mut steps = [[1.0, 0.0, 0.0, 0.0, 0.0, 0.0]; 8];
        steps[5][0] = 1.5;
        let found = row(&steps);
        assert_eq!(found[0], (0.5 + FLOOR).ln());
        // Of the six second differences three are not 0.
        assert_eq!(found[6], (0.25 + FLOOR).ln());
        assert_eq!(found[7], FLOOR.ln());
        assert_eq!(found[12], -found[6]);
        assert_eq!(found[18..], [0.0, 0.0]);
        let back = row(&[[-1.0, 0.1, 0.0, 0.0, 0.0, 0.0]; 8]);
        assert!((back[18] - (std::f64::consts::PI - 0.1_f64.atan())).abs() < 1e-12);
        // Slower than it is said to move.
        assert_eq!(
            row(&[[-0.04, 0.0, 0.0, 0.0, 0.0, 0.0]; 8])[18..],
            [0.0, 0.0]
        );
    }

    #[test]
    fn bad_spans_are_errors() {
        let mut work = SpanWorkspace::default();
        assert!(span_row(&[0.0; 24], 10.0, &mut work).is_err());
        assert!(span_row(&[0.0; 31], 10.0, &mut work).is_err());
        assert!(span_row(&[f64::NAN; 48], 10.0, &mut work).is_err());
        let large = span_row(&[1e200; 48], 10.0, &mut work).unwrap();
        assert!(large.iter().all(|x| x.is_finite()));
    }

    #[test]
    fn names_are_those_of_the_numbers() {
        let names: Vec<String> = (0..SPAN_NUMBERS).map(span_name).collect();
        assert_eq!(names[0], "change.translation_x");
        assert_eq!(names[17], "smooth.rotation_z");
        assert_eq!(names[18], "sideslip");
        assert!(is_logarithm(17) && !is_logarithm(18));
    }
}
