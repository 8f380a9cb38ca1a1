//! Fitting: from a model and trusted logs to a detector, without retraining.

use super::short::{STRIDE, ShortWindows};
use super::trial::Trial;
use super::{Defaults, Detector, DetectorHeader, FitOptions, VERSION, WholeReference};
use super::{extent, span, trial};
use crate::backend::Computing;
use crate::built_in;
use crate::error::{Error, Result, Setting};
use crate::logs::{Needs, Note, conform};
use crate::model_file::{LogRecord, Model};
use crate::probe::{Probe, ProbePlan, checked};
use crate::progress::Progress;
use crate::report;
use crate::series::{Collector, Motion, TrustedRanges};
use dose3_datasets::{
    Frame, Kind, LogGroups, Overlap, Trajectory, Window, overlaps, stretch_numbers, stretches,
    windows_of_each,
};
use dose3_diffusion::Process;
use dose3_ood::{
    Combination, DetectorConfig, DetectorStatistics, Place, PoseReference, StatisticsSet,
};
use std::borrow::Cow;

/// With fewer trusted windows, fewer than ten lie beyond the 0.9 quantile, where the tail of chances begins.
const FEW_WINDOWS: usize = 100;

/// A fit to be: a model, settings, and where it is computed.
///
/// ```no_run
/// use dose3::Detector;
///
/// let trusted = dose3::load(["trusted/"])?;
/// let detector = Detector::builder().statistics("kinematic,differences".parse()?).alpha(0.01).fit(&trusted)?;
/// detector.save("detector.dose3")?;
/// # Ok::<(), dose3::Error>(())
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
pub struct DetectorBuilder {
    model: Option<Model>,
    pub(super) options: FitOptions,
    computing: Computing,
    leave_out: bool,
}

/// A fitted detector with what the user should know.
#[derive(Clone, Debug, PartialEq)]
pub struct Fitted {
    /// The detector.
    pub detector: Detector,
    /// Number of trusted windows.
    pub windows: usize,
    /// What was said of the trusted logs, each once.
    pub notes: Vec<Note>,
    /// Logs that the fit would have stopped at ([`DetectorBuilder::leave_out`]).
    pub left_out: Vec<LeftOut>,
}

/// A log that the fit is not of.
#[derive(Clone, Debug, PartialEq)]
pub struct LeftOut {
    /// Its index among the logs given.
    pub index: usize,
    /// What is wrong with it.
    pub reason: String,
}

impl DetectorBuilder {
    /// The model; by default the built-in one of body-frame motion.
    #[must_use]
    pub fn model(mut self, model: Model) -> Self {
        self.model = Some(model);
        self
    }

    /// The statistics, in blocks with a density each.
    #[must_use]
    pub fn statistics(mut self, statistics: StatisticsSet) -> Self {
        self.options.statistics = Some(statistics);
        self
    }

    /// Share of trusted logs, and of trusted windows, that may be rejected, in (0, 1).
    #[must_use]
    pub fn alpha(mut self, alpha: f64) -> Self {
        self.options.alpha = alpha;
        self
    }

    /// Seed of noise and fit.
    #[must_use]
    pub fn seed(mut self, seed: u64) -> Self {
        self.options.seed = seed;
        self
    }

    /// All settings at once.
    #[must_use]
    pub fn options(mut self, options: FitOptions) -> Self {
        self.options = options;
        self
    }

    /// Where and on how many threads it is computed, here and when the detector judges.
    #[must_use]
    pub fn computing(mut self, computing: Computing) -> Self {
        self.computing = computing;
        self
    }

    /// Whether logs that a fit would stop at (in another frame than the first log, too slow, shorter than a window) are
    /// left out of it and named, as long as one is left.
    #[must_use]
    pub fn leave_out(mut self, leave_out: bool) -> Self {
        self.leave_out = leave_out;
        self
    }

    /// Fits to the trusted logs.
    ///
    /// # Errors
    /// No log, a log that does not fit the model or is shorter than a window, settings out of range, too few
    /// windows.
    pub fn fit(&self, trusted: &[Trajectory]) -> Result<Detector> {
        Ok(self.run(trusted, &mut ())?.detector)
    }

    /// As [`DetectorBuilder::fit`], with what there is to know beside the detector.
    ///
    /// # Errors
    /// As [`DetectorBuilder::fit`].
    pub fn run(&self, trusted: &[Trajectory], progress: &mut dyn Progress) -> Result<Fitted> {
        match &self.model {
            Some(model) if self.is_open(model) => self.run_with_trial(model, trusted, progress),
            Some(model) => self.run_on(model, trusted, progress),
            None => self.run_on(&built_in::motion()?, trusted, progress),
        }
    }

    /// Whether the trusted logs are to say if the joint network of the model is asked.
    fn is_open(&self, model: &Model) -> bool {
        let said = self.options.statistics.is_some() || self.options.shares.is_some();
        model.joint.is_some() && !said
    }

    fn run_with_trial(
        &self,
        model: &Model,
        trusted: &[Trajectory],
        progress: &mut dyn Progress,
    ) -> Result<Fitted> {
        let mut with_network = self.clone();
        with_network.options.statistics = Some(trial::STATISTICS.parse()?);
        with_network.options.shares = Some(trial::SHARES.to_vec());
        let trial = Trial::run(&with_network, model, trusted)?;
        let chosen = match trial.helps() {
            true => &with_network,
            false => self,
        };
        let mut fitted = chosen.run_on(model, trusted, progress)?;
        fitted.notes.push(trial.note());
        Ok(fitted)
    }

    pub(super) fn run_on(
        &self,
        model: &Model,
        trusted: &[Trajectory],
        progress: &mut dyn Progress,
    ) -> Result<Fitted> {
        let options = &self.options;
        let statistics = self.statistics_of(model)?;
        let plan = self.plan(model, &statistics)?;
        if !(1..=extent::MOST_STRIDE).contains(&options.stride) {
            let expected = format!("1 to {}", extent::MOST_STRIDE);
            return Err(Error::setting(Setting::Stride, options.stride, expected));
        }
        if !(options.alpha > 0.0 && options.alpha < 1.0) {
            let expected = "a share between 0 and 1";
            return Err(Error::setting(Setting::Alpha, options.alpha, expected));
        }
        let mut probe = Probe::for_sets(model, &plan, [&statistics], self.computing)?;
        let Together {
            trusted,
            logs,
            needs,
            mut notes,
            left_out,
            window,
        } = self.brought_together(model, trusted, &statistics)?;
        let trusted = trusted.as_ref();
        let stride = extent::stride(model, window, options.stride);
        probe.set_window(window);
        let windows = windows_of_each(&logs, probe.poses(), stride)?;
        if windows.len() < FEW_WINDOWS {
            notes.push(Note::FewWindows {
                windows: windows.len(),
                needed: FEW_WINDOWS,
            });
        }
        let config = self.config(statistics, &plan, window.div_ceil(stride), model);
        config.check()?;

        let shared = match options.join_overlapping {
            true => overlaps(trusted),
            false => Vec::new(),
        };
        notes.extend(joining(&shared, trusted.len()).map(|pair| Note::Overlap {
            first: trusted[pair.first].name.clone(),
            second: trusted[pair.second].name.clone(),
            shared: pair.shared,
        }));
        let groups = LogGroups::of(&logs).joined(&shared);
        let set = &config.statistics;
        probe.learn(&logs, &groups, set)?;
        let total = windows.len();
        let (mut rows, mut poses) = (Vec::with_capacity(total), Vec::new());
        probe.measure(&logs, &windows, |window| {
            rows.push(window.row(set)?);
            poses.extend(window.poses()?.into_iter().map(|(_, numbers)| numbers));
            progress.measured(window.index + 1, total)
        })?;
        let poses = PoseReference::fit(&poses)?;
        let of_steps = extent::short(model, window, set).into_iter();
        let short = of_steps
            .map(|steps| short_windows(steps, &logs, &groups, &config, &mut probe))
            .collect::<Result<_>>()?;
        let places = places(&windows, stride, &groups);
        let statistics = DetectorStatistics::fit(config, &rows, &places, &groups.names)?;
        let audit = &statistics.calibration().audit;
        notes.extend(audit.iter().map(|found| Note::UnlikeTheOthers {
            group: found.group.clone(),
            log: logs[found.log].name.clone(),
            chance: found.p_value,
            place: {
                let (first, last) = (&windows[found.first], &windows[found.last]);
                report::Place::new(&logs[found.log], first.start, last.start + last.length - 1)
            },
            row_kind: logs[found.log].row_kind,
            left_out: found.left_out,
        }));
        let motion = model.header.representation.kind == Kind::Motion;
        let whole = WholeReference::fit(
            &logs,
            &groups,
            motion && options.timing,
            motion && options.calibration,
        )?;
        let odd = audit.iter().filter(|found| found.left_out);
        let odd: Vec<usize> = odd.map(|found| groups.of_log[found.log]).collect();
        let kept = |log: &usize| !odd.contains(&groups.of_log[*log]);
        let ranges = match needs.exacting() {
            true => Some(ranges(&logs, kept, &windows, &probe)?),
            false => None,
        };
        let spans = match needs.exacting() {
            true => span::fit(&logs, &groups, kept, needs.rate)?,
            false => Vec::new(),
        };
        let header = DetectorHeader {
            format_version: VERSION,
            rate: needs.rate,
            frame: needs.frame,
            steps: plan.steps,
            noise: plan.sharing,
            stride,
            window: (window != model.header.window).then_some(window),
            trusted: logs.iter().map(LogRecord::from).collect(),
            statistics,
            reference: probe.reference(),
            poses: Some(poses),
            whole,
            ranges,
            short,
            spans,
            version: env!("CARGO_PKG_VERSION").to_string(),
        };
        Ok(Fitted {
            detector: Detector::new(carried(model, &header), header, self.computing),
            windows: total,
            notes,
            left_out,
        })
    }

    /// Each log is resampled once, however many are left out.
    fn brought_together<'a>(
        &self,
        model: &Model,
        trusted: &'a [Trajectory],
        statistics: &StatisticsSet,
    ) -> Result<Together<'a>> {
        let needs = self.needs(model, trusted, statistics)?;
        let (mut logs, mut notes, mut left_out) = (Vec::new(), Vec::new(), Vec::new());
        let usual = &model.header;
        if needs.representation.kind == Kind::Motion && needs.rate < usual.rate {
            notes.push(Note::MeasuredAt {
                hertz: needs.rate,
                usual: usual.rate,
            });
        }
        let conformed: Vec<_> = trusted.iter().map(|log| conform(log, &needs)).collect();
        let suitable = conformed.iter().flatten();
        let lengths = suitable.map(|(log, _)| extent::longest(log)).collect();
        let window = extent::window(model, lengths, statistics, self.options.window)?;
        if self.options.window.is_none() && window < usual.window {
            notes.push(Note::ShortWindows {
                steps: window,
                usual: usual.window,
            });
        }
        let poses = usual.representation.kind.poses(window);
        let mut first_error = None;
        for (index, conformed) in conformed.into_iter().enumerate() {
            let conformed = conformed.and_then(|(log, said)| {
                let one = std::slice::from_ref(log.as_ref());
                windows_of_each(one, poses, self.options.stride)?;
                Ok((log.into_owned(), said))
            });
            match conformed {
                Ok((log, said)) => {
                    logs.push(log);
                    notes.extend(said);
                }
                Err(error) if self.leave_out => {
                    let reason = error.to_string();
                    left_out.push(LeftOut { index, reason });
                    first_error.get_or_insert(error);
                }
                Err(error) => return Err(error),
            }
        }
        if let Some(error) = first_error.filter(|_| logs.is_empty()) {
            return Err(error);
        }
        if needs.representation.kind == Kind::Motion && needs.frame == Frame::Sensor {
            notes.push(Note::UnknownAxes);
        }
        let mut said = Vec::new();
        notes.retain(|note| {
            let new = !said.contains(note);
            said.push(note.clone());
            new
        });
        let is_left = |index: usize| left_out.iter().any(|left| left.index == index);
        let all = trusted.iter().enumerate();
        let kept = all.filter(|(index, _)| !is_left(*index));
        Ok(Together {
            trusted: match left_out.is_empty() {
                true => Cow::Borrowed(trusted),
                false => kept.map(|(_, log)| log.clone()).collect(),
            },
            logs,
            needs,
            notes,
            left_out,
            window,
        })
    }

    /// What the trusted logs must be like: as the model and the first of them are, at a rate that most of them have.
    fn needs(
        &self,
        model: &Model,
        trusted: &[Trajectory],
        statistics: &StatisticsSet,
    ) -> Result<Needs> {
        let first = trusted.first().ok_or(Error::NoLog { purpose: "fit on" })?;
        Ok(Needs {
            representation: model.header.representation,
            metric: statistics.needs_increments(),
            rate: extent::rate(model, trusted, statistics, self.options.rate)?,
            frame: first.frame,
        })
    }

    fn statistics_of(&self, model: &Model) -> Result<StatisticsSet> {
        Ok(match &self.options.statistics {
            Some(set) => set.clone(),
            None => Defaults::of(model).statistics.parse()?,
        })
    }

    fn shares_of(&self, model: &Model) -> Option<Vec<f64>> {
        let usual = || Defaults::of(model).shares.map(<[f64]>::to_vec);
        match (&self.options.shares, &self.options.statistics) {
            (Some(shares), _) => Some(shares.clone()),
            (None, None) => usual(),
            (None, Some(_)) => None,
        }
    }

    fn plan(&self, model: &Model, statistics: &StatisticsSet) -> Result<ProbePlan> {
        let (options, defaults) = (&self.options, Defaults::of(model));
        let plan = ProbePlan {
            steps: options.steps.unwrap_or(defaults.steps),
            draws: options.draws.unwrap_or(defaults.draws),
            seed: options.seed,
            sharing: options.noise,
        };
        checked(&plan, &Process::new(model.header.process)?, statistics)
    }

    fn config(
        &self,
        statistics: StatisticsSet,
        plan: &ProbePlan,
        overlap: usize,
        model: &Model,
    ) -> DetectorConfig {
        let options = &self.options;
        let usual = match statistics.blocks() {
            0 | 1 => Combination::Joint,
            _ => Combination::Fisher,
        };
        DetectorConfig {
            statistics,
            density: options.density.clone(),
            combination: options.combination.unwrap_or(usual),
            shares: self.shares_of(model),
            keep_all: options.keep_all,
            overlap,
            alpha: options.alpha,
            window_alpha: options.alpha,
            draws: plan.draws,
            seed: plan.seed,
            ..DetectorConfig::default()
        }
    }
}

/// The trusted logs that can be used, as they were given and as the model needs them.
struct Together<'a> {
    trusted: Cow<'a, [Trajectory]>,
    logs: Vec<Trajectory>,
    needs: Needs,
    notes: Vec<Note>,
    left_out: Vec<LeftOut>,
    /// Steps of a window.
    window: usize,
}

/// The model as a detector keeps it: without a joint network that it does not ask.
fn carried(model: &Model, header: &DetectorHeader) -> Model {
    let joint = match header.statistics.config().statistics.needs_joint() {
        true => model.joint.clone(),
        false => None,
    };
    Model {
        header: model.header.clone(),
        parameters: model.parameters.clone(),
        joint,
    }
}

/// Short windows of the trusted logs, with densities and calibration of their own.
fn short_windows(
    steps: usize,
    logs: &[Trajectory],
    groups: &LogGroups,
    config: &DetectorConfig,
    probe: &mut Probe,
) -> Result<ShortWindows> {
    probe.set_window(steps);
    let windows = windows_of_each(logs, probe.poses(), STRIDE)?;
    let rows = probe.rows(logs, &windows, &config.statistics)?;
    let config = DetectorConfig {
        overlap: steps.div_ceil(STRIDE),
        ..config.clone()
    };
    let places = places(&windows, STRIDE, groups);
    Ok(ShortWindows {
        steps,
        stride: STRIDE,
        statistics: DetectorStatistics::fit(config, &rows, &places, &groups.names)?,
    })
}

/// Where each window lies.
fn places(windows: &[Window], stride: usize, groups: &LogGroups) -> Vec<Place> {
    let place = |(window, stretch): (&Window, usize)| Place {
        group: groups.of_log[window.trajectory],
        log: window.trajectory,
        stretch,
    };
    let numbers = stretch_numbers(windows, stride);
    windows.iter().zip(numbers).map(place).collect()
}

/// The values that plain quantities take in those of `logs` that are `kept`, by pose and by window.
fn ranges(
    logs: &[Trajectory],
    kept: impl Fn(&usize) -> bool,
    windows: &[Window],
    probe: &Probe,
) -> Result<TrustedRanges> {
    let mut collector = Collector::default();
    for log in (0..logs.len()).filter(kept) {
        let (t, linear) = (&logs[log], probe.linear_of(log));
        for stretch in stretches(t, t.max_gap) {
            let poses = &t.poses[stretch.clone()];
            let motion = Motion::new(poses, t.frame, t.rate.hertz, linear.as_deref())?;
            let within = windows
                .iter()
                .filter(|w| w.trajectory == log && stretch.contains(&w.start))
                .map(|w| w.start - stretch.start..w.start - stretch.start + w.length);
            collector.add(poses, &motion, &within.collect::<Vec<_>>());
        }
    }
    Ok(collector.finish())
}

/// Those of the pairs that tell of something new: between logs that no pair before links. Eight logs of one recording
/// are seven sentences, not twenty-eight.
fn joining(pairs: &[Overlap], logs: usize) -> impl Iterator<Item = &Overlap> {
    let mut linked: Vec<usize> = (0..logs).collect();
    pairs.iter().filter(move |pair| {
        let (a, b) = (linked[pair.first], linked[pair.second]);
        linked.iter_mut().filter(|l| **l == b).for_each(|l| *l = a);
        a != b
    })
}
