//! Writers of every format that is read, in full precision: translations and stamps are read back bit for bit,
//! rotations to 1e-13 rad (they pass through a projection, a quaternion or angles). RobotCar's stamps are whole
//! microseconds; IROS20 in single precision keeps 24 bits.

use std::fs;
use std::io::{self, Write};
use std::path::Path;

use dose3_lie::{Pose, Rotation};
use nalgebra::UnitQuaternion;

use crate::Trajectory;
use crate::read::write_4x4;

/// KITTI: the row-major 3x4 of each pose a line. Stamps go into a separate file, see [`kitti_times`].
///
/// # Errors
/// Those of the sink.
pub fn kitti(sink: &mut impl Write, trajectory: &Trajectory) -> io::Result<()> {
    let mut sink = io::BufWriter::new(sink);
    for pose in &trajectory.poses {
        let values = matrix(pose);
        let words: Vec<String> = values[..12]
            .iter()
            .map(|value| format!("{value:e}"))
            .collect();
        writeln!(sink, "{}", words.join(" "))?;
    }
    sink.flush()
}

/// KITTI times: one stamp a line, seconds from the first pose.
///
/// # Errors
/// Those of the sink.
pub fn kitti_times(sink: &mut impl Write, trajectory: &Trajectory) -> io::Result<()> {
    let mut sink = io::BufWriter::new(sink);
    let first = trajectory.stamps.first().copied().unwrap_or(0);
    for stamp in &trajectory.stamps {
        writeln!(sink, "{}", seconds(stamp - first))?;
    }
    sink.flush()
}

/// TUM: `timestamp tx ty tz qx qy qz qw`.
///
/// # Errors
/// Those of the sink.
pub fn tum(sink: &mut impl Write, trajectory: &Trajectory) -> io::Result<()> {
    let mut sink = io::BufWriter::new(sink);
    writeln!(sink, "# timestamp tx ty tz qx qy qz qw")?;
    for (stamp, pose) in trajectory.stamps.iter().zip(&trajectory.poses) {
        let [x, y, z] = pose.translation.into();
        let q = quaternion(&pose.rotation);
        writeln!(
            sink,
            "{} {x} {y} {z} {} {} {} {}",
            seconds(*stamp),
            q.i,
            q.j,
            q.k,
            q.w
        )?;
    }
    sink.flush()
}

/// EuRoC: the pose columns of `state_groundtruth_estimate0/data.csv`.
///
/// # Errors
/// Those of the sink.
pub fn euroc(sink: &mut impl Write, trajectory: &Trajectory) -> io::Result<()> {
    let mut sink = io::BufWriter::new(sink);
    let position = "p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m]";
    writeln!(
        sink,
        "#timestamp [ns], {position}, q_RS_w [], q_RS_x [], q_RS_y [], q_RS_z []"
    )?;
    for (stamp, pose) in trajectory.stamps.iter().zip(&trajectory.poses) {
        let [x, y, z] = pose.translation.into();
        let q = quaternion(&pose.rotation);
        writeln!(sink, "{stamp},{x},{y},{z},{},{},{},{}", q.w, q.i, q.j, q.k)?;
    }
    sink.flush()
}

/// RobotCar `gps/ins.csv` with the columns that make a pose; stamps are rounded to microseconds.
///
/// # Errors
/// Those of the sink.
pub fn robotcar_ins(sink: &mut impl Write, trajectory: &Trajectory) -> io::Result<()> {
    let mut sink = io::BufWriter::new(sink);
    writeln!(sink, "timestamp,northing,easting,down,roll,pitch,yaw")?;
    for (stamp, pose) in trajectory.stamps.iter().zip(&trajectory.poses) {
        let [north, east, down] = pose.translation.into();
        let [roll, pitch, yaw] = euler_angles(&pose.rotation);
        let microseconds = (stamp + 500).div_euclid(1000);
        writeln!(
            sink,
            "{microseconds},{north},{east},{down},{roll},{pitch},{yaw}"
        )?;
    }
    sink.flush()
}

/// RobotCar `vo/vo.csv`: the motion between neighbours, the later stamp as the source.
///
/// # Errors
/// Those of the sink.
pub fn robotcar_vo(sink: &mut impl Write, trajectory: &Trajectory) -> io::Result<()> {
    let mut sink = io::BufWriter::new(sink);
    writeln!(
        sink,
        "source_timestamp,destination_timestamp,x,y,z,roll,pitch,yaw"
    )?;
    for (stamps, poses) in trajectory
        .stamps
        .windows(2)
        .zip(trajectory.poses.windows(2))
    {
        let step = poses[0].inverse().compose(&poses[1]);
        let [x, y, z] = step.translation.into();
        let [roll, pitch, yaw] = euler_angles(&step.rotation);
        let [earlier, later] = [stamps[0], stamps[1]].map(|stamp| (stamp + 500).div_euclid(1000));
        writeln!(sink, "{later},{earlier},{x},{y},{z},{roll},{pitch},{yaw}")?;
    }
    sink.flush()
}

/// Precision of the numbers in a `.npy` stream.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Precision {
    /// `<f4`, as the IROS20 data has it.
    Single,
    /// `<f8`
    Double,
}

/// IROS20: one 4x4 `.npy` array per pose, one after another.
///
/// # Errors
/// Those of the sink.
pub fn iros20(
    sink: &mut impl Write,
    trajectory: &Trajectory,
    precision: Precision,
) -> io::Result<()> {
    let mut sink = io::BufWriter::new(sink);
    for pose in &trajectory.poses {
        write_4x4(&mut sink, &matrix(pose), precision == Precision::Single)?;
    }
    sink.flush()
}

/// The original layout of the IROS20 data: `0000000.txt`, `0000001.txt`, ... with one 4x4 each, into an
/// existing folder.
///
/// # Errors
/// Those of the file system.
pub fn iros20_poses(folder: &Path, trajectory: &Trajectory) -> io::Result<()> {
    for (index, pose) in trajectory.poses.iter().enumerate() {
        let rows: Vec<String> = matrix(pose)
            .chunks(4)
            .map(|row| {
                row.iter()
                    .map(|value| format!("{value:e}"))
                    .collect::<Vec<_>>()
                    .join(" ")
            })
            .collect();
        fs::write(
            folder.join(format!("{index:07}.txt")),
            rows.join("\n") + "\n",
        )?;
    }
    Ok(())
}

/// The 4x4 of a pose, row-major.
fn matrix(pose: &Pose) -> [f64; 16] {
    let r = pose.rotation.matrix();
    let t = &pose.translation;
    std::array::from_fn(|index| match (index / 4, index % 4) {
        (3, 3) => 1.0,
        (3, _) => 0.0,
        (row, 3) => t[row],
        (row, column) => r[(row, column)],
    })
}

fn quaternion(rotation: &Rotation) -> UnitQuaternion<f64> {
    UnitQuaternion::from_rotation_matrix(rotation)
}

/// Nanoseconds as exact decimal seconds.
fn seconds(nanoseconds: i64) -> String {
    let sign = if nanoseconds < 0 { "-" } else { "" };
    let magnitude = nanoseconds.unsigned_abs();
    format!(
        "{sign}{}.{:09}",
        magnitude / 1_000_000_000,
        magnitude % 1_000_000_000
    )
}

/// Roll, pitch, yaw of `Rz(yaw) Ry(pitch) Rx(roll)`; at a pitch of 90 degrees the yaw is set to 0.
pub(crate) fn euler_angles(rotation: &Rotation) -> [f64; 3] {
    let r = rotation.matrix();
    let cosine = r[(0, 0)].hypot(r[(1, 0)]);
    let pitch = (-r[(2, 0)]).atan2(cosine);
    if cosine < 1e-9 {
        return [(-r[(1, 2)]).atan2(r[(1, 1)]), pitch, 0.0];
    }
    [
        r[(2, 1)].atan2(r[(2, 2)]),
        pitch,
        r[(1, 0)].atan2(r[(0, 0)]),
    ]
}
