//! Statistics of windows for all rows at once: one pass of the networks serves them all.

use super::methods::{METHODS, Network, all};
use anyhow::{Context, Result};
use dose3::backend::Computing;
use dose3::{Model, Probe, ProbePlan};
use dose3_datasets::{Trajectory, Window, stretch_numbers};
use dose3_diffusion::NoiseSharing;
use dose3_model::PairParameters;
use dose3_ood::localise::pose_numbers;
use dose3_ood::{DensityConfig, DetectorConfig, DetectorStatistics, Place, StatisticsSet};

/// Statistics `[method][window][column]`; empty for methods that were not asked for.
pub type Rows = Vec<Vec<Vec<f64>>>;

/// Numbers of every pose but the first of a window, see [`pose_numbers`].
pub type Poses = Vec<Vec<f64>>;

/// Settings that all parts of the run share.
pub struct Settings {
    /// Diffusion steps visited.
    pub steps: usize,
    /// Noise draws, common to all windows.
    pub draws: usize,
    /// The density of every block.
    pub density: DensityConfig,
    /// Seed of noise and fits.
    pub seed: u64,
    /// Where networks run.
    pub computing: Computing,
}

/// Turns windows into statistics.
pub struct Prober {
    trained: Probe,
    untrained: Probe,
    /// Poses of a window.
    pub poses: usize,
}

impl Prober {
    /// Loads the model, and an untrained one of its shape.
    ///
    /// # Errors
    /// A backend that is not there.
    pub fn new(model: &Model, settings: &Settings) -> Result<Self> {
        let plan = ProbePlan {
            steps: settings.steps.min(model.header.process.steps),
            draws: settings.draws,
            seed: settings.seed,
            sharing: NoiseSharing::Shared,
        };
        let untrained = Model {
            header: model.header.clone(),
            parameters: PairParameters::init(&model.parameters.config(), settings.seed)?,
            joint: None,
        };
        let probe = |model: &Model, trained: bool| -> Result<Probe> {
            let sets = distinct(&of_networks(&all(), trained))?;
            let sets = sets.iter().map(|(set, _)| set);
            Ok(Probe::for_sets(model, &plan, sets, settings.computing)?)
        };
        let trained = probe(model, true)?;
        Ok(Self {
            poses: trained.poses(),
            untrained: probe(&untrained, false)?,
            trained,
        })
    }

    /// Statistics of `windows` for the `methods` named; `tick` hears of every window done.
    ///
    /// # Errors
    /// As [`Prober::probe`].
    pub fn rows(
        &mut self,
        logs: &[Trajectory],
        windows: &[Window],
        methods: &[usize],
        tick: &dyn Fn(),
    ) -> Result<Rows> {
        let ignore = &mut |_, _| ();
        self.probe(logs, windows, methods, &|_| false, ignore, tick)
    }

    /// As [`Prober::rows`]; `visit` is given the pose numbers, by the trained networks, of the
    /// windows that `wanted` names.
    ///
    /// # Errors
    /// A window that cannot be represented, a failing network.
    pub fn probe(
        &mut self,
        logs: &[Trajectory],
        windows: &[Window],
        methods: &[usize],
        wanted: &dyn Fn(usize) -> bool,
        visit: &mut dyn FnMut(usize, Poses),
        tick: &dyn Fn(),
    ) -> Result<Rows> {
        let mut rows: Rows = vec![Vec::new(); METHODS.len()];
        for (probe, trained) in [(&mut self.trained, true), (&mut self.untrained, false)] {
            let sets = distinct(&of_networks(methods, trained))?;
            if sets.is_empty() {
                continue;
            }
            probe.measure(logs, windows, |window| {
                for (set, methods) in &sets {
                    let row = window.row(set)?;
                    for &method in methods {
                        rows[method].push(row.clone());
                    }
                }
                if trained && wanted(window.index) {
                    visit(window.index, pose_numbers(&window.sample())?);
                }
                tick();
                anyhow::Ok(())
            })?;
        }
        Ok(rows)
    }
}

/// Those of some methods that the trained networks serve, or the untrained ones.
fn of_networks(methods: &[usize], trained: bool) -> Vec<usize> {
    let all = methods.iter().copied();
    all.filter(|&m| (METHODS[m].network != Network::Untrained) == trained)
        .collect()
}

/// The sets of some methods, each once, with the methods that share it.
fn distinct(methods: &[usize]) -> Result<Vec<(StatisticsSet, Vec<usize>)>> {
    let mut sets: Vec<(&str, Vec<usize>)> = Vec::new();
    for &method in methods {
        let text = METHODS[method].statistics;
        match sets.iter_mut().find(|(known, _)| *known == text) {
            Some((_, methods)) => methods.push(method),
            None => sets.push((text, vec![method])),
        }
    }
    sets.into_iter()
        .map(|(text, methods)| Ok((text.parse()?, methods)))
        .collect()
}

/// Windows of whole logs with their statistics.
pub struct SetRows {
    /// The windows.
    pub windows: Vec<Window>,
    /// Their statistics.
    pub rows: Rows,
}

/// Where a window lies.
#[derive(Clone, Copy, Debug)]
pub struct Spot {
    /// Index of its log.
    pub log: usize,
    /// Number of its gap-free stretch.
    pub stretch: usize,
}

/// The steps between windows of one stretch: the smallest there are.
fn stride(windows: &[Window]) -> usize {
    let steps = windows
        .windows(2)
        .filter(|w| w[0].trajectory == w[1].trajectory);
    let steps = steps.map(|w| w[1].start.saturating_sub(w[0].start));
    steps.min().unwrap_or(1)
}

impl SetRows {
    /// The rows of `method` for the windows that `keep` wants, with where they lie.
    pub fn select(
        &self,
        method: usize,
        mut keep: impl FnMut(usize, &Window) -> bool,
    ) -> (Vec<Vec<f64>>, Vec<Spot>) {
        let all = self.windows.iter().enumerate();
        let chosen: Vec<usize> = all.filter(|(i, w)| keep(*i, w)).map(|(i, _)| i).collect();
        let windows: Vec<Window> = chosen.iter().map(|&i| self.windows[i]).collect();
        let stretches = stretch_numbers(&windows, stride(&self.windows));
        let spots = windows.iter().zip(stretches).map(|(window, stretch)| Spot {
            log: window.trajectory,
            stretch,
        });
        let rows = chosen.iter().map(|&i| self.rows[method][i].clone());
        (rows.collect(), spots.collect())
    }
}

/// How many windows `stride` poses apart share motion: a window of `poses` poses has one step fewer.
pub fn overlap(poses: usize, stride: usize) -> usize {
    (poses - 1).div_ceil(stride)
}

/// Fits a method's detector to rows of trusted windows; `groups` numbers the group of each log.
///
/// # Errors
/// Too few rows.
pub fn fit(
    method: usize,
    (rows, spots): &(Vec<Vec<f64>>, Vec<Spot>),
    groups: &[usize],
    overlap: usize,
    settings: &Settings,
) -> Result<DetectorStatistics> {
    let method = &METHODS[method];
    let config = DetectorConfig {
        statistics: method.statistics.parse()?,
        density: settings.density.clone(),
        combination: method.combination,
        overlap,
        draws: settings.draws,
        seed: settings.seed,
        ..DetectorConfig::default()
    };
    let place = |spot: &Spot| Place {
        group: groups[spot.log],
        log: spot.log,
        stretch: spot.stretch,
    };
    let places: Vec<Place> = spots.iter().map(place).collect();
    let names: Vec<String> = (0..groups.iter().max().map_or(0, |g| g + 1))
        .map(|group| format!("group {group}"))
        .collect();
    DetectorStatistics::fit(config, rows, &places, &names)
        .with_context(|| format!("row {}", method.key))
}
