//! One-class nearest neighbour: the distance to the nearest trusted row, columns in standard deviations.

/// The trusted rows.
pub struct Nearest {
    mean: Vec<f64>,
    deviation: Vec<f64>,
    rows: Vec<Vec<f64>>,
}

impl Nearest {
    /// Keeps `rows`, which are of one length.
    pub fn fit(rows: &[Vec<f64>]) -> Self {
        let columns = rows.first().map_or(0, Vec::len);
        let count = rows.len() as f64;
        let mean: Vec<f64> = (0..columns)
            .map(|c| rows.iter().map(|row| row[c]).sum::<f64>() / count)
            .collect();
        let deviation: Vec<f64> = (0..columns)
            .map(|c| {
                let squares = rows.iter().map(|row| (row[c] - mean[c]).powi(2));
                (squares.sum::<f64>() / count).sqrt().max(1e-9)
            })
            .collect();
        let mut nearest = Self {
            mean,
            deviation,
            rows: Vec::new(),
        };
        nearest.rows = rows.iter().map(|row| nearest.standardised(row)).collect();
        nearest
    }

    /// The distance; higher is more unusual.
    pub fn score(&self, row: &[f64]) -> f64 {
        let row = self.standardised(row);
        let distance = |other: &Vec<f64>| -> f64 {
            row.iter().zip(other).map(|(a, b)| (a - b) * (a - b)).sum()
        };
        let nearest = self.rows.iter().map(distance);
        nearest.fold(f64::INFINITY, f64::min).sqrt()
    }

    fn standardised(&self, row: &[f64]) -> Vec<f64> {
        let columns = row.iter().zip(&self.mean).zip(&self.deviation);
        columns
            .map(|((x, mean), deviation)| (x - mean) / deviation)
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::Nearest;

    #[test]
    fn distance_by_hand() {
        let nearest = Nearest::fit(&[vec![0.0, 10.0], vec![2.0, 30.0]]);
        // Deviations 1 and 10.
        assert!((nearest.score(&[0.0, 20.0]) - 1.0).abs() < 1e-12);
        assert!((nearest.score(&[3.0, 30.0]) - 1.0).abs() < 1e-12);
        assert_eq!(nearest.score(&[2.0, 30.0]), 0.0);
    }
}
