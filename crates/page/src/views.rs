//! From where a path is looked at: from above and from the side, along its own axes.

use dose3::Pose;
use dose3::datasets::Frame;
use dose3::nalgebra::{Matrix2, Matrix3, SymmetricEigen, Vector3};

/// Mean of unit vectors above which they agree on a direction.
const AGREED: f64 = 0.7;

/// A path in its own axes.
pub struct Views {
    /// Per pose metres along the path's longest direction, across it, and up (or along its shortest).
    pub points: Vec<[f64; 3]>,
    /// Whether up is that of the body; else it is the direction in which the path extends least.
    pub up_of_body: bool,
}

impl Views {
    /// Of the poses of a body whose axes are those of `frame`.
    ///
    /// Where the body's up is known and it mostly stays upright, that is up, and the plane below is turned to the
    /// path's principal axes; else all three are principal axes. The path ends further along the first than it begins.
    pub fn new(poses: &[Pose], frame: Frame) -> Self {
        let count = poses.len().max(1) as f64;
        let origin = poses.first().map_or(Vector3::zeros(), |p| p.translation);
        // Coordinates may be UTM: the origin goes first.
        let places: Vec<Vector3<f64>> = poses.iter().map(|p| p.translation - origin).collect();
        let mean = places.iter().sum::<Vector3<f64>>() / count;
        let spread: Matrix3<f64> = places
            .iter()
            .map(|p| (p - mean) * (p - mean).transpose())
            .sum();
        let up = body_up(poses, frame);
        let axes = match up {
            Some(up) => upright(&spread, up),
            None => principal(&spread),
        };
        let axes = forwards(axes, places.last().copied().unwrap_or_default());
        let point = |p: &Vector3<f64>| {
            let p = p - mean;
            [p.dot(&axes[0]), p.dot(&axes[1]), p.dot(&axes[2])]
        };
        Self {
            points: places.iter().map(point).collect(),
            up_of_body: up.is_some(),
        }
    }
}

/// The direction that is up for the body on average, where there is one.
fn body_up(poses: &[Pose], frame: Frame) -> Option<Vector3<f64>> {
    if !frame.has_forward() {
        return None;
    }
    let up = frame.to_forward_left_up().inverse() * Vector3::z();
    let sum: Vector3<f64> = poses.iter().map(|pose| pose.rotation * up).sum();
    let mean = sum / poses.len().max(1) as f64;
    (mean.norm() >= AGREED).then(|| mean.normalize())
}

/// The principal axes of the plane below `up`, and `up`.
fn upright(spread: &Matrix3<f64>, up: Vector3<f64>) -> [Vector3<f64>; 3] {
    let helper = match up.x.abs() < 0.9 {
        true => Vector3::x(),
        false => Vector3::y(),
    };
    let u = up.cross(&helper).normalize();
    let v = up.cross(&u);
    let (uv, uu, vv) = (
        u.dot(&(spread * v)),
        u.dot(&(spread * u)),
        v.dot(&(spread * v)),
    );
    let eigen = SymmetricEigen::new(Matrix2::new(uu, uv, uv, vv));
    let largest = eigen.eigenvectors.column(eigen.eigenvalues.imax());
    let along = u * largest[0] + v * largest[1];
    [along, up.cross(&along), up]
}

/// The principal axes, the longest first, right-handed.
fn principal(spread: &Matrix3<f64>) -> [Vector3<f64>; 3] {
    let eigen = SymmetricEigen::new(*spread);
    let mut order = [0, 1, 2];
    order.sort_by(|&a, &b| eigen.eigenvalues[b].total_cmp(&eigen.eigenvalues[a]));
    let along: Vector3<f64> = eigen.eigenvectors.column(order[0]).into();
    let mut up: Vector3<f64> = eigen.eigenvectors.column(order[2]).into();
    // Of two signs the one whose largest component is positive, so that a repeated run draws the same.
    if up[up.iamax()] < 0.0 {
        up = -up;
    }
    [along, up.cross(&along), up]
}

/// Turned about up so that `last` lies ahead; the largest component decides where it lies at the start.
fn forwards(axes: [Vector3<f64>; 3], last: Vector3<f64>) -> [Vector3<f64>; 3] {
    let [along, across, up] = axes;
    let ahead = last.dot(&along);
    let behind = match ahead.abs() > 1e-9 {
        true => ahead < 0.0,
        false => along[along.iamax()] < 0.0,
    };
    match behind {
        true => [-along, -across, up],
        false => axes,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use dose3::lie::{Rotation, Vector};

    /// A camera that drives 100 m along (1, 0, 1), with y down, and 10 m to its left and back.
    fn drive() -> Vec<Pose> {
        let yaw = Rotation::from_axis_angle(&Vector::y_axis(), std::f64::consts::FRAC_PI_4);
        let at = |i: i32| {
            let s = f64::from(i);
            let left = 10.0 * (s / 100.0 * std::f64::consts::PI).sin();
            let body = Vector::new(-left, -0.01 * s, s);
            Pose::new(yaw, yaw * body + Vector::new(5e5, 0.0, 4e6))
        };
        (0..=100).map(at).collect()
    }

    #[test]
    fn a_camera_that_drives_is_seen_from_above() {
        let views = Views::new(&drive(), Frame::CameraRdf);
        assert!(views.up_of_body);
        let (first, last) = (views.points[0], views.points[100]);
        assert!(
            (last[0] - first[0] - 100.0).abs() < 0.1,
            "{first:?} {last:?}"
        );
        // Left is positive, and up is up though the camera's y points down.
        assert!(views.points[50][1] > first[1] + 9.0);
        assert!((last[2] - first[2] - 1.0).abs() < 1e-3);
    }

    #[test]
    fn lengths_are_kept_without_a_known_up() {
        let poses = drive();
        let views = Views::new(&poses, Frame::Object);
        assert!(!views.up_of_body);
        for (i, j) in [(0, 100), (3, 50), (50, 99)] {
            let true_length = (poses[i].translation - poses[j].translation).norm();
            let (a, b) = (views.points[i], views.points[j]);
            let drawn = (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f64>().sqrt();
            assert!((drawn - true_length).abs() < 1e-6);
        }
        let extent = |axis: usize| {
            let of = views.points.iter().map(|p| p[axis]);
            of.clone().fold(f64::MIN, f64::max) - of.fold(f64::MAX, f64::min)
        };
        assert!(extent(0) > extent(1) && extent(1) > extent(2));
    }

    #[test]
    fn a_body_that_stands_still_has_a_view() {
        let poses = vec![Pose::identity(); 5];
        for frame in [Frame::BodyFlu, Frame::Sensor] {
            let views = Views::new(&poses, frame);
            assert!(views.points.iter().flatten().all(|x| *x == 0.0));
        }
        assert!(Views::new(&[], Frame::Sensor).points.is_empty());
    }
}
