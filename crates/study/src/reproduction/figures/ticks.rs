//! Round numbers along an axis.

use std::ops::Range;

/// Multiples of 1, 2 or 5 times a power of ten within `range`, about `count` of them; none for an empty or
/// infinite range.
pub fn ticks(range: &Range<f64>, count: usize) -> Vec<f64> {
    let Some(step) = step(range, count) else {
        return Vec::new();
    };
    let first = (range.start / step - 1e-9).ceil() as i64;
    let last = (range.end / step + 1e-9).floor() as i64;
    (first..=last).map(|i| i as f64 * step).collect()
}

/// The ticks as text, all with as many decimals as their step needs.
pub fn labels(ticks: &[f64]) -> Vec<String> {
    let step = match ticks {
        [first, second, ..] => second - first,
        _ => 1.0,
    };
    let decimals = (-step.log10() - 1e-9).ceil().clamp(0.0, 9.0) as usize;
    ticks
        .iter()
        .map(|tick| {
            // Adding zero turns -0 into 0.
            let text = format!("{:.decimals$}", tick + 0.0);
            text.replace('-', "\u{2212}")
        })
        .collect()
}

fn step(range: &Range<f64>, count: usize) -> Option<f64> {
    let width = range.end - range.start;
    if !(width.is_finite() && width > 0.0) {
        return None;
    }
    let rough = width / count.max(1) as f64;
    let power = 10f64.powf(rough.log10().floor());
    [1.0, 2.0, 5.0, 10.0]
        .into_iter()
        .map(|factor| factor * power)
        .find(|step| *step >= rough * (1.0 - 1e-9))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_by_hand() {
        let text = |range, count| labels(&ticks(&range, count)).join(" ");
        assert_eq!(text(0.0..1.0, 5), "0.0 0.2 0.4 0.6 0.8 1.0");
        assert_eq!(text(-3.0..3.0, 6), "−3 −2 −1 0 1 2 3");
        assert_eq!(text(-130.0..270.0, 4), "−100 0 100 200");
        assert_eq!(text(0.31..0.36, 3), "0.32 0.34 0.36");
        assert_eq!(text(1.0..1.0, 3), "");
        assert_eq!(text(0.0..f64::INFINITY, 3), "");
    }
}
