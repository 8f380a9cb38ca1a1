//! Which poses of a window are unlike the trusted ones.
//!
//! A window's score says that something is wrong among its poses; a user wants to know where. Every pose
//! gets numbers from the same forward passes and the same increments as the statistics: per axis the log
//! denoising error in each noise band, smoothed over five poses, the log size of the first and second difference of
//! the increment that leads to it, and that of what a linear prediction from the other axes leaves of it. Each number is measured from its trusted mean, in units of
//! what one trusted pose in a thousand reaches, because some of them have far heavier tails than others; the
//! pose's score is the largest of them.

use crate::error::{Error, expect_finite, expect_len};
use crate::score::Score;
use crate::statistics::{
    BANDS, CHANNELS, JOINT_POSE_NUMBERS, Sample, TraceSummary, quantile_sorted,
};
use serde::{Deserialize, Serialize};

/// Weights of the smoothing over poses; one draw's error of a single pose is mostly chance.
const KERNEL: [f64; 5] = [1.0, 2.0, 3.0, 2.0, 1.0];
/// A squared denoising error below this counts as this.
const SQUARE_FLOOR: f64 = 1e-9;
/// A difference or a residual (metres or radians per pose) below this counts as this.
const DIFFERENCE_FLOOR: f64 = 1e-5;
/// Share of the trusted poses below the pose threshold.
const TRUSTED_SHARE: f64 = 0.999;
/// A number that hardly varies among trusted poses reaches at least this far.
const SMALLEST_REACH: f64 = 1e-3;

/// What trusted poses look like.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PoseReference {
    /// Mean of each number over trusted poses.
    mean: Vec<f64>,
    /// How far above it one trusted pose in a thousand is.
    reach: Vec<f64>,
    /// Trusted poses beyond it: one in a thousand.
    threshold: Score,
}

/// The numbers of every pose of a window but the first, which no increment leads to: differences; behind them, where
/// the sample has a linear predictor, what its two models leave over; where the joint network or traces are known, the
/// denoising errors.
///
/// # Errors
/// [`Error::MissingInput`] without increments; [`Error::Shape`] where trace and increments disagree.
pub fn pose_numbers(sample: &Sample<'_>) -> Result<Vec<Vec<f64>>, Error> {
    let increments = sample.increments.unwrap_or_default();
    let steps = increments.len() / CHANNELS;
    expect_len("body-frame increments", steps * CHANNELS, increments.len())?;
    let mut rows = differences(increments);
    if let Some(predictor) = sample.linear {
        let log = |x: &f64| x.abs().max(DIFFERENCE_FLOOR).ln();
        for (row, left) in rows.iter_mut().zip(predictor.residuals(increments)?) {
            row.extend(left.iter().flatten().map(log));
        }
    }
    if let Some(joint) = sample.joint {
        expect_len("increments that the joint network saw", steps, joint.len())?;
        for (row, squares) in rows.iter_mut().zip(smoothed(&joint.of_poses())) {
            row.extend(squares.iter().map(|x| x.max(SQUARE_FLOOR).ln()));
        }
    }
    let mut errors: Vec<Vec<f64>> = Vec::new();
    for trace in sample.traces {
        let of_draw = smoothed_errors(trace, steps)?;
        match errors.is_empty() {
            true => errors = of_draw,
            false => errors
                .iter_mut()
                .flatten()
                .zip(of_draw.iter().flatten())
                .for_each(|(sum, x)| *sum += x),
        }
    }
    let draws = sample.traces.len().max(1) as f64;
    for (row, errors) in rows.iter_mut().zip(errors) {
        row.extend(errors.iter().map(|x| (x / draws).max(SQUARE_FLOOR).ln()));
    }
    Ok(rows)
}

/// Log first and second differences: a bad pose shows in the steps into it and out of it.
fn differences(increments: &[f64]) -> Vec<Vec<f64>> {
    let step: Vec<&[f64]> = increments.chunks_exact(CHANNELS).collect();
    let difference = |i: usize, axis: usize| match (i.checked_sub(1), step.get(i)) {
        (Some(before), Some(now)) => now[axis] - step[before][axis],
        _ => 0.0,
    };
    let log = |x: f64| x.abs().max(DIFFERENCE_FLOOR).ln();
    (0..step.len())
        .map(|i| {
            // The first step has no step before it; the difference to the next one stands in.
            let at = i.max(1);
            (0..CHANNELS)
                .flat_map(|axis| {
                    let first = difference(at, axis);
                    let next = if i + 1 < step.len() {
                        difference(i + 1, axis)
                    } else {
                        first
                    };
                    [log(first), log(next - first)]
                })
                .collect()
        })
        .collect()
}

/// Each row averaged with its neighbours.
fn smoothed(rows: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let half = KERNEL.len() / 2;
    let of = |i: usize| {
        let near = i.saturating_sub(half)..(i + half + 1).min(rows.len());
        let mut sum = vec![0.0; rows[i].len()];
        let mut total = 0.0;
        for j in near {
            let weight = KERNEL[j + half - i];
            total += weight;
            let row = sum.iter_mut().zip(&rows[j]);
            row.for_each(|(sum, x)| *sum += weight * x);
        }
        sum.iter_mut().for_each(|x| *x /= total);
        sum
    };
    (0..rows.len()).map(of).collect()
}

/// `[steps][bands * channels]`, for the last `steps` elements of the trace.
fn smoothed_errors(trace: &TraceSummary, steps: usize) -> Result<Vec<Vec<f64>>, Error> {
    if trace.pose_residual.is_empty() {
        return Ok(vec![Vec::new(); steps]);
    }
    expect_len("noise bands of a trace", BANDS, trace.pose_residual.len())?;
    let Some(skipped) = trace.length.checked_sub(steps) else {
        return expect_len("elements of the trace", steps, trace.length).map(|()| Vec::new());
    };
    let half = KERNEL.len() / 2;
    Ok((skipped..trace.length)
        .map(|i| {
            let near = i.saturating_sub(half)..(i + half + 1).min(trace.length);
            let weight = |j: usize| KERNEL[j + half - i];
            let total: f64 = near.clone().map(weight).sum();
            let band = |errors: &Vec<[f32; CHANNELS]>| {
                let mut sum = [0.0; CHANNELS];
                for j in near.clone() {
                    for (sum, error) in sum.iter_mut().zip(errors[j]) {
                        *sum += weight(j) * f64::from(error) / total;
                    }
                }
                sum
            };
            trace.pose_residual.iter().flat_map(band).collect()
        })
        .collect())
}

impl PoseReference {
    /// From the [`pose_numbers`] of trusted poses.
    ///
    /// # Errors
    /// [`Error::TooFew`] for fewer than two poses, [`Error::Shape`] and [`Error::NotFinite`] for bad rows.
    pub fn fit(rows: &[Vec<f64>]) -> Result<Self, Error> {
        let Some(first) = rows.first().filter(|_| rows.len() > 1) else {
            return Err(Error::TooFew {
                what: "trusted poses",
                needed: 2,
                found: rows.len(),
                hint: "a spread needs two poses",
            });
        };
        for row in rows {
            expect_len("numbers of a pose", first.len(), row.len())?;
            expect_finite("numbers of a pose", row)?;
        }
        let (mean, reach) = (0..first.len())
            .map(|column| {
                let mut values: Vec<f64> = rows.iter().map(|row| row[column]).collect();
                values.sort_by(f64::total_cmp);
                let mean = values.iter().sum::<f64>() / values.len() as f64;
                let reach = quantile_sorted(&values, TRUSTED_SHARE) - mean;
                (mean, reach.max(SMALLEST_REACH))
            })
            .unzip();
        let mut reference = Self {
            mean,
            reach,
            threshold: Score::new(0.0),
        };
        let scores: Result<Vec<Score>, Error> = rows.iter().map(|r| reference.score(r)).collect();
        let mut scores: Vec<f64> = scores?.iter().map(|s| s.value()).collect();
        scores.sort_by(f64::total_cmp);
        reference.threshold = Score::new(quantile_sorted(&scores, TRUSTED_SHARE));
        Ok(reference)
    }

    /// One in a thousand trusted poses is beyond it.
    #[must_use]
    pub fn threshold(&self) -> Score {
        self.threshold
    }

    /// By how much the most unusual number of a pose is too high: 1 is what one trusted pose in a thousand
    /// reaches in that number.
    ///
    /// # Errors
    /// [`Error::Shape`] for another number of numbers, [`Error::NotFinite`].
    pub fn score(&self, row: &[f64]) -> Result<Score, Error> {
        expect_len("numbers of a pose", self.mean.len(), row.len())?;
        expect_finite("numbers of a pose", row)?;
        let columns = row.iter().zip(&self.mean).zip(&self.reach);
        let largest = columns
            .map(|((x, mean), reach)| (x - mean) / reach)
            .fold(0.0, f64::max);
        Ok(Score::new(largest))
    }

    /// Checks what a file may have brought in.
    ///
    /// # Errors
    /// [`Error::Shape`], [`Error::NotFinite`], [`Error::Inconsistent`].
    pub fn validate(&self) -> Result<(), Error> {
        let columns = self.mean.len();
        expect_len("reaches of a pose reference", columns, self.reach.len())?;
        expect_finite("means of a pose reference", &self.mean)?;
        expect_finite("reaches of a pose reference", &self.reach)?;
        // Differences of two orders, residuals of two models, denoising errors: see `pose_numbers`.
        let joint = JOINT_POSE_NUMBERS / CHANNELS;
        let known = [2, 4].iter().flat_map(|plain| {
            let errors = [0, joint]
                .into_iter()
                .flat_map(|joint| [joint, joint + BANDS]);
            errors.map(move |errors| (plain + errors) * CHANNELS)
        });
        if !known.into_iter().any(|known| known == columns) || self.reach.iter().any(|&r| r <= 0.0)
        {
            return Err(Error::Inconsistent {
                part: "pose reference",
                reason: format!("{columns} numbers a pose, or a reach that is not positive"),
            });
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::statistics::LinearPredictor;

    /// Forward steps of 1 m with a ripple; from step `bad` on they are `jump` longer for one step.
    fn increments(jump: f64) -> Vec<f64> {
        (0..40)
            .flat_map(|i| {
                let ripple = 0.01 * f64::from(i % 3);
                let extra = if i == 20 { jump } else { 0.0 };
                [1.0 + ripple + extra, 0., 0., 0., 0., 0.]
            })
            .collect()
    }

    #[test]
    fn a_jump_is_found_where_it_is() {
        let sound = increments(0.0);
        let sample = |increments| Sample {
            increments: Some(increments),
            ..Sample::default()
        };
        let reference = PoseReference::fit(&pose_numbers(&sample(&sound)).unwrap()).unwrap();
        reference.validate().unwrap();
        let jumped = increments(0.5);
        let rows = pose_numbers(&sample(&jumped)).unwrap();
        let scores: Vec<Score> = rows.iter().map(|r| reference.score(r).unwrap()).collect();
        let beyond: Vec<usize> = (0..scores.len())
            .filter(|&i| scores[i] > reference.threshold())
            .collect();
        assert!(beyond.contains(&20), "{beyond:?}");
        assert!(beyond.iter().all(|i| (18..=22).contains(i)), "{beyond:?}");
    }

    #[test]
    fn a_linear_predictor_adds_what_it_leaves_over() {
        let sound = increments(0.0);
        let predictor = LinearPredictor::fit(&[&sound]).unwrap();
        let sample = |increments| Sample {
            increments: Some(increments),
            linear: Some(&predictor),
            ..Sample::default()
        };
        let rows = pose_numbers(&sample(&sound)).unwrap();
        assert_eq!((rows.len(), rows[0].len()), (40, 4 * CHANNELS));
        PoseReference::fit(&rows).unwrap().validate().unwrap();
        let jumped = pose_numbers(&sample(&increments(0.5))).unwrap();
        // Forward, by the model that knows the neighbours.
        let column = 3 * CHANNELS;
        let worst = (0..40).max_by(|&a, &b| jumped[a][column].total_cmp(&jumped[b][column]));
        assert_eq!(worst, Some(20));
        assert!(jumped[20][column] > rows[20][column] + 1.0);
    }

    #[test]
    fn denoising_errors_are_smoothed_and_joined() {
        let mut trace = TraceSummary {
            length: 8,
            steps: Vec::new(),
            residual_q90: Vec::new(),
            residual_max: Vec::new(),
            pose_residual: vec![vec![[0.0; CHANNELS]; 8]; BANDS],
        };
        trace.pose_residual[2][4][1] = 9.0;
        let smooth = smoothed_errors(&trace, 7).unwrap();
        assert_eq!(smooth.len(), 7);
        // Element 4 of the trace is step 3 of 7; the kernel's centre weighs 3 of 9.
        let column = 2 * CHANNELS + 1;
        assert!((smooth[3][column] - 3.0).abs() < 1e-12);
        assert!((smooth[1][column] - 1.0).abs() < 1e-12);
        assert_eq!(smooth[0][column], 0.0);
        assert_eq!(smooth[3][column - 1], 0.0);
        assert!(smoothed_errors(&trace, 9).is_err());
    }

    #[test]
    fn bad_rows_are_refused() {
        assert!(PoseReference::fit(&[vec![0.0; 12]]).is_err());
        assert!(PoseReference::fit(&[vec![0.0; 12], vec![f64::NAN; 12]]).is_err());
        let reference = PoseReference::fit(&[vec![0.0; 12], vec![1.0; 12]]).unwrap();
        assert!(reference.score(&[0.0; 11]).is_err());
        assert!(reference.score(&[f64::INFINITY; 12]).is_err());
        // Mean 0.5; the 0.999 quantile of 0 and 1 is 0.999.
        let score = reference.score(&[1.5; 12]).unwrap().value();
        assert!((score - 1.0 / 0.499).abs() < 1e-9, "{score}");
    }
}
