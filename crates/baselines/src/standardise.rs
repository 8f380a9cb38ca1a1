use serde::{Deserialize, Serialize};

use crate::{Error, Sequences};

/// Per channel, the mean and the standard deviation of the training windows.
///
/// Not the `Standardizer` of `dose3-ood`: there a column is a statistic, and one that never varied makes any other
/// value far out. Here a constant channel keeps its unit, so that rounding is not blown up in front of a network.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Standardizer {
    /// Mean of each channel over all windows and poses.
    pub mean: Vec<f64>,
    /// Standard deviation of each channel; 1 for a channel that is constant.
    pub scale: Vec<f64>,
}

impl Standardizer {
    /// Measures the training windows.
    ///
    /// # Errors
    /// Windows that do not pass [`Sequences::check`], or none.
    pub fn fit(data: &Sequences<'_>) -> Result<Self, Error> {
        data.check_training()?;
        let count = (data.data.len() / data.channels) as f64;
        let poses = || data.data.chunks_exact(data.channels);
        let mut mean = vec![0.0; data.channels];
        for pose in poses() {
            for (sum, &value) in mean.iter_mut().zip(pose) {
                *sum += f64::from(value);
            }
        }
        mean.iter_mut().for_each(|sum| *sum /= count);
        let mut square = vec![0.0; data.channels];
        for pose in poses() {
            for ((sum, &value), mean) in square.iter_mut().zip(pose).zip(&mean) {
                *sum += (f64::from(value) - mean).powi(2);
            }
        }
        let deviations = square.iter().map(|sum| (sum / count).sqrt());
        // A channel whose spread is f32 rounding of its mean is constant.
        let scale = deviations
            .zip(&mean)
            .map(|(sd, mean)| {
                if sd > 1e-6 * mean.abs() && sd > 1e-12 {
                    sd
                } else {
                    1.0
                }
            })
            .collect();
        Ok(Self { mean, scale })
    }

    /// Appends one standardised window to `out`.
    pub(crate) fn extend(&self, out: &mut Vec<f32>, window: &[f32]) {
        for pose in window.chunks_exact(self.mean.len()) {
            for ((&value, mean), scale) in pose.iter().zip(&self.mean).zip(&self.scale) {
                out.push(((f64::from(value) - mean) / scale) as f32);
            }
        }
    }

    /// Sum of the log scales, by which a density over standardised poses exceeds the one in the caller's units.
    pub(crate) fn log_volume(&self) -> f64 {
        self.scale.iter().map(|scale| scale.ln()).sum()
    }

    /// Takes standardised numbers back to the caller's units.
    pub(crate) fn restore(&self, data: &mut [f32]) {
        for pose in data.chunks_exact_mut(self.mean.len()) {
            for ((value, mean), scale) in pose.iter_mut().zip(&self.mean).zip(&self.scale) {
                *value = (f64::from(*value) * scale + mean) as f32;
            }
        }
    }

    pub(crate) fn check(&self, channels: usize) -> Result<(), Error> {
        let sound = self.mean.len() == channels
            && self.scale.len() == channels
            && self.mean.iter().all(|mean| mean.is_finite())
            && self
                .scale
                .iter()
                .all(|scale| scale.is_finite() && *scale > 0.0);
        if sound {
            Ok(())
        } else {
            Err(Error::Header(
                "standardisation constants are not valid".to_owned(),
            ))
        }
    }
}
