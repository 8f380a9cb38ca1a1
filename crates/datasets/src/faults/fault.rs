//! The kinds of fault.

use dose3_lie::Vector;

use super::from_forward_left_up;
use crate::Frame;

/// An axis of the body, or of a world whose axes follow the same convention.
///
/// Where [`Frame::has_forward`] is false, these are the frame's own x, y and z.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Axis {
    /// The direction of travel.
    Forward,
    /// To the left of it.
    Left,
    /// Away from the ground.
    Up,
}

/// A fault with its severity.
///
/// Written as `jump:1.0m`, `mounting:5.0deg`, `scale:1.2x` or `reversal` by `Display`, and read back by `FromStr`,
/// which also takes `rad` for `deg`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Fault {
    /// Between the first two poses of the range the position jumps in a random direction (of the body's
    /// forward-left plane where there is one). For good: everything after is displaced.
    /// A satellite fix after a tunnel, a loop closure, multipath.
    Jump {
        /// Length of the jump, metres.
        metres: f64,
    },
    /// The first pose of the range is repeated for some time, at most to the end of the range; then the log goes on
    /// where it would have been. A stuck driver or filter whose last message is sent again.
    Freeze {
        /// Seconds of repeated poses by the log's stamps, after the first one.
        seconds: f64,
    },
    /// Each pose of the range but the first is missing with this probability; the stamps of the others are their
    /// own, so the log gets shorter. A lossy link, an overloaded recorder.
    Drop {
        /// Probability, 0 to 0.95.
        share: f64,
    },
    /// Independent normal noise on each coordinate of each position. A poor fix, a camera with little texture.
    JitterPosition {
        /// Standard deviation of each coordinate, metres.
        metres: f64,
    },
    /// Independent normal noise on each rotation, `R exp(n)`. Vibration, a poor attitude fix.
    JitterRotation {
        /// Standard deviation of each coordinate of the tangent `n`, radians.
        radians: f64,
    },
    /// Heading turns away at a constant rate to a random side and the path bends with it; for good.
    /// The bias of a gyroscope in dead reckoning.
    DriftYaw {
        /// Rate about the body's up axis, radians a second.
        radians_per_second: f64,
    },
    /// Position slides away at constant speed in a direction fixed in the world, drawn as that of the jump; the
    /// offset reached stays for good. An inertial system without a fix, a slowly moving multipath error.
    DriftPosition {
        /// Speed of the error, metres a second.
        metres_per_second: f64,
    },
    /// Steps are longer by a share that grows with time; after the range they are right again, the path stays
    /// displaced. Monocular odometry that loses its scale.
    DriftScale {
        /// Growth of the scale, per second.
        per_second: f64,
    },
    /// Steps are longer (shorter below 1) by a factor, from the first to the last. A wrong wheel radius or stereo
    /// base, feet for yards.
    Scale {
        /// Factor on every step, 0.001 to 1000.
        factor: f64,
    },
    /// The motion of the range backward in time, beginning at its first pose.
    /// A log played backward, a sign lost in a time difference.
    Reversal,
    /// Time runs faster and slower in turn, in whole waves of about ten seconds; poses are interpolated, the first
    /// and the last of the range stay. A clock that is being corrected, a buffer that stalls and catches up.
    TimeWarp {
        /// Speed is between `1 - depth` and `1 + depth` times the true one, 0 to 0.95.
        depth: f64,
    },
    /// The body is turned about its up axis by a constant angle to a random side; positions stay.
    /// A sensor knocked or mounted askew, a wrong extrinsic calibration.
    Mounting {
        /// The angle, radians.
        radians: f64,
    },
    /// Roll and pitch of each pose change places (`Rz(yaw) Ry(pitch) Rx(roll)` of forward-left-up body against world
    /// axes of the same convention; KITTI's world is its first camera). Two columns of a file taken for each other.
    RollPitchSwap,
    /// The whole motion in a mirror: one body axis points the other way, and rotations are turned with it into
    /// proper ones (`S R S`). Left-handed data taken for right-handed. On a car, whose mirror image is a car,
    /// `Left` leaves little more to see than the side of the road.
    Handedness {
        /// The axis that is mirrored.
        axis: Axis,
    },
    /// Positions in a mirror, rotations as they were: the body no longer moves where it points.
    /// One column with the wrong sign, east-north-up taken for north-east-down.
    MirroredPositions {
        /// The axis of the world that is mirrored.
        axis: Axis,
    },
    /// Each rotation is `exp(pi / 180 log R)` of itself: nearly the identity; positions stay.
    /// Angles in radians read as if they were degrees.
    DegreesForRadians,
    /// The body moves sideways at constant speed, to a random side, on top of its motion; the offset reached stays.
    /// Slipping wheels, cross wind, a drifting optical flow sensor.
    Slip {
        /// Speed along the body's left axis, metres a second.
        metres_per_second: f64,
    },
    /// The sensor's rate is this factor times the one claimed: poses of the range are skipped (above 1) or repeated
    /// (below 1), and the stamps go on at the claimed rate; the log gets shorter or longer and all later stamps move.
    /// A 20 Hz log read as 10 Hz, a slow topic published again by a fast node.
    Rate {
        /// True rate over claimed rate, 0.05 to 20. Above 1, motion looks faster than it is.
        factor: f64,
    },
    /// Positions come late: each is the one that the sound log had this long before, straight between its poses;
    /// rotations are on time. Position and attitude stamped by different clocks, a slow receiver.
    PositionLate {
        /// The delay, seconds.
        seconds: f64,
    },
    /// Rotations come late: each is the one that the sound log had this long before, along the geodesic between its
    /// poses; positions are on time. A filtered or buffered attitude.
    AttitudeLate {
        /// The delay, seconds.
        seconds: f64,
    },
    /// Positions are those of another point of the body, which lies this far ahead, to the left or above (or, by the
    /// seed, behind, to the right or below). The position of the antenna taken for that of the body.
    LeverArm {
        /// The axis of the body along which the point lies.
        axis: Axis,
        /// Its distance, metres.
        metres: f64,
    },
    /// The body's axes are turned by a constant angle about one of them, to a random side; positions stay. A poor
    /// extrinsic calibration. Unlike [`Fault::Mounting`] it is there for good, so that no step shows where it began.
    Extrinsic {
        /// The axis of the body that it is turned about.
        axis: Axis,
        /// The angle, radians.
        radians: f64,
    },
    /// Positions and rotations are running means over this time, half of it before and half after each pose.
    /// A smoother, a filter with too little trust in its measurements.
    Smooth {
        /// Length of the mean, seconds.
        seconds: f64,
    },
    /// Positions alone are running means, as those of [`Fault::Smooth`].
    SmoothPosition {
        /// Length of the mean, seconds.
        seconds: f64,
    },
    /// Poses of the beginning of the range are interpolated between those at both ends of the gap, which lasts this
    /// long or to the last pose of the range. A loss of tracking that was filled in afterwards.
    BridgedGap {
        /// Length of the gap by the log's stamps, seconds.
        seconds: f64,
    },
    /// Coordinates of positions are rounded to multiples of a length. Too few decimals in a file, a coarse map.
    Quantised {
        /// The length, metres.
        metres: f64,
    },
    /// Positions pass through 32-bit floats as coordinates of a map, 5735 km north and 620 km east of its origin at
    /// the first pose of the range (world axes taken for north, west and up): they come in steps of half a metre to
    /// the north and six centimetres to the east.
    SinglePrecision,
    /// Height stays that of the first pose of the range (world axes that follow the body's convention).
    /// Odometry in the plane.
    FrozenHeight,
    /// Roll and pitch are zero (`Rz(yaw)` of forward-left-up body against world axes of the same convention).
    /// Odometry in the plane.
    Level,
    /// Yaw is the direction of the last step; where the body is slower than 0.3 m/s, the yaw before. Roll and pitch
    /// stay. The course over ground of a satellite receiver taken for heading.
    HeadingFromCourse,
    /// Each pose of the range but the first is, with this probability, the one before it once more; stamps stay.
    /// A publisher that is faster than its source.
    Stale {
        /// Probability, 0 to 0.95.
        share: f64,
    },
    /// One pose in so many is measured, those between are interpolated. A slow sensor brought to a higher rate.
    Interpolated {
        /// Rate of the poses over the measured ones, 1 to 20.
        factor: f64,
    },
    /// The position moves away at constant speed in a random direction (as [`Fault::Jump`]) over some time from the
    /// start of the range on, at most to its end; for good. A loop closure that is spread over time.
    Closure {
        /// Length of the way, metres.
        metres: f64,
        /// Time that it takes, seconds.
        seconds: f64,
    },
    /// No poses for some time after the first pose of the range, at most to its last one; then the log goes on.
    /// A process that hangs, a link that is lost.
    Stall {
        /// Length of the silence by the log's stamps, seconds.
        seconds: f64,
    },
    /// The poses of some time after the first pose of the range all come at its end, a millisecond apart, and have
    /// stamps that say so. A buffer stamped on arrival.
    Burst {
        /// Time that they wait, at most, seconds.
        seconds: f64,
    },
    /// Independent normal noise on the stamps between the first and the last of the range, in order again
    /// afterwards. Poses stamped on arrival over a loaded link.
    StampJitter {
        /// Standard deviation of a stamp, seconds.
        seconds: f64,
    },
    /// Each pose of the range but the last is, with this probability, sent twice: a copy follows a millisecond
    /// later (at most half a step), so the log gets longer. A message sent again, two publishers of a topic.
    Doubled {
        /// Probability, 0 to 0.95.
        share: f64,
    },
    /// Poses are measured up to half this share of a step too early or too late, and stamped rightly.
    /// A sensor without a steady trigger.
    Uneven {
        /// Steps last between `1 - depth` and `1 + depth` times as long as before, 0 to 0.95.
        depth: f64,
    },
    /// One pose in so many is there, with its own stamp; the log gets shorter.
    /// A sensor that falls back to a lower rate.
    Thinned {
        /// Rate before over rate within, 1 to 20.
        factor: f64,
    },
}

impl Axis {
    /// The axis as a unit vector of the frame's own axes.
    pub(super) fn direction(self, frame: Frame) -> Vector {
        from_forward_left_up(
            frame,
            match self {
                Self::Forward => Vector::x(),
                Self::Left => Vector::y(),
                Self::Up => Vector::z(),
            },
        )
    }
}
