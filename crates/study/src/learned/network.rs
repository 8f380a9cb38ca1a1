//! Either baseline, behind one face.

use super::Baseline;
use anyhow::Result;
use dose3_baselines::{Divergence, GlowRatio, Jem, Outcome, Sequences};

/// A trained baseline.
pub enum Network {
    /// Two flows.
    Glow(Box<GlowRatio>),
    /// A classifier.
    Jem(Box<Jem>),
}

impl Network {
    pub fn from_bytes(baseline: Baseline, bytes: &[u8]) -> Result<Self> {
        Ok(match baseline {
            Baseline::Glow => Self::Glow(Box::new(GlowRatio::from_bytes(bytes)?)),
            Baseline::Jem => Self::Jem(Box::new(Jem::from_bytes(bytes)?)),
        })
    }

    pub fn to_bytes(&self) -> Result<Vec<u8>> {
        Ok(match self {
            Self::Glow(glow) => glow.to_bytes()?,
            Self::Jem(jem) => jem.to_bytes()?,
        })
    }

    /// A score for each window, higher = more out of distribution.
    pub fn score(&self, windows: Sequences<'_>) -> Result<Vec<f64>> {
        Ok(match self {
            Self::Glow(glow) => glow.score(windows)?,
            Self::Jem(jem) => jem.score(windows)?,
        })
    }

    pub fn parameters(&self) -> usize {
        match self {
            Self::Glow(glow) => glow.parameters(),
            Self::Jem(jem) => jem.parameters(),
        }
    }

    /// How training ended, in words.
    pub fn outcome(&self) -> String {
        match self {
            // A Glow that diverges is an error of training.
            Self::Glow(glow) => {
                let steps = glow.foreground().config().steps;
                format!("completed 2 x {steps} steps")
            }
            Self::Jem(jem) => match jem.outcome() {
                Outcome::Completed { steps } => format!("completed {steps} steps"),
                Outcome::Diverged {
                    step,
                    snapshot,
                    sign,
                } => {
                    let sign = match sign {
                        Divergence::NotFinite => "not finite".to_owned(),
                        Divergence::EnergyGap { gap, .. } => format!("energy gap {gap:.0}"),
                    };
                    format!("diverged at step {step} ({sign}), weights of step {snapshot}")
                }
            },
        }
    }
}
