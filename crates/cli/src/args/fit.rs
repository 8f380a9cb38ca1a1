//! Arguments of `dose3 fit`.

use super::{Computing, Reading};
use clap::{Args as ClapArgs, ValueEnum};
use dose3_datasets::GroupBy;
use dose3_diffusion::NoiseSharing;
use std::path::PathBuf;

#[derive(Debug, ClapArgs)]
#[command(after_help = "Examples:\n  \
    dose3 fit --trusted good/ --out trusted.dose3\n  \
    dose3 fit --trusted runs/ --group '{}_run*' --out trusted.dose3\n  \
    dose3 fit --list logs.csv --alpha 0.01 --out trusted.dose3\n  \
    dose3 fit --trusted drives/ --tf map:base_link --out trusted.dose3")]
pub struct Fit {
    /// Model file, or a built-in one: `motion` (body-frame motion at 10 Hz) or `paper` (the paper's
    /// windows, trained on KITTI)
    #[arg(long, value_name = "FILE|NAME", default_value = "motion")]
    pub model: PathBuf,
    /// Files or folders with trusted logs
    #[arg(long, required_unless_present = "list", num_args = 1.., value_name = "PATH")]
    pub trusted: Vec<PathBuf>,
    /// A file that names more trusted logs: one path a line, or csv with a column `path` (from the list's own folder on)
    /// and, where wanted, a column `group`
    #[arg(long, value_name = "FILE")]
    pub list: Option<PathBuf>,
    /// Which logs count as one, because they are runs of one route or parts of one recording: `folder`,
    /// or a pattern of file names with {} for the group's name, such as '{}_run*'
    #[arg(long, value_name = "HOW")]
    pub group: Option<GroupBy>,
    /// Trusted logs count as they are named, even where they share a recording
    #[arg(long)]
    pub no_overlap: bool,
    /// Detector file to write
    #[arg(long, value_name = "FILE")]
    pub out: PathBuf,
    /// Replace what lies there, whatever it is
    #[arg(long)]
    pub force: bool,
    /// Statistics, joined by + for one density, by commas for a density each, by / for a test of their own
    /// with a share of alpha (default: the best measured for a motion model, and beside it the joint
    /// network where the model has one and it finds more in held-out trusted logs; `paper24` for a paper model)
    #[arg(long, value_name = "SET")]
    pub statistics: Option<String>,
    /// How several densities become one score: joint, fisher, harmonic-mean, maximum (default:
    /// fisher where the statistics have commas, else joint)
    #[arg(long, value_name = "NAME")]
    pub combination: Option<String>,
    /// Shares of alpha of the tests, which sum to 1 (default: equal ones)
    #[arg(long, value_name = "SHARE", value_delimiter = ',')]
    pub shares: Option<Vec<f64>>,
    /// Do not compare the stamps of logs
    #[arg(long)]
    pub no_timing: bool,
    /// Do not ask whether position and attitude belong together
    #[arg(long)]
    pub no_calibration: bool,
    /// Keep trusted logs that are unlike the others among what new logs are compared with
    #[arg(long)]
    pub keep_all: bool,
    /// Density over them: mixture[:N|:auto][:diagonal], kernel[:WIDTH], neighbours[:K]
    // Brackets of help are no links.
    #[allow(rustdoc::broken_intra_doc_links)]
    #[arg(long, value_name = "DENSITY", default_value = "mixture")]
    pub density: String,
    /// Share of trusted windows and logs that may be rejected
    #[arg(long, value_name = "SHARE", default_value_t = 0.05)]
    pub alpha: f64,
    /// Poses between the starts of windows of 128 steps; shorter ones start nearer in proportion
    #[arg(long, value_name = "N", default_value_t = 32)]
    pub stride: usize,
    /// Measure at this rate, hertz, 2 to 200 (default: 10, or where too few trusted logs are as fast, theirs);
    /// faster logs are interpolated down to it, slower ones refused
    #[arg(long, value_name = "HZ")]
    pub resample: Option<f64>,
    /// Steps of a window, at least 32 (default: 128, or fewer where too few trusted logs are as long); logs that
    /// are too short for them are judged in windows of 64 or 32
    #[arg(long, value_name = "N")]
    pub window: Option<usize>,
    /// Diffusion steps visited, at most the model's own (default: 12 of a motion model, all of a paper
    /// model)
    #[arg(long, value_name = "N")]
    pub steps: Option<usize>,
    /// Noise draws per window, averaged (default: 1 with a motion model, 2 with a paper model)
    #[arg(long, value_name = "N")]
    pub draws: Option<usize>,
    /// Noise of the windows: `shared` draws, or `own` for every window (the paper's evaluation)
    #[arg(long, value_enum, default_value = "shared")]
    pub noise: NoiseName,
    /// The older name of `--noise own`
    #[arg(long, hide = true, conflicts_with = "noise")]
    pub own_noise: bool,
    /// Seed of noise and fit
    #[arg(long, default_value_t = 0)]
    pub seed: u64,
    #[command(flatten)]
    pub reading: Reading,
    #[command(flatten)]
    pub computing: Computing,
}

impl Fit {
    /// Whether windows share their noise.
    pub fn noise(&self) -> NoiseSharing {
        match self.noise {
            _ if self.own_noise => NoiseSharing::Own,
            NoiseName::Own => NoiseSharing::Own,
            NoiseName::Shared => NoiseSharing::Shared,
        }
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum NoiseName {
    Own,
    Shared,
}
