//! Statistics of all windows of a set: one pass of the networks for each kind of noise serves all rows.

use crate::rows::{Noise, Statistics};
use crate::sets::DataSet;
use anyhow::Result;
use dose3::backend::Computing;
use dose3::{Model, Probe, ProbePlan};
use dose3_ood::StatisticsSet;

/// Rows that share their noise.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Pass {
    /// Their noise, with the most draws of any; none for rows without a network.
    pub noise: Option<Noise>,
}

/// How a pass is run.
#[derive(Clone, Copy, Debug)]
pub struct PassSettings {
    /// Diffusion steps visited.
    pub steps: usize,
    /// Seed of the noise.
    pub seed: u64,
    /// Where.
    pub computing: Computing,
}

/// The passes that these rows need, in the order of their first rows.
pub fn passes(rows: &[Statistics]) -> Vec<Pass> {
    let mut passes: Vec<Pass> = Vec::new();
    for row in rows {
        match passes.iter_mut().find(|pass| pass.serves(row)) {
            Some(pass) => {
                if let (Some(noise), Some(of_row)) = (&mut pass.noise, row.noise) {
                    noise.draws = noise.draws.max(of_row.draws);
                }
            }
            None => passes.push(Pass { noise: row.noise }),
        }
    }
    passes
}

impl Pass {
    /// Whether a row is computed in this pass.
    pub fn serves(&self, row: &Statistics) -> bool {
        self.noise.map(|n| n.sharing) == row.noise.map(|n| n.sharing)
    }

    /// Draws of each window; one without a network.
    pub fn draws(&self) -> usize {
        self.noise.map_or(1, |noise| noise.draws)
    }

    /// The numbers of those of `rows` that this pass serves, with their positions: `[window][column]`. `tick` hears
    /// of every window done.
    ///
    /// # Errors
    /// A window that cannot be represented, a failing network, a statistic that cannot be computed.
    pub fn run(
        &self,
        model: &Model,
        set: &DataSet,
        rows: &[Statistics],
        settings: &PassSettings,
        tick: &dyn Fn(),
    ) -> Result<Vec<(usize, Vec<Vec<f64>>)>> {
        let mut found = Vec::new();
        for (index, row) in rows.iter().enumerate().filter(|(_, r)| self.serves(r)) {
            let statistics: StatisticsSet = row.set.parse()?;
            found.push((index, statistics, Vec::with_capacity(set.windows.len())));
        }
        let plan = ProbePlan {
            steps: settings.steps,
            draws: self.draws(),
            seed: settings.seed,
            sharing: self.noise.map(|n| n.sharing).unwrap_or_default(),
        };
        let needed = found.iter().map(|(_, statistics, _)| statistics);
        let mut probe = Probe::for_sets(model, &plan, needed, settings.computing)?;
        probe.measure(&set.trajectories, &set.windows, |window| {
            for (index, statistics, numbers) in &mut found {
                numbers.push(rows[*index].evaluate(statistics, &window)?);
            }
            tick();
            anyhow::Ok(())
        })?;
        let found = found
            .into_iter()
            .map(|(index, _, numbers)| (index, numbers));
        Ok(found.collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use dose3_diffusion::NoiseSharing;

    #[test]
    fn a_pass_has_the_most_draws_of_its_rows() {
        let rows = [
            Statistics::own("paper24", 1),
            Statistics::shared("paper24", 2),
            Statistics::own("r3", 4),
            Statistics::without_network("kinematic"),
        ];
        let noise = |sharing, draws| Some(Noise { sharing, draws });
        let found: Vec<Option<Noise>> = passes(&rows).iter().map(|p| p.noise).collect();
        let expected = [
            noise(NoiseSharing::Own, 4),
            noise(NoiseSharing::Shared, 2),
            None,
        ];
        assert_eq!(found, expected);
    }
}
