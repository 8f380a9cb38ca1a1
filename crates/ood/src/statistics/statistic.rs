//! The named members of a set.

use super::{
    Column, JointErrors, Sample, TraceSummary, Workspace, bands, correlation, differences, joint,
    joint_score, kinematic, linear, moments, paper, path,
};
use crate::error::Error;
use serde::{Deserialize, Serialize};
use std::fmt;
use std::str::FromStr;

/// One named family of statistics; see the table in [the module](super).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum Statistic {
    /// The paper's 24: rotation split by axis.
    Paper24,
    /// The paper's 12: rotation pooled.
    Paper12,
    /// The paper's 6 of the translation branch.
    R3,
    /// All six channels pooled.
    Diffpath6,
    /// Length of the change of the estimate along all steps.
    Diffpath1,
    /// Log mean denoising error per axis and noise band.
    Residual,
    /// Denoising error pooled over poses by upper quantile and maximum.
    ResidualQuantiles,
    /// Mean of the estimate per axis and noise band.
    EpsMean,
    /// Log mean squared change between steps per axis and noise band.
    Change,
    /// Raw moments of the represented poses.
    Moments24,
    /// Body velocity, angular rate and their differences.
    Kinematic,
    /// Robust quantiles of the differences of velocity and angular rate.
    Differences,
    /// Quantiles of what a linear prediction of each axis from the others leaves over.
    Lin,
    /// Cross-correlations of pairs of axes and their lags.
    Cc,
    /// Log mean denoising error of the joint network per axis and level.
    Joint,
    /// The same given the other branch, and given the other axes.
    JointGiven,
    /// Upper quantile and maximum over poses of both.
    JointQuantiles,
    /// Their sum over levels as in the evidence lower bound, per axis.
    JointElbo,
    /// Slopes of the joint network's log-likelihood along mixed axes and delays.
    JointScore,
}

/// What a statistic is computed from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Source {
    Trace,
    Poses,
    Increments,
    Joint,
}

impl Statistic {
    /// All statistics, in the order of the documentation.
    pub const ALL: [Statistic; 19] = [
        Statistic::Paper24,
        Statistic::Paper12,
        Statistic::R3,
        Statistic::Diffpath6,
        Statistic::Diffpath1,
        Statistic::Residual,
        Statistic::ResidualQuantiles,
        Statistic::EpsMean,
        Statistic::Change,
        Statistic::Moments24,
        Statistic::Kinematic,
        Statistic::Differences,
        Statistic::Lin,
        Statistic::Cc,
        Statistic::Joint,
        Statistic::JointGiven,
        Statistic::JointQuantiles,
        Statistic::JointElbo,
        Statistic::JointScore,
    ];

    /// The name used in files, on the command line and in tables.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Statistic::Paper24 => "paper24",
            Statistic::Paper12 => "paper12",
            Statistic::R3 => "r3",
            Statistic::Diffpath6 => "diffpath6",
            Statistic::Diffpath1 => "diffpath1",
            Statistic::Residual => "residual",
            Statistic::ResidualQuantiles => "residual-quantiles",
            Statistic::EpsMean => "eps-mean",
            Statistic::Change => "change",
            Statistic::Moments24 => "moments24",
            Statistic::Kinematic => "kinematic",
            Statistic::Differences => "differences",
            Statistic::Lin => "lin",
            Statistic::Cc => "cc",
            Statistic::Joint => "joint",
            Statistic::JointGiven => "joint-given",
            Statistic::JointQuantiles => "joint-quantiles",
            Statistic::JointElbo => "joint-elbo",
            Statistic::JointScore => "joint-score",
        }
    }

    /// What it asks of a window, in words for people who judge logs.
    #[must_use]
    pub fn asks(self) -> &'static str {
        match self {
            Statistic::Paper24 | Statistic::Paper12 | Statistic::R3 | Statistic::Diffpath6 => {
                "how large the diffusion network's estimates are, and how they change along the process"
            }
            Statistic::Diffpath1 => {
                "how far the diffusion network's estimate travels along the process"
            }
            Statistic::Residual => "motion that the diffusion network cannot predict",
            Statistic::ResidualQuantiles => {
                "single poses that the diffusion network cannot predict"
            }
            Statistic::EpsMean => "which way the diffusion network would move each axis",
            Statistic::Change => {
                "how the diffusion network's estimate of each axis changes between steps of the process"
            }
            Statistic::Moments24 => "mean and spread of what the network is shown",
            Statistic::Kinematic => "how fast and how rough each axis moves",
            Statistic::Differences => {
                "jumps and noise of each axis, whatever few jumps sound logs have themselves"
            }
            Statistic::Lin => "whether each axis moves as the others say",
            Statistic::Cc => "whether the axes move together, and at the same time",
            Statistic::Joint => "motion that the joint network cannot predict",
            Statistic::JointGiven => {
                "motion of an axis that the joint network cannot predict from the others"
            }
            Statistic::JointQuantiles => "single poses that the joint network cannot predict",
            Statistic::JointElbo => "how unlikely each axis's motion is to the joint network",
            Statistic::JointScore => {
                "axes that are mixed or late, as the joint network knows motion"
            }
        }
    }

    pub(super) fn source(self) -> Source {
        match self {
            Statistic::Moments24 => Source::Poses,
            Statistic::Kinematic | Statistic::Differences | Statistic::Lin | Statistic::Cc => {
                Source::Increments
            }
            Statistic::Joint
            | Statistic::JointGiven
            | Statistic::JointQuantiles
            | Statistic::JointElbo
            | Statistic::JointScore => Source::Joint,
            _ => Source::Trace,
        }
    }

    pub(super) fn columns(self) -> Vec<Column> {
        match self {
            Statistic::Paper24 => paper::columns(&paper::SPLIT),
            Statistic::Paper12 => paper::columns(&paper::NO_SPLIT),
            Statistic::R3 => paper::columns(&paper::TRANSLATION),
            Statistic::Diffpath6 => paper::columns(&paper::ALL),
            Statistic::Diffpath1 => vec![path::column()],
            Statistic::Residual => bands::columns(&["log_residual"]),
            Statistic::ResidualQuantiles => {
                bands::columns(&["log_residual_q90", "log_residual_max"])
            }
            Statistic::EpsMean => bands::columns(&["mean_eps"]),
            Statistic::Change => bands::columns(&["log_change"]),
            Statistic::Moments24 => moments::columns(),
            Statistic::Kinematic => kinematic::columns(),
            Statistic::Differences => differences::columns(),
            Statistic::Lin => linear::columns(),
            Statistic::Cc => correlation::columns(),
            Statistic::Joint => joint::columns(),
            Statistic::JointGiven => joint::given_columns(),
            Statistic::JointQuantiles => joint::quantile_columns(),
            Statistic::JointElbo => joint::elbo_columns(),
            Statistic::JointScore => joint_score::columns(),
        }
    }

    /// Appends the values, one per column. Several draws are averaged.
    pub(super) fn values(
        self,
        sample: &Sample<'_>,
        work: &mut Workspace,
        out: &mut Vec<f64>,
    ) -> Result<(), Error> {
        match self.source() {
            Source::Trace => self.average_of_traces(sample.traces, out),
            Source::Poses => {
                let window = sample.window.ok_or(Error::MissingInput {
                    statistic: self,
                    input: "the represented poses",
                })?;
                moments::values(&window, out)
            }
            Source::Joint => {
                let errors = sample.joint.ok_or(Error::MissingInput {
                    statistic: self,
                    input: "errors of the joint network",
                })?;
                self.of_joint(errors, out)
            }
            Source::Increments => {
                let increments = sample.increments.ok_or(Error::MissingInput {
                    statistic: self,
                    input: "body-frame increments",
                })?;
                match self {
                    Statistic::Differences => differences::values(increments, work, out),
                    Statistic::Cc => correlation::values(increments, work, out),
                    Statistic::Lin => {
                        let predictor = sample.linear.ok_or(Error::MissingInput {
                            statistic: self,
                            input: "a linear predictor fitted to trusted logs",
                        })?;
                        linear::values(predictor, increments, work, out)
                    }
                    _ => kinematic::values(increments, work, out),
                }
            }
        }
    }

    fn of_joint(self, errors: &JointErrors, out: &mut Vec<f64>) -> Result<(), Error> {
        match self {
            Statistic::JointGiven => joint::given_values(errors, out),
            Statistic::JointQuantiles => joint::quantile_values(errors, out),
            Statistic::JointElbo => joint::elbo_values(errors, out),
            Statistic::JointScore => {
                let score = errors.score().ok_or(Error::MissingInput {
                    statistic: self,
                    input: "signed errors of the joint network",
                })?;
                joint_score::values(score, out);
            }
            _ => joint::values(errors, out),
        }
        Ok(())
    }

    fn average_of_traces(self, traces: &[TraceSummary], out: &mut Vec<f64>) -> Result<(), Error> {
        let start = out.len();
        let mut values = Vec::new();
        for (draw, trace) in traces.iter().enumerate() {
            values.clear();
            self.of_trace(trace, &mut values)?;
            if draw == 0 {
                out.extend_from_slice(&values);
            } else {
                for (sum, value) in out[start..].iter_mut().zip(&values) {
                    *sum += value;
                }
            }
        }
        if traces.is_empty() {
            return Err(Error::MissingInput {
                statistic: self,
                input: "a trace of the noise estimator",
            });
        }
        for value in &mut out[start..] {
            *value /= traces.len() as f64;
        }
        Ok(())
    }

    fn of_trace(self, trace: &TraceSummary, out: &mut Vec<f64>) -> Result<(), Error> {
        match self {
            Statistic::Paper24 => paper::values(&paper::SPLIT, trace, out),
            Statistic::Paper12 => paper::values(&paper::NO_SPLIT, trace, out),
            Statistic::R3 => paper::values(&paper::TRANSLATION, trace, out),
            Statistic::Diffpath6 => paper::values(&paper::ALL, trace, out),
            Statistic::Diffpath1 => out.push(path::change_norm(trace)),
            Statistic::Residual => bands::residual(trace, out)?,
            Statistic::ResidualQuantiles => bands::residual_quantiles(trace, out)?,
            Statistic::EpsMean => bands::eps_mean(trace, out)?,
            Statistic::Change => bands::change(trace, out)?,
            // `values` sends these to their own sources.
            Statistic::Moments24
            | Statistic::Kinematic
            | Statistic::Differences
            | Statistic::Lin
            | Statistic::Cc
            | Statistic::Joint
            | Statistic::JointGiven
            | Statistic::JointQuantiles
            | Statistic::JointElbo
            | Statistic::JointScore => {}
        }
        Ok(())
    }
}

impl fmt::Display for Statistic {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for Statistic {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self, Error> {
        let name = text.trim();
        Self::ALL
            .into_iter()
            .find(|s| s.name() == name)
            .ok_or_else(|| Error::UnknownStatistic {
                name: name.to_owned(),
                known: Self::ALL.map(Self::name).join(", "),
            })
    }
}
