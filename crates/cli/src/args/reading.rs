//! How logs are read.

use clap::{Args as ClapArgs, ValueEnum};
use dose3_datasets::{Columns, Format, Frame, LostKind, StampUnit};
use std::path::PathBuf;

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
    /// Metres in one unit of the logs' positions; replaces what a header says
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
    /// Topics of a recording; topic, rigid body, list or array of a table, JSON or npz file with several (default: the only
    /// one with poses; of a flight log the usual one)
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
