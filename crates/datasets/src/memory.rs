//! Checks of poses that come from memory.

use dose3_lie::{Pose, so3};

use crate::read::LARGEST_COORDINATE;
use crate::{Error, LoadReport};

/// Largest entry of `|R^T R - I|` that is taken for rounding of single precision.
const ROUNDING: f64 = 1e-5;
/// Largest one that is repaired.
const REPAIRED: f64 = 1e-3;

/// Checks stamps and poses of a log, replaces rotations that are off, and says how many were.
pub(crate) fn check(name: &str, stamps: &[i64], poses: &mut [Pose]) -> Result<LoadReport, Error> {
    let fault = |pose: usize, expected: &'static str, found: String| {
        Err(Error::Memory {
            name: name.to_owned(),
            pose,
            expected,
            found,
        })
    };
    if stamps.len() != poses.len() {
        let found = format!("{} stamps and {} poses", stamps.len(), poses.len());
        return fault(
            stamps.len().min(poses.len()),
            "a stamp for every pose",
            found,
        );
    }
    if poses.len() < 2 {
        return fault(
            poses.len(),
            "two poses at least",
            format!("{}", poses.len()),
        );
    }
    if let Some(i) = (1..stamps.len()).find(|i| stamps[i - 1] >= stamps[*i]) {
        let found = format!("{} after {}", stamps[i], stamps[i - 1]);
        return fault(i, "a stamp later than the one before, nanoseconds", found);
    }
    let mut report = LoadReport::default();
    for (i, pose) in poses.iter_mut().enumerate() {
        if !pose.is_finite() {
            return fault(i, "finite numbers", "NaN or infinity".to_owned());
        }
        if pose.translation.amax() > LARGEST_COORDINATE {
            let found = format!("{:e}", pose.translation.amax());
            return fault(i, "coordinates in metres below 1e9", found);
        }
        let projected = match so3::project(pose.rotation.matrix(), REPAIRED) {
            Ok(projected) => projected,
            Err(error) => return fault(i, "a rotation", error.to_string()),
        };
        report.largest_rotation_error = report.largest_rotation_error.max(projected.error);
        if projected.error > ROUNDING {
            report.rotations_projected += 1;
            pose.rotation = projected.rotation;
        }
    }
    Ok(report)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Frame, Trajectory};
    use dose3_lie::nalgebra::{Isometry3, Vector3};
    use dose3_lie::{Matrix, Rotation, Vector};

    fn log(stamps: &[i64], change: impl Fn(&mut Vec<Pose>)) -> Result<Trajectory, Error> {
        let pose = |i| Isometry3::new(Vector3::new(f64::from(i), 0.0, 0.0), Vector3::z() * 0.1);
        let mut poses: Vec<Pose> = (0..3).map(|i| pose(i).into()).collect();
        change(&mut poses);
        Trajectory::from_poses("log", Frame::Sensor, stamps, poses)
    }

    #[test]
    fn poses_that_are_no_log_are_refused_with_the_pose_at_fault() {
        let pose_of = |result: Result<Trajectory, Error>| match result {
            Err(Error::Memory { pose, .. }) => pose,
            other => panic!("{other:?}"),
        };
        let good = [0, 10, 20];
        assert!(log(&good, |_| ()).unwrap().report.is_clean());
        assert_eq!(pose_of(log(&[0, 10], |_| ())), 2);
        assert_eq!(pose_of(log(&[0, 10, 10], |_| ())), 2);
        assert_eq!(pose_of(log(&good[..1], |p| p.truncate(1))), 1);
        let nan = |p: &mut Vec<Pose>| p[1].translation.x = f64::NAN;
        assert_eq!(pose_of(log(&good, nan)), 1);
        // As readers of files have it.
        let far = |p: &mut Vec<Pose>| p[1].translation.x = -1e10;
        assert_eq!(pose_of(log(&good, far)), 1);
        let with = |factor: f64| {
            move |p: &mut Vec<Pose>| {
                let matrix = Matrix::identity() * factor;
                p[2] = Pose::new(Rotation::from_matrix_unchecked(matrix), Vector::zeros());
            }
        };
        assert_eq!(pose_of(log(&good, with(1.1))), 2);
        assert_eq!(pose_of(log(&good, with(-1.0))), 2);
        // Off by more than rounding: repaired, and said.
        let repaired = log(&good, with(1.0001)).unwrap();
        assert_eq!(repaired.report.rotations_projected, 1);
        assert_eq!(repaired.poses[2].rotation, Rotation::identity());
    }
}
