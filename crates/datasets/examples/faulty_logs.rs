//! Writes synthetic drives as TUM files, sound ones and the same drive with faults:
//! `cargo run --release -p dose3-datasets --example faulty_logs -- FOLDER freeze:1s jump:1m slip:1m/s`.
//! `FOLDER/trusted` gets eight drives, `FOLDER/others` eight other sound ones, `FOLDER/new` one more as `sound.txt` and,
//! named after its fault, with each fault in its poses 300 to 380 (in all of them, where the fault is of a whole log).

use dose3_datasets::faults::Fault;
use dose3_datasets::synthetic::{Platform, trajectory};
use dose3_datasets::{Trajectory, write};
use std::error::Error;
use std::path::Path;

const POSES: usize = 1200;
const HERTZ: f64 = 20.0;

fn main() -> Result<(), Box<dyn Error>> {
    let mut args = std::env::args().skip(1);
    let folder = args
        .next()
        .ok_or("expected a folder, and names of faults like freeze:1s")?;
    let folder = Path::new(&folder);
    for seed in 0..8 {
        let drive = trajectory(Platform::Vehicle, seed, POSES, HERTZ);
        write_tum(&folder.join("trusted"), &format!("drive{seed}"), &drive)?;
        let other = trajectory(Platform::Vehicle, 50 + seed, POSES, HERTZ);
        write_tum(
            &folder.join("others"),
            &format!("drive{}", 50 + seed),
            &other,
        )?;
    }
    let sound = trajectory(Platform::Vehicle, 40, POSES, HERTZ);
    write_tum(&folder.join("new"), "sound", &sound)?;
    for name in args {
        let fault: Fault = name.parse()?;
        let range = match fault {
            // Faults that a log has from end to end.
            Fault::Scale { .. }
            | Fault::Mounting { .. }
            | Fault::RollPitchSwap
            | Fault::Handedness { .. }
            | Fault::MirroredPositions { .. }
            | Fault::PositionLate { .. }
            | Fault::AttitudeLate { .. }
            | Fault::LeverArm { .. }
            | Fault::Extrinsic { .. }
            | Fault::StampJitter { .. } => 0..POSES,
            _ => 300..380,
        };
        write_tum(
            &folder.join("new"),
            &name.replace([':', '/'], "_"),
            &fault.apply(&sound, range, 1)?,
        )?;
    }
    Ok(())
}

fn write_tum(folder: &Path, name: &str, log: &Trajectory) -> Result<(), Box<dyn Error>> {
    std::fs::create_dir_all(folder)?;
    let mut file = std::fs::File::create(folder.join(format!("{name}.txt")))?;
    Ok(write::tum(&mut file, log)?)
}
