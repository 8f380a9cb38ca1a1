//! Quantities of the poses of one gap-free stretch, computed one by one so that a long log needs little memory.

use super::quantity::{Axis, Part, Quantity};
use crate::error::Result;
use dose3_datasets::{Frame, increments};
use dose3_lie::{Pose, Vector, so3};
use dose3_ood::statistics::{LinearPredictor, Regressors};

/// A body slower than this (m/s) has no direction of motion.
const MOVING: f64 = 0.5;
/// Steps before and after a pose that its noise is measured over.
const NOISE_REACH: usize = 5;
/// Steps before and after a step that a running median is taken over.
const MEDIAN_REACH: usize = 3;
/// Second differences of white noise have a variance of 1 + 4 + 1 of it.
const NOISE_GAIN: f64 = 6.0;
/// Steps smaller than this (metres, radians) are none: rounding of f64 stays below it.
const NO_STEP: f64 = 1e-9;
/// A body that moves by less than this in a step (metres, radians) says nothing about what is frozen or steady.
const SOME_STEP: f64 = 1e-4;
/// Steps that differ by less than this share of themselves, or by less than the second number (metres, radians), are
/// equal.
const EQUAL: (f64, f64) = (1e-4, 1e-6);

/// The motion between the poses of a stretch.
pub(crate) struct Motion {
    hertz: f64,
    /// Per step translation seen from half-way through the turn, metres, and turn, radians; forward-left-up where
    /// these are known.
    steps: Vec<[f64; 6]>,
    /// What `lin` leaves of each step by the other axes.
    left_over: Option<Vec<[f64; 6]>>,
    /// Per step the change of position in the world, metres.
    world: Vec<Vector>,
    /// Per step whether the next step is the same.
    equal: Vec<bool>,
}

impl Motion {
    /// Of consecutive poses at `hertz`.
    pub fn new(
        poses: &[Pose],
        frame: Frame,
        hertz: f64,
        linear: Option<&LinearPredictor>,
    ) -> Result<Self> {
        let flat = increments(poses, frame);
        let axes = frame.to_forward_left_up();
        let steps: Vec<[f64; 6]> = flat.chunks_exact(6).map(half_way).collect();
        let left_over = match linear {
            Some(linear) => {
                let others = Regressors::ALL
                    .iter()
                    .position(|r| *r == Regressors::Others);
                let all = linear.residuals(&flat)?;
                Some(all.into_iter().map(|r| r[others.unwrap_or(0)]).collect())
            }
            None => None,
        };
        let world = poses
            .windows(2)
            .map(|pair| axes * (pair[1].translation - pair[0].translation))
            .collect();
        let equal = flat.chunks_exact(6).zip(flat.chunks_exact(6).skip(1));
        let equal = equal.map(|(a, b)| same_step(a, b)).collect();
        Ok(Self {
            hertz,
            steps,
            left_over,
            world,
            equal,
        })
    }

    /// A quantity of every pose; none of the first one and where it is not defined.
    pub fn column(&self, quantity: Quantity) -> Vec<Option<f64>> {
        let mut column = Vec::with_capacity(self.steps.len() + 1);
        column.push(None);
        let hertz = self.hertz;
        let steps = self.steps.iter();
        match quantity {
            Quantity::Velocity(axis) => {
                column.extend(steps.map(|s| Some(s[axis as usize] * hertz)));
            }
            Quantity::Acceleration(axis) => {
                let a = axis as usize;
                if !self.steps.is_empty() {
                    column.push(None);
                }
                let changes = self.steps.windows(2);
                column.extend(changes.map(|p| Some((p[1][a] - p[0][a]) * hertz * hertz)));
            }
            Quantity::Noise(axis) => column.extend(self.noise(axis as usize)),
            Quantity::Unexplained(axis) => match &self.left_over {
                Some(left) => column.extend(left.iter().map(|r| Some(r[axis as usize] * hertz))),
                None => column.extend(steps.map(|_| None)),
            },
            Quantity::Speed => column.extend(steps.map(|s| Some(norm(&s[..3]) * hertz))),
            Quantity::Turning => column.extend(steps.map(|s| Some(norm(&s[3..]) * hertz))),
            Quantity::Sideslip => column.extend(steps.map(|s| {
                let moving = norm(&s[..2]) * hertz >= MOVING;
                moving.then(|| s[1].atan2(s[0]))
            })),
            Quantity::Climb => column.extend(steps.map(|s| {
                let moving = norm(&s[..3]) * hertz >= MOVING;
                moving.then(|| s[2].atan2(norm(&s[..2])))
            })),
            Quantity::Jump(part) => column.extend(self.jumps(part)),
            Quantity::Repeats(part) => {
                let still = |s: &[f64; 6]| match part {
                    Part::Position => norm(&s[..3]) < NO_STEP,
                    Part::Attitude => norm(&s[3..]) < NO_STEP,
                };
                column.extend(self.runs(steps.map(|s| Some(still(s)))));
            }
            Quantity::Steady => {
                // A step belongs to a run if it is the same as the one before.
                let equal = std::iter::once(false).chain(self.equal.iter().copied());
                let steady = equal.zip(steps).map(|(equal, s)| {
                    Some(equal && (norm(&s[..3]) > SOME_STEP || norm(&s[3..]) > SOME_STEP))
                });
                column.extend(self.runs(steady));
            }
            Quantity::Frozen(axis) => column.extend(self.frozen(axis)),
        }
        column
    }

    /// As [`Motion::column`], as windows are compared by it.
    pub fn compared(&self, quantity: Quantity) -> Vec<Option<f64>> {
        let column = self.column(quantity);
        match quantity.is_smoothed() {
            true => running_median(&column),
            false => column,
        }
    }

    fn jumps(&self, part: Part) -> Vec<Option<f64>> {
        let from = match part {
            Part::Position => 0,
            Part::Attitude => 3,
        };
        let mut squares = vec![0.0; self.steps.len()];
        for axis in from..from + 3 {
            let series: Vec<Option<f64>> = self.steps.iter().map(|s| Some(s[axis])).collect();
            let usual = running_median(&series);
            for ((square, step), usual) in squares.iter_mut().zip(&self.steps).zip(usual) {
                *square += (step[axis] - usual.unwrap_or(0.0)).powi(2);
            }
        }
        squares
            .into_iter()
            .map(|square| Some(square.sqrt()))
            .collect()
    }

    /// Lengths in seconds of the runs of `true` up to each step; `None` neither goes on nor ends a run.
    fn runs(&self, steps: impl Iterator<Item = Option<bool>>) -> Vec<Option<f64>> {
        let mut length = 0_u32;
        steps
            .map(|step| {
                match step {
                    Some(true) => length += 1,
                    Some(false) => length = 0,
                    None => {}
                }
                Some(f64::from(length) / self.hertz)
            })
            .collect()
    }

    fn frozen(&self, axis: Axis) -> Vec<Option<f64>> {
        let moves = |world: &Vector| world.norm() > SOME_STEP;
        let steps = self.world.iter().enumerate().map(|(i, world)| {
            let change = match axis {
                Axis::Forward | Axis::Left | Axis::Up => world[axis as usize],
                Axis::Roll | Axis::Pitch | Axis::Yaw => self.steps[i][axis as usize],
            };
            match change.abs() < NO_STEP {
                true => moves(world).then_some(true),
                false => Some(false),
            }
        });
        self.runs(steps)
    }

    fn noise(&self, axis: usize) -> Vec<Option<f64>> {
        let second: Vec<f64> = self
            .steps
            .windows(3)
            .map(|s| (s[2][axis] - 2.0 * s[1][axis] + s[0][axis]).powi(2))
            .collect();
        (0..self.steps.len())
            .map(|i| {
                // The second difference k is centred on step k + 1.
                let from = (i.saturating_sub(NOISE_REACH + 1)).min(second.len());
                let to = (i + NOISE_REACH).min(second.len());
                let near = &second[from..to];
                let mean = near.iter().sum::<f64>() / near.len() as f64;
                (!near.is_empty()).then(|| (mean / NOISE_GAIN).sqrt() * self.hertz)
            })
            .collect()
    }
}

/// The median of each pose with a value and the values of three poses on both sides.
fn running_median(column: &[Option<f64>]) -> Vec<Option<f64>> {
    let mut near = Vec::with_capacity(2 * MEDIAN_REACH + 1);
    (0..column.len())
        .map(|i| {
            column[i]?;
            near.clear();
            let from = i.saturating_sub(MEDIAN_REACH);
            let to = (i + MEDIAN_REACH + 1).min(column.len());
            near.extend(column[from..to].iter().flatten());
            near.sort_by(f64::total_cmp);
            Some(near[near.len() / 2])
        })
        .collect()
}

fn half_way(step: &[f64]) -> [f64; 6] {
    let turn = Vector::new(step[3], step[4], step[5]);
    let moved = so3::exp(&(-0.5 * turn)) * Vector::new(step[0], step[1], step[2]);
    [moved.x, moved.y, moved.z, turn.x, turn.y, turn.z]
}

/// Whether two consecutive steps go the same way in the world and turn alike, as those of interpolated poses.
fn same_step(first: &[f64], second: &[f64]) -> bool {
    let part = |step: &[f64], at: usize| Vector::new(step[at], step[at + 1], step[at + 2]);
    let (turn, next_turn) = (part(first, 3), part(second, 3));
    // The second step in the axes of the pose that the first one starts from.
    let (moved, next) = (part(first, 0), so3::exp(&turn) * part(second, 0));
    let equal = |a: Vector, b: Vector| (a - b).norm() < (EQUAL.0 * a.norm()).max(EQUAL.1);
    equal(moved, next) && equal(turn, next_turn)
}

fn norm(values: &[f64]) -> f64 {
    values.iter().map(|x| x * x).sum::<f64>().sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use dose3_lie::Rotation;

    /// Circle of 5 m radius at 1 m/s, to the left, climbing 0.1 m/s; 10 Hz.
    fn helix(poses: usize) -> Vec<Pose> {
        (0..poses)
            .map(|i| {
                let t = i as f64 * 0.1;
                let (angle, radius) = (t / 5.0, 5.0);
                Pose::new(
                    Rotation::from_axis_angle(&Vector::z_axis(), angle),
                    Vector::new(radius * angle.sin(), radius * (1.0 - angle.cos()), 0.1 * t),
                )
            })
            .collect()
    }

    fn of(poses: &[Pose], quantity: Quantity) -> Vec<Option<f64>> {
        let motion = Motion::new(poses, Frame::BodyFlu, 10.0, None).unwrap();
        let column = motion.column(quantity);
        assert_eq!(column.len(), poses.len(), "{quantity}");
        column
    }

    #[test]
    fn a_helix_by_hand() {
        let poses = helix(40);
        let last = |quantity| of(&poses, quantity)[39].unwrap();
        assert!((last(Quantity::Velocity(Axis::Forward)) - 1.0).abs() < 1e-3);
        assert!(last(Quantity::Velocity(Axis::Left)).abs() < 1e-12);
        assert!((last(Quantity::Velocity(Axis::Yaw)) - 0.2).abs() < 1e-12);
        assert!(last(Quantity::Acceleration(Axis::Forward)).abs() < 1e-9);
        assert!(last(Quantity::Sideslip).abs() < 1e-9);
        assert!((last(Quantity::Climb) - 0.1_f64.atan()).abs() < 1e-4);
        assert!(last(Quantity::Noise(Axis::Up)) < 1e-9);
        // The body turns about its up axis only.
        assert!((last(Quantity::Frozen(Axis::Roll)) - 3.9).abs() < 1e-9);
        assert_eq!(last(Quantity::Frozen(Axis::Yaw)), 0.0);
        assert_eq!(last(Quantity::Frozen(Axis::Up)), 0.0);
        assert_eq!(last(Quantity::Repeats(Part::Position)), 0.0);
        // No prediction, no remainder; the first pose has no step, the second no acceleration.
        assert_eq!(of(&poses, Quantity::Unexplained(Axis::Up)), vec![None; 40]);
        let acceleration = of(&poses, Quantity::Acceleration(Axis::Up));
        assert_eq!((acceleration[0], acceleration[1]), (None, None));
    }

    #[test]
    fn repeats_and_interpolated_poses_are_counted() {
        let mut poses = helix(40);
        let still = poses[10];
        poses[11..=14].fill(still);
        let (a, b) = (poses[20], poses[30]);
        for (step, pose) in poses[21..30].iter_mut().enumerate() {
            *pose = dose3_lie::se3::interpolate(&a, &b, (step + 1) as f64 / 10.0);
        }
        let still = of(&poses, Quantity::Repeats(Part::Position));
        assert_eq!(still[10], Some(0.0));
        assert!((still[14].unwrap() - 0.4).abs() < 1e-12);
        assert_eq!(still[15], Some(0.0));
        let steady = of(&poses, Quantity::Steady);
        assert_eq!(steady[14], Some(0.0));
        assert!((steady[30].unwrap() - 0.9).abs() < 1e-12, "{:?}", steady);
        assert_eq!(steady[31], Some(0.0));
    }

    #[test]
    fn a_jump_is_a_single_step_and_no_speed() {
        let mut poses = helix(40);
        poses[20..].iter_mut().for_each(|p| p.translation.z += 2.0);
        let jumps = of(&poses, Quantity::Jump(Part::Position));
        assert!((jumps[20].unwrap() - 2.0).abs() < 1e-3);
        assert!(jumps[1..].iter().flatten().filter(|j| **j > 1e-2).count() == 1);
        let motion = Motion::new(&poses, Frame::BodyFlu, 10.0, None).unwrap();
        let up = Quantity::Velocity(Axis::Up);
        assert!(motion.column(up)[20].unwrap() > 20.0);
        assert!(motion.compared(up)[20].unwrap() < 0.2);
    }

    #[test]
    fn too_few_poses_have_no_quantities_and_do_not_panic() {
        for poses in [0, 1, 2, 3] {
            let poses = helix(poses);
            let motion = Motion::new(&poses, Frame::Sensor, 10.0, None).unwrap();
            for quantity in Quantity::all() {
                let column = motion.column(quantity);
                assert_eq!(column.len(), poses.len().max(1), "{quantity}");
            }
        }
    }
}
