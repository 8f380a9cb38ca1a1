//! Judging: what a detector says of a log.

use super::Detector;
use crate::detector::extent::longest;
use crate::detector::header::Windows;
use crate::detector::short;
use crate::error::{Error, Result, Setting};
use crate::logs::{Note, conform};
use crate::progress::Progress;
use crate::reasons;
use crate::report::{PoseScores, Report};
use dose3_datasets::{Trajectory, stretch_numbers, windows_of_each};

/// How a log is judged.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct JudgeOptions {
    /// Share of trusted logs that may be rejected, in (0, 1); the detector's where `None`.
    pub alpha: Option<f64>,
}

impl Detector {
    /// Judges a log. Its windows lie as those of the trusted logs did, because the calibration knows how much they
    /// overlap; a log that is too short for them is judged in short windows. The report does not depend on the number
    /// of threads.
    ///
    /// # Errors
    /// A log in another frame, in another unit, slower than the trusted logs where that matters, or without one
    /// window; a backend that cannot be had.
    pub fn judge(&self, log: &Trajectory) -> Result<Report> {
        self.judge_with(log, &JudgeOptions::default(), &mut ())
    }

    /// As [`Detector::judge`], at another alpha; `progress` hears of every window.
    ///
    /// # Errors
    /// As [`Detector::judge`]; an alpha out of range.
    pub fn judge_with(
        &self,
        log: &Trajectory,
        options: &JudgeOptions,
        progress: &mut dyn Progress,
    ) -> Result<Report> {
        if let Some(alpha) = options.alpha.filter(|a| !(*a > 0.0 && *a < 1.0)) {
            let expected = "a share between 0 and 1";
            return Err(Error::setting(Setting::Alpha, alpha, expected));
        }
        // Of the log as it was read: that it was interpolated is a note.
        let repaired = log.report.lines();
        let (log, notes) = conform(log, &self.needs())?;
        let logs = std::slice::from_ref(log.as_ref());
        let header = &self.header;
        let set = &header.statistics.config().statistics;
        let mut notes = notes;
        let usual = header.usual(&self.model);
        let short = self.short_for(&logs[0]);
        let of_length = short.unwrap_or(usual);
        if short.is_some() {
            notes.push(Note::ShortWindows {
                steps: of_length.steps,
                usual: self.model.header.window,
            });
        }
        let mut pose_scores = vec![None; log.len()];
        let (windows, rows) = self.loaded.with(self, |probe| {
            probe.set_window(of_length.steps);
            let windows = match short {
                Some(short) => short::of_log(&logs[0], probe.poses(), short.stride)?,
                None => windows_of_each(logs, probe.poses(), usual.stride)?,
            };
            let mut rows = Vec::with_capacity(windows.len());
            probe.measure(logs, &windows, |window| {
                rows.push(window.row(set)?);
                if let Some(reference) = &header.poses {
                    for (pose, numbers) in window.poses()? {
                        pose_scores[pose] = Some(reference.score(&numbers)?);
                    }
                }
                progress.measured(window.index + 1, windows.len())
            })?;
            Ok((windows, rows))
        })?;
        let stretches = stretch_numbers(&windows, of_length.stride);
        let alpha = options.alpha.unwrap_or(header.statistics.config().alpha);
        let whole = header.whole.judge(&log, alpha)?;
        let outside = whole.tests(&log);
        let evidence = of_length
            .statistics
            .judge_with(&rows, &stretches, &outside, alpha)?;
        let mut said: Vec<String> = notes.iter().map(Note::to_string).collect();
        said.extend(repaired);
        said.extend(log.report.remarks.iter().map(ToString::to_string));
        let poses = PoseScores {
            scores: pose_scores,
            threshold: header.poses.as_ref().map(|p| p.threshold()),
        };
        let mut report = Report::new(&log, &windows, evidence, whole, poses, said);
        reasons::explain(self, &log, &mut report)?;
        Ok(report)
    }

    /// The longest short windows that a log has, or the shortest, where it has no usual one.
    fn short_for(&self, log: &Trajectory) -> Option<Windows<'_>> {
        let (kind, longest) = (self.model.header.representation.kind, longest(log));
        let fits = |steps: usize| kind.poses(steps) <= longest;
        if fits(self.header.usual(&self.model).steps) {
            return None;
        }
        let all = &self.header.short;
        let short = all.iter().find(|short| fits(short.steps)).or(all.last())?;
        Some(Windows {
            steps: short.steps,
            stride: short.stride,
            statistics: &short.statistics,
        })
    }
}
