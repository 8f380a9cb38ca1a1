//! The command line.

use clap::{Args as ClapArgs, Parser, Subcommand, ValueEnum};
use dose3::backend::Backend;
use dose3_datasets::{Columns, Format, Frame, GroupBy, Kind, LostKind, StampUnit};
use dose3_diffusion::NoiseSharing;
use std::path::PathBuf;

/// Is this pose log like the logs I trust, and if not, where and why?
#[derive(Debug, Parser)]
#[command(version, max_term_width = 100)]
#[command(
    after_help = "Exit codes: 0 in distribution (or done), 1 out of distribution, 2 error.\n\
    Formats are told by content: KITTI, TUM, EuRoC, RobotCar, csv with named columns, matrices, npy, \
    IROS20, g2o, COLMAP, NeRF, Open3D; MCAP, ROS 1 and ROS 2 bags, PX4 ULog; .gz and .zst of text; \
    - is standard input."
)]
pub struct Args {
    /// What to do
    #[command(subcommand)]
    pub command: Command,
}

#[derive(Debug, Subcommand)]
pub enum Command {
    /// Train the two noise estimators on pose logs (needed once; a trained model is built in)
    Train(Train),
    /// Learn what trusted logs look like to a model, without retraining it
    Fit(Fit),
    /// Judge logs: verdict, p-value, where and why
    Score(Score),
    /// Measure a detector on logs known to be in and out of distribution
    Eval(Eval),
    /// Show what a log holds, and what had to be repaired when reading it
    Inspect(Inspect),
    /// Generate pose sequences from a model
    Sample(Sample),
}

impl Command {
    /// Threads asked for; 0 for all cores.
    pub fn threads(&self) -> usize {
        match self {
            Self::Train(a) => a.computing.threads,
            Self::Fit(a) => a.computing.threads,
            Self::Score(a) => a.computing.threads,
            Self::Eval(a) => a.computing.threads,
            Self::Sample(a) => a.computing.threads,
            Self::Inspect(_) => 0,
        }
    }
}

/// How logs are read.
#[derive(Clone, Debug, Default, ClapArgs)]
#[command(next_help_heading = "Reading logs")]
pub struct Reading {
    /// Format of the logs (default: told by content)
    #[arg(long, value_name = "FORMAT")]
    pub format: Option<Format>,
    /// Body frame of logs whose format does not say it: camera-rdf, body-frd, body-flu, object, sensor;
    /// LOG=FRAME for one log, whatever its format says
    #[arg(long, value_name = "FRAME|LOG=FRAME")]
    pub frame: Vec<FrameOf>,
    /// Poses a second, in place of the stamps in the file: an index, all the same, missing
    #[arg(long, value_name = "HZ")]
    pub rate: Option<f64>,
    /// Rate of logs without stamps, or whose stamps only count poses, hertz (default: the data set's)
    #[arg(long, value_name = "HZ")]
    pub nominal_rate: Option<f64>,
    /// Metres in one unit of the logs' positions
    #[arg(long, value_name = "METRES", default_value_t = 1.0)]
    pub unit: f64,
    /// Stamps of a KITTI log, one line a pose (default: found beside it)
    #[arg(long, value_name = "FILE")]
    pub times: Option<PathBuf>,
    /// Longest step between stamps that is not a gap, seconds (default: 10 typical steps)
    #[arg(long, value_name = "SECONDS")]
    pub max_gap: Option<f64>,
    /// Unit of the stamps: s, ms, us, ns (default: told by the header or by their size)
    #[arg(long, value_name = "UNIT")]
    pub stamp_unit: Option<StampUnit>,
    /// Columns of text files, as roles in the file's order (`t,x,y,z,qw,qx,qy,qz`, `-` skips one) or as
    /// pairs (`t=stamp,x=3,yaw=heading`) (default: told by the header or the data)
    #[arg(long, value_name = "COLUMNS")]
    pub columns: Option<Columns>,
    /// Column of text tables that tells several logs apart, by name or by number from 1: one log a value
    #[arg(long, value_name = "NAME")]
    pub log_column: Option<String>,
    /// What marks rows without a pose (default: NaN, zero rotations, the identity amid others)
    #[arg(long, value_name = "KIND", value_delimiter = ',')]
    pub lost: Vec<LostKind>,
    /// Lost tracking is an error instead of a gap
    #[arg(long)]
    pub strict: bool,
    /// Topics of a recording (default: its only topic of poses; of a flight log the usual one)
    #[arg(long, value_name = "TOPIC")]
    pub topic: Vec<String>,
    /// Parent and child frame, like map:base_link, to be looked up in a recording's transforms
    #[arg(long, value_name = "PARENT:CHILD", value_parser = frames)]
    pub tf: Option<(String, String)>,
    /// Stamps of a recording: those in the headers of messages, or the times of recording
    #[arg(long, value_enum, default_value_t, value_name = "WHICH")]
    pub stamp: StampName,
}

/// Two frames with a colon between.
fn frames(text: &str) -> Result<(String, String), String> {
    match text.split_once(':') {
        Some((parent, child)) if !parent.is_empty() && !child.is_empty() => {
            Ok((parent.to_owned(), child.to_owned()))
        }
        _ => Err("expected two frames like map:base_link".to_owned()),
    }
}

/// Which time of a message is its stamp.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum StampName {
    #[default]
    Header,
    Record,
}

/// A body frame of all logs whose format does not say it, or `LOG=FRAME` of one log.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum FrameOf {
    Unknown(Frame),
    Log(String, Frame),
}

impl std::str::FromStr for FrameOf {
    type Err = dose3_datasets::Error;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        match text.rsplit_once('=') {
            Some((log, frame)) => Ok(Self::Log(log.to_owned(), frame.parse()?)),
            None => Ok(Self::Unknown(text.parse()?)),
        }
    }
}

/// Where networks run.
#[derive(Clone, Copy, Debug, ClapArgs)]
#[command(next_help_heading = "Computing")]
pub struct Computing {
    /// Where the networks run
    #[arg(long, value_name = "BACKEND", default_value_t)]
    pub backend: Backend,
    /// Threads (0: all cores); results do not depend on it
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub threads: usize,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum ScheduleName {
    Cosine,
    Linear,
    /// Ratios of noise to signal from 0.003 to 20, evenly spaced in their logarithm
    LogSigma,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum RotationNoiseName {
    /// A Gaussian in the tangent space, as in the paper
    Tangent,
    /// The heat kernel on SO(3)
    IgSo3,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum RotationProcessName {
    /// exactly invertible for every rotation and noise
    Group,
    /// invertible while the sum stays shorter than pi
    Tangent,
}

#[derive(Debug, ClapArgs)]
pub struct Train {
    /// Files or folders with logs
    #[arg(long, required = true, num_args = 1.., value_name = "PATH")]
    pub data: Vec<PathBuf>,
    /// Model file to write
    #[arg(long, value_name = "FILE")]
    pub out: PathBuf,
    /// How poses become numbers: `paper` (positions from the window's start, divided by their largest;
    /// rotations as given) or `motion` (body-frame increments: free of the world's frame, scale stored
    /// in the model)
    #[arg(long, alias = "protocol", value_name = "NAME", default_value = "paper")]
    pub representation: Kind,
    /// Poses a window
    #[arg(long, value_name = "N", default_value_t = 128)]
    pub window: usize,
    /// Logs held out for validation, by name, or `none` (default: about 15 % of them, by seed)
    #[arg(long, value_name = "NAME", value_delimiter = ',')]
    pub hold_out: Vec<String>,
    /// Resample faster logs to this rate first, hertz
    #[arg(long, value_name = "HZ")]
    pub resample: Option<f64>,
    /// Width of the first level of both networks
    #[arg(long, value_name = "N", default_value_t = 16)]
    pub width: usize,
    /// Width multipliers, one a level
    #[arg(long, value_name = "N", value_delimiter = ',', default_value = "1,2,4")]
    pub multipliers: Vec<usize>,
    /// Diffusion steps T
    #[arg(long, value_name = "T", default_value_t = 30)]
    pub diffusion_steps: usize,
    /// Noise schedule of the translations (default: cosine, log-sigma with --representation motion)
    #[arg(long, value_enum)]
    pub translation_schedule: Option<ScheduleName>,
    /// Noise schedule of the rotations (default: as above; the authors' code: linear)
    #[arg(long, value_enum)]
    pub rotation_schedule: Option<ScheduleName>,
    /// Noise of the rotations
    #[arg(long, value_enum, default_value = "tangent")]
    pub rotation_noise: RotationNoiseName,
    /// How rotations are noised: the equations' group product or Algorithm 1's tangent sum
    #[arg(long, value_enum, default_value = "group")]
    pub rotation_process: RotationProcessName,
    /// Optimiser steps
    #[arg(long, value_name = "N", default_value_t = 4000)]
    pub steps: usize,
    /// Windows a step
    #[arg(long, value_name = "N", default_value_t = 64)]
    pub batch: usize,
    /// Peak learning rate
    #[arg(long, value_name = "RATE", default_value_t = 1e-3)]
    pub learning_rate: f64,
    /// Seed of everything random
    #[arg(long, default_value_t = 0)]
    pub seed: u64,
    /// Store weights as f16 (half the size)
    #[arg(long)]
    pub half: bool,
    /// Checkpoint file; a run goes on from it where it exists (default: OUT with .checkpoint)
    #[arg(long, value_name = "FILE")]
    pub checkpoint: Option<PathBuf>,
    #[command(flatten)]
    pub reading: Reading,
    #[command(flatten)]
    pub computing: Computing,
}

#[derive(Debug, ClapArgs)]
pub struct Fit {
    /// Model file, or a built-in one: `motion` (body-frame motion at 10 Hz) or `paper` (the paper's
    /// windows, trained on KITTI)
    #[arg(long, value_name = "FILE|NAME", default_value = "motion")]
    pub model: PathBuf,
    /// Files or folders with trusted logs
    #[arg(long, required_unless_present = "list", num_args = 1.., value_name = "PATH")]
    pub trusted: Vec<PathBuf>,
    /// A csv file with a column `path` (from the list's own folder on) and, where wanted, a column
    /// `group`: more trusted logs
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
    /// Statistics, joined by + for one density, by commas for a density each, by / for a test of their own
    /// with a share of alpha (default: the best measured for a motion model, `paper24` for a paper model)
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
    #[arg(long, value_name = "DENSITY", default_value = "mixture")]
    pub density: String,
    /// Share of trusted windows and logs that may be rejected
    #[arg(long, default_value_t = 0.05)]
    pub alpha: f64,
    /// Poses between the starts of windows
    #[arg(long, value_name = "N", default_value_t = 32)]
    pub stride: usize,
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

#[derive(Debug, ClapArgs)]
pub struct Score {
    /// Detector file
    #[arg(long, value_name = "FILE")]
    pub detector: PathBuf,
    /// Files or folders with logs to judge
    #[arg(required = true, value_name = "LOG")]
    pub logs: Vec<PathBuf>,
    /// One JSON document instead of text
    #[arg(long)]
    pub json: bool,
    /// Show every window
    #[arg(long)]
    pub windows: bool,
    /// Share of trusted logs that may be rejected (default: the detector's)
    #[arg(long)]
    pub alpha: Option<f64>,
    /// Say as well which logs differ if of those called at most this share may be false alarms
    /// (Benjamini and Hochberg)
    #[arg(long, value_name = "SHARE")]
    pub fdr: Option<f64>,
    #[command(flatten)]
    pub reading: Reading,
    #[command(flatten)]
    pub computing: Computing,
}

#[derive(Debug, ClapArgs)]
pub struct Eval {
    /// Detector file
    #[arg(long, value_name = "FILE")]
    pub detector: PathBuf,
    /// Files or folders with in-distribution logs (not those the detector was fitted on)
    #[arg(long, required = true, num_args = 1.., value_name = "PATH")]
    pub id: Vec<PathBuf>,
    /// Files or folders with out-of-distribution logs
    #[arg(long, required = true, num_args = 1.., value_name = "PATH")]
    pub ood: Vec<PathBuf>,
    /// One JSON document instead of text
    #[arg(long)]
    pub json: bool,
    /// Bootstrap resamples of the intervals
    #[arg(long, value_name = "N", default_value_t = 1000)]
    pub resamples: usize,
    #[command(flatten)]
    pub reading: Reading,
    #[command(flatten)]
    pub computing: Computing,
}

#[derive(Debug, ClapArgs)]
pub struct Inspect {
    /// Files or folders with logs
    #[arg(required = true, value_name = "LOG")]
    pub logs: Vec<PathBuf>,
    /// One JSON document instead of text
    #[arg(long)]
    pub json: bool,
    #[command(flatten)]
    pub reading: Reading,
}

#[derive(Debug, ClapArgs)]
pub struct Sample {
    /// Model file, or a built-in one: `motion` or `paper`
    #[arg(long, value_name = "FILE|NAME", default_value = "motion")]
    pub model: PathBuf,
    /// Folder for the generated sequences, KITTI format
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
    /// How many
    #[arg(long, value_name = "N", default_value_t = 4)]
    pub count: usize,
    /// Seed of the first; the others follow
    #[arg(long, default_value_t = 0)]
    pub seed: u64,
    #[command(flatten)]
    pub computing: Computing,
}
