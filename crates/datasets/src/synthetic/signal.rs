//! Smooth random signals: what roads, hands and wind have in common.

use std::f64::consts::TAU;

use dose3_lie::{Pose, Vector, so3};
use rand::{Rng, RngExt};
use rand_distr::{Distribution, StandardNormal};

/// A sum of sinusoids: band-limited, infinitely smooth, the same for the same random numbers.
pub(super) struct Signal {
    /// Amplitude, angular frequency, phase.
    terms: Vec<[f64; 3]>,
}

impl Signal {
    /// Frequencies log-uniform in `band` (cycles per unit of the argument), amplitudes falling as `1 / f`,
    /// scaled to the given root mean square.
    pub fn new(rng: &mut impl Rng, band: [f64; 2], terms: usize, rms: f64) -> Self {
        let [low, high] = band.map(f64::ln);
        let mut terms: Vec<[f64; 3]> = (0..terms)
            .map(|index| {
                // One frequency in each equal part of the band: no seed leaves half of it empty.
                let share = (index as f64 + rng.random::<f64>()) / terms as f64;
                let frequency = (low + (high - low) * share).exp();
                let amplitude = (0.5 + rng.random::<f64>()) / frequency;
                [amplitude, TAU * frequency, TAU * rng.random::<f64>()]
            })
            .collect();
        let power: f64 = terms
            .iter()
            .map(|[amplitude, ..]| amplitude * amplitude / 2.0)
            .sum();
        let scale = if power > 0.0 { rms / power.sqrt() } else { 0.0 };
        terms
            .iter_mut()
            .for_each(|[amplitude, ..]| *amplitude *= scale);
        Self { terms }
    }

    pub fn at(&self, t: f64) -> f64 {
        self.terms
            .iter()
            .map(|[amplitude, omega, phase]| amplitude * (omega * t + phase).sin())
            .sum()
    }
}

/// Three signals as a vector.
pub(super) struct VectorSignal([Signal; 3]);

impl VectorSignal {
    pub fn new(rng: &mut impl Rng, band: [f64; 2], terms: usize, rms: [f64; 3]) -> Self {
        Self(rms.map(|rms| Signal::new(rng, band, terms, rms)))
    }

    pub fn at(&self, t: f64) -> Vector {
        Vector::new(self.0[0].at(t), self.0[1].at(t), self.0[2].at(t))
    }
}

/// A path's own time, which runs with the clock, slows down and stands still in pauses.
pub(super) struct Activity {
    own_time: f64,
    clock: f64,
    /// Start and end of the current or next pause, in clock time.
    pause: [f64; 2],
    every: f64,
    longest: f64,
    ramp: f64,
}

impl Activity {
    /// Pauses of up to `longest` seconds, `every` seconds of motion on average between them; the motion takes `ramp`
    /// seconds to stop and to start.
    pub fn new(rng: &mut impl Rng, every: f64, longest: f64, ramp: f64) -> Self {
        let mut activity = Self {
            own_time: 0.0,
            clock: 0.0,
            pause: [0.0, 0.0],
            every,
            longest,
            ramp,
        };
        activity.plan(rng);
        activity
    }

    pub fn own_time(&self) -> f64 {
        self.own_time
    }

    /// Advances the clock by `step` seconds.
    pub fn advance(&mut self, step: f64, rng: &mut impl Rng) {
        self.own_time += step * self.speed();
        self.clock += step;
        if self.clock > self.pause[1] + self.ramp {
            self.plan(rng);
        }
    }

    fn plan(&mut self, rng: &mut impl Rng) {
        let start = self.clock + self.ramp + self.every * rng.random_range(0.4..1.6);
        self.pause = [start, start + self.longest * rng.random_range(0.2..1.0)];
    }

    /// 1 in motion, 0 in a pause, smooth between.
    fn speed(&self) -> f64 {
        let away = (self.pause[0] - self.clock).max(self.clock - self.pause[1]);
        let x = (away / self.ramp).clamp(0.0, 1.0);
        x * x * x * (x * (6.0 * x - 15.0) + 10.0)
    }
}

/// Errors of a real sensor: a slowly wandering part and a white part, for position (metres) and rotation (radians).
pub(super) struct SensorNoise {
    wander: [Vector; 2],
    wander_rms: [f64; 2],
    white: [f64; 2],
    /// What the wandering part keeps of itself from one pose to the next.
    memory: f64,
}

impl SensorNoise {
    /// `wander` and `white` are root mean squares of position and rotation; `seconds` the correlation time.
    pub fn new(wander: [f64; 2], white: [f64; 2], seconds: f64, period: f64) -> Self {
        Self {
            wander: [Vector::zeros(); 2],
            wander_rms: wander,
            white,
            memory: (-period / seconds).exp(),
        }
    }

    /// The pose as the sensor reports it, once per pose in order.
    pub fn apply(&mut self, pose: &Pose, rng: &mut impl Rng) -> Pose {
        let fresh = (1.0 - self.memory * self.memory).sqrt();
        let mut error = [Vector::zeros(); 2];
        for (part, error) in error.iter_mut().enumerate() {
            self.wander[part] =
                self.wander[part] * self.memory + normal(rng) * (fresh * self.wander_rms[part]);
            *error = self.wander[part] + normal(rng) * self.white[part];
        }
        Pose {
            rotation: pose.rotation * so3::exp(&error[1]),
            translation: pose.translation + error[0],
        }
    }
}

/// Three independent standard normal numbers.
pub(super) fn normal(rng: &mut impl Rng) -> Vector {
    Vector::from_fn(|_, _| StandardNormal.sample(rng))
}
