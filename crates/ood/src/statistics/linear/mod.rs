//! The block `lin`: how well each axis of the motion follows, linearly, from the others.
//!
//! A rigid sensor on a body moves along one axis as its motion along the others says: a car that turns left
//! leans, one that brakes dives. [`LinearPredictor`] learns by ridge regression on trusted logs what each axis
//! does at step t, (i) from the other axes at steps t - 3 to t + 3 and (ii) from the same and its own
//! three neighbours on both sides. What is left over (the residual) grows where a sensor shakes, stalls or jumps,
//! and where the axes do not belong together: an offset in time, another lever arm, a mirrored axis.
//!
//! Steps are twists with the translation seen from half-way through the turn. Every axis is divided by its root
//! mean square over the trusted logs, values beyond their .995 quantile taken as that quantile, and clipped at 8
//! of them, so that the jumps of a sound sensor do not decide what is learnt. The product of forward velocity and
//! yaw rate, which says how fast the heading of the velocity turns, is one more regressor of all axes but these two.
//!
//! Per axis and model the block has the logarithm of median, 0.9 quantile and maximum of the absolute residual over
//! the window, in metres or radians a pose.

mod block;
mod normal;
mod reference;

pub(super) use block::{columns, values};
pub use reference::LinearReference;

use super::Workspace;
use super::trace::CHANNELS;
use super::twist::{Twist, halfway, halfway_into};
use crate::error::{Error, expect_finite, expect_len};
use crate::statistics::scale::SCALE_FLOOR;
use normal::{ENTRIES, Sums, entries};
use serde::{Deserialize, Serialize};
use std::sync::LazyLock;

/// Steps before and after that a step is predicted from.
const REACH: usize = 3;
const LAGS: usize = 2 * REACH + 1;
/// The axes, and the product of the first and the last.
const CHANNELS_IN: usize = CHANNELS + 1;
const PRODUCT: usize = CHANNELS;
/// Largest scaled value.
const CLIP: f64 = 8.0;

pub(super) type Channels = [f64; CHANNELS_IN];
/// By what it was predicted from and axis.
pub(super) type Residual = [[f64; CHANNELS]; 2];
type Features = Vec<usize>;

/// What every model is regressed on: axis by axis, in the order of [`Regressors::ALL`].
static FEATURES: LazyLock<Vec<Features>> = LazyLock::new(|| {
    (0..CHANNELS)
        .flat_map(|axis| Regressors::ALL.map(|r| r.features(axis)))
        .collect()
});

/// What an axis is predicted from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Regressors {
    /// The other axes, three steps back to three ahead.
    Others,
    /// The same, and the axis' own three steps before and after.
    OthersAndNeighbours,
}

impl Regressors {
    /// Both, in the order of columns and residuals.
    pub const ALL: [Regressors; 2] = [Regressors::Others, Regressors::OthersAndNeighbours];

    /// The entries of the lagged vector that `axis` is regressed on.
    fn features(self, axis: usize) -> Features {
        let keep = |entry: &usize| {
            let (channel, lag) = (entry / LAGS, entry % LAGS);
            match channel {
                PRODUCT => axis != 0 && axis != CHANNELS - 1,
                _ if channel == axis => self == Regressors::OthersAndNeighbours && lag != REACH,
                _ => true,
            }
        };
        (0..ENTRIES).filter(keep).collect()
    }
}

/// Predicts each axis of the motion from the others; fitted to trusted logs.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Stored", into = "Stored")]
pub struct LinearPredictor {
    scale: Vec<f64>,
    models: Vec<Model>,
}

/// One regression, in scaled units.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Model {
    intercept: f64,
    weights: Vec<f64>,
    /// Root mean square of what the trusted logs leave over.
    spread: f64,
}

#[derive(Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Stored {
    /// Of the six axes (metres, radians) and of the scaled product.
    scale: Vec<f64>,
    /// Axis by axis, in the order of [`Regressors::ALL`].
    models: Vec<Model>,
}

/// Where a step is farthest from what the others say: for words and marks.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Deviation {
    /// Index of the increment.
    pub increment: usize,
    /// Index into [`AXES`](super::AXES): forward, left, up, then the turns about them, where the body has these axes.
    pub axis: usize,
    /// Measured less predicted, metres or radians in this step.
    pub value: f64,
    /// Its size over the root mean square of the trusted residuals of this axis.
    pub ratio: f64,
}

impl LinearPredictor {
    /// Of all gap-free stretches of all trusted logs: `[n, 6]` body-frame increments each. Stretches of fewer than
    /// seven increments teach nothing.
    ///
    /// # Errors
    /// [`Error::TooFew`] where no stretch has seven increments; [`Error::Shape`], [`Error::NotFinite`].
    pub fn fit(stretches: &[&[f64]]) -> Result<Self, Error> {
        let groups = vec![0; stretches.len()];
        Ok(LinearReference::fit(stretches, &groups)?.into_all())
    }

    fn solve(scale: &[f64], sums: &Sums) -> Self {
        let models = (0..CHANNELS)
            .flat_map(|axis| Regressors::ALL.map(|regressors| (axis, regressors)))
            .map(|(axis, regressors)| {
                let target = axis * LAGS + REACH;
                let (intercept, weights, spread) = sums.regress(target, &regressors.features(axis));
                Model {
                    intercept,
                    weights,
                    spread,
                }
            })
            .collect();
        Self {
            scale: scale.to_vec(),
            models,
        }
    }

    /// What is left of every increment of `[n, 6]`: measured less predicted, metres and radians, by what it was
    /// predicted from ([`Regressors::ALL`]) and axis. Near the ends the first or last increment stands in for the
    /// ones beyond. Values beyond 8 trusted root mean squares count as these 8.
    ///
    /// # Errors
    /// [`Error::Shape`], [`Error::NotFinite`].
    pub fn residuals(&self, increments: &[f64]) -> Result<Vec<[[f64; CHANNELS]; 2]>, Error> {
        let mut work = Workspace::default();
        self.residuals_into(increments, &mut work)?;
        Ok(work.residuals)
    }

    /// As [`Self::residuals`], into the workspace.
    fn residuals_into(&self, increments: &[f64], work: &mut Workspace) -> Result<(), Error> {
        halfway_into(increments, &mut work.twists)?;
        scaled_into(&work.twists, &self.scale, &mut work.channels);
        let series = &work.channels;
        work.residuals.clear();
        let steps = self.predictions(series).zip(series);
        work.residuals.extend(steps.map(|(predicted, measured)| {
            let left =
                |r: usize, axis: usize| (measured[axis] - predicted[r][axis]) * self.scale[axis];
            [0, 1].map(|r| std::array::from_fn(|axis| left(r, axis)))
        }));
        Ok(())
    }

    /// For every increment of `[n, 6]` the axis that is farthest from its prediction by the others and its own
    /// neighbours; the value that is measured is not clipped here.
    ///
    /// # Errors
    /// [`Error::Shape`], [`Error::NotFinite`].
    pub fn deviations(&self, increments: &[f64]) -> Result<Vec<Deviation>, Error> {
        let twists = halfway(increments)?;
        let series = scaled(&twists, &self.scale);
        let steps = self.predictions(&series).zip(&twists).enumerate();
        Ok(steps
            .map(|(increment, (predicted, measured))| {
                let of = |axis: usize| {
                    let value = measured[axis] - predicted[1][axis] * self.scale[axis];
                    let usual = self.models[2 * axis + 1].spread * self.scale[axis];
                    Deviation {
                        increment,
                        axis,
                        value,
                        ratio: value.abs() / usual.max(SCALE_FLOOR),
                    }
                };
                (1..CHANNELS).map(of).fold(of(0), |worst, next| {
                    if next.ratio > worst.ratio {
                        next
                    } else {
                        worst
                    }
                })
            })
            .collect())
    }

    /// Scaled predictions of every element.
    fn predictions<'a>(&'a self, series: &'a [Channels]) -> impl Iterator<Item = Residual> + 'a {
        let features = &*FEATURES;
        (0..series.len()).map(move |t| {
            let row = entries(series, t);
            let predict = |model: &Model, features: &Features| {
                let terms = features.iter().zip(&model.weights);
                model.intercept + terms.map(|(&f, w)| w * row[f]).sum::<f64>()
            };
            let of = |i: usize| predict(&self.models[i], &features[i]);
            [0, 1].map(|r| std::array::from_fn(|axis| of(2 * axis + r)))
        })
    }

    /// Checks what a file may have brought in.
    ///
    /// # Errors
    /// [`Error::Shape`], [`Error::NotFinite`], [`Error::Inconsistent`] for a scale or a spread that cannot be one.
    pub fn validate(&self) -> Result<(), Error> {
        expect_len(
            "scales of the linear predictor",
            CHANNELS_IN,
            self.scale.len(),
        )?;
        expect_finite("scales of the linear predictor", &self.scale)?;
        expect_len(
            "models of the linear predictor",
            2 * CHANNELS,
            self.models.len(),
        )?;
        for (i, model) in self.models.iter().enumerate() {
            let features = Regressors::ALL[i % 2].features(i / 2).len();
            expect_len("weights of a linear model", features, model.weights.len())?;
            let numbers = [&model.intercept, &model.spread];
            expect_finite("a linear model", numbers.into_iter().chain(&model.weights))?;
        }
        if self.scale.iter().any(|&s| s < SCALE_FLOOR) || self.models.iter().any(|m| m.spread < 0.0)
        {
            return Err(Error::Inconsistent {
                part: "linear predictor",
                reason: format!("a scale below {SCALE_FLOOR} or a negative spread"),
            });
        }
        Ok(())
    }
}

impl TryFrom<Stored> for LinearPredictor {
    type Error = Error;

    fn try_from(stored: Stored) -> Result<Self, Error> {
        let predictor = Self {
            scale: stored.scale,
            models: stored.models,
        };
        predictor.validate()?;
        Ok(predictor)
    }
}

impl From<LinearPredictor> for Stored {
    fn from(predictor: LinearPredictor) -> Self {
        Self {
            scale: predictor.scale,
            models: predictor.models,
        }
    }
}

/// Scaled and clipped axes, and their product.
fn scaled(twists: &[Twist], scale: &[f64]) -> Vec<Channels> {
    let mut channels = Vec::new();
    scaled_into(twists, scale, &mut channels);
    channels
}

fn scaled_into(twists: &[Twist], scale: &[f64], out: &mut Vec<Channels>) {
    let clipped = |x: f64| x.clamp(-CLIP, CLIP);
    let of = |twist: &Twist| {
        let mut channels = [0.0; CHANNELS_IN];
        for (axis, x) in twist.iter().enumerate() {
            channels[axis] = clipped(x / scale[axis]);
        }
        channels[PRODUCT] = clipped(channels[0] * channels[CHANNELS - 1] / scale[PRODUCT]);
        channels
    };
    out.clear();
    out.extend(twists.iter().map(of));
}

#[cfg(test)]
mod tests;
