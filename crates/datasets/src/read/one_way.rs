//! Whether a body moves along one direction of its own, as a car does: under the right order of its quaternion it
//! does, under the other one the direction changes as soon as the body turns.

use dose3_lie::{Rotation, Vector};

/// Turning after which the direction of motion is looked at afresh, radians: between two such looks the body has turned, so
/// that they are evidence of their own. All orders of a quaternion have the same angles between poses, and so the same looks.
const LOOK: f64 = 0.1;
/// The direction of a car holds to a few degrees; a spread less than that of 2.5 degrees says no more.
const LEAST_SPREAD: f64 = 1e-3;
/// Directions that spread more than this (about 9 degrees) are not one direction: half as much again as the most of synthetic
/// drives, 0.0077 (seeds 1000 to 1149, 42 stretches of 25 to 2000 poses of each).
const MOST_SPREAD: f64 = 0.012;
/// Log-likelihood by which one reading must tell the directions better than the other, nats: half as much again as the most by
/// which a wrong order that spreads no more was better in synthetic logs of all platforms, 41 (the same seeds and
/// stretches, both kinds of wrong order). The right order of a drive is better by some 4 for each look.
const SURE: f64 = 60.0;

/// How well one direction tells the directions of motion in the body frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct OneWay {
    /// 1 - |mean direction|: 0 where it is always the same, 1 where there is none.
    pub spread: f64,
    /// Log-likelihood of the directions under the best von Mises-Fisher distribution beyond that under the uniform one, nats.
    pub nats: f64,
}

impl OneWay {
    /// Of the way between poses; `None` for a body that stands still.
    pub fn new(positions: &[Vector], rotations: &[Rotation]) -> Option<Self> {
        let looks = looks(positions, rotations);
        let length: f64 = looks.iter().map(|way| way.norm()).sum();
        let sum: Vector = looks.iter().sum();
        (length > 0.0 && length.is_finite()).then(|| {
            let spread = (1.0 - sum.norm() / length).max(0.0);
            // The first look gives the direction that the others are held against.
            let nats = (looks.len() - 1) as f64 * likelihood(spread);
            Self { spread, nats }
        })
    }

    /// Whether the motion has one direction under this reading, and clearly less so under the other, which also says
    /// that the body turns. Hands, and cameras that look anywhere, have none under both.
    pub fn beats(self, other: Self) -> bool {
        self.spread < MOST_SPREAD && self.nats - other.nats > SURE
    }
}

/// The way in the body frame from look to look; at least one.
fn looks(positions: &[Vector], rotations: &[Rotation]) -> Vec<Vector> {
    let mut looks = Vec::new();
    let (mut way, mut from) = (Vector::zeros(), 0);
    for index in 1..positions.len() {
        way += rotations[index - 1].inverse() * (positions[index] - positions[index - 1]);
        if rotations[from].angle_to(&rotations[index]) > LOOK {
            looks.push(way);
            (way, from) = (Vector::zeros(), index);
        }
    }
    looks.push(way);
    looks
}

/// Log-likelihood of a direction under the von Mises-Fisher distribution of this spread beyond that under the uniform one,
/// nats: `ln(k / sinh k) + k (1 - spread)`, with the concentration k of Banerjee et al. (2005), equation 4.4.
fn likelihood(spread: f64) -> f64 {
    let mean = 1.0 - spread.clamp(LEAST_SPREAD, 1.0);
    if mean < 1e-6 {
        return 0.0;
    }
    let k = mean * (3.0 - mean * mean) / (1.0 - mean * mean);
    (2.0 * k).ln() - k * (1.0 - mean) - (-(-2.0 * k).exp()).ln_1p()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::synthetic::{Platform, trajectory};
    use nalgebra::{Quaternion, UnitQuaternion};

    /// Rotations read in the wrong order, for both kinds of file.
    fn misread(rotations: &[Rotation], w_last: bool) -> Vec<Rotation> {
        let turned = |rotation: &Rotation| {
            let q = UnitQuaternion::from_rotation_matrix(rotation);
            let q = if w_last {
                Quaternion::new(q.i, q.j, q.k, q.w)
            } else {
                Quaternion::new(q.k, q.w, q.i, q.j)
            };
            UnitQuaternion::from_quaternion(q).to_rotation_matrix()
        };
        rotations.iter().map(turned).collect()
    }

    #[test]
    fn the_likelihood_falls_from_one_direction_to_none() {
        let values: Vec<f64> = (0..=100)
            .map(|i| likelihood(f64::from(i) / 100.0))
            .collect();
        assert!(values.windows(2).all(|pair| pair[0] > pair[1]));
        assert_eq!(values[100], 0.0);
        // Narrow: -ln(spread) + ln 2 - 1.
        assert!((likelihood(0.01) - (200_f64.ln() - 1.0)).abs() < 0.01);
    }

    #[test]
    fn wrong_orders_never_win_and_right_ones_do_on_drives_that_turn() {
        // Seeds other than those that the margin is from.
        let (mut drives, mut told) = ([0, 0], [0, 0]);
        for platform in Platform::ALL {
            for seed in 5000..5040 {
                let log = trajectory(platform, seed, 3000, 20.0);
                let positions: Vec<Vector> = log.poses.iter().map(|p| p.translation).collect();
                let right: Vec<Rotation> = log.poses.iter().map(|p| p.rotation).collect();
                for w_last in [true, false] {
                    let wrong = misread(&right, w_last);
                    for (start, length) in [
                        (300, 25),
                        (900, 50),
                        (2000, 100),
                        (700, 200),
                        (100, 500),
                        (2000, 1000),
                        (0, 3000),
                    ] {
                        let rows = start..start + length;
                        let of = |rotations: &[Rotation]| {
                            OneWay::new(&positions[rows.clone()], &rotations[rows.clone()])
                        };
                        let (Some(right), Some(wrong)) = (of(&right), of(&wrong)) else {
                            continue;
                        };
                        let what = format!("{platform} {seed} {rows:?}: {right:?} {wrong:?}");
                        assert!(!wrong.beats(right), "{what}");
                        if platform == Platform::Vehicle && length >= 1000 {
                            let long = usize::from(length == 3000);
                            drives[long] += 1;
                            told[long] += usize::from(right.beats(wrong));
                        }
                    }
                }
            }
        }
        // Those of 50 seconds, some of which hardly turn, and those of 150.
        assert!(100 * told[0] > 60 * drives[0], "{told:?} of {drives:?}");
        assert!(100 * told[1] > 95 * drives[1], "{told:?} of {drives:?}");
    }
}
