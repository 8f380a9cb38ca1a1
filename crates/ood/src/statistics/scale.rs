//! How far each axis moves in trusted logs, whatever single jumps they hold.

use super::quantile_sorted;
use super::trace::CHANNELS;
use super::twist::Twist;

/// Share of an axis' values below the size that larger ones are taken as when its scale is measured.
const WINSORISED: f64 = 0.995;
/// An axis that hardly moves in the trusted logs (metres or radians per pose) is scaled by this.
pub(super) const SCALE_FLOOR: f64 = 1e-5;

/// Root mean square of each axis over all steps, values beyond their .995 quantile taken as that quantile; at least
/// 1e-5 metres or radians, and 1 for no steps at all.
pub fn axis_scale(stretches: &[Vec<Twist>]) -> [f64; CHANNELS] {
    if stretches.iter().all(Vec::is_empty) {
        return [1.0; CHANNELS];
    }
    std::array::from_fn(|axis| winsorised(stretches.iter().flatten().map(|t| t[axis])))
}

/// Root mean square of `values`, those beyond the .995 quantile of their size taken as that.
pub(super) fn winsorised(values: impl Iterator<Item = f64>) -> f64 {
    let mut sizes: Vec<f64> = values.map(f64::abs).collect();
    if sizes.is_empty() {
        return SCALE_FLOOR;
    }
    sizes.sort_by(f64::total_cmp);
    let most = quantile_sorted(&sizes, WINSORISED);
    // Divided by the largest first: squares of large numbers overflow.
    let unit = most.max(SCALE_FLOOR);
    let squares = sizes.iter().map(|x| (x.min(most) / unit).powi(2));
    let mean = squares.sum::<f64>() / sizes.len() as f64;
    (unit * mean.sqrt()).max(SCALE_FLOOR)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn single_jumps_do_not_decide() {
        let mut steps: Vec<Twist> = (0..1000)
            .map(|t| {
                [
                    if t % 2 == 0 { 1.0 } else { -1.0 },
                    0.1,
                    0.0,
                    0.0,
                    0.0,
                    0.02,
                ]
            })
            .collect();
        steps[500][0] = 1e6;
        let scale = axis_scale(&[steps]);
        assert!((scale[0] - 1.0).abs() < 1e-9 && (scale[1] - 0.1).abs() < 1e-9);
        assert_eq!(scale[2], SCALE_FLOOR);
        assert_eq!(axis_scale(&[]), [1.0; CHANNELS]);
    }
}
