//! Raw moments of the poses: what the paper's 24 numbers would be if the poses themselves took the
//! place of the noise estimate and the pose index that of the diffusion step. A baseline: a network
//! is judged by what it adds to this.

use super::Column;
use crate::error::{Error, expect_len};

/// A represented window without its noise.
#[derive(Clone, Copy, Debug)]
pub struct PoseWindow<'a> {
    /// `[length, 3]`: translations as represented.
    pub translation: &'a [f32],
    /// `[length, 3]`: log of the rotations as represented (radians).
    pub tangent: &'a [f32],
}

const PARTS: [&str; 4] = ["translation", "rotation_x", "rotation_y", "rotation_z"];

pub(super) fn columns() -> Vec<Column> {
    let mut columns = Vec::new();
    for part in PARTS {
        for quantity in ["pose", "dpose"] {
            for power in 1..=3 {
                let name = format!("{part}.mean_{quantity}^{power}");
                columns.push(Column { part, name });
            }
        }
    }
    columns
}

pub(super) fn values(window: &PoseWindow<'_>, out: &mut Vec<f64>) -> Result<(), Error> {
    let length = window.translation.len() / 3;
    expect_len(
        "translations of a window",
        length * 3,
        window.translation.len(),
    )?;
    expect_len("tangents of a window", length * 3, window.tangent.len())?;
    if length < 2 {
        return Err(Error::TooFew {
            what: "poses of a window",
            needed: 2,
            found: length,
            hint: "differences need two poses",
        });
    }
    let translation: [Vec<f64>; 3] = [0, 1, 2].map(|axis| column(window.translation, axis));
    push_moments(out, &translation);
    for axis in 0..3 {
        push_moments(out, &[column(window.tangent, axis)]);
    }
    Ok(())
}

fn column(values: &[f32], axis: usize) -> Vec<f64> {
    let column = values.iter().skip(axis).step_by(3);
    column.map(|&v| f64::from(v)).collect()
}

/// Means of x, x^2, x^3, then of the differences along each column, pooled over the columns.
fn push_moments(out: &mut Vec<f64>, columns: &[Vec<f64>]) {
    let differences: Vec<Vec<f64>> = columns
        .iter()
        .map(|c| c.windows(2).map(|w| w[1] - w[0]).collect())
        .collect();
    for pooled in [columns, &differences] {
        let count = pooled.iter().map(Vec::len).sum::<usize>() as f64;
        for power in 1..=3 {
            let sum: f64 = pooled.iter().flatten().map(|x| x.powi(power)).sum();
            out.push(sum / count);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn moments_by_hand() {
        // x runs 0, 1, 3; y and z stand still at 1 and 0.
        let translation = [0.0, 1.0, 0.0, 1.0, 1.0, 0.0, 3.0, 1.0, 0.0];
        let tangent = [0.1, 0.0, 0.0, 0.2, 0.0, 0.0, 0.3, 0.0, 0.5];
        let mut out = Vec::new();
        let window = PoseWindow {
            translation: &translation,
            tangent: &tangent,
        };
        values(&window, &mut out).unwrap();
        assert_eq!(out.len(), columns().len());
        let near = |index: usize, value: f64| assert!((out[index] - value).abs() < 1e-7, "{index}");
        near(0, 7.0 / 9.0);
        near(1, 13.0 / 9.0);
        near(2, 31.0 / 9.0);
        near(3, 3.0 / 6.0);
        near(4, 5.0 / 6.0);
        near(5, 9.0 / 6.0);
        near(6, 0.2);
        near(9, 0.1);
        near(18, 0.5 / 3.0);
        near(22, 0.125);
    }

    #[test]
    fn bad_shapes_are_errors() {
        let mut out = Vec::new();
        for (translation, tangent) in [(7, 6), (6, 3), (3, 3), (0, 0)] {
            let window = PoseWindow {
                translation: &[0.0; 9][..translation],
                tangent: &[0.0; 9][..tangent],
            };
            assert!(values(&window, &mut out).is_err());
        }
    }
}
