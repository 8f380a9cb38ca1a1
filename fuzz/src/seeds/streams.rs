//! A detector for streams, a drive, and what may happen to it on the way.

use dose3::stream::Monitor;
use dose3::{Detector, FitOptions, StreamOptions, Trajectory};
use dose3_datasets::Frame;
use dose3_datasets::synthetic::{Platform, trajectory};
use std::sync::{Arc, LazyLock};

/// A small detector of windows of 64 steps, with short windows beside them.
pub static DETECTOR: LazyLock<Detector> = LazyLock::new(|| {
    let trusted: Vec<Trajectory> = (0..4)
        .map(|seed| trajectory(Platform::Vehicle, seed, 400, 10.0))
        .collect();
    let options = FitOptions {
        window: Some(64),
        ..FitOptions::default()
    };
    let fitted = Detector::builder().options(options).fit(&trusted);
    fitted.unwrap_or_else(|error| panic!("{error}"))
});

/// What streams by it share.
pub static MONITOR: LazyLock<Arc<Monitor>> = LazyLock::new(|| {
    let monitor = DETECTOR.monitor(&StreamOptions::default());
    monitor.unwrap_or_else(|error| panic!("{error}"))
});

/// The drive whose poses are sent.
pub static DRIVE: LazyLock<Trajectory> =
    LazyLock::new(|| trajectory(Platform::Vehicle, 9, 1200, 20.0));

/// One thing that happens.
#[derive(Clone, Copy, Debug)]
pub enum Push {
    /// So many poses of the drive.
    Drive(u8),
    /// The state is written, read and gone on from.
    PutAway,
    /// So many poses are lost.
    Skip(u8),
    /// The next pose comes with this stamp.
    Stamp(i64),
    /// The next pose is this, its quaternion x, y, z, w.
    Quaternion([f64; 3], [f64; 4]),
    /// From now on stamps are so many nanoseconds later.
    Later(i64),
    /// From now on positions are off by this.
    Elsewhere([f64; 3]),
    /// The last pose comes again.
    Again,
    /// So many poses come again.
    Back(u8),
    /// The log ends, and goes on.
    Finish,
    /// The stream is new.
    Reset,
}

/// What bytes say: a byte for the kind, then its numbers, little-endian.
pub fn pushes(mut bytes: &[u8]) -> impl Iterator<Item = Push> {
    std::iter::from_fn(move || {
        let kind = take::<1>(&mut bytes)?[0];
        Some(match kind % 12 {
            0 | 11 => Push::Drive(take::<1>(&mut bytes)?[0]),
            1 => Push::PutAway,
            2 => Push::Skip(take::<1>(&mut bytes)?[0]),
            3 => Push::Stamp(i64::from_le_bytes(take(&mut bytes)?)),
            4 => Push::Quaternion(numbers(&mut bytes)?, numbers(&mut bytes)?),
            5 => Push::Later(i64::from_le_bytes(take(&mut bytes)?)),
            6 => Push::Elsewhere(numbers(&mut bytes)?),
            7 => Push::Again,
            8 => Push::Back(take::<1>(&mut bytes)?[0]),
            9 => Push::Finish,
            _ => Push::Reset,
        })
    })
}

fn take<const N: usize>(bytes: &mut &[u8]) -> Option<[u8; N]> {
    let (first, rest) = bytes.split_first_chunk()?;
    *bytes = rest;
    Some(*first)
}

fn numbers<const N: usize>(bytes: &mut &[u8]) -> Option<[f64; N]> {
    let mut numbers = [0.0; N];
    for number in &mut numbers {
        *number = f64::from_le_bytes(take(bytes)?);
    }
    Some(numbers)
}

/// A sound drive; one that is put away; one with a gap, poses that come late and poses that are none.
pub fn sequences() -> Vec<Vec<u8>> {
    let number = |x: f64| x.to_le_bytes();
    let bad: Vec<u8> = [f64::NAN, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]
        .into_iter()
        .flat_map(number)
        .collect();
    let elsewhere: Vec<u8> = [5e5, 4e6, 100.0].into_iter().flat_map(number).collect();
    let year = 31_557_600_000_000_000_i64.to_le_bytes();
    vec![
        [0, 250].repeat(4),
        [0, 33, 1, 0, 200, 1, 0, 200, 1].to_vec(),
        [
            &[0, 200, 2, 40, 0, 200, 7, 8, 3, 4][..],
            &bad,
            &[0, 100, 5],
            &year,
            &[0, 100, 6],
            &elsewhere,
            &[0, 200, 9, 0, 90, 10, 0, 90, 3],
            &5_i64.to_le_bytes(),
            &[0, 40],
        ]
        .concat(),
    ]
}

/// What is kept of a stream before its rate is known, in the middle, and while an alarm stands.
pub fn states() -> Vec<Vec<u8>> {
    let sound = DRIVE.poses.iter().copied().enumerate();
    let shaken = sound.map(|(i, mut pose)| {
        pose.translation.z += if i > 150 { 0.4 * (i % 3) as f64 } else { 0.0 };
        pose
    });
    let poses: Vec<_> = shaken.collect();
    let state = |count: usize| {
        let stream = MONITOR.stream(Frame::BodyFlu);
        let mut stream = stream.unwrap_or_else(|error| panic!("{error}"));
        for (stamp, pose) in DRIVE.stamps.iter().zip(&poses).take(count) {
            let said = stream.push(*stamp, *pose);
            said.unwrap_or_else(|error| panic!("{error}"));
        }
        serde_json::to_vec(&stream.state()).unwrap_or_else(|error| panic!("{error}"))
    };
    [0, 20, 60, 150, 320].map(state).to_vec()
}
