//! Poses that were never filled in: identities in the midst of a log, stamps of zero among dates.

use std::collections::HashSet;

use dose3_lie::Pose;

use super::{A_DATE, Collector};
use crate::error::Place;
use crate::{Error, LostKind, LostSpan, Remark, RemarkKind, RowKind, StampUnit};

/// The identity counts as lost tracking where the log jumps there by this many typical steps.
const IDENTITY_JUMP: f64 = 4.0;

impl Collector<'_> {
    /// Takes out what says that tracking was lost by being the identity.
    pub(super) fn lose_identities(&mut self) -> Result<(), Error> {
        let named = self.options.lost.contains(&LostKind::Identity);
        if !named && (self.chained || !self.options.lost.is_empty()) {
            return Ok(());
        }
        let identity: Vec<bool> = self
            .poses
            .iter()
            .map(|pose| *pose == Pose::identity())
            .collect();
        if !identity.contains(&true) || identity.iter().all(|lost| *lost) {
            return Ok(());
        }
        let mut steps: Vec<f64> = (1..self.poses.len())
            .filter(|index| !identity[*index] && !identity[index - 1])
            .map(|index| (self.poses[index].translation - self.poses[index - 1].translation).norm())
            .collect();
        steps.sort_by(f64::total_cmp);
        let typical = steps.get(steps.len() / 2).copied().unwrap_or(0.0);
        let far = |index: usize| self.poses[index].translation.norm() > IDENTITY_JUMP * typical;
        let mut lost = vec![false; identity.len()];
        let mut start = 0;
        while start < identity.len() {
            let same = identity[start..]
                .iter()
                .take_while(|other| **other == identity[start]);
            let end = start + same.count();
            let before = start.checked_sub(1);
            let after = (end < identity.len()).then_some(end);
            let jumps = typical > 0.0 && before.is_none_or(far) && after.is_none_or(far);
            if identity[start] && (named || jumps) {
                lost[start..end].fill(true);
            }
            start = end;
        }
        self.take_out(&lost)
    }

    /// Removes poses, as lost by the identity.
    fn take_out(&mut self, lost: &[bool]) -> Result<(), Error> {
        if !lost.contains(&true) {
            return Ok(());
        }
        let (stamps, poses) = (
            std::mem::take(&mut self.stamps),
            std::mem::take(&mut self.poses),
        );
        let (rows, indices) = (
            std::mem::take(&mut self.rows),
            std::mem::take(&mut self.indices),
        );
        let breaks: HashSet<usize> = std::mem::take(&mut self.breaks).into_iter().collect();
        let mut spans = std::mem::take(&mut self.report.lost).into_iter().peekable();
        for index in 0..poses.len() {
            while let Some(mut span) = spans.next_if(|span| span.before <= index) {
                span.before = self.poses.len();
                self.start_stretch();
                self.report.lost.push(span);
            }
            if breaks.contains(&index) {
                self.start_stretch();
            }
            if lost[index] {
                let stamp = self.stamp_unit.map(|_| stamps[index]);
                let place = match self.row_kind {
                    RowKind::Line => Place::Line(rows[index] as usize),
                    RowKind::Message => Place::Message(rows[index] as usize),
                    _ => Place::Pose(rows[index] as usize),
                };
                self.lose(place, rows[index], stamp, LostKind::Identity)?;
                continue;
            }
            self.stamps.push(stamps[index]);
            self.poses.push(poses[index]);
            self.rows.push(rows[index]);
            self.indices.push(indices[index]);
        }
        let before = self.poses.len();
        self.report
            .lost
            .extend(spans.map(|span| LostSpan { before, ..span }));
        Ok(())
    }

    /// Leaves out first stamps of (nearly) zero before dates, which were never filled in.
    pub(super) fn leave_out_zero_stamps(&mut self) {
        let early = self.stamps.partition_point(|stamp| *stamp < A_DATE / 100);
        let dates = self
            .stamps
            .get(self.stamps.len() / 2)
            .is_some_and(|stamp| *stamp > A_DATE);
        if early == 0 || !dates || early > 1 + self.stamps.len() / 10 {
            return;
        }
        let unit = self.stamp_unit.unwrap_or(StampUnit::Seconds);
        let text = format!(
            "{} {} has the stamp {} {} while the others are dates like {}: {early} row(s) at the start left out",
            self.row_kind,
            self.rows[0],
            unit.write(self.stamps[0]),
            unit.symbol(),
            unit.write(self.stamps[early]),
        );
        self.report
            .remarks
            .push(Remark::new(RemarkKind::OutlierStamp, text));
        self.stamps.drain(..early);
        self.poses.drain(..early);
        self.rows.drain(..early);
        self.indices.drain(..early);
        self.breaks = self
            .breaks
            .iter()
            .filter_map(|index| index.checked_sub(early))
            .collect();
        for span in &mut self.report.lost {
            span.before = span.before.saturating_sub(early);
        }
    }
}
