//! What a long table of faults comes down to.

use super::methods::{KINEMATIC, METHODS, MOMENTS};
use super::windows::FaultCell;
use crate::numbers::spread;
use serde::Serialize;
use std::collections::BTreeMap;

/// A fault that some row tells from sound motion at this AUROC can be detected.
pub const DETECTABLE: f64 = 0.8;
/// Above this the baseline leaves little to gain.
const STRONG: f64 = 0.9;
/// Differences below this are not counted as worse.
const TOLERANCE: f64 = 0.01;
/// What differences of sums may be off by.
const ROUNDING: f64 = 1e-9;

/// AUROC of every row on one fault in one set: one number a model.
#[derive(Clone, Debug, PartialEq)]
pub struct Line {
    /// Letter of the set.
    pub set: char,
    /// The fault with its severity.
    pub fault: String,
    /// `[method][model]`.
    pub auroc: Vec<Vec<f64>>,
}

impl Line {
    /// Mean over models.
    pub fn mean(&self, method: usize) -> f64 {
        mean(&self.auroc[method]).unwrap_or(f64::NAN)
    }

    /// Whether some row detects it.
    pub fn detectable(&self) -> bool {
        (0..self.auroc.len()).any(|m| self.mean(m) >= DETECTABLE)
    }
}

/// Mean; none of nothing.
pub fn mean(values: &[f64]) -> Option<f64> {
    (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
}

/// Mean of some numbers, with their spread where there are several.
pub fn show(values: &[f64]) -> String {
    match values {
        [] => "–".into(),
        [one] => format!("{one:.3}"),
        several => {
            let (mean, spread) = spread(several);
            format!("{mean:.3} ± {spread:.3}")
        }
    }
}

/// Puts the cells of several models into lines, in the order of the first model's.
pub fn lines(runs: &[Vec<FaultCell>]) -> Vec<Line> {
    let mut index: BTreeMap<(char, &str), usize> = BTreeMap::new();
    let mut lines: Vec<Line> = Vec::new();
    for cell in runs.iter().flatten() {
        let at = *index.entry((cell.set, &cell.fault)).or_insert_with(|| {
            lines.push(Line {
                set: cell.set,
                fault: cell.fault.clone(),
                auroc: vec![Vec::new(); METHODS.len()],
            });
            lines.len() - 1
        });
        if let Some(m) = METHODS.iter().position(|m| m.key == cell.method) {
            lines[at].auroc[m].push(cell.auroc);
        }
    }
    lines
}

/// One row over the faults of one set, or of all.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Summary {
    /// Letter of the set; none for all sets together.
    pub set: Option<char>,
    /// Key of the row.
    pub method: &'static str,
    /// Mean AUROC over all faults.
    pub mean_all: f64,
    /// Faults and severities that can be detected.
    pub detectable: usize,
    /// Mean AUROC over them.
    pub mean_detectable: Option<f64>,
    /// The same of each model.
    pub mean_detectable_of_models: Vec<f64>,
    /// Detectable ones that the kinematic density finds at less than .9.
    pub weak: usize,
    /// Mean gain over the kinematic density on those.
    pub gain_where_weak: Option<f64>,
    /// Lowest difference to the kinematic density, with its fault.
    pub worst_to_kinematic: (f64, String),
    /// Lowest difference to the raw moments, with its fault.
    pub worst_to_moments: (f64, String),
    /// Faults where it is more than .01 below the kinematic density.
    pub below_kinematic: usize,
    /// Faults where it is more than .01 below the raw moments.
    pub below_moments: usize,
}

/// Summaries of all rows: set by set, then of all sets.
pub fn summaries(lines: &[Line]) -> Vec<Summary> {
    let mut sets: Vec<Option<char>> = Vec::new();
    for line in lines {
        if !sets.contains(&Some(line.set)) {
            sets.push(Some(line.set));
        }
    }
    sets.push(None);
    let of = |set: Option<char>| -> Vec<&Line> {
        let all = lines.iter();
        all.filter(|l| set.is_none_or(|s| s == l.set)).collect()
    };
    sets.iter()
        .flat_map(|&set| {
            let lines = of(set);
            (0..METHODS.len()).map(move |m| summary(set, m, &lines))
        })
        .collect()
}

fn summary(set: Option<char>, method: usize, lines: &[&Line]) -> Summary {
    let found: Vec<&&Line> = lines.iter().filter(|l| l.detectable()).collect();
    let weak: Vec<f64> = found
        .iter()
        .filter(|l| l.mean(KINEMATIC) < STRONG)
        .map(|l| l.mean(method) - l.mean(KINEMATIC))
        .collect();
    let models = lines.first().map_or(0, |l| l.auroc[method].len());
    let of_model = |model: usize| -> Option<f64> {
        let values: Vec<f64> = found.iter().map(|l| l.auroc[method][model]).collect();
        mean(&values)
    };
    let to = |baseline: usize| -> (f64, String, usize) {
        let mut worst = (f64::INFINITY, String::new());
        let mut below = 0;
        for line in lines {
            let difference = line.mean(method) - line.mean(baseline);
            below += usize::from(difference < -TOLERANCE - ROUNDING);
            if difference < worst.0 {
                let at = set.map_or_else(|| format!("{} ", line.set), |_| String::new());
                worst = (difference, format!("{at}{}", line.fault));
            }
        }
        (worst.0, worst.1, below)
    };
    let (kinematic, moments) = (to(KINEMATIC), to(MOMENTS));
    let means = |lines: &[&Line]| -> Vec<f64> { lines.iter().map(|l| l.mean(method)).collect() };
    let found: Vec<&Line> = found.iter().map(|l| **l).collect();
    Summary {
        set,
        method: METHODS[method].key,
        mean_all: mean(&means(lines)).unwrap_or(f64::NAN),
        detectable: found.len(),
        mean_detectable: mean(&means(&found)),
        mean_detectable_of_models: (0..models).filter_map(of_model).collect(),
        weak: weak.len(),
        gain_where_weak: mean(&weak),
        worst_to_kinematic: (kinematic.0, kinematic.1),
        worst_to_moments: (moments.0, moments.1),
        below_kinematic: kinematic.2,
        below_moments: moments.2,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::faults::methods::NETWORK;

    fn line(set: char, fault: &str, kinematic: f64, moments: f64, network: [f64; 2]) -> Line {
        let mut auroc = vec![vec![0.5; 2]; METHODS.len()];
        auroc[KINEMATIC] = vec![kinematic; 2];
        auroc[MOMENTS] = vec![moments; 2];
        auroc[NETWORK] = network.to_vec();
        Line {
            set,
            fault: fault.into(),
            auroc,
        }
    }

    #[test]
    fn summaries_by_hand() {
        let lines = [
            line('K', "a", 0.7, 0.5, [0.85, 0.95]),
            line('K', "b", 0.95, 0.96, [0.94, 0.94]),
            line('K', "c", 0.6, 0.5, [0.55, 0.55]),
            line('O', "a", 1.0, 0.5, [1.0, 1.0]),
        ];
        let all = summaries(&lines);
        let of = |set| {
            let found = all.iter().find(|s| s.set == set && s.method == "network");
            found.unwrap()
        };
        let k = of(Some('K'));
        let near = |a: f64, b: f64| assert!((a - b).abs() < 1e-12, "{a} {b}");
        near(k.mean_all, (0.9 + 0.94 + 0.55) / 3.0);
        assert_eq!((k.detectable, k.weak), (2, 1));
        near(k.mean_detectable.unwrap(), 0.92);
        near(k.mean_detectable_of_models[0], 0.895);
        near(k.gain_where_weak.unwrap(), 0.2);
        near(k.worst_to_kinematic.0, -0.05);
        assert_eq!(k.worst_to_kinematic.1, "c");
        near(k.worst_to_moments.0, -0.02);
        assert_eq!((k.below_kinematic, k.below_moments), (1, 1));
        let pooled = of(None);
        assert_eq!(pooled.worst_to_kinematic.1, "K c");
        assert_eq!(pooled.detectable, 3);
        assert_eq!(of(Some('O')).gain_where_weak, None);
    }

    #[test]
    fn cells_of_models_make_lines() {
        let cell = |fault: &str, method, auroc| FaultCell {
            set: 'K',
            fault: fault.into(),
            method,
            auroc,
            interval: None,
        };
        let runs = [
            vec![cell("a", "kinematic", 0.6), cell("b", "kinematic", 0.7)],
            vec![cell("a", "kinematic", 0.8), cell("b", "kinematic", 0.9)],
        ];
        let lines = lines(&runs);
        assert_eq!(lines.len(), 2);
        assert_eq!(lines[0].auroc[KINEMATIC], [0.6, 0.8]);
        assert!((lines[1].mean(KINEMATIC) - 0.8).abs() < 1e-12);
    }
}
