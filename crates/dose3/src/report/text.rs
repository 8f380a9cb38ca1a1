//! A report in plain words.

use super::{Place, Report};
use dose3_datasets::RowKind;
use dose3_ood::Verdict;
use dose3_ood::detector::Evidence;
use std::fmt;

/// Segments and runs of poses that are shown.
const SHOWN: usize = 5;
/// Groups of statistics that are shown.
const GROUPS: usize = 3;

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
        self.write_whole(f)?;
        if !self.segments.is_empty() {
            for (i, reason) in self.contributions.iter().take(GROUPS).enumerate() {
                writeln!(
                    f,
                    "  {:<11} {}: {:.0} % of windows beyond the trusted ones, p {:.3}",
                    if i == 0 { "statistics" } else { "" },
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
        let deciding = e.deciding();
        let like = match e.basis.groups {
            1 => "the one trusted log".to_owned(),
            n => format!("your {n} trusted logs"),
        };
        let what = match &deciding.evidence {
            Evidence::Run(run) => {
                let (first, last) = (&self.windows[run.first], &self.windows[run.last]);
                let (windows, poses) =
                    (run.last + 1 - run.first, last.last_pose - first.first_pose);
                match windows {
                    1 => format!("its most unusual window, {} poses", poses + 1),
                    n => format!("its most unusual run of {n} windows, {} poses", poses + 1),
                }
            }
            Evidence::Finding(sentence) => sentence.clone(),
        };
        let chance = chance_beside(e.p_value, e.alpha);
        writeln!(f, "  decided by  {what} ({})", deciding.name)?;
        writeln!(
            f,
            "  chance      {chance} of this in a log like {like}, called at {} or less",
            e.alpha
        )?;
        self.write_basis(f)?;
        writeln!(
            f,
            "  how far     {}; {} of {} windows beyond {:.2}; mean score {:.2}",
            match e.excess {
                x if x < 0.1 => "no farther than usual".to_owned(),
                x => format!("{x:.1} times a trusted extreme"),
            },
            e.beyond,
            e.windows,
            e.threshold.value(),
            e.mean_score.value(),
        )
    }

    fn write_basis(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let basis = &self.evidence.basis;
        let groups = match basis.groups {
            1 => "1 log".to_owned(),
            n => format!("{n} logs"),
        };
        let alone = format!("{groups} alone could only say {:.3}", basis.smallest_rank_p);
        match basis.tail {
            true => writeln!(
                f,
                "  rests on    a tail fitted to {} trusted windows; {alone}",
                basis.windows
            )?,
            false if self.evidence.deciding().run().is_some() => {
                writeln!(
                    f,
                    "  rests on    ranks among {} trusted windows",
                    basis.windows
                )?;
            }
            false => writeln!(f, "  rests on    {groups}")?,
        }
        let measured: Vec<String> = basis
            .measured_alarms()
            .iter()
            .map(|m| format!("{} of {} ({})", m.called, m.pieces, m.data))
            .collect();
        if !measured.is_empty() {
            let (so_few, said) = match basis.groups {
                1 => ("one trusted log", "says only like or unlike it"),
                2 => ("two trusted logs", "is provisional"),
                _ => ("three trusted logs", "is uncertain where logs differ"),
            };
            writeln!(
                f,
                "  few logs    with {so_few} the verdict {said}: so few called sound logs of other recordings \
                 {}; trust more logs",
                measured.join(", ")
            )?;
        }
        Ok(())
    }

    /// Rows of the file as it counts them, with stamps where there are any.
    #[must_use]
    pub fn place(&self, place: &Place) -> String {
        let stamps = match (&place.first_stamp, &place.last_stamp) {
            (Some(first), Some(last)) if first != last => format!(", stamps {first} to {last}"),
            _ => String::new(),
        };
        let when = match place.first_row == place.last_row {
            true => format!("{:.1} s", place.start_s),
            false => format!("{:.1} s to {:.1} s{stamps}", place.start_s, place.end_s),
        };
        format!("{} ({when})", rows(self.log.row_kind, place))
    }

    fn write_whole(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let events = self.whole.timing.iter().flat_map(|timing| &timing.events);
        for (i, event) in events.take(SHOWN).enumerate() {
            writeln!(f, "  {:<11} {event}", if i == 0 { "timing" } else { "" })?;
        }
        // A calibration as unusual as one trusted log in twenty is worth knowing, called or not.
        if let Some(finding) = self.whole.calibration.as_ref().filter(|c| c.chance <= 0.05) {
            let sentence = finding.sentence(self.log.named_axes);
            let called = match finding.called {
                true => String::new(),
                false if finding.measured.called > 1 => format!(
                    ", not called: the trusted logs would call {} of their own {} pieces as well",
                    finding.measured.called, finding.measured.pieces
                ),
                false => ", not enough for a call".to_owned(),
            };
            writeln!(
                f,
                "  calibration {sentence} (chance {}{called})",
                chance(finding.chance)
            )?;
        }
        Ok(())
    }

    fn write_places(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (i, s) in self.segments.iter().take(SHOWN).enumerate() {
            writeln!(
                f,
                "  {:<11} {}, worst score {:.2}",
                if i == 0 || !self.segments[i - 1].reasons.is_empty() {
                    "where"
                } else {
                    ""
                },
                self.place(&s.place),
                s.worst_score.value()
            )?;
            for (i, reason) in s.reasons.iter().enumerate() {
                let why = if i == 0 { "why" } else { "" };
                let at = rows(self.log.row_kind, &reason.place);
                writeln!(f, "  {why:<11} {}, {at}", reason.sentence)?;
            }
        }
        match self.segments.len().saturating_sub(SHOWN) {
            0 => {}
            1 => writeln!(f, "              and 1 more segment")?,
            more => writeln!(f, "              and {more} more segments")?,
        }
        for (i, s) in self.pose_spans.iter().take(SHOWN).enumerate() {
            writeln!(
                f,
                "  {:<11} {}, {:.1} times a trusted extreme",
                if i == 0 { "poses" } else { "" },
                self.place(&s.place),
                s.worst_score.value()
            )?;
        }
        Ok(())
    }
}

/// A chance in digits that people read: `0.43`, `0.0012`, `3e-7`.
fn chance(p: f64) -> String {
    match p {
        p if p >= 0.0095 => format!("{p:.2}"),
        p if p >= 0.000_095 => format!("{p:.4}"),
        p => format!("{p:.0e}"),
    }
}

/// As [`chance`], with so many digits that it lies on the same side of alpha as the number itself.
fn chance_beside(p: f64, alpha: f64) -> String {
    let right = |text: &String| {
        let shown: f64 = text.parse().unwrap_or(p);
        (shown <= alpha) == (p <= alpha)
    };
    let longer = (3..=9).map(|digits| format!("{p:.digits$}"));
    let mut texts = std::iter::once(chance(p)).chain(longer);
    texts.find(right).unwrap_or_else(|| p.to_string())
}

/// `lines 501 to 520`, `line 7`.
pub(crate) fn rows(kind: RowKind, place: &Place) -> String {
    match (place.first_row, place.last_row) {
        (first, last) if first == last => format!("{kind} {first}"),
        (first, last) => format!("{kind}s {first} to {last}"),
    }
}
