//! What statistics learn from the trusted logs before they are computed.

use crate::error::Result;
use crate::joint;
use dose3_datasets::{LogGroups, Trajectory, increments, stretches};
use dose3_ood::StatisticsSet;
use dose3_ood::statistics::{CHANNELS, LinearPredictor, LinearReference, axis_scale};
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// What a probe needs beside its model to measure new logs; stored in a detector.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ProbeReference {
    /// How each axis of the motion follows from the others, for `lin`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub linear: Option<LinearPredictor>,
    /// Metres and radians a step that count as 1 on each axis, for the joint network.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub scale: Option<[f64; CHANNELS]>,
}

impl ProbeReference {
    /// Whether nothing was learnt, because no statistic needs it.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        *self == Self::default()
    }
}

/// The same in use: for new logs, or for the trusted ones themselves.
#[derive(Default)]
pub(crate) struct Learnt {
    new: Option<Arc<LinearPredictor>>,
    /// For each trusted log, learnt without its group; empty where new logs are measured.
    of_log: Vec<Arc<LinearPredictor>>,
    /// Of the joint network, by all trusted logs.
    pub scale: Option<[f64; CHANNELS]>,
}

impl Learnt {
    pub fn from_trusted(
        logs: &[Trajectory],
        groups: &LogGroups,
        set: &StatisticsSet,
    ) -> Result<Self> {
        let mut learnt = Self::default();
        if set.needs_joint() {
            let mut all = Vec::new();
            for log in logs {
                all.extend(joint::steps(log)?);
            }
            learnt.scale = Some(axis_scale(&all));
        }
        if !set.needs_linear() {
            return Ok(learnt);
        }
        let (mut of_stretches, mut group) = (Vec::new(), Vec::new());
        for (log, of_log) in logs.iter().zip(&groups.of_log) {
            for stretch in stretches(log, log.max_gap) {
                of_stretches.push(increments(&log.poses[stretch], log.frame));
                group.push(*of_log);
            }
        }
        let of_stretches: Vec<&[f64]> = of_stretches.iter().map(Vec::as_slice).collect();
        let reference = LinearReference::fit(&of_stretches, &group)?;
        let without: Vec<Arc<LinearPredictor>> = (0..groups.names.len())
            .map(|group| Arc::new(reference.without(group).clone()))
            .collect();
        Ok(Self {
            new: Some(Arc::new(reference.into_all())),
            of_log: groups.of_log.iter().map(|g| without[*g].clone()).collect(),
            ..learnt
        })
    }

    pub fn for_new_logs(reference: &ProbeReference) -> Self {
        Self {
            new: reference.linear.clone().map(Arc::new),
            of_log: Vec::new(),
            scale: reference.scale,
        }
    }

    pub fn of_log(&self, log: usize) -> Option<Arc<LinearPredictor>> {
        self.of_log.get(log).or(self.new.as_ref()).cloned()
    }

    pub fn reference(&self) -> ProbeReference {
        ProbeReference {
            linear: self.new.as_deref().cloned(),
            scale: self.scale,
        }
    }
}
