//! What one piece of a log says of how position and attitude belong together.

use super::regression::Regression;
use crate::error::Error;
use crate::statistics::twist;
use nalgebra::{UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};

/// Coefficients of a piece.
pub const COEFFICIENTS: usize = 14;
/// Causes that are told apart.
pub(super) const CAUSES: usize = 6;
/// Increments of a piece, about.
const LENGTH: usize = 1000;
/// A stretch of fewer increments says nothing.
const SHORTEST: usize = 200;

/// One regression.
#[derive(Clone, Copy)]
struct Equation {
    target: Axis,
    /// All of it from one pose to the next.
    differenced: bool,
    terms: &'static [Term],
}

const fn equation(target: Axis, differenced: bool, terms: &'static [Term]) -> Equation {
    Equation {
        target,
        differenced,
        terms,
    }
}

const EQUATIONS: [Equation; 5] = [
    equation(
        Axis::Left,
        false,
        &[
            Term::Forward,
            Term::Turn(2),
            Term::ForwardTurn(2),
            Term::Turn(0),
        ],
    ),
    equation(
        Axis::Up,
        false,
        &[
            Term::Forward,
            Term::Turn(1),
            Term::ForwardTurn(1),
            Term::Turn(0),
        ],
    ),
    equation(Axis::Forward, true, &[Term::Turn(2), Term::Turn(1)]),
    equation(Axis::Left, true, &[Term::Turn(2), Term::Turn(0)]),
    equation(Axis::Up, true, &[Term::Turn(1), Term::Turn(0)]),
];

/// An axis of the body.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum Axis {
    /// Ahead; the turn about it is roll.
    Forward,
    /// To the left; the turn about it is pitch, positive with the nose down.
    Left,
    /// Up; the turn about it is yaw, positive to the left.
    Up,
}

/// A regressor.
#[derive(Clone, Copy)]
enum Term {
    Forward,
    Turn(usize),
    ForwardTurn(usize),
}

/// What two halves of a pose may have between them.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum Kind {
    /// Position behind (positive) or ahead of the attitude in time.
    TimeOffset,
    /// Position of a point away from the one that the trusted logs report, along an axis of the body.
    LeverArm,
    /// Attitude turned about an axis of the body against the direction of travel.
    Mounting,
    /// Positions in another unit of length.
    Length,
    /// Turns in another unit of angle.
    Turn,
}

pub(super) const CAUSE: [(Kind, Axis); CAUSES] = [
    (Kind::TimeOffset, Axis::Forward),
    (Kind::LeverArm, Axis::Forward),
    (Kind::LeverArm, Axis::Left),
    (Kind::LeverArm, Axis::Up),
    (Kind::Mounting, Axis::Left),
    (Kind::Mounting, Axis::Up),
];

/// What a regressor is made of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Regressor {
    /// A step.
    Step,
    /// A turn.
    Turn,
    /// The product of both.
    ForwardTurn,
}

/// The regressor of each coefficient.
pub(super) fn regressors_of() -> impl Iterator<Item = Regressor> {
    let terms = EQUATIONS.iter().flat_map(|equation| equation.terms);
    terms.map(|term| match term {
        Term::Forward => Regressor::Step,
        Term::Turn(_) => Regressor::Turn,
        Term::ForwardTurn(_) => Regressor::ForwardTurn,
    })
}

/// The regressions of one piece.
#[derive(Clone, Debug, PartialEq)]
pub struct CalibrationPiece {
    motion: Vec<Motion>,
    hertz: f64,
    /// In the order of the equations.
    pub(super) coefficients: Vec<f64>,
    pub(super) errors: Vec<f64>,
}

/// A step and the turn that comes with it.
type Motion = (Vector3<f64>, Vector3<f64>);

impl CalibrationPiece {
    /// The pieces of a gap-free stretch of `[n, 6]` body-frame increments at `hertz` poses a second: as many of equal
    /// length as bring them closest to 1000 increments, at least one; none for fewer than 200 increments.
    ///
    /// # Errors
    /// [`Error::Parameter`] for a rate that is not positive, [`Error::Shape`], [`Error::NotFinite`].
    pub fn of_stretch(increments: &[f64], hertz: f64) -> Result<Vec<Self>, Error> {
        if !(hertz > 0.0 && hertz.is_finite()) {
            return Err(Error::Parameter {
                name: "poses a second",
                value: hertz.to_string(),
                expected: "must be positive",
            });
        }
        let twists = twist::halfway(increments)?;
        if twists.len() < SHORTEST {
            return Ok(Vec::new());
        }
        let count = ((twists.len() + LENGTH / 2) / LENGTH).max(1);
        let cut = |i: usize| i * twists.len() / count;
        Ok((0..count)
            .map(|i| Self::of(&twists[cut(i)..cut(i + 1)], hertz))
            .collect())
    }

    fn of(twists: &[twist::Twist], hertz: f64) -> Self {
        let vector = |v: &[f64]| Vector3::new(v[0], v[1], v[2]);
        let motion: Vec<Motion> = twists
            .iter()
            .map(|t| (vector(&t[..3]), vector(&t[3..])))
            .collect();
        let (mut coefficients, mut errors) = (Vec::new(), Vec::new());
        for (equation, regressors) in EQUATIONS.iter().zip(regressors(&motion)) {
            let target = equation.target(&motion);
            let fit = Regression::fit(&regressors, &target);
            coefficients.extend(&fit.coefficients);
            errors.extend(fit.standard_errors(&target));
        }
        Self {
            motion,
            hertz,
            coefficients,
            errors,
        }
    }

    /// How much each cause of size one (second, metre, radian) moves each coefficient, `[cause][coefficient]`.
    pub(super) fn patterns(&self) -> Vec<Vec<f64>> {
        let mut patterns = vec![Vec::new(); CAUSES];
        for (equation, regressors) in EQUATIONS.iter().zip(regressors(&self.motion)) {
            let fit = Regression::fit(&regressors, &equation.target(&self.motion));
            for (pattern, cause) in patterns.iter_mut().zip(CAUSE) {
                let moved: Vec<Motion> = (0..self.motion.len())
                    .map(|t| {
                        (
                            moved_by(cause, &self.motion, t, self.hertz),
                            Vector3::zeros(),
                        )
                    })
                    .collect();
                pattern.extend(fit.solve(&equation.target(&moved)));
            }
        }
        patterns
    }

    /// Coefficients with the position taken so many poses later against the attitude, and the mean over the equations
    /// of the log scatter that they leave.
    pub(super) fn shifted(&self, poses: i64) -> (Vec<f64>, f64) {
        let mut orientation = UnitQuaternion::identity();
        let world: Vec<(UnitQuaternion<f64>, Vector3<f64>)> = self
            .motion
            .iter()
            .map(|(u, w)| {
                let halfway = orientation * UnitQuaternion::from_scaled_axis(0.5 * w);
                orientation *= UnitQuaternion::from_scaled_axis(*w);
                (halfway, halfway * u)
            })
            .collect();
        let last = self.motion.len() as i64 - 1;
        let moved: Vec<Motion> = (0..=last)
            .map(|t| {
                let from = (t + poses).clamp(0, last) as usize;
                let t = t as usize;
                (world[t].0.inverse() * world[from].1, self.motion[t].1)
            })
            .collect();
        let (mut coefficients, mut scatter) = (Vec::with_capacity(COEFFICIENTS), 0.0);
        for (equation, regressors) in EQUATIONS.iter().zip(regressors(&moved)) {
            let fit = Regression::fit(&regressors, &equation.target(&moved));
            scatter += fit.scatter.ln() / EQUATIONS.len() as f64;
            coefficients.extend(fit.coefficients);
        }
        (coefficients, scatter)
    }

    /// Poses a second.
    pub(super) fn hertz(&self) -> f64 {
        self.hertz
    }
}

impl Equation {
    fn series(&self, motion: &[Motion], of: impl Fn(&Motion) -> f64) -> Vec<f64> {
        match self.differenced {
            true => motion.windows(2).map(|m| of(&m[1]) - of(&m[0])).collect(),
            false => motion.iter().map(of).collect(),
        }
    }

    fn target(&self, motion: &[Motion]) -> Vec<f64> {
        self.series(motion, |(u, _)| u[self.target as usize])
    }
}

/// Of each equation.
fn regressors(motion: &[Motion]) -> [Vec<Vec<f64>>; 5] {
    EQUATIONS.map(|equation| {
        let series = |term: &Term| match *term {
            Term::Forward => equation.series(motion, |(u, _)| u.x),
            Term::Turn(axis) => equation.series(motion, |(_, w)| w[axis]),
            Term::ForwardTurn(axis) => equation.series(motion, |(u, w)| u.x * w[axis]),
        };
        equation.terms.iter().map(series).collect()
    })
}

/// By how much a cause of size one (second, metre, radian) changes a step.
fn moved_by((kind, axis): (Kind, Axis), motion: &[Motion], t: usize, hertz: f64) -> Vector3<f64> {
    let (u, w) = &motion[t];
    let unit = Vector3::from_fn(|i, _| f64::from(u8::from(i == axis as usize)));
    match kind {
        // R(t)^T v(t - s): the body has turned on, and moved otherwise before.
        Kind::TimeOffset => {
            let (before, after) = (t.saturating_sub(1), (t + 1).min(motion.len() - 1));
            let change = (motion[after].0 - motion[before].0) / (after - before).max(1) as f64;
            -(w.cross(u) + change) * hertz
        }
        // The point at `l` moves by w x l more.
        Kind::LeverArm => w.cross(&unit),
        // R exp(d) sees exp(-d) u.
        Kind::Mounting => -unit.cross(u),
        // Units have no pattern of size one.
        Kind::Length | Kind::Turn => Vector3::zeros(),
    }
}
