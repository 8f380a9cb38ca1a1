//! What a user should know of how a log was taken.

use crate::report::{Place, rows};
use dose3_datasets::{Frame, RowKind, Shared};
use serde::{Deserialize, Serialize};
use std::fmt;

/// One thing that is worth knowing and no error; as text a sentence.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum Note {
    /// The file has no stamps, so the rate is the one the data set is known for.
    NominalRate {
        /// That rate, hertz.
        hertz: f64,
    },
    /// The log's rate is another one, and only poses are counted.
    OtherRate {
        /// The log's rate, hertz.
        hertz: f64,
        /// That of the trusted logs, hertz.
        trusted: f64,
    },
    /// The log is of another kind of body.
    OtherBody {
        /// The log's frame.
        frame: Frame,
        /// That of the trusted logs.
        trusted: Frame,
    },
    /// The log was brought down to the rate needed.
    Interpolated {
        /// The log's own rate, hertz.
        from: f64,
        /// The rate needed, hertz.
        to: f64,
    },
    /// Trusted logs are measured at another rate than the model's, because too few reach that.
    MeasuredAt {
        /// The rate, hertz.
        hertz: f64,
        /// The model's, hertz.
        usual: f64,
    },
    /// Windows are shorter than the usual ones.
    ShortWindows {
        /// Steps of a window.
        steps: usize,
        /// Steps of the usual ones.
        usual: usize,
    },
    /// The body axes of the trusted logs are not known.
    UnknownAxes,
    /// Two trusted logs are not independent of each other.
    Overlap {
        /// Name of one log.
        first: String,
        /// Name of the other.
        second: String,
        /// What they share.
        shared: Shared,
    },
    /// There is little trusted motion.
    FewWindows {
        /// Trusted windows.
        windows: usize,
        /// From so many on a tail of chances rests on ten windows.
        needed: usize,
    },
    /// A trusted group of logs is unlike the others.
    UnlikeTheOthers {
        /// Name of the group.
        group: String,
        /// Its log with the worst run of windows.
        log: String,
        /// Chance of such a run in a log like the others.
        chance: f64,
        /// Where the run is.
        place: Place,
        /// What rows of the log's file count.
        row_kind: RowKind,
        /// Whether the group is left out of what new logs are compared with.
        left_out: bool,
    },
    /// The model has a joint network, and it was tried whether its test finds more.
    JointNetwork {
        /// Whether the detector asks it.
        asked: bool,
        /// Groups of trusted logs.
        groups: usize,
        /// Pieces of held-out trusted logs with faults.
        pieces: usize,
        /// Of them, those called with the network's test.
        with: usize,
        /// Of them, those called without.
        without: usize,
        /// The same three of sound pieces.
        sound: [usize; 3],
    },
}

impl fmt::Display for Note {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NominalRate { hertz } => write!(
                f,
                "no stamps in the file: {hertz:.4} Hz is the data set's nominal rate"
            ),
            Self::OtherRate { hertz, trusted } => write!(
                f,
                "the log has {hertz:.4} Hz, the trusted logs {trusted:.4} Hz; a paper model counts \
                 poses, so a window spans another time"
            ),
            Self::OtherBody { frame, trusted } => write!(
                f,
                "the log is in frame {frame}, the trusted logs in {trusted}: another kind of body, \
                 its axes are compared as they are"
            ),
            Self::Interpolated { from, to } => {
                write!(f, "interpolated from {from:.4} Hz down to {to:.4} Hz")
            }
            Self::MeasuredAt { hertz, usual } => write!(
                f,
                "measured at {hertz:.4} Hz, not at {usual:.4} Hz, which too few of the trusted logs reach: \
                 fast and short faults show less"
            ),
            Self::ShortWindows { steps, usual } => write!(
                f,
                "measured in windows of {steps} steps instead of {usual}, because there are too few poses \
                 without a gap: fewer faults show"
            ),
            Self::UnknownAxes => f.write_str(
                "the body axes of the trusted logs are not known and taken as they are: logs to be \
                 judged must come from the same source",
            ),
            Self::Overlap {
                first,
                second,
                shared,
            } => match shared {
                Shared::Time { seconds } => write!(
                    f,
                    "{first} and {second} were recorded at the same time ({seconds:.0} s of it): they count \
                     as one log"
                ),
                Shared::Positions { share } => write!(
                    f,
                    "{first} and {second} hold the same positions ({:.0} % of the shorter one): they count \
                     as one log",
                    100.0 * share
                ),
                Shared::Route { share } => write!(
                    f,
                    "{first} and {second} go the same way ({:.0} % of the places): if new logs go other ways, \
                     name runs of one route as one group",
                    100.0 * share
                ),
            },
            Self::FewWindows { windows, needed } => write!(
                f,
                "only {windows} trusted windows, {needed} or more are needed for chances that mean what they say: \
                 trust more or longer logs"
            ),
            Self::UnlikeTheOthers {
                group,
                log,
                chance,
                place,
                row_kind,
                left_out,
            } => write!(
                f,
                "{group} is unlike the other trusted logs (chance {chance:.1e}): {} of {log}; it is {} what \
                 new logs are compared with",
                rows(*row_kind, place),
                if *left_out {
                    "left out of"
                } else {
                    "kept among"
                }
            ),
            Self::JointNetwork {
                pieces: 0, groups, ..
            } => write!(
                f,
                "the joint network is not asked: {groups} groups of trusted logs are too few, or too short, to \
                 measure whether it finds more"
            ),
            Self::JointNetwork {
                asked,
                pieces,
                with,
                without,
                sound: [sound, sound_with, sound_without],
                ..
            } => write!(
                f,
                "the joint network is {}: of {pieces} faulty pieces of held-out trusted logs {with} are called with its test \
                 and {without} without, of {sound} sound ones {sound_with} and {sound_without}",
                if *asked { "asked" } else { "not asked" },
            ),
        }
    }
}
