//! Which single cause explains best how a log differs from the trusted ones.

use super::piece::{Axis, CAUSE, CAUSES, COEFFICIENTS, CalibrationPiece, Kind};
use super::reference::median;
use super::units::{UNITS, undone};

/// The position is tried so many whole poses earlier to later against the attitude.
const FARTHEST: i64 = 3;
/// A shift may raise the logarithm of what the regressions leave over by this.
const TORN_APART: f64 = 0.1;
/// Another unit is named where it leaves less than this share of what the best other cause leaves: units are rarer, and
/// there are more of them.
const BETTER: f64 = 0.5;
/// A factor that leaves nothing of what goes with turns.
const NOTHING: f64 = 1e12;

/// Coefficients of a log: medians over its pieces.
pub(super) struct Log<'a> {
    pieces: &'a [CalibrationPiece],
    pub coefficients: Vec<f64>,
    pub errors: Vec<f64>,
}

/// What is off, and along or about which axis.
pub(super) type Cause = (Kind, Axis);

/// A cause with its size.
pub(super) struct Explanation {
    pub cause: Cause,
    /// Seconds, metres, radians; of a unit its factor.
    pub value: f64,
    pub standard_error: f64,
    /// What each coefficient adds to the size of the cause, by weighted least squares: `W a / (a' W a)`.
    pub parts: Vec<f64>,
}

impl<'a> Log<'a> {
    /// None for no piece.
    pub fn of(pieces: &'a [CalibrationPiece]) -> Option<Self> {
        // The median of n normal numbers scatters by sqrt(pi / 2n).
        let gain = match pieces.len() {
            0 => return None,
            1 => 1.0,
            n => (std::f64::consts::FRAC_PI_2 / n as f64).sqrt(),
        };
        let errors = medians(pieces.iter().map(|p| p.errors.clone()).collect());
        Some(Self {
            pieces,
            coefficients: medians(pieces.iter().map(|p| p.coefficients.clone()).collect()),
            errors: errors.iter().map(|e| gain * e).collect(),
        })
    }

    /// `usual` and `spread`: trusted coefficients.
    pub fn explain(&self, usual: &[f64], spread: &[f64]) -> Explanation {
        let scatter = self.errors.iter().zip(spread);
        let weights: Vec<f64> = scatter.map(|(e, s)| 1.0 / (e * e + s * s)).collect();
        let patterns = self.mean_patterns();
        let parts = |cause: usize| -> Vec<f64> {
            let each = patterns[cause].iter().zip(&weights);
            let total: f64 = each.clone().map(|(a, w)| w * a * a).sum();
            each.map(|(a, w)| if total > 0.0 { w * a / total } else { 0.0 })
                .collect()
        };
        let differ = |coefficients: &[f64]| -> Vec<f64> {
            coefficients.iter().zip(usual).map(|(b, m)| b - m).collect()
        };
        let difference = differ(&self.coefficients);
        let square = |d: &[f64]| d.iter().zip(&weights).map(|(d, w)| w * d * d).sum::<f64>();
        let whole = square(&difference);
        let (mut best, mut most) = (0, f64::NEG_INFINITY);
        let mut found = Vec::with_capacity(CAUSES);
        for (cause, (kind, _)) in CAUSE.iter().enumerate() {
            let parts = parts(cause);
            let (value, standard_error, left) = match kind {
                Kind::TimeOffset => self.time_offset(|b| square(&differ(b))),
                _ => {
                    let size = dot(&parts, &difference);
                    let rest = difference.iter().zip(&patterns[cause]);
                    let rest: Vec<f64> = rest.map(|(d, a)| d - size * a).collect();
                    (size, rms(&parts, &self.errors), square(&rest))
                }
            };
            if whole - left > most {
                (best, most) = (cause, whole - left);
            }
            found.push(Explanation {
                cause: CAUSE[cause],
                value,
                standard_error,
                parts,
            });
        }
        self.unit(usual, spread, whole - most)
            .unwrap_or_else(|| found.swap_remove(best))
    }

    /// The unit that explains the differences better than what leaves `left` of their squares.
    fn unit(&self, usual: &[f64], spread: &[f64], left: f64) -> Option<Explanation> {
        let of_unit = |&(kind, factor, ..): &(Kind, f64, &str, &str)| {
            let errors = undone(kind, factor, &self.errors);
            let square = |coefficients: &[f64]| -> f64 {
                let squares = (0..COEFFICIENTS).map(|i| {
                    let scatter = errors[i].powi(2) + spread[i].powi(2);
                    (coefficients[i] - usual[i]).powi(2) / scatter
                });
                squares.sum()
            };
            // A large factor brings all that goes with turns near 0, which may be near enough by itself.
            let nothing = match kind {
                Kind::Turn => undone(kind, NOTHING.recip(), &self.coefficients),
                _ => undone(kind, NOTHING, &self.coefficients),
            };
            let remains = square(&undone(kind, factor, &self.coefficients));
            (remains, square(&nothing), kind, factor)
        };
        let best = UNITS
            .iter()
            .map(of_unit)
            .min_by(|a, b| a.0.total_cmp(&b.0))?;
        let (remains, nothing, kind, factor) = best;
        (remains < BETTER * left.min(nothing)).then(|| Explanation {
            cause: (kind, Axis::Forward),
            value: factor,
            standard_error: 0.0,
            parts: vec![0.0; COEFFICIENTS],
        })
    }

    /// The offset that brings the coefficients closest to the usual ones when it is undone: seconds, its standard
    /// error, and the distance left. An offset does not only add what its first order says; it also tears apart what
    /// belongs together in the same instant. So the position is really shifted, by whole poses, since interpolation
    /// would smooth it; between them a parabola finds the least distance. A shift that leaves a tenth more scatter
    /// than none tears apart itself and is no candidate.
    fn time_offset(&self, distance: impl Fn(&[f64]) -> f64) -> (f64, f64, f64) {
        let hertz = self.pieces[0].hertz();
        let (distances, scatters): (Vec<f64>, Vec<f64>) = (-FARTHEST..=FARTHEST)
            .map(|poses| {
                let shifted = self.pieces.iter().map(|p| p.shifted(poses));
                let (coefficients, scatters): (Vec<_>, Vec<f64>) = shifted.unzip();
                (distance(&medians(coefficients)), median(scatters))
            })
            .unzip();
        let none = FARTHEST as usize;
        let candidates =
            (1..distances.len() - 1).filter(|&k| scatters[k] <= scatters[none] + TORN_APART);
        let lowest = candidates.min_by(|&a, &b| distances[a].total_cmp(&distances[b]));
        let k = lowest.unwrap_or(none);
        let (before, at, after) = (distances[k - 1], distances[k], distances[k + 1]);
        let bend = 0.5 * (before - 2.0 * at + after);
        let slope = 0.5 * (after - before);
        let (shift, error) = if bend > 0.0 {
            let shift = (-0.5 * slope / bend).clamp(-1.0, 1.0);
            (shift, bend.sqrt().recip())
        } else {
            (0.0, 1.0)
        };
        let left = at + slope * shift + bend * shift * shift;
        let poses = k as f64 - FARTHEST as f64 + shift;
        if poses.abs() >= FARTHEST as f64 {
            // Still falling where the search ends: not an offset that was found.
            return (0.0, error / hertz, distances[none]);
        }
        (poses / hertz, error / hertz, left.max(0.0))
    }

    fn mean_patterns(&self) -> Vec<Vec<f64>> {
        let mut mean = vec![vec![0.0; COEFFICIENTS]; CAUSES];
        for piece in self.pieces {
            let patterns = piece.patterns();
            let pairs = mean.iter_mut().flatten().zip(patterns.iter().flatten());
            pairs.for_each(|(sum, x)| *sum += x / self.pieces.len() as f64);
        }
        mean
    }
}

pub(super) fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Scatter of a sum whose parts scatter independently.
pub(super) fn rms(parts: &[f64], errors: &[f64]) -> f64 {
    let squares = parts.iter().zip(errors).map(|(p, e)| (p * e).powi(2));
    squares.sum::<f64>().sqrt()
}

/// Of each coefficient over rows of them.
fn medians(rows: Vec<Vec<f64>>) -> Vec<f64> {
    let column = |i: usize| rows.iter().map(|row| row[i]).collect();
    (0..COEFFICIENTS).map(|i| median(column(i))).collect()
}
