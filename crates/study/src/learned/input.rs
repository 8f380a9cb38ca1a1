//! Windows of poses as the numbers and labels that the baselines learn from.

use anyhow::{Context, Result, ensure};
use dose3_baselines::Motion;
use dose3_datasets::{Representation, Trajectory, Window, increments};
use dose3_diffusion::rotation_tangents;

/// Numbers of an element: represented translation x, y, z, then rotation tangent x, y, z.
pub const CHANNELS: usize = 6;

/// The represented windows, `[windows, length, CHANNELS]`.
///
/// # Errors
/// A window that cannot be represented, or of another length.
pub fn numbers(
    trajectories: &[Trajectory],
    windows: &[Window],
    representation: Representation,
    length: usize,
) -> Result<Vec<f32>> {
    let mut out = Vec::with_capacity(windows.len() * length * CHANNELS);
    for window in windows {
        let tensor = representation.represent_window(window, trajectories)?;
        ensure!(
            tensor.length == length,
            "a window of {} elements where {length} are needed",
            tensor.length
        );
        let tangents = rotation_tangents(&tensor.rotation);
        let elements = tensor.translation.chunks_exact(3);
        for (translation, rotation) in elements.zip(tangents.chunks_exact(3)) {
            out.extend_from_slice(translation);
            out.extend_from_slice(rotation);
        }
    }
    Ok(out)
}

/// Mean turning rate and speed of each window, in forward-left-up axes of the body.
///
/// # Errors
/// A window that lies outside its log or has no step.
pub fn motions(trajectories: &[Trajectory], windows: &[Window]) -> Result<Vec<Motion>> {
    let motion = |window: &Window| {
        let poses = window
            .poses(trajectories)
            .filter(|poses| poses.len() > 1)
            .with_context(|| format!("window {window:?} has no steps in its log"))?;
        let steps = increments(poses, trajectories[window.trajectory].frame);
        let (mut yaw, mut path) = (0.0, 0.0);
        for step in steps.chunks_exact(6) {
            yaw += step[5];
            path += step[..3].iter().map(|v| v * v).sum::<f64>().sqrt();
        }
        let count = (poses.len() - 1) as f64;
        Ok(Motion {
            yaw_rate: yaw / count,
            speed: path / count,
        })
    };
    windows.iter().map(motion).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use dose3_datasets::Kind;
    use dose3_datasets::synthetic::{Platform, trajectory};
    use dose3_lie::{Vector, so3};

    /// 0.5 m forward and 0.01 rad to the left from each pose to the next.
    fn left_turn() -> Trajectory {
        let mut log = trajectory(Platform::Vehicle, 1, 20, 10.0);
        for i in 1..log.poses.len() {
            let mut pose = log.poses[i - 1];
            pose.translation += pose.rotation * Vector::new(0.5, 0.0, 0.0);
            pose.rotation *= so3::exp(&Vector::new(0.0, 0.0, 0.01));
            log.poses[i] = pose;
        }
        log
    }

    fn window(length: usize) -> Window {
        Window {
            trajectory: 0,
            start: 2,
            length,
        }
    }

    #[test]
    fn a_left_turn_by_hand() {
        let logs = [left_turn()];
        let motion = motions(&logs, &[window(10)]).unwrap()[0];
        assert!((motion.yaw_rate - 0.01).abs() < 1e-12);
        assert!((motion.speed - 0.5).abs() < 1e-12);
        assert!(motions(&logs, &[window(1)]).is_err());

        let scaling = dose3_datasets::Scaling::Stored {
            translation: 0.25,
            rotation: 10.0,
        };
        let kind = Kind::Motion;
        let representation = Representation { kind, scaling };
        let numbers = numbers(&logs, &[window(5)], representation, 4).unwrap();
        assert_eq!(numbers.len(), 4 * CHANNELS);
        for element in numbers.chunks_exact(CHANNELS) {
            let expected = [2.0, 0.0, 0.0, 0.0, 0.0, 0.1];
            let far = element.iter().zip(expected).map(|(a, b)| (a - b).abs());
            assert!(far.fold(0.0_f32, f32::max) < 1e-5, "{element:?}");
        }
    }

    #[test]
    fn windows_of_another_length_are_refused() {
        let logs = [left_turn()];
        assert!(numbers(&logs, &[window(5)], Representation::PAPER, 4).is_err());
    }
}
