//! A multicopter: rotors push along the body's up axis only, so the acceleration dictates the attitude.

use std::f64::consts::PI;

use dose3_lie::{Matrix, Pose, Rotation, Vector};
use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::Clock;
use super::signal::{Activity, SensorNoise, Signal, VectorSignal};

const GRAVITY: f64 = 9.81;
/// Largest tilt that the controller allows, as horizontal over vertical thrust.
const LARGEST_TILT: f64 = 0.7;

struct Path {
    course: VectorSignal,
    wind: VectorSignal,
    origin: Vector,
}

impl Path {
    /// Wind pushes whether the course goes on or hovers.
    fn at(&self, own_time: f64, time: f64) -> Vector {
        self.origin + self.course.at(own_time) + self.wind.at(time)
    }
}

struct State {
    activity: Activity,
    time: f64,
    /// Positions at the last three inner steps, for velocity and acceleration.
    positions: [Vector; 3],
    /// Thrust direction after the lag of the attitude controller.
    up: Vector,
}

pub(super) fn simulate(clock: &Clock, rng: &mut impl Rng) -> Vec<Pose> {
    let pace = rng.random_range(0.7..1.5);
    let size = rng.random_range(1.0..2.2);
    let drag = rng.random_range(0.15..0.4);
    let lag = rng.random_range(0.06..0.12);
    let path = Path {
        course: VectorSignal::new(
            rng,
            [0.03 * pace, 0.35 * pace],
            10,
            [size, size, 0.35 * size],
        ),
        wind: VectorSignal::new(rng, [0.3, 1.2], 8, [0.025, 0.025, 0.015]),
        origin: Vector::new(
            rng.random_range(-5.0..5.0),
            rng.random_range(-5.0..5.0),
            rng.random_range(2.0..6.0),
        ),
    };
    let swing = rng.random_range(0.6..1.5);
    let heading = Signal::new(rng, [0.02 * pace, 0.25 * pace], 8, swing);
    let heading_start = rng.random_range(-PI..PI);
    let every = rng.random_range(8.0..20.0);
    let activity = Activity::new(rng, every, 5.0, 1.5);
    let mut noise = SensorNoise::new(
        [6e-4, 1.5e-3],
        [2e-4, 8e-4],
        0.8,
        clock.step * clock.substeps as f64,
    );
    let mut noise_rng = ChaCha8Rng::seed_from_u64(rng.random());
    let mut state = State {
        activity,
        time: 0.0,
        positions: [path.at(0.0, 0.0); 3],
        up: Vector::z(),
    };
    // Two seconds before the first pose fill the differences and settle the attitude.
    let mut advance = |state: &mut State, step: f64| {
        state.activity.advance(step, rng);
        state.time += step;
        let [_, b, c] = state.positions;
        state.positions = [b, c, path.at(state.activity.own_time(), state.time)];
        let [a, b, c] = state.positions;
        let velocity = (c - a) / (2.0 * step);
        let acceleration = (c - b * 2.0 + a) / (step * step);
        let mut thrust = acceleration + velocity * drag + Vector::new(0.0, 0.0, GRAVITY);
        thrust.z = thrust.z.max(0.3 * GRAVITY);
        let sideways = thrust.x.hypot(thrust.y);
        let limit = LARGEST_TILT * thrust.z;
        if sideways > limit {
            thrust.x *= limit / sideways;
            thrust.y *= limit / sideways;
        }
        let share = 1.0 - (-step / lag).exp();
        state.up = (state.up + (thrust.normalize() - state.up) * share).normalize();
    };
    let settle = (2.0 / clock.step) as usize;
    for index in 0..settle {
        // The first two differences would see the path jump to a start from rest.
        advance(&mut state, clock.step);
        if index < 2 {
            state.up = Vector::z();
        }
    }
    clock.run(state, advance, |state| {
        let rotation = attitude(
            &state.up,
            heading_start + heading.at(state.activity.own_time()),
        );
        noise.apply(
            &Pose {
                rotation,
                translation: state.positions[1],
            },
            &mut noise_rng,
        )
    })
}

/// The rotation whose z axis is `up` and whose x axis points as far as possible along the heading.
fn attitude(up: &Vector, heading: f64) -> Rotation {
    let ahead = Vector::new(heading.cos(), heading.sin(), 0.0);
    // `up` is within 35 degrees of vertical, so it is never parallel to a level heading.
    let left = up.cross(&ahead).normalize();
    let forward = left.cross(up);
    Rotation::from_matrix_unchecked(Matrix::from_columns(&[forward, left, *up]))
}
