//! Judges poses that are in memory: drives on a bumpy road, and one whose position jumps.

// An example prints.
#![allow(clippy::print_stdout)]

use dose3::nalgebra::{Isometry3, Translation3, UnitQuaternion};
use dose3::prelude::*;

/// A drive of 60 s at 10 Hz that winds with `period` seconds: stamps in nanoseconds, poses in metres.
fn drive(period: f64) -> (Vec<i64>, Vec<Isometry3<f64>>) {
    let (mut x, mut y) = (0.0, 0.0);
    let poses = (0..600).map(|i| {
        let t = 0.1 * f64::from(i);
        let heading = 0.4 * (std::f64::consts::TAU * t / period).sin();
        let bump = 0.01 * (7.3 * t).sin() + 0.004 * (17.0 * t).cos();
        x += heading.cos();
        y += heading.sin();
        Isometry3::from_parts(
            Translation3::new(x, y, bump),
            UnitQuaternion::from_euler_angles(0.5 * bump, 0.3 * bump, heading),
        )
    });
    let poses = poses.collect();
    ((0..600).map(|i| i * 100_000_000).collect(), poses)
}

fn main() -> dose3::Result<()> {
    let mut trusted = Vec::new();
    for i in 0..6 {
        let (stamps, poses) = drive(20.0 + f64::from(i));
        trusted.push(Trajectory::from_poses(
            format!("drive {i}"),
            Frame::BodyFlu,
            stamps,
            poses,
        )?);
    }
    let detector = Detector::fit(&trusted)?;

    let (stamps, mut poses) = drive(22.5);
    let sound = Trajectory::from_poses("sound", Frame::BodyFlu, stamps.clone(), poses.clone())?;
    println!("{}", detector.judge(&sound)?);

    // From pose 300 on the localisation is 3 m off to the left.
    poses[300..]
        .iter_mut()
        .for_each(|pose| pose.translation.y += 3.0);
    let jumped = Trajectory::from_poses("jumped", Frame::BodyFlu, stamps, poses)?;
    let report = detector.judge(&jumped)?;
    println!("{report}");
    if let Some(span) = report.pose_spans.first() {
        println!("the pose that sticks out most: {}", span.worst_pose);
    }
    Ok(())
}
