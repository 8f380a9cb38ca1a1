//! Faults of the pose: each pose of the range changes on its own.

use std::f64::consts::PI;

use dose3_lie::{Pose, Vector, so3};
use rand_chacha::ChaCha8Rng;

use super::{from_forward_left_up, normal};
use crate::Frame;
use crate::read::euler_rotation;
use crate::write::euler_angles;

pub(super) fn jitter_position(poses: &mut [Pose], metres: f64, rng: &mut ChaCha8Rng) {
    for pose in poses {
        pose.translation += normal(rng) * metres;
    }
}

pub(super) fn jitter_rotation(poses: &mut [Pose], radians: f64, rng: &mut ChaCha8Rng) {
    for pose in poses {
        pose.rotation *= so3::exp(&(normal(rng) * radians));
    }
}

/// About the up axis, positive to the left.
pub(super) fn mounting(poses: &mut [Pose], frame: Frame, angle: f64) {
    let turn = so3::exp(&(from_forward_left_up(frame, Vector::z()) * angle));
    for pose in poses {
        pose.rotation *= turn;
    }
}

pub(super) fn swap_roll_and_pitch(poses: &mut [Pose], frame: Frame) {
    let axes = frame.to_forward_left_up();
    for pose in poses {
        let [roll, pitch, yaw] = euler_angles(&(axes * pose.rotation * axes.inverse()));
        pose.rotation = axes.inverse() * euler_rotation(pitch, roll, yaw) * axes;
    }
}

pub(super) fn degrees_for_radians(poses: &mut [Pose]) {
    for pose in poses {
        pose.rotation = so3::scale(PI / 180.0, &pose.rotation);
    }
}

pub(super) fn quantise(poses: &mut [Pose], metres: f64) {
    if metres == 0.0 {
        return;
    }
    for pose in poses {
        pose.translation = pose.translation.map(|x| (x / metres).round() * metres);
    }
}

/// A place of Central Europe in coordinates of UTM, forward, left, up for north, west, up.
const ORIGIN: [f64; 3] = [5_735_000.0, -620_000.0, 0.0];

pub(super) fn single_precision(poses: &mut [Pose], frame: Frame) {
    let axes = frame.to_forward_left_up();
    let origin = Vector::from(ORIGIN)
        - axes
            * poses
                .first()
                .map_or(Vector::zeros(), |pose| pose.translation);
    for pose in poses {
        let place = axes * pose.translation + origin;
        let rounded = place.map(|x| f64::from(x as f32));
        pose.translation += axes.inverse() * (rounded - place);
    }
}
