//! An object in a hand in front of a camera: it is shown from all sides, put down, picked up again.

use dose3_lie::{Pose, Vector, so3};
use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::Clock;
use super::signal::{Activity, SensorNoise, VectorSignal, normal};

struct State {
    activity: Activity,
    time: f64,
}

pub(super) fn simulate(clock: &Clock, rng: &mut impl Rng) -> Vec<Pose> {
    let reach = rng.random_range(0.05..0.12);
    let turn = rng.random_range(0.5..1.0);
    let pace = rng.random_range(0.7..1.4);
    // Slow carrying plus fast handling; all in the hand's own time, which pauses stop.
    let carry = VectorSignal::new(
        rng,
        [0.04 * pace, 0.4 * pace],
        8,
        [1.4 * reach, reach, reach],
    );
    let handle = VectorSignal::new(rng, [0.5 * pace, 1.6 * pace], 8, [0.05 * reach; 3]);
    let show = VectorSignal::new(rng, [0.03 * pace, 0.3 * pace], 8, [turn; 3]);
    let twist = VectorSignal::new(rng, [0.4 * pace, 1.5 * pace], 8, [0.04 * turn; 3]);
    // The tremor of a hand does not pause: it ends only where the object lies, so it is small.
    let tremor = VectorSignal::new(rng, [5.0, 11.0], 6, [1.5e-4; 3]);
    let centre = Vector::new(
        rng.random_range(-0.1..0.1),
        rng.random_range(-0.1..0.1),
        rng.random_range(0.6..0.9),
    );
    let upright = so3::exp(&(normal(rng) * 1.5));
    let every = rng.random_range(4.0..10.0);
    let activity = Activity::new(rng, every, 3.0, 0.6);
    let mut noise = SensorNoise::new(
        [5e-4, 2e-3],
        [2e-4, 1e-3],
        0.5,
        clock.step * clock.substeps as f64,
    );
    let mut noise_rng = ChaCha8Rng::seed_from_u64(rng.random());
    clock.run(
        State {
            activity,
            time: 0.0,
        },
        |state, step| {
            state.activity.advance(step, rng);
            state.time += step;
        },
        |state| {
            let t = state.activity.own_time();
            let pose = Pose {
                rotation: so3::exp(&show.at(t)) * upright * so3::exp(&twist.at(t)),
                translation: centre + carry.at(t) + handle.at(t) + tremor.at(state.time),
            };
            noise.apply(&pose, &mut noise_rng)
        },
    )
}
