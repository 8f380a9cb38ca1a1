//! Blocks of the joint network: how well each axis of the motion is denoised, by what is known of the others.
//!
//! A network that sees all six axes, each with a noise level of its own, is asked several things of a window
//! ([`VIEWS`]): all axes noised alike, at four levels; one branch noised, translation or rotation, the other clean; one
//! axis noised, the others clean. From small noise an axis is estimated by its own neighbours in time, from large
//! noise by the other axes alone; where one does not follow from the other any more, the error grows.
//!
//! | block | numbers | for each axis |
//! |---|---|---|
//! | `joint` | 24 | log mean squared error over the window, all axes noised, four levels |
//! | `joint-given` | 24 | the same given the other branch, and given the five other axes, two levels each |
//! | `joint-quantiles` | 96 | log 0.9 quantile and maximum over the window of all these |
//! | `joint-elbo` | 6 | log of the sum over the levels, weighted as in the evidence lower bound |
//!
//! Signed errors, in [`SCORE_VIEW`], are of [`JointScore`].

use super::joint_score::JointScore;
use super::quantile::quantile_sorted;
use super::trace::CHANNELS;
use super::{AXES, Column};
use crate::error::{Error, expect_len};

/// A question to the network: which axes are noised, the others being clean, and how much.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JointView {
    /// Noised axes.
    pub noised: [bool; CHANNELS],
    /// Noise in units of the axis' scale.
    pub sigma: f64,
}

/// Levels at which all axes are noised.
const ALL_LEVELS: [f64; 4] = [0.1, 0.3, 1.0, 3.0];
/// Levels of one branch, or one axis, given the rest.
const GIVEN_LEVELS: [f64; 2] = [0.3, 3.0];
/// Numbers of each axis: at every level of `ALL_LEVELS`, given the other branch, given the other axes.
const OF_AXIS: usize = ALL_LEVELS.len() + 2 * GIVEN_LEVELS.len();
/// Questions.
const COUNT: usize = ALL_LEVELS.len() + GIVEN_LEVELS.len() * (2 + CHANNELS);
/// A squared error below this counts as this under a logarithm.
const SQUARE_FLOOR: f64 = 1e-9;

/// Index of the question whose signed errors make a [`JointScore`]: all axes, little noise.
pub const SCORE_VIEW: usize = 1;

/// All questions, in the order of the errors.
pub const VIEWS: [JointView; COUNT] = views();

const fn views() -> [JointView; COUNT] {
    let mut views = [JointView {
        noised: [true; CHANNELS],
        sigma: 0.0,
    }; COUNT];
    let mut at = 0;
    while at < ALL_LEVELS.len() {
        views[at].sigma = ALL_LEVELS[at];
        at += 1;
    }
    // Two branches, then six axes, at each level.
    let mut level = 0;
    while level < GIVEN_LEVELS.len() {
        let mut part = 0;
        while part < 2 + CHANNELS {
            let mut axis = 0;
            while axis < CHANNELS {
                views[at].noised[axis] = match part {
                    0 => axis < CHANNELS / 2,
                    1 => axis >= CHANNELS / 2,
                    _ => axis + 2 == part,
                };
                axis += 1;
            }
            views[at].sigma = GIVEN_LEVELS[level];
            at += 1;
            part += 1;
        }
        level += 1;
    }
    views
}

/// The view of each number of an axis.
fn views_of(axis: usize) -> [usize; OF_AXIS] {
    let all = ALL_LEVELS.len();
    let given = |level: usize, part: usize| all + level * (2 + CHANNELS) + part;
    let branch = usize::from(axis >= CHANNELS / 2);
    [
        0,
        1,
        2,
        3,
        given(0, branch),
        given(1, branch),
        given(0, 2 + axis),
        given(1, 2 + axis),
    ]
}

const NAMES: [&str; OF_AXIS] = [
    "joint_0.1",
    "joint_0.3",
    "joint_1",
    "joint_3",
    "given_branch_0.3",
    "given_branch_3",
    "given_axes_0.3",
    "given_axes_3",
];

/// What the network got wrong of one window.
#[derive(Clone, Debug, PartialEq)]
pub struct JointErrors {
    length: usize,
    /// `[view][pose][axis]`
    squares: Vec<f32>,
    score: Option<JointScore>,
}

impl JointErrors {
    /// Of squared denoising errors `[view][pose][axis]`, in the order of [`VIEWS`]; those of clean axes are not used.
    ///
    /// # Errors
    /// [`Error::Shape`]; [`Error::TooFew`] for no pose.
    pub fn new(length: usize, squares: Vec<f32>) -> Result<Self, Error> {
        if length == 0 {
            return Err(Error::TooFew {
                what: "increments of a window",
                needed: 1,
                found: 0,
                hint: "an empty window says nothing",
            });
        }
        let expected = VIEWS.len() * length * CHANNELS;
        expect_len("errors of the joint network", expected, squares.len())?;
        Ok(Self {
            length,
            squares,
            score: None,
        })
    }

    /// The same with signed errors in [`SCORE_VIEW`].
    #[must_use]
    pub fn with_score(self, score: JointScore) -> Self {
        Self {
            score: Some(score),
            ..self
        }
    }

    pub(super) fn score(&self) -> Option<&JointScore> {
        self.score.as_ref()
    }

    /// Increments of the window.
    #[must_use]
    pub fn len(&self) -> usize {
        self.length
    }

    /// Never: a window has increments.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.length == 0
    }

    /// Squared errors of one axis in one view, by pose.
    fn series(&self, view: usize, axis: usize) -> impl Iterator<Item = f64> + '_ {
        let of_view = &self.squares[view * self.length * CHANNELS..][..self.length * CHANNELS];
        let own = of_view.iter().skip(axis).step_by(CHANNELS);
        own.map(|&e| f64::from(e))
    }

    fn mean(&self, view: usize, axis: usize) -> f64 {
        self.series(view, axis).sum::<f64>() / self.length as f64
    }

    /// For every pose the squared errors of all axes and views, axis by axis; they are to be smoothed.
    pub(crate) fn of_poses(&self) -> Vec<Vec<f64>> {
        let mut rows = vec![Vec::with_capacity(CHANNELS * OF_AXIS); self.length];
        for axis in 0..CHANNELS {
            for view in views_of(axis) {
                for (row, square) in rows.iter_mut().zip(self.series(view, axis)) {
                    row.push(square);
                }
            }
        }
        rows
    }
}

/// Numbers of a pose.
pub(crate) const POSE_NUMBERS: usize = CHANNELS * OF_AXIS;

fn named(numbers: &[usize], quantities: &[&str]) -> Vec<Column> {
    let mut columns = Vec::new();
    for part in AXES {
        for &number in numbers {
            for quantity in quantities {
                let name = format!("{part}.{}.{quantity}", NAMES[number]);
                columns.push(Column { part, name });
            }
        }
    }
    columns
}

const ALL: [usize; 4] = [0, 1, 2, 3];
const GIVEN: [usize; 4] = [4, 5, 6, 7];
const BOTH: [usize; OF_AXIS] = [0, 1, 2, 3, 4, 5, 6, 7];

pub(super) fn columns() -> Vec<Column> {
    named(&ALL, &["log_mean"])
}

pub(super) fn given_columns() -> Vec<Column> {
    named(&GIVEN, &["log_mean"])
}

pub(super) fn quantile_columns() -> Vec<Column> {
    named(&BOTH, &["log_q90", "log_max"])
}

pub(super) fn elbo_columns() -> Vec<Column> {
    let of = |part: &'static str| Column {
        part,
        name: format!("{part}.joint.log_elbo"),
    };
    AXES.map(of).into()
}

fn log(square: f64) -> f64 {
    square.max(SQUARE_FLOOR).ln()
}

pub(super) fn values(errors: &JointErrors, out: &mut Vec<f64>) {
    means(errors, &ALL, out);
}

pub(super) fn given_values(errors: &JointErrors, out: &mut Vec<f64>) {
    means(errors, &GIVEN, out);
}

fn means(errors: &JointErrors, numbers: &[usize], out: &mut Vec<f64>) {
    for axis in 0..CHANNELS {
        let views = views_of(axis);
        out.extend(numbers.iter().map(|&n| log(errors.mean(views[n], axis))));
    }
}

pub(super) fn quantile_values(errors: &JointErrors, out: &mut Vec<f64>) {
    for axis in 0..CHANNELS {
        for view in views_of(axis) {
            let mut squares: Vec<f64> = errors.series(view, axis).collect();
            squares.sort_by(f64::total_cmp);
            out.extend([0.9, 1.0].map(|q| log(quantile_sorted(&squares, q))));
        }
    }
}

/// With D the estimate, the bound integrates `|D - x_0|^2 / sigma^2` over ln sigma; the errors are
/// `(D - x_0)^2 (1 + sigma^2) / sigma^2`.
pub(super) fn elbo_values(errors: &JointErrors, out: &mut Vec<f64>) {
    for axis in 0..CHANNELS {
        let term = |view: usize| errors.mean(view, axis) / (1.0 + VIEWS[view].sigma.powi(2));
        out.push(log(ALL.into_iter().map(term).sum()));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_axis_is_noised_where_it_is_asked_for() {
        for axis in 0..CHANNELS {
            let views = views_of(axis);
            assert!(views.iter().all(|&view| VIEWS[view].noised[axis]));
            let noised = views.map(|v| VIEWS[v].noised.iter().filter(|n| **n).count());
            assert_eq!(noised, [6, 6, 6, 6, 3, 3, 1, 1]);
            let sigma = views.map(|view| VIEWS[view].sigma);
            assert_eq!(sigma, [0.1, 0.3, 1.0, 3.0, 0.3, 3.0, 0.3, 3.0]);
        }
    }

    #[test]
    fn numbers_by_hand() {
        // Error 4 in the first pose of yaw with all else clean at the higher level; 1 elsewhere.
        let length = 10;
        let mut squares = vec![1.0; COUNT * length * CHANNELS];
        squares[views_of(5)[7] * length * CHANNELS + 5] = 4.0;
        let errors = JointErrors::new(length, squares).unwrap();
        let of = |f: fn(&JointErrors, &mut Vec<f64>)| {
            let mut out = Vec::new();
            f(&errors, &mut out);
            out
        };
        let given = of(given_values);
        assert_eq!(given.len(), given_columns().len());
        assert!((given[23] - 1.3_f64.ln()).abs() < 1e-12);
        assert!(given[..23].iter().all(|x| *x == 0.0));
        assert_eq!(of(values), [0.0; 24]);
        let quantiles = of(quantile_values);
        assert_eq!(quantiles.len(), quantile_columns().len());
        assert_eq!(quantiles[95], 4_f64.ln());
        let sum: f64 = ALL_LEVELS.iter().map(|s| 1.0 / (1.0 + s * s)).sum();
        assert!((of(elbo_values)[0] - sum.ln()).abs() < 1e-12);
        let poses = errors.of_poses();
        assert_eq!((poses.len(), poses[0].len()), (length, POSE_NUMBERS));
        assert_eq!(poses[0][POSE_NUMBERS - 1], 4.0);
        assert!(JointErrors::new(3, vec![0.0; 5]).is_err());
        assert!(JointErrors::new(0, Vec::new()).is_err());
    }
}
