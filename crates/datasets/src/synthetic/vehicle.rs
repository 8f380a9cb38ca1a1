//! A car: a driver with a speed and a steering target, a kinematic bicycle, a sprung body on a rough road.

use std::collections::VecDeque;
use std::f64::consts::{FRAC_PI_2, PI};

use dose3_lie::{Pose, Rotation, Vector};
use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::Clock;
use super::signal::{SensorNoise, Signal};

/// Comfortable accelerations and jerk of a driver, m/s^2 and m/s^3.
const ACCELERATION: f64 = 1.6;
const BRAKING: f64 = 2.4;
const JERK: f64 = 2.5;
/// Fastest turn of the road wheels, rad/s.
const STEERING_RATE: f64 = 0.6;
/// Lateral acceleration that a driver accepts in a bend, m/s^2.
const LATERAL: f64 = 2.5;

/// A piece of road with one speed and one curvature (1/m, positive to the left).
struct Segment {
    end: End,
    speed: f64,
    curvature: f64,
}

/// When a segment is over.
enum End {
    /// After so many metres.
    Metres(f64),
    /// After so many seconds of standing.
    Standing(f64),
}

/// What differs between cars and roads.
struct Car {
    wheel_base: f64,
    cruise: [f64; 2],
    turn_share: f64,
    stop_share: f64,
    /// Angular frequency and damping of the body on its springs.
    spring: [f64; 2],
    /// Roll and pitch per acceleration, rad/(m/s^2).
    lean: [f64; 2],
    /// Where the sensor sits, forward-left-up from the rear axle, metres.
    lever: Vector,
    /// Road profile over distance: heave (m), roll and pitch (rad) of the rough surface; grade and bank (rad).
    rough: [Signal; 3],
    grade: Signal,
    bank: Signal,
    /// The driver's small corrections of the steering over time, rad.
    correction: Signal,
}

struct State {
    position: Vector,
    yaw: f64,
    speed: f64,
    acceleration: f64,
    steering: f64,
    travelled: f64,
    time: f64,
    /// Heave, roll, pitch of the body and their rates.
    body: [[f64; 2]; 3],
    plan: VecDeque<Segment>,
}

pub(super) fn simulate(clock: &Clock, rng: &mut impl Rng) -> Vec<Pose> {
    let car = Car::new(rng);
    let mut noise = SensorNoise::new(
        [4e-3, 3e-4],
        [2e-4, 4e-5],
        2.0,
        clock.step * clock.substeps as f64,
    );
    let state = State {
        position: Vector::new(
            rng.random_range(-500.0..500.0),
            rng.random_range(-500.0..500.0),
            rng.random_range(0.0..100.0),
        ),
        yaw: rng.random_range(-PI..PI),
        speed: rng.random_range(0.0..car.cruise[1]),
        acceleration: 0.0,
        steering: 0.0,
        travelled: 0.0,
        time: 0.0,
        body: [[0.0; 2]; 3],
        plan: VecDeque::new(),
    };
    let mut noise_rng = ChaCha8Rng::seed_from_u64(rng.random());
    clock.run(
        state,
        |state, step| state.advance(&car, step, rng),
        |state| noise.apply(&state.pose(&car), &mut noise_rng),
    )
}

impl Car {
    fn new(rng: &mut impl Rng) -> Self {
        let cruise = rng.random_range(7.0..19.0);
        Self {
            wheel_base: rng.random_range(2.4..3.0),
            cruise: [0.6 * cruise, cruise],
            turn_share: rng.random_range(0.15..0.35),
            stop_share: rng.random_range(0.06..0.18),
            spring: [
                2.0 * PI * rng.random_range(1.2..1.7),
                rng.random_range(0.25..0.4),
            ],
            lean: [rng.random_range(4e-3..8e-3), rng.random_range(4e-3..8e-3)],
            lever: Vector::new(
                rng.random_range(0.8..1.8),
                rng.random_range(-0.3..0.3),
                rng.random_range(1.4..1.9),
            ),
            rough: [0.010, 0.004, 0.004].map(|rms| {
                let rms = rms * rng.random_range(0.6..1.4);
                Signal::new(rng, [0.02, 0.5], 16, rms)
            }),
            grade: Signal::new(rng, [1.0 / 900.0, 1.0 / 120.0], 6, 0.02),
            bank: Signal::new(rng, [1.0 / 300.0, 1.0 / 40.0], 6, 0.012),
            correction: Signal::new(rng, [0.05, 0.4], 8, 0.003),
        }
    }
}

impl State {
    fn advance(&mut self, car: &Car, step: f64, rng: &mut impl Rng) {
        let (target_speed, curvature) = self.follow_plan(car, step, rng);
        self.drive(target_speed, step);
        self.steer(car, curvature, step);
        let yaw_rate = self.speed * self.steering.tan() / car.wheel_base;
        let grade = car.grade.at(self.travelled);
        self.yaw += yaw_rate * step;
        let (sine, cosine) = self.yaw.sin_cos();
        let flat = self.speed * grade.cos() * step;
        self.position += Vector::new(flat * cosine, flat * sine, self.speed * grade.sin() * step);
        self.travelled += self.speed * step;
        self.time += step;
        // Bodies lean out of a bend and dive when braking (forward-left-up: roll right and nose down positive).
        let lean = [
            0.0,
            car.lean[0] * self.speed * yaw_rate,
            -car.lean[1] * self.acceleration,
        ];
        let [omega, damping] = car.spring;
        for (axis, [value, rate]) in self.body.iter_mut().enumerate() {
            let rest = lean[axis] + car.rough[axis].at(self.travelled);
            *rate += (omega * omega * (rest - *value) - 2.0 * damping * omega * *rate) * step;
            *value += *rate * step;
        }
    }

    /// Target speed and curvature now; takes finished segments off the plan.
    fn follow_plan(&mut self, car: &Car, step: f64, rng: &mut impl Rng) -> (f64, f64) {
        while self.plan.len() < 2 {
            self.extend_plan(car, rng);
        }
        let speed = self.speed;
        let segment = &mut self.plan[0];
        let over = match &mut segment.end {
            End::Metres(left) => {
                *left -= speed * step;
                *left <= 0.0
            }
            End::Standing(left) => {
                if speed == 0.0 {
                    *left -= step;
                }
                *left <= 0.0
            }
        };
        let now = (segment.speed, segment.curvature);
        if over {
            self.plan.pop_front();
        }
        now
    }

    /// Adds a straight, a bend, a turn at a junction or a stop.
    fn extend_plan(&mut self, car: &Car, rng: &mut impl Rng) {
        let cruise = rng.random_range(car.cruise[0]..car.cruise[1]);
        let side = if rng.random_bool(0.5) { 1.0 } else { -1.0 };
        let kind: f64 = rng.random();
        if kind < car.stop_share {
            self.plan.push_back(Segment {
                end: End::Standing(rng.random_range(2.0..12.0)),
                speed: 0.0,
                curvature: 0.0,
            });
        } else if kind < car.stop_share + car.turn_share {
            let radius = rng.random_range(8.0..16.0);
            let speed = (LATERAL * radius).sqrt().min(cruise);
            let angle = FRAC_PI_2 * rng.random_range(0.7..1.2);
            let approach = 4.0 + (car.cruise[1].powi(2) - speed * speed).max(0.0) / (1.4 * BRAKING);
            self.plan.push_back(Segment {
                end: End::Metres(approach),
                speed,
                curvature: 0.0,
            });
            self.plan.push_back(Segment {
                end: End::Metres(radius * angle),
                speed,
                curvature: side / radius,
            });
        } else if kind < 0.75 {
            let radius = rng.random_range(50.0..300.0);
            let speed = (LATERAL * radius).sqrt().min(cruise);
            let metres = rng.random_range(20.0..90.0);
            self.plan.push_back(Segment {
                end: End::Metres(metres),
                speed,
                curvature: side / radius,
            });
        } else {
            let metres = rng.random_range(30.0..150.0);
            self.plan.push_back(Segment {
                end: End::Metres(metres),
                speed: cruise,
                curvature: 0.0,
            });
        }
    }

    fn drive(&mut self, target: f64, step: f64) {
        let wanted = ((target - self.speed) / 1.2).clamp(-BRAKING, ACCELERATION);
        self.acceleration += (wanted - self.acceleration).clamp(-JERK * step, JERK * step);
        self.speed += self.acceleration * step;
        if self.speed <= 0.0 || target == 0.0 && self.speed < 0.1 {
            // The brakes hold.
            self.speed = 0.0;
            self.acceleration = self.acceleration.max(0.0);
        }
    }

    fn steer(&mut self, car: &Car, curvature: f64, step: f64) {
        // Nobody turns the wheel while standing.
        let moving = (self.speed / 2.0).min(1.0);
        let target = (car.wheel_base * curvature).atan()
            + car.correction.at(self.time) * (4.0 / (4.0 + self.speed));
        let rate = ((target - self.steering) / 0.35).clamp(-STEERING_RATE, STEERING_RATE);
        self.steering += rate * moving * step;
    }

    fn pose(&self, car: &Car) -> Pose {
        let [heave, roll, pitch] = self.body.map(|[value, _]| value);
        let rotation = Rotation::from_euler_angles(
            car.bank.at(self.travelled) + roll,
            pitch - car.grade.at(self.travelled),
            self.yaw,
        );
        let translation = self.position + rotation * (car.lever + Vector::new(0.0, 0.0, heave));
        Pose {
            rotation,
            translation,
        }
    }
}
