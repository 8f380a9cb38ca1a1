//! Where the angles are among seven numbers without a header.

use dose3_lie::{Rotation, Vector, so3};

use super::sample::Sample;
use super::settle::Turn;
use crate::read::collect::euler_rotation;
use crate::read::guess::{self, OVERRULED};

/// A body that turns less, radians, moves evenly under any reading.
const LEAST_TURNING: f64 = 0.2;
/// A thousandth of the speed is rounding.
const ROUNDING: f64 = 1e-3;

/// What six numbers behind a stamp are where the motion is far more even so than as position, roll, pitch and yaw.
pub(super) fn other(sample: &Sample) -> Option<String> {
    let angles = sample.rotations.iter();
    let angles: Vec<Vector> = angles.map(|[a, b, c, _]| Vector::new(*a, *b, *c)).collect();
    let turns: [(&str, Turn); 3] = [
        ("roll, pitch, yaw", euler_rotation),
        ("yaw, pitch, roll", |yaw, pitch, roll| {
            euler_rotation(roll, pitch, yaw)
        }),
        ("a rotation vector", |x, y, z| {
            so3::exp(&Vector::new(x, y, z))
        }),
    ];
    let (mut usual, mut best, mut words) = (f64::INFINITY, f64::INFINITY, String::new());
    let positions = &sample.positions;
    for (behind, positions, numbers) in [(true, positions, &angles), (false, &angles, positions)] {
        for ((index, (name, turn)), factor) in turns
            .iter()
            .enumerate()
            .flat_map(|turn| [(turn, 1.0), (turn, 1_f64.to_radians())])
        {
            let scaled = numbers.iter().map(|numbers| numbers * factor);
            let rotations: Vec<Rotation> = scaled.map(|v| turn(v.x, v.y, v.z)).collect();
            let Some(roughness) = guess::roughness(positions, &rotations) else {
                continue;
            };
            let first = rotations[0].inverse();
            let turned = || {
                rotations
                    .iter()
                    .any(|other| so3::log(&(first * *other)).norm() > LEAST_TURNING)
            };
            if behind && index == 0 {
                usual = usual.min(roughness);
            } else if roughness < best && turned() {
                best = roughness;
                words = match behind {
                    true => format!("position, {name}"),
                    false => format!("{name}, position"),
                };
            }
        }
    }
    let decided = usual.is_finite() && (best + ROUNDING) * OVERRULED < usual + ROUNDING;
    decided.then_some(words)
}
