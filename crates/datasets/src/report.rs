//! What a reader had to repair, counted.

use serde::{Deserialize, Serialize};

use crate::{LostSpan, Remark};

/// Repairs made while reading one log. All zero for a clean file.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct LoadReport {
    /// The file began with a UTF-8 byte order mark, which was skipped.
    pub byte_order_mark: bool,
    /// Lines that ended in carriage return and line feed.
    pub crlf_lines: usize,
    /// Empty lines before the last line of data.
    pub blank_lines: usize,
    /// An incomplete last line or last array without its end (a recording cut off), left out.
    pub truncated_tail: usize,
    /// Poses left out because stamp and pose repeat the one before.
    pub repeated_poses: usize,
    /// Poses left out because their stamp was already taken by a different pose; the first one is kept.
    pub conflicting_stamps: usize,
    /// The stamps of both, nanoseconds, in order.
    #[serde(skip)]
    pub repeated_stamps: Vec<i64>,
    /// Quaternions whose norm was off by more than the rounding of the file (0.001) and was set to 1.
    pub quaternions_normalised: usize,
    /// Rotation matrices off by more than rounding (1e-5) that were replaced by the nearest rotation.
    pub rotations_projected: usize,
    /// Largest entry of `|R^T R - I|` seen, before the projection; for quaternion formats the largest `|norm - 1|`.
    pub largest_rotation_error: f64,
    /// Frames missing in a folder of one file per pose; their places in time stay empty.
    pub missing_frames: usize,
    /// Relative poses that do not continue the one before; a new stretch starts at each.
    pub chain_breaks: usize,
    /// Steps between stamps longer than the largest allowed one; a new stretch starts after each.
    pub gaps: usize,
    /// Metres in the unit that the header names for positions, which were multiplied by it; `None` where it names none or metres.
    pub length_unit: Option<f64>,
    /// The rate in hertz before resampling, where the log was resampled.
    pub resampled_from: Option<f64>,
    /// Rows without a pose, where tracking was lost; a new stretch starts after each span.
    pub lost: Vec<LostSpan>,
    /// What was assumed, and what looks wrong.
    pub remarks: Vec<Remark>,
}

impl LoadReport {
    /// Rows that hold no pose.
    pub fn lost_rows(&self) -> usize {
        self.lost.iter().map(|span| span.rows).sum()
    }

    /// True where the file was read as it is, without any repair (gaps, rounding and remarks are no repairs).
    pub fn is_clean(&self) -> bool {
        let gaps_and_rounding = Self {
            gaps: self.gaps,
            largest_rotation_error: self.largest_rotation_error,
            resampled_from: self.resampled_from,
            remarks: self.remarks.clone(),
            ..Self::default()
        };
        *self == gaps_and_rounding
    }

    /// One sentence for each kind of repair that happened, for people.
    pub fn lines(&self) -> Vec<String> {
        let mut lines = Vec::new();
        if self.byte_order_mark {
            lines.push("skipped a UTF-8 byte order mark".to_owned());
        }
        let counted = [
            (
                self.crlf_lines,
                "line(s) with Windows line ends read as usual",
            ),
            (self.blank_lines, "blank line(s) skipped"),
            (
                self.truncated_tail,
                "incomplete pose left out at the end of the file (recording cut off)",
            ),
            (
                self.repeated_poses,
                "pose(s) left out that repeat the stamp and the pose before",
            ),
            (
                self.conflicting_stamps,
                "pose(s) left out whose stamp was taken by a different pose (the first is kept)",
            ),
            (
                self.quaternions_normalised,
                "quaternion(s) with a norm off by more than 0.001 normalised",
            ),
            (
                self.rotations_projected,
                "matrix(es) not quite orthogonal replaced by the nearest rotation",
            ),
            (
                self.missing_frames,
                "frame(s) missing, left as gaps in time",
            ),
            (
                self.chain_breaks,
                "break(s) in the chain of relative poses, no window crosses them",
            ),
            (self.gaps, "gap(s) in the stamps, no window crosses them"),
        ];
        for (count, sentence) in counted {
            if count > 0 {
                lines.push(format!("{count} {sentence}"));
            }
        }
        if !self.lost.is_empty() {
            lines.push(self.lost_line());
        }
        if let Some(hertz) = self.resampled_from {
            lines.push(format!("resampled from {hertz:.2} Hz by interpolation"));
        }
        lines
    }

    /// Where tracking was lost, in one sentence.
    fn lost_line(&self) -> String {
        const SHOWN: usize = 4;
        let spans: Vec<String> = self.lost.iter().take(SHOWN).map(span_words).collect();
        let more = self.lost.len().saturating_sub(SHOWN);
        let more = if more > 0 {
            format!(" and {more} more")
        } else {
            String::new()
        };
        format!(
            "{} row(s) without a pose in {} place(s), tracking lost, no window crosses them: {}{more}",
            self.lost_rows(),
            self.lost.len(),
            spans.join(", ")
        )
    }
}

fn span_words(span: &LostSpan) -> String {
    if span.first_row == span.last_row {
        format!("row {} ({})", span.first_row, span.kind)
    } else {
        format!(
            "rows {} to {} ({})",
            span.first_row, span.last_row, span.kind
        )
    }
}
