//! Positions that were rounded lie on a grid.

use dose3_lie::Pose;

/// Poses that are looked at together.
pub(crate) const GRID_SPAN: usize = 48;
/// Poses from such a span to the next.
pub(crate) const GRID_STEP: usize = 16;
/// Coordinates closer than this (metres) are one: rounding of f64.
const SAME: f64 = 1e-9;
/// A grid is seen where a coordinate takes at least so many values.
const FEWEST: usize = 8;
/// Gaps are multiples of the smallest to this share of it.
const MULTIPLE: f64 = 0.01;

/// The coarsest grid that a coordinate of all these positions lies on, metres; 0 for none. By chance eight
/// positions do so once in 10^10.
pub(crate) fn grid(poses: &[Pose]) -> f64 {
    let of = |axis: usize| {
        let mut values: Vec<f64> = poses.iter().map(|p| p.translation[axis]).collect();
        values.sort_by(f64::total_cmp);
        values.dedup_by(|a, b| (*a - *b).abs() < SAME);
        if values.len() < FEWEST {
            return 0.0;
        }
        let gaps = || values.windows(2).map(|pair| pair[1] - pair[0]);
        let smallest = gaps().fold(f64::INFINITY, f64::min);
        let whole = |gap: f64| {
            let times = gap / smallest;
            (times - times.round()).abs() < MULTIPLE
        };
        if gaps().all(whole) { smallest } else { 0.0 }
    };
    (0..3).map(of).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;
    use dose3_lie::{Rotation, Vector};

    #[test]
    fn rounded_positions_lie_on_a_grid_and_others_do_not() {
        let at = |i: usize| 1000.0 + 1.3 * i as f64 + (i as f64).sin();
        let poses = |round: f64| -> Vec<Pose> {
            let near = |x: f64| {
                if round > 0.0 {
                    (x / round).round() * round
                } else {
                    x
                }
            };
            (0..48)
                .map(|i| Pose::new(Rotation::identity(), Vector::new(near(at(i)), 0.0, 5.0)))
                .collect()
        };
        assert!((grid(&poses(0.25)) - 0.25).abs() < 1e-9);
        assert!((grid(&poses(0.001)) / 0.001).fract() < 1e-3);
        assert_eq!(grid(&poses(0.0)), 0.0);
        assert_eq!(grid(&poses(0.0)[..3]), 0.0);
    }
}
