//! Predictors for the trusted logs themselves: each without the logs of its own group.

use super::normal::Sums;
use super::{CHANNELS, CHANNELS_IN, LAGS, LinearPredictor, PRODUCT};
use super::{halfway, scaled};
use crate::error::{Error, expect_len};
use crate::statistics::scale::{SCALE_FLOOR, winsorised};
use rayon::prelude::*;
use std::collections::BTreeMap;

/// The predictor of new logs, and for each group of trusted logs one that has not seen the group, so that the rows
/// of trusted windows look like those that a new log will have. Axes are scaled alike in all of them, by all logs.
#[derive(Clone, Debug, PartialEq)]
pub struct LinearReference {
    all: LinearPredictor,
    without: BTreeMap<usize, LinearPredictor>,
}

impl LinearReference {
    /// Of the gap-free stretches of trusted logs: `[n, 6]` body-frame increments each, and for each the group (a
    /// recording, a route) that is held out as one. Same input, same bytes, for any number of threads.
    ///
    /// # Errors
    /// [`Error::TooFew`] where no stretch has seven increments; [`Error::Shape`], [`Error::NotFinite`].
    pub fn fit(stretches: &[&[f64]], groups: &[usize]) -> Result<Self, Error> {
        expect_len(
            "groups of the trusted stretches",
            stretches.len(),
            groups.len(),
        )?;
        let twists: Result<Vec<_>, Error> = stretches.par_iter().map(|s| halfway(s)).collect();
        let twists = twists?;
        let mut scale = vec![SCALE_FLOOR; CHANNELS_IN];
        scale[PRODUCT] = 1.0;
        for axis in 0..CHANNELS {
            scale[axis] = winsorised(twists.iter().flatten().map(|t| t[axis]));
        }
        let unscaled = twists.iter().flat_map(|t| scaled(t, &scale));
        scale[PRODUCT] = winsorised(unscaled.map(|channels| channels[PRODUCT]));

        let mut members: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
        for (stretch, &group) in groups.iter().enumerate() {
            members.entry(group).or_default().push(stretch);
        }
        let members: Vec<(usize, Vec<usize>)> = members.into_iter().collect();
        let sums: Vec<(usize, Sums)> = members
            .par_iter()
            .map(|(group, stretches)| {
                let mut sums = Sums::none();
                for &stretch in stretches {
                    sums.push(&scaled(&twists[stretch], &scale));
                }
                (*group, sums)
            })
            .collect();
        let total = |left_out: Option<usize>| {
            let mut total = Sums::none();
            let kept = sums.iter().filter(|(group, _)| Some(*group) != left_out);
            kept.for_each(|(_, sums)| total.add(sums));
            total
        };
        let all = total(None);
        if all.rows == 0 {
            return Err(Error::TooFew {
                what: "consecutive increments of a trusted log",
                needed: LAGS,
                found: twists.iter().map(Vec::len).max().unwrap_or(0),
                hint: "give longer trusted logs",
            });
        }
        let without = sums.par_iter().filter_map(|&(group, _)| {
            let others = total(Some(group));
            (others.rows > 0).then(|| (group, LinearPredictor::solve(&scale, &others)))
        });
        Ok(Self {
            without: without.collect(),
            all: LinearPredictor::solve(&scale, &all),
        })
    }

    /// For new logs.
    #[must_use]
    pub fn all(&self) -> &LinearPredictor {
        &self.all
    }

    /// The same, alone.
    #[must_use]
    pub fn into_all(self) -> LinearPredictor {
        self.all
    }

    /// For the trusted logs of a group: fitted without them, where there are others.
    #[must_use]
    pub fn without(&self, group: usize) -> &LinearPredictor {
        self.without.get(&group).unwrap_or(&self.all)
    }
}
