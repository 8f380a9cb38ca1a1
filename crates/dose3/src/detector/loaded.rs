//! The networks of a detector, loaded when they are first needed.

use super::Detector;
use crate::error::Result;
use crate::probe::Probe;
use std::fmt;
use std::sync::{Mutex, PoisonError};

/// A probe that is no part of the detector's value: copies begin without one, and all are equal.
#[derive(Default)]
pub(super) struct Loaded(Mutex<Option<Probe>>);

impl Loaded {
    /// Calls `run` with the probe of `detector`.
    pub fn with<T>(
        &self,
        detector: &Detector,
        run: impl FnOnce(&mut Probe) -> Result<T>,
    ) -> Result<T> {
        // A probe holds no half-written state: whoever panicked with it left it as good as it was.
        let mut slot = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let probe = match &mut *slot {
            Some(probe) => probe,
            empty => empty.insert(detector.probe()?),
        };
        run(probe)
    }
}

impl Detector {
    /// What measures windows of new logs.
    pub(crate) fn probe(&self) -> Result<Probe> {
        let header = &self.header;
        let set = &header.statistics.config().statistics;
        let plan = header.plan();
        let mut probe = Probe::for_sets(&self.model, &plan, [set], self.computing)?;
        probe.set_reference(&header.reference);
        probe.set_window(header.window.unwrap_or(self.model.header.window));
        Ok(probe)
    }
}

impl Clone for Loaded {
    fn clone(&self) -> Self {
        Self::default()
    }
}

impl PartialEq for Loaded {
    fn eq(&self, _: &Self) -> bool {
        true
    }
}

impl fmt::Debug for Loaded {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Loaded")
    }
}
