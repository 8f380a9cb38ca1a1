//! A report in plain words.

use super::Report;
use dose3_ood::Verdict;
use std::fmt;

/// Segments and runs of poses that are shown.
const SHOWN: usize = 5;
/// Groups of statistics that are shown.
const REASONS: usize = 3;

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let verdict = match self.verdict {
            Verdict::InDistribution => "in distribution",
            Verdict::OutOfDistribution => "OUT OF DISTRIBUTION",
            Verdict::Like => "like the one trusted log",
            Verdict::Unlike => "UNLIKE the one trusted log",
        };
        writeln!(f, "{:<24} {verdict}", self.log.name)?;
        self.write_evidence(f)?;
        self.write_places(f)?;
        if self.evidence.beyond > 0 {
            for (i, reason) in self.reasons.iter().take(REASONS).enumerate() {
                writeln!(
                    f,
                    "  {:<11} {}: {:.0} % of windows beyond the trusted ones, p {:.3}",
                    if i == 0 { "why" } else { "" },
                    reason.group,
                    100.0 * reason.share_beyond,
                    reason.p_value
                )?;
            }
        }
        for note in &self.notes {
            writeln!(f, "  {:<11} {note}", "note")?;
        }
        Ok(())
    }
}

impl Report {
    fn write_evidence(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let e = &self.evidence;
        writeln!(
            f,
            "  decided by  {}: chance {:.2e} in a log like the trusted ones, alpha {}",
            e.deciding().name,
            e.p_value,
            e.alpha
        )?;
        let groups = match e.basis.groups {
            1 => "1 trusted log".to_owned(),
            n => format!("{n} trusted logs"),
        };
        writeln!(
            f,
            "  rests on    a tail fitted to {} trusted windows; without a model {groups} can only say \
             {:.3}",
            e.basis.windows, e.basis.smallest_rank_p
        )?;
        writeln!(
            f,
            "  windows     {} of {} beyond {:.2}; mean score {:.2}; {:.2} times a trusted extreme",
            e.beyond,
            e.windows,
            e.threshold.value(),
            e.mean_score.value(),
            e.excess
        )
    }

    fn write_places(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (i, s) in self.segments.iter().take(SHOWN).enumerate() {
            writeln!(
                f,
                "  {:<11} poses {} to {} ({:.1} s to {:.1} s), worst score {:.2}",
                if i == 0 { "where" } else { "" },
                s.first_pose,
                s.last_pose,
                s.start_s,
                s.end_s,
                s.worst_score.value()
            )?;
        }
        match self.segments.len().saturating_sub(SHOWN) {
            0 => {}
            1 => writeln!(f, "              and 1 more segment")?,
            more => writeln!(f, "              and {more} more segments")?,
        }
        for (i, s) in self.pose_spans.iter().take(SHOWN).enumerate() {
            writeln!(
                f,
                "  {:<11} {} to {} ({:.1} s to {:.1} s), pose {} the most ({:.1} times a trusted \
                 extreme)",
                if i == 0 { "poses" } else { "" },
                s.first_pose,
                s.last_pose,
                s.start_s,
                s.end_s,
                s.worst_pose,
                s.worst_score.value()
            )?;
        }
        Ok(())
    }
}
