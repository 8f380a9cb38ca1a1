//! The motion of a body between consecutive poses, as the body sees it.

use dose3_lie::{Pose, so3};

use crate::Frame;

/// `T_i^-1 T_{i+1}` of consecutive poses, in the log's own axes, metres and radians.
///
/// The difference of positions is taken before it is turned ([`Pose::relative`]): with UTM coordinates,
/// subtracting afterwards would lose nanometres.
pub(crate) fn motions(poses: &[Pose]) -> impl Iterator<Item = Pose> + '_ {
    poses.windows(2).map(|pair| pair[0].relative(&pair[1]))
}

/// Body-frame motion between consecutive poses, `[poses - 1, 6]`: the translation of `T_i^-1 T_{i+1}` in metres
/// and the logarithm of its rotation in radians, in forward-left-up axes where `frame` defines them, else in the
/// body's own.
///
/// ```
/// use dose3_datasets::{Frame, increments};
/// use dose3_lie::{Pose, Rotation, Vector};
///
/// // A camera that looks ahead and moves a metre along its z axis moves a metre forward.
/// let at = |z| Pose::new(Rotation::identity(), Vector::new(0.0, 0.0, z));
/// assert_eq!(increments(&[at(1.0), at(2.0)], Frame::CameraRdf), [1.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
/// ```
pub fn increments(poses: &[Pose], frame: Frame) -> Vec<f64> {
    let pairs = poses.windows(2);
    pairs
        .flat_map(|pair| increment(&pair[0], &pair[1], frame))
        .collect()
}

/// The same of one step, for poses that come one after the other.
pub fn increment(from: &Pose, to: &Pose, frame: Frame) -> [f64; 6] {
    let (axes, step) = (frame.to_forward_left_up(), from.relative(to));
    let t = axes * step.translation;
    let r = axes * so3::log(&step.rotation);
    [t.x, t.y, t.z, r.x, r.y, r.z]
}
