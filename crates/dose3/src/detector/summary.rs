//! What a detector trusts and what it can see, for people.

use super::{CALIBRATION_SHARE, Detector, TIMING_SHARE};
use crate::error::Result;
use crate::model_file::LogRecord;
use crate::model_file::summary::{count, names};
use crate::series::Quantity;
use dose3_datasets::{Frame, Kind, hex};
use dose3_ood::statistics::Statistic;
use serde::Serialize;
use sha2::{Digest, Sha256};
use std::collections::BTreeSet;
use std::fmt;

/// A detector in numbers and words; `Display` says it in a terminal.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct DetectorSummary {
    /// SHA-256 of the detector as this build writes it: two detectors with one hash judge alike.
    pub sha256: String,
    /// Version of the program that fitted it.
    pub version: String,
    /// The trusted logs.
    pub trusted: Vec<LogRecord>,
    /// Trusted groups that new logs are compared with.
    pub groups: usize,
    /// Trusted groups that are unlike the others, and whether new logs are compared with them.
    pub odd: Vec<OddGroup>,
    /// Trusted windows that new ones are compared with.
    pub windows: usize,
    /// Poses that every log is brought down to a second, hertz.
    pub rate_hz: f64,
    /// Whether time and axes matter: a faster log is interpolated, a slower one refused.
    pub exacting: bool,
    /// The body frame of the trusted logs.
    pub frame: Frame,
    /// Length of a window, and so of the shortest log, seconds.
    pub window_s: f64,
    /// The statistics.
    pub statistics: String,
    /// Each test with its share of alpha.
    pub tests: Vec<(String, f64)>,
    /// Share of sound logs that may be called.
    pub alpha: f64,
    /// The smallest chance that so many groups can say by ranks alone, 1 / (n + 1).
    pub smallest_rank_chance: f64,
    /// Groups with which ranks alone could call a log at alpha.
    pub groups_for_alpha: usize,
    /// What quantities do in 98 of 100 trusted windows.
    pub ranges: Vec<QuantitySummary>,
    /// What is asked of a log, in words.
    pub sees: Vec<String>,
    /// What cannot be seen, in words.
    pub cannot_see: Vec<String>,
}

/// A trusted group that is unlike the others.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct OddGroup {
    /// Its name.
    pub group: String,
    /// Chance of it among groups like the others.
    pub chance: f64,
    /// Whether new logs are not compared with it.
    pub left_out: bool,
}

/// The trusted range of a quantity.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct QuantitySummary {
    /// Which.
    #[cfg_attr(feature = "schema", schemars(with = "String"))]
    pub quantity: Quantity,
    /// In words.
    pub label: String,
    /// Its SI unit.
    pub unit: String,
    /// In the middle of all poses.
    pub median: f64,
    /// 98 of 100 poses are between these.
    pub middle: [f64; 2],
    /// The smallest and the largest of all.
    pub all: [f64; 2],
}

impl Detector {
    /// What it trusts and what it can see.
    ///
    /// # Errors
    /// A header that cannot be serialised.
    pub fn summary(&self) -> Result<DetectorSummary> {
        let header = self.header();
        let (statistics, needs) = (&header.statistics, self.needs());
        let (config, calibration) = (statistics.config(), statistics.calibration());
        let whole = &header.whole;
        let outside = [
            ("timing", TIMING_SHARE, whole.timing.is_some()),
            (
                "calibration",
                CALIBRATION_SHARE,
                whole.calibration.is_some(),
            ),
        ];
        let outside: Vec<(String, f64)> = outside
            .into_iter()
            .filter(|(.., there)| *there)
            .map(|(name, share, _)| (name.to_owned(), share))
            .collect();
        let left: f64 = 1.0 - outside.iter().map(|(_, share)| share).sum::<f64>();
        let own = config
            .statistics
            .test_names()
            .into_iter()
            .zip(config.shares());
        let tests = own.map(|(name, share)| (name, share * left)).chain(outside);
        let named = header.frame.has_forward();
        let ranges = header.ranges.iter().flat_map(|ranges| ranges.iter());
        let model = &self.model().header;
        Ok(DetectorSummary {
            sha256: hex(Sha256::digest(self.to_bytes()?)),
            version: header.version.clone(),
            trusted: header.trusted.clone(),
            groups: calibration.logs,
            odd: calibration
                .audit
                .iter()
                .map(|found| OddGroup {
                    group: found.group.clone(),
                    chance: found.p_value,
                    left_out: found.left_out,
                })
                .collect(),
            windows: calibration.windows.len(),
            rate_hz: header.rate,
            exacting: needs.exacting(),
            frame: header.frame,
            window_s: (model.representation.kind.poses(model.window) - 1) as f64 / header.rate,
            statistics: config.statistics.to_string(),
            tests: tests.collect(),
            alpha: config.alpha,
            smallest_rank_chance: 1.0 / (calibration.logs + 1) as f64,
            groups_for_alpha: (1.0 / config.alpha - 1e-9).ceil() as usize - 1,
            ranges: ranges
                .map(|(quantity, range)| QuantitySummary {
                    quantity,
                    label: quantity.label(named),
                    unit: quantity.unit().symbol().to_owned(),
                    median: range.poses.median(),
                    middle: [range.poses.at(0.01), range.poses.at(0.99)],
                    all: [range.poses.low(), range.poses.high()],
                })
                .collect(),
            sees: self.sees(),
            cannot_see: self.cannot_see(),
        })
    }

    fn sees(&self) -> Vec<String> {
        let header = self.header();
        let names = header.statistics.config().statistics.to_string();
        let of = |statistic: &Statistic| {
            let mut parts = names.split([',', '/', '+']);
            parts.any(|part| part == statistic.name())
        };
        let mut sees: Vec<String> = Statistic::ALL
            .into_iter()
            .filter(of)
            .map(|statistic| format!("{} ({statistic})", statistic.asks()))
            .collect();
        if let Some(timing) = &header.whole.timing {
            sees.push(format!(
                "lost, late, doubled and irregular stamps, as in {} trusted groups (timing)",
                timing.len()
            ));
        }
        if header.whole.calibration.is_some() {
            sees.push("position late, apart or turned against attitude (calibration)".to_owned());
        }
        sees
    }

    fn cannot_see(&self) -> Vec<String> {
        let header = self.header();
        let mut blind = vec![
            "a fault that leaves the motion plausible: a slow drift, a few percent of scale"
                .to_owned(),
        ];
        if self.model().header.representation.kind == Kind::Motion {
            blind.push(
                "a world that is shifted or turned: only the motion of the body counts".to_owned(),
            );
            blind.push(format!(
                "anything faster than {:.0} Hz can hold",
                header.rate / 2.0
            ));
        }
        if header.whole.timing.is_none() {
            blind.push("stamps: the trusted logs have none, or they are not compared".to_owned());
        }
        if header.whole.calibration.is_none() {
            blind.push("calibration of position against attitude as a test of its own".to_owned());
        }
        if header.ranges.is_none() {
            blind.push(
                "reasons in words: it was fitted without trusted ranges; fit it again".to_owned(),
            );
        }
        blind
    }
}

/// Quantities that a terminal shows: the others stand in JSON.
fn shown(quantity: Quantity) -> bool {
    matches!(
        quantity,
        Quantity::Velocity(_) | Quantity::Noise(_) | Quantity::Sideslip | Quantity::Climb
    )
}

impl fmt::Display for DetectorSummary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let poses: usize = self.trusted.iter().map(|log| log.poses).sum();
        let groups: BTreeSet<&str> = self.trusted.iter().map(|log| log.group.as_str()).collect();
        writeln!(
            f,
            "  trusts      {} in {}, {poses} poses: {}",
            count(self.trusted.len(), "log"),
            count(groups.len(), "group"),
            names(&self.trusted)
        )?;
        for odd in &self.odd {
            let kept = match odd.left_out {
                true => "new logs are not compared with it",
                false => "new logs are compared with it all the same",
            };
            writeln!(
                f,
                "  odd         {} (chance {:.1e} among the others): {kept}",
                odd.group, odd.chance
            )?;
        }
        writeln!(f, "  frame       {}", self.frame)?;
        let rate = self.rate_hz;
        match self.exacting {
            true => writeln!(
                f,
                "  rate        {rate:.1} Hz; faster logs are interpolated, slower ones refused"
            )?,
            false => writeln!(
                f,
                "  rate        {rate:.1} Hz; only the order of poses counts"
            )?,
        }
        writeln!(
            f,
            "  shortest    log it can judge: {:.1} s without a gap",
            self.window_s
        )?;
        let tests: Vec<String> = self
            .tests
            .iter()
            .map(|(name, share)| format!("{name} {:.2}", share))
            .collect();
        writeln!(
            f,
            "  tests       {} (shares of alpha {})",
            tests.join(", "),
            self.alpha
        )?;
        writeln!(
            f,
            "  alone       {} can say {:.3} at least; {} would call at {} without a model of the tail",
            count(self.groups, "group"),
            self.smallest_rank_chance,
            count(self.groups_for_alpha, "group"),
            self.alpha
        )?;
        for (i, sees) in self.sees.iter().enumerate() {
            writeln!(f, "  {:<11} {sees}", if i == 0 { "sees" } else { "" })?;
        }
        for (i, blind) in self.cannot_see.iter().enumerate() {
            writeln!(
                f,
                "  {:<11} {blind}",
                if i == 0 { "cannot see" } else { "" }
            )?;
        }
        let ranges = self.ranges.iter().filter(|range| shown(range.quantity));
        for (i, range) in ranges.enumerate() {
            let (unit, factor) = range.quantity.unit().readable();
            let [low, high] = range.middle.map(|value| value * factor);
            if i == 0 {
                writeln!(f, "  usual       98 of 100 trusted poses")?;
            }
            writeln!(
                f,
                "              {:<24} {:>8.3} to {:>8.3} {unit}",
                range.label, low, high
            )?;
        }
        writeln!(
            f,
            "  sha-256     {}, fitted by dose3 {}",
            self.sha256, self.version
        )
    }
}
