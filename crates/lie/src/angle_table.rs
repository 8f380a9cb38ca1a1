//! A cumulative distribution over an interval `[0, upper]` of angles, tabulated from a density.

/// Number of equal cells of a table.
const CELLS: usize = 1024;

/// Abscissas in `[0, 1]` and weights of the 4-point Gauss-Legendre rule, exact up to degree 7.
const GAUSS_LEGENDRE: [(f64, f64); 4] = [
    (0.069_431_844_202_973_71, 0.173_927_422_568_726_93),
    (0.330_009_478_207_571_87, 0.326_072_577_431_273_07),
    (0.669_990_521_792_428_1, 0.326_072_577_431_273_07),
    (0.930_568_155_797_026_3, 0.173_927_422_568_726_93),
];

/// Cumulative probability and density at the nodes; between them the cubic that meets both at either end.
#[derive(Clone, Debug)]
pub(crate) struct AngleTable {
    upper: f64,
    /// Cumulative probability at the nodes, from 0 to exactly 1.
    cumulative: Vec<f64>,
    /// Density at the nodes times the width of a cell: the slope of `cumulative` per cell.
    slope: Vec<f64>,
}

impl AngleTable {
    /// Tabulates `density`, which must hold all but a negligible part of its mass in `[0, upper]`.
    pub(crate) fn new(upper: f64, density: impl Fn(f64) -> f64) -> Self {
        let width = upper / CELLS as f64;
        let mut cumulative = vec![0.0];
        let mut total = 0.0;
        for cell in 0..CELLS {
            let mean: f64 = GAUSS_LEGENDRE
                .iter()
                .map(|(x, weight)| weight * density(width * (cell as f64 + x)))
                .sum();
            total += width * mean;
            cumulative.push(total);
        }
        cumulative.iter_mut().for_each(|value| *value /= total);
        let slope = (0..=CELLS)
            .map(|node| width * density(width * node as f64) / total)
            .collect();
        Self {
            upper,
            cumulative,
            slope,
        }
    }

    /// Probability of an angle at most `angle`.
    pub(crate) fn cdf(&self, angle: f64) -> f64 {
        if angle <= 0.0 {
            return 0.0;
        }
        if angle >= self.upper {
            return 1.0;
        }
        let position = angle / self.upper * CELLS as f64;
        let cell = (position as usize).min(CELLS - 1);
        self.cubic(cell, position - cell as f64).0
    }

    /// Angle at which [`Self::cdf`] reaches `probability` in `[0, 1]`.
    pub(crate) fn quantile(&self, probability: f64) -> f64 {
        let above = self
            .cumulative
            .partition_point(|&value| value <= probability);
        let cell = above.clamp(1, CELLS) - 1;
        self.upper * (cell as f64 + self.invert_cubic(cell, probability)) / CELLS as f64
    }

    /// Value and slope, per cell, of the interpolating cubic at fraction `x` of a cell.
    fn cubic(&self, cell: usize, x: f64) -> (f64, f64) {
        let (start, end) = (self.cumulative[cell], self.cumulative[cell + 1]);
        let (rise, left, right) = (end - start, self.slope[cell], self.slope[cell + 1]);
        let square = 3.0 * rise - 2.0 * left - right;
        let cube = left + right - 2.0 * rise;
        (
            start + x * (left + x * (square + x * cube)),
            left + x * (2.0 * square + 3.0 * x * cube),
        )
    }

    /// Fraction of the cell at which the cubic takes the value `probability`: Newton's method kept inside a
    /// bracket that bisection shrinks.
    fn invert_cubic(&self, cell: usize, probability: f64) -> f64 {
        if probability <= self.cumulative[cell] {
            return 0.0;
        }
        if probability >= self.cumulative[cell + 1] {
            return 1.0;
        }
        let (mut low, mut high) = (0.0, 1.0);
        let mut x = 0.5;
        for _ in 0..64 {
            let (value, slope) = self.cubic(cell, x);
            if value < probability {
                low = x;
            } else {
                high = x;
            }
            let newton = x - (value - probability) / slope;
            // The ends belong to the bracket: a Newton step of zero means that x is the root.
            let next = if (low..=high).contains(&newton) {
                newton
            } else {
                0.5 * (low + high)
            };
            let step = (next - x).abs();
            x = next;
            // Newton's next step would be of the order of the square of this one.
            if step < 1e-9 {
                break;
            }
        }
        x
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quadrature_weights() {
        for power in 0..8 {
            let sum: f64 = GAUSS_LEGENDRE
                .iter()
                .map(|(x, weight)| weight * x.powi(power))
                .sum();
            assert!(
                (sum * f64::from(power + 1) - 1.0).abs() < 1e-15,
                "degree {power}"
            );
        }
    }

    /// The density 3 x^2 on [0, 1] has the cdf x^3, which the cubics reproduce exactly.
    #[test]
    fn cubic_distribution() {
        let table = AngleTable::new(1.0, |x| 3.0 * x * x);
        for probability in [0.0, 1e-12, 1e-6, 0.1, 0.5, 0.999, 1.0] {
            let angle = table.quantile(probability);
            assert!(
                (angle - f64::cbrt(probability)).abs() < 1e-12,
                "{probability}"
            );
            assert!(
                (table.cdf(angle) - probability).abs() < 1e-14,
                "{probability}"
            );
        }
        assert_eq!(table.cdf(-1.0), 0.0);
        assert_eq!(table.cdf(2.0), 1.0);
    }
}
