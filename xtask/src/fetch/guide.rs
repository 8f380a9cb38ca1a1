//! Data sets that this task cannot fetch: where they are, under which terms, and where to put them.

use dose3_study::say;
use std::path::Path;

use anyhow::{Context, Result, bail};

use super::check::{self, Report};

/// One data set.
#[derive(Debug)]
pub struct Guide {
    /// Name on the command line.
    pub name: &'static str,
    /// Everything a person needs to get it.
    pub text: &'static str,
    check: fn(&Path) -> Result<Report>,
}

/// Oxford RobotCar and its radar extension.
pub const ROBOTCAR: Guide = Guide {
    name: "robotcar",
    text: "\
Oxford RobotCar (INS poses of the Oxford Radar RobotCar data set)

Where:    Register (free, non-commercial use) and download, for each of the four traversals below,
          the archive of the sensor GPS/INS; only gps/ins.csv of it is needed.
            https://robotcar-dataset.robots.ox.ac.uk
            https://oxford-robotics-institute.github.io/radar-robotcar-dataset
Layout:   data/robotcar/2019-01-11-14-02-26/gps/ins.csv
          data/robotcar/2019-01-14-12-05-52/gps/ins.csv
          data/robotcar/2019-01-14-14-48-55/gps/ins.csv
          data/robotcar/2019-01-15-13-06-37/gps/ins.csv
          A folder may keep its longer original name (2019-01-11-14-02-26-radar-oxford-10k).
Licence:  Creative Commons Attribution-NonCommercial-ShareAlike 4.0 (CC BY-NC-SA 4.0)
Citation: W. Maddern, G. Pascoe, C. Linegar, P. Newman: 1 Year, 1000 km: The Oxford RobotCar
          Dataset. IJRR 36(1), 2017.
          D. Barnes, M. Gadd, P. Murcutt, P. Newman, I. Posner: The Oxford Radar RobotCar Dataset:
          A Radar Extension to the Oxford RobotCar Dataset. ICRA 2020.",
    check: check::robotcar,
};

/// Object poses of the IROS 2020 tracking work.
pub const IROS20: Guide = Guide {
    name: "iros20",
    text: "\
IROS20 (poses of hand-held objects: YCBInEOAT, released with se(3)-TrackNet)

Where:    The data set YCBInEOAT (22 GB with its images, 9 videos), linked from
            https://github.com/wenbowen123/iros20-6d-pose-tracking
          Only the folder annotated_poses of each video is needed.
Layout:   data/iros20/<video>/annotated_poses/0000000.txt ...
          or the 42 files that the DOSE3 paper used (4x4 float32 arrays one after another):
          data/iros20/traj_3.npy ...
          Results differ between the two: the videos have 7,449 frames, the files 73,756 poses.
Licence:  YCBInEOAT: as its authors state it with the download (their code beside it has a
          three-clause BSD licence). The .npy files come with the released code of the DOSE3
          authors (MIT).
Citation: B. Wen, C. Mitash, B. Ren, K. E. Bekris: se(3)-TrackNet: Data-driven 6D Pose Tracking by
          Calibrating Image Residuals in Synthetic Domains. IROS 2020. arXiv:2007.13866",
    check: check::iros20,
};

/// The task: prints the guide, and checks `folder` where one is given.
///
/// # Errors
/// A folder that cannot be read, lacks a log, or has one that does not load.
pub fn run(guide: &Guide, folder: Option<&Path>) -> Result<()> {
    say!("{}\n", guide.text);
    let Some(folder) = folder else {
        say!(
            "Then:     cargo xtask fetch-data {} --check data/{0}",
            guide.name
        );
        return Ok(());
    };
    let report =
        (guide.check)(folder).with_context(|| format!("cannot check {}", folder.display()))?;
    say!("{}", report.to_string().trim_end());
    if !report.is_complete() {
        bail!(
            "{}: {} log(s) missing, {} that do not load",
            folder.display(),
            report.missing.len(),
            report.failed.len()
        );
    }
    Ok(())
}
