//! Whether the joint network's test earns a share of alpha, by the trusted logs themselves.
//!
//! A test that calls nothing which the others do not costs them a part of alpha. So before it is given one, a detector
//! with it is fitted to one half of the trusted groups, pieces of the other half get faults, and what the detector calls is
//! compared with what the same tests without the network call; then the halves change places. Chances of tests do not
//! depend on their shares, so one fit says both.

use super::fit::DetectorBuilder;
use super::options::MOTION_SHARES;
use crate::error::{Error, Result};
use crate::logs::{Note, conform};
use crate::model_file::Model;
use crate::report::Report;
use dose3_datasets::faults::Fault;
use dose3_datasets::{LogGroups, Trajectory, overlaps, stretches};

/// The default's tests with one of the joint network beside them.
pub(super) const STATISTICS: &str = "kinematic,differences,lin/cc/joint-score";
/// Their shares of alpha.
pub(super) const SHARES: [f64; 3] = [0.6, 0.2, 0.2];
/// With fewer groups a half has none to hold out.
const FEWEST_GROUPS: usize = 4;
/// Poses of a piece, at the rate at which logs are measured.
const PIECE: usize = 400;
/// Faulty ones of them.
const FAULTY: std::ops::Range<usize> = 160..260;
/// Most pieces of a half.
const PIECES: usize = 6;
/// Every so many faults of couplings, which the network is for, and of the suite.
const COUPLINGS: usize = 3;
const SUITE: usize = 6;
/// The test stays if it calls so many more of all faulty pieces.
const LEAST_GAIN: f64 = 0.01;

/// What was called with the network's test and without it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Trial {
    groups: usize,
    faulty: Counts,
    sound: Counts,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Counts {
    pieces: usize,
    with: usize,
    without: usize,
}

impl Counts {
    fn add(&mut self, report: &Report) {
        let alpha = report.evidence.alpha;
        let tests = &report.evidence.tests;
        let called = |shares: &[f64]| {
            let mut weighted = tests.iter().zip(shares).map(|(t, share)| t.p_value / share);
            weighted.any(|p| p <= alpha)
        };
        self.pieces += 1;
        self.with += usize::from(called(&SHARES));
        self.without += usize::from(called(&MOTION_SHARES));
    }
}

impl Trial {
    /// `builder` asks for [`STATISTICS`].
    pub fn run(builder: &DetectorBuilder, model: &Model, trusted: &[Trajectory]) -> Result<Self> {
        let shared = match builder.options.join_overlapping {
            true => overlaps(trusted),
            false => Vec::new(),
        };
        let groups = LogGroups::of(trusted).joined(&shared);
        let mut trial = Self {
            groups: groups.names.len(),
            ..Self::default()
        };
        if trial.groups < FEWEST_GROUPS {
            return Ok(trial);
        }
        let mut half = builder.clone();
        // What is asked of logs as wholes is the same with and without the network.
        (half.options.timing, half.options.calibration) = (false, false);
        for held_out in 0..2 {
            let of = |half: usize| -> Vec<Trajectory> {
                let logs = trusted.iter().zip(&groups.of_log);
                let logs = logs.filter(|(_, group)| *group % 2 == half);
                logs.map(|(log, _)| log.clone()).collect()
            };
            // A half that is too small to be fitted says nothing; so does a network that cannot run, which the fit
            // without it does not need.
            let Ok(fitted) = half.run_on(model, &of(1 - held_out), &mut ()) else {
                let groups = trial.groups;
                return Ok(Self {
                    groups,
                    ..Self::default()
                });
            };
            trial.judge(&fitted.detector, &of(held_out))?;
        }
        Ok(trial)
    }

    fn judge(&mut self, detector: &super::Detector, logs: &[Trajectory]) -> Result<()> {
        let couplings = Fault::couplings().into_iter().step_by(COUPLINGS);
        let suite = Fault::suite().into_iter().step_by(SUITE);
        let faults: Vec<Fault> = couplings.chain(suite).map(|(.., fault)| fault).collect();
        for (seed, piece) in pieces(detector, logs).iter().enumerate() {
            self.sound.add(&detector.judge(piece)?);
            for fault in &faults {
                let injected = fault.inject(piece, FAULTY, seed as u64);
                let faulty = injected.map_err(Error::from)?.trajectory;
                // A fault that leaves no window is no matter of this test.
                if let Ok(report) = detector.judge(&faulty) {
                    self.faulty.add(&report);
                }
            }
        }
        Ok(())
    }

    /// Whether the network's test calls more faults and no more sound pieces.
    pub fn helps(&self) -> bool {
        let needed = (LEAST_GAIN * self.faulty.pieces as f64).max(1.0);
        self.faulty.with as f64 >= self.faulty.without as f64 + needed
            && self.sound.with <= self.sound.without
    }

    pub fn note(&self) -> Note {
        Note::JointNetwork {
            asked: self.helps(),
            groups: self.groups,
            pieces: self.faulty.pieces,
            with: self.faulty.with,
            without: self.faulty.without,
            sound: [self.sound.pieces, self.sound.with, self.sound.without],
        }
    }
}

/// Pieces of the logs, evenly spread, as the detector measures them. Logs that it cannot judge have none.
fn pieces(detector: &super::Detector, logs: &[Trajectory]) -> Vec<Trajectory> {
    let needs = detector.needs();
    let mut all = Vec::new();
    for log in logs {
        let Ok((log, _)) = conform(log, &needs) else {
            continue;
        };
        for stretch in stretches(&log, log.max_gap) {
            let starts = stretch.clone().step_by(PIECE);
            let whole = starts.filter(|start| start + PIECE <= stretch.end);
            all.extend(whole.map(|start| log.cut(start..start + PIECE)));
        }
    }
    let kept = all.len().min(PIECES);
    let mut index = 0;
    let count = all.len();
    all.retain(|_| {
        index += 1;
        (index - 1) * kept / count != index * kept / count
    });
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    fn trial(faulty: [usize; 3], sound: [usize; 3]) -> Trial {
        let counts = |[pieces, with, without]: [usize; 3]| Counts {
            pieces,
            with,
            without,
        };
        Trial {
            groups: 6,
            faulty: counts(faulty),
            sound: counts(sound),
        }
    }

    #[test]
    fn the_network_stays_for_what_only_it_calls() {
        assert!(trial([200, 102, 100], [12, 0, 0]).helps());
        assert!(!trial([200, 101, 100], [12, 0, 0]).helps());
        assert!(!trial([200, 99, 100], [12, 0, 0]).helps());
        // Not at the price of false alarms.
        assert!(!trial([200, 120, 100], [12, 1, 0]).helps());
        assert!(trial([20, 11, 10], [2, 1, 1]).helps());
        assert!(!Trial::default().helps());
    }

    #[test]
    fn pieces_are_spread_over_the_logs() {
        use dose3_datasets::synthetic::{Platform, suite, trajectory};
        let trusted = suite(Platform::Vehicle, 4, 1);
        let builder = super::super::Detector::builder().statistics("kinematic".parse().unwrap());
        let detector = builder.fit(&trusted).unwrap();
        let long = trajectory(Platform::Vehicle, 5, 8000, 20.0);
        let found = pieces(&detector, &[long, trusted[0].cut(0..200)]);
        assert_eq!(found.len(), PIECES);
        assert!(found.iter().all(|piece| piece.len() == PIECE));
        assert!((found[0].rate.hertz - 10.0).abs() < 1e-9);
        assert!(pieces(&detector, &[trusted[0].cut(0..200)]).is_empty());
    }
}
