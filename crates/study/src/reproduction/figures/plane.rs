//! The plane in which a log moves.

use dose3_datasets::Frame;
use dose3_lie::{Pose, Vector};

/// Two directions of the world, and what they are called.
#[derive(Clone, Debug, PartialEq)]
pub struct Plane {
    /// To the right.
    pub across: Vector,
    /// Upwards.
    pub up: Vector,
    /// Names of both.
    pub names: [String; 2],
}

impl Plane {
    /// The ground where the frame of the body tells the axes of the world it starts in: x-z for a camera, north
    /// and east for forward-right-down, x-y for forward-left-up; else the two directions in which `poses` spread
    /// most.
    pub fn of_motion(frame: Frame, poses: &[Pose]) -> Self {
        match frame {
            Frame::CameraRdf => Self::of_axes(Vector::x(), "x", Vector::z(), "z"),
            Frame::BodyFrd => Self::of_axes(Vector::y(), "y, east", Vector::x(), "x, north"),
            Frame::BodyFlu => Self::of_axes(Vector::x(), "x", Vector::y(), "y"),
            Frame::Object | Frame::Sensor => Self::principal(poses),
        }
    }

    fn of_axes(across: Vector, right: &str, up: Vector, top: &str) -> Self {
        Self {
            across,
            up,
            names: [right.to_string(), top.to_string()],
        }
    }

    fn principal(poses: &[Pose]) -> Self {
        let count = poses.len().max(1) as f64;
        let mean = poses.iter().map(|p| p.translation).sum::<Vector>() / count;
        let spread = poses.iter().fold(dose3_lie::Matrix::zeros(), |sum, p| {
            let d = p.translation - mean;
            sum + d * d.transpose()
        });
        let eigen = spread.symmetric_eigen();
        let mut order = [0, 1, 2];
        order.sort_by(|a, b| eigen.eigenvalues[*b].total_cmp(&eigen.eigenvalues[*a]));
        let direction = |i: usize| {
            let v: Vector = eigen.eigenvectors.column(order[i]).into_owned();
            // An eigenvector has no sign; its largest entry is made positive.
            if v[v.iamax()] < 0.0 { -v } else { v }
        };
        Self::of_axes(
            direction(0),
            "1st principal direction",
            direction(1),
            "2nd principal direction",
        )
    }

    /// A point or direction as drawn.
    pub fn project(&self, v: &Vector) -> (f64, f64) {
        (self.across.dot(v), self.up.dot(v))
    }
}

/// Where a body of `frame` looks, in its own axes; x where the frame does not say.
pub fn forward(frame: Frame) -> Vector {
    match frame {
        Frame::CameraRdf => Vector::z(),
        _ => Vector::x(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use dose3_lie::Rotation;

    fn poses(points: &[[f64; 3]]) -> Vec<Pose> {
        let pose = |p: &[f64; 3]| Pose {
            rotation: Rotation::identity(),
            translation: Vector::from(*p),
        };
        points.iter().map(pose).collect()
    }

    #[test]
    fn a_camera_moves_in_x_and_z_and_a_vehicle_in_east_and_north() {
        let v = Vector::new(1.0, 2.0, 3.0);
        let at = |frame| Plane::of_motion(frame, &[]).project(&v);
        assert_eq!(at(Frame::CameraRdf), (1.0, 3.0));
        assert_eq!(at(Frame::BodyFrd), (2.0, 1.0));
        assert_eq!(at(Frame::BodyFlu), (1.0, 2.0));
    }

    #[test]
    fn an_object_is_seen_where_it_spreads_most() {
        // 3 along (0, 1, 1) / sqrt 2, 1 along x, nothing along (0, 1, -1).
        let cloud = poses(&[
            [0.0, 3.0, 3.0],
            [0.0, -3.0, -3.0],
            [1.0, 0.0, 0.0],
            [-1.0, 0.0, 0.0],
        ]);
        let plane = Plane::of_motion(Frame::Object, &cloud);
        let (across, up) = plane.project(&Vector::new(0.0, 1.0, 1.0));
        assert!((across - 2f64.sqrt()).abs() < 1e-12 && up.abs() < 1e-12);
        assert!((plane.up - Vector::x()).norm() < 1e-12);
        // A single pose has no plane, but must not fail.
        let still = Plane::of_motion(Frame::Object, &poses(&[[1.0, 2.0, 3.0]]));
        assert!((still.across.norm() - 1.0).abs() < 1e-12);
    }
}
