//! The arguments of `dose3 watch`.

use clap::Args as ClapArgs;
use dose3_datasets::{Frame, StampUnit};
use std::path::PathBuf;

#[derive(Debug, ClapArgs)]
#[command(after_help = "Examples:\n  \
    dose3 watch --detector detector.dose3 < poses.txt\n  \
    dose3 watch --detector detector.dose3 --follow poses.txt --windows\n  \
    dose3 watch --detector detector.dose3 --realtime drive.bag --speed 10\n\
    Lines: stamp x y z qx qy qz qw (TUM), or one JSON object each, such as\n  \
    {\"stamp\": 1.05, \"position\": [1, 2, 0], \"orientation\": [0, 0, 0, 1]}\n\
    with stamp_ns for whole nanoseconds; metres; quaternions x, y, z, w.\n\
    Exit codes: 0 like the trusted logs in the end, 1 an alarm stood, 2 error or too few poses.")]
pub struct Watch {
    /// Detector file
    #[arg(long, value_name = "FILE")]
    pub detector: PathBuf,
    /// Read a file that grows instead of standard input, from its beginning on, until it is told to stop
    #[arg(long, value_name = "FILE", conflicts_with = "realtime")]
    pub follow: Option<PathBuf>,
    /// Play a log of any format at its own pace
    #[arg(long, value_name = "LOG")]
    pub realtime: Option<PathBuf>,
    /// How many times faster a log is played
    #[arg(long, value_name = "N", default_value_t = 1.0, requires = "realtime")]
    pub speed: f64,
    /// Body frame of the poses (default: that of the trusted logs)
    #[arg(long, value_name = "FRAME")]
    pub frame: Option<Frame>,
    /// False alarms an hour that are allowed on logs like the trusted ones
    #[arg(long, value_name = "N", default_value_t = 1.0)]
    pub alarms_per_hour: f64,
    /// Say what comes of every window too, not alarms and events alone
    #[arg(long)]
    pub windows: bool,
    /// Poses at the detector's rate from window to window, a divisor of the detector's stride (default: a quarter of it)
    #[arg(long, value_name = "N")]
    pub every: Option<usize>,
    /// Seconds between signs of life; 0 for none
    #[arg(
        long,
        value_name = "SECONDS",
        default_value_t = 10.0,
        allow_negative_numbers = true
    )]
    pub heartbeat: f64,
    /// Poses a second that come (default: measured from the first 32)
    #[arg(long, value_name = "HZ")]
    pub rate: Option<f64>,
    /// Longest step between stamps that is not a gap, seconds (default: 10 typical steps)
    #[arg(long, value_name = "SECONDS")]
    pub max_gap: Option<f64>,
    /// Metres from pose to pose that are a jump of the estimator's world (default: 100 typical steps of the model's data)
    #[arg(long, value_name = "METRES")]
    pub reset: Option<f64>,
    /// Unit of the stamps in lines: s, ms, us, ns
    #[arg(long, value_name = "UNIT", default_value_t = StampUnit::Seconds)]
    pub stamp_unit: StampUnit,
    /// Go on from this file where it is there, and leave there how things stand in the end
    #[arg(long, value_name = "FILE")]
    pub state: Option<PathBuf>,
    /// Keep a recording of poses, scores of windows, alarms and events for Foxglove, PlotJuggler or rerun, which can
    /// be opened while it grows
    #[arg(long, value_name = "FILE")]
    pub mcap: Option<PathBuf>,
    /// Replace whatever lies where the recording is to be
    #[arg(long, requires = "mcap")]
    pub force: bool,
    /// No words to standard error
    #[arg(long)]
    pub quiet: bool,
}
