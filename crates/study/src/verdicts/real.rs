//! Real failures: estimates of odometries, judged by detectors that were fitted to trusted logs.

use super::contender::DEFAULT;
use super::defects;
use super::fold::{self, FoldFit, Measured};
use super::judge::{Judged, worst_run};
use super::run::Run;
use super::table::Measurer;
use super::timing;
use crate::data::DataRoot;
use anyhow::{Context, Result};
use dose3_datasets::{LoadOptions, Trajectory, at_rate, load, stretches};
use dose3_ood::Score;
use dose3_ood::metrics::{Bootstrap, Estimate, Grouped, Metric, estimate};
use dose3_ood::timing::TimingReference;
use serde::Serialize;
use std::path::{Path, PathBuf};

/// Folds in which groups of trusted logs are left out.
const FOLDS: usize = 10;

/// One log with what a contender says of it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Judgement {
    /// Name of the data.
    pub set: &'static str,
    /// How trusted logs were chosen.
    pub protocol: &'static str,
    /// Key of the contender.
    pub contender: &'static str,
    /// `sound` for trusted logs left out, else what the estimate is.
    pub kind: String,
    /// Name of the log.
    pub log: String,
    /// Windows judged.
    pub windows: usize,
    /// Called out of distribution.
    pub called: bool,
    /// Chance of as much in a log like the trusted ones.
    pub chance: f64,
    /// Mean window score.
    pub mean: f64,
    /// Highest of the lowest scores of three windows in a row.
    pub worst: f64,
    /// What is known to be wrong with a trusted log.
    pub defect: Option<String>,
}

/// Logs of one kind against the sound ones.
#[derive(Clone, Debug, Serialize)]
pub struct RealCell {
    /// Name of the data.
    pub set: &'static str,
    /// How trusted logs were chosen.
    pub protocol: &'static str,
    /// Key of the contender.
    pub contender: &'static str,
    /// What the estimates are; `sound` for trusted logs left out.
    pub kind: String,
    /// Logs judged.
    pub logs: usize,
    /// Logs called.
    pub called: usize,
    /// Mean scores of these logs against those of the sound ones.
    pub auroc_mean: Option<Estimate>,
    /// The same of the worst three windows in a row.
    pub auroc_worst: Option<Estimate>,
}

/// A log that is judged.
struct Subject {
    kind: String,
    log: Trajectory,
    /// What its recording is called by all estimators.
    recording: String,
}

/// The recording of a log of `vio`, whoever estimated it: parts of one recording share it.
pub(crate) fn recording(name: &str) -> String {
    let letters = name
        .to_lowercase()
        .replace("uzh-", "")
        .replace("indoor_indoor", "indoor");
    // Parts of one drive are called a to e.
    let whole = letters
        .strip_suffix(|c: char| ('a'..='e').contains(&c))
        .and_then(|rest| rest.strip_suffix('_'))
        .unwrap_or(&letters);
    whole.chars().filter(char::is_ascii_alphanumeric).collect()
}

/// The text files of a folder, by name.
fn files(folder: &Path) -> Result<Vec<PathBuf>> {
    let mut paths: Vec<_> = std::fs::read_dir(folder)
        .with_context(|| format!("{} cannot be read", folder.display()))?
        .map(|entry| Ok(entry?.path()))
        .collect::<Result<Vec<_>>>()?;
    paths.retain(|path| path.extension().is_some_and(|end| end == "txt"));
    paths.sort();
    Ok(paths)
}

/// The log with the name of its file.
fn named(path: &Path, mut log: Trajectory) -> Result<Trajectory> {
    let stem = path.file_stem().context("a file without a name")?;
    log.name = stem.to_string_lossy().into_owned();
    Ok(log)
}

/// Reads the text files of a folder, brought to the rate. Logs shorter than a window or slower than the rate cannot be
/// judged; they are added to `left`.
pub(crate) fn read(
    folder: &Path,
    hertz: f64,
    poses: usize,
    left: &mut Vec<String>,
) -> Result<Vec<Trajectory>> {
    let mut logs = Vec::new();
    for path in files(folder)? {
        let log = named(&path, load(&path, &LoadOptions::default())?)?;
        let log = match at_rate(&log, hertz) {
            Err(dose3_datasets::Error::Upsampling { from, .. }) => {
                left.push(format!("{} ({from:.1} poses a second)", log.name));
                continue;
            }
            log => log?,
        };
        let longest = stretches(&log, log.max_gap)
            .into_iter()
            .map(|s| s.len())
            .max();
        if longest.unwrap_or(0) < poses {
            left.push(format!("{} (shorter than a window)", log.name));
            continue;
        }
        logs.push(log);
    }
    Ok(logs)
}

/// The trusted logs of `vio` as they were recorded, with the numbers of their recordings; none without the folder.
///
/// # Errors
/// Logs that cannot be read.
pub fn trusted_vio(root: &DataRoot) -> Result<Option<(Vec<Trajectory>, Vec<usize>)>> {
    let folder = root.path.join("vio").join("trusted");
    if !folder.is_dir() {
        return Ok(None);
    }
    let logs = files(&folder)?
        .iter()
        .map(|path| named(path, load(path, &LoadOptions::default())?))
        .collect::<Result<Vec<_>>>()?;
    let recordings: Vec<String> = logs.iter().map(|log| recording(&log.name)).collect();
    let groups = numbers(&recordings);
    Ok(Some((logs, groups)))
}

/// `vio`: one odometry is trusted, failures are those of another on the same recordings.
///
/// # Errors
/// Logs that cannot be read or judged.
pub fn vio(root: &DataRoot, run: &mut Run<'_>) -> Result<(Vec<Judgement>, Vec<String>)> {
    let (hertz, poses) = (run.hertz, run.measurer.poses);
    let folder = root.path.join("vio");
    let mut left = Vec::new();
    if !folder.is_dir() {
        return Ok((Vec::new(), left));
    }
    let trusted = read(&folder.join("trusted"), hertz, poses, &mut left)?;
    let recordings: Vec<String> = trusted.iter().map(|log| recording(&log.name)).collect();
    let groups = numbers(&recordings);
    let mut others = Vec::new();
    for kind in ["diverged", "wrong", "agrees"] {
        for log in read(&folder.join(kind), hertz, poses, &mut left)? {
            others.push(Subject {
                kind: kind.to_owned(),
                recording: recording(&log.name),
                log,
            });
        }
    }
    run.measurer.scale_by(&trusted)?;
    let windows = run.measurer.windows(&trusted);
    let measured = Measured {
        table: run.measurer.measure(&trusted, &windows)?,
        logs: &trusted,
        groups: &groups,
    };
    let mut found = Vec::new();
    let sound = |log: usize| Subject {
        kind: "sound".to_owned(),
        log: trusted[log].clone(),
        recording: recordings[log].clone(),
    };
    // Every other trusted log; the rest is sound.
    let every_other: Vec<usize> = (0..trusted.len()).step_by(2).collect();
    let fit = fold::fit(&measured, &every_other, run)?;
    let stamps = Some(timing::reference(&trusted, &every_other, &groups)?);
    let rest: Vec<Subject> = (1..trusted.len()).step_by(2).map(sound).collect();
    for subjects in [&rest, &others] {
        judge(
            ("vio", "every other"),
            subjects,
            (&fit, stamps.as_ref()),
            &mut run.measurer,
            &mut found,
        )?;
    }
    if run.one_fold() {
        return Ok((found, left));
    }
    for fold in fold::by_group(&groups, FOLDS) {
        let fit = fold::fit(&measured, &fold.fitted, run)?;
        let stamps = timing::reference(&trusted, &fold.fitted, &groups)?;
        let with = (&fit, Some(&stamps));
        let left_out: Vec<Subject> = fold.tested.iter().map(|log| sound(*log)).collect();
        judge(
            ("vio", "group left out"),
            &left_out,
            with,
            &mut run.measurer,
            &mut found,
        )?;
        let same: Vec<Subject> = others
            .iter()
            .filter(|other| left_out.iter().any(|log| log.recording == other.recording))
            .map(|other| Subject {
                kind: other.kind.clone(),
                log: other.log.clone(),
                recording: other.recording.clone(),
            })
            .collect();
        judge(
            ("vio", "group left out"),
            &same,
            with,
            &mut run.measurer,
            &mut found,
        )?;
    }
    Ok((found, left))
}

/// `kitti-estimates`: odometries on KITTI sequences, by detectors fitted to the reference of the others; the
/// reference of each sequence, left out in turn, is sound.
///
/// # Errors
/// Logs that cannot be read or judged.
pub fn kitti(
    root: &DataRoot,
    reference: &[Trajectory],
    run: &mut Run<'_>,
) -> Result<(Vec<Judgement>, Vec<String>)> {
    let mut left = Vec::new();
    let folder = root.path.join("kitti-estimates");
    if !folder.is_dir() {
        return Ok((Vec::new(), left));
    }
    let estimates = read(&folder, run.hertz, run.measurer.poses, &mut left)?;
    let groups: Vec<usize> = (0..reference.len()).collect();
    run.measurer.scale_by(reference)?;
    let windows = run.measurer.windows(reference);
    let measured = Measured {
        table: run.measurer.measure(reference, &windows)?,
        logs: reference,
        groups: &groups,
    };
    let mut found = Vec::new();
    for fold in fold::by_group(&groups, usize::MAX) {
        let names: Vec<&str> = fold
            .tested
            .iter()
            .map(|log| reference[*log].name.as_str())
            .collect();
        let of_sequence = estimates.iter().filter(|log| {
            let mut words = log.name.split('_');
            words.any(|word| names.contains(&word))
        });
        let mut subjects: Vec<Subject> = of_sequence
            .map(|log| Subject {
                kind: estimator(&log.name),
                log: log.clone(),
                recording: String::new(),
            })
            .collect();
        if run.one_fold() && subjects.is_empty() {
            continue;
        }
        subjects.extend(fold.tested.iter().map(|log| Subject {
            kind: "sound".to_owned(),
            log: reference[*log].clone(),
            recording: String::new(),
        }));
        let fit = fold::fit(&measured, &fold.fitted, run)?;
        let protocol = ("kitti-estimates", "sequence left out");
        judge(
            protocol,
            &subjects,
            (&fit, None),
            &mut run.measurer,
            &mut found,
        )?;
    }
    Ok((found, left))
}

fn estimator(name: &str) -> String {
    let known = [
        ("ORB", "ORB-SLAM2"),
        ("SPTAM", "S-PTAM"),
        ("scsfm", "SC-SfM-Learner"),
    ];
    let known = known.iter().find(|(part, _)| name.contains(part));
    known.map_or(name, |(_, estimator)| estimator).to_owned()
}

/// The stamps, where they are trusted, are one more row: the default with them as a test of its own.
fn judge(
    (set, protocol): (&'static str, &'static str),
    subjects: &[Subject],
    (fit, stamps): (&FoldFit, Option<&TimingReference>),
    measurer: &mut Measurer,
    found: &mut Vec<Judgement>,
) -> Result<()> {
    let logs: Vec<Trajectory> = subjects.iter().map(|subject| subject.log.clone()).collect();
    let windows = measurer.windows(&logs);
    let table = measurer.measure(&logs, &windows)?;
    for (contender, fitted) in &fit.fitted {
        for (i, subject) in subjects.iter().enumerate() {
            let windows = table.of_log(i);
            let rows = measurer.rows(&table, &windows, &contender.set()?, |_| fit.linear.all())?;
            let stretches: Vec<usize> = windows.iter().map(|&w| table.stretches[w]).collect();
            let scores = fitted.scores(&rows)?;
            let worst = worst_run(&scores, &stretches, 3);
            let is_reference = set == "kitti-estimates" && subject.kind == "sound";
            let name = &subject.log.name;
            let judgement = |contender: &'static str, judged: Judged| Judgement {
                set,
                protocol,
                contender,
                kind: subject.kind.clone(),
                log: name.clone(),
                windows: windows.len(),
                called: judged.called,
                chance: judged.chance,
                mean: judged.mean,
                worst: worst.map_or(judged.mean, |score| score.value()),
                defect: is_reference
                    .then(|| defects::known('K', name, 0..subject.log.len(), &subject.log))
                    .flatten(),
            };
            found.push(judgement(contender.key, fitted.judge(&rows, &stretches)?));
            let test = stamps.and_then(|stamps| timing::test(stamps, &subject.log));
            if let Some(test) = test.filter(|_| contender.key == DEFAULT) {
                let judged = fitted.judge_with(&rows, &stretches, &[test])?;
                found.push(judgement("default, stamps", judged));
            }
        }
    }
    Ok(())
}

/// Judgements by data, protocol, contender and kind.
///
/// # Errors
/// No resamples.
pub fn cells(judgements: &[Judgement], bootstrap: Bootstrap) -> Result<Vec<RealCell>> {
    let mut cells: Vec<RealCell> = Vec::new();
    for one in judgements {
        let same = |cell: &RealCell| {
            (cell.set, cell.protocol, cell.contender) == (one.set, one.protocol, one.contender)
                && cell.kind == one.kind
        };
        if cells.iter().any(same) {
            continue;
        }
        let of = |kind: &str| -> Vec<&Judgement> {
            let beside = |other: &&Judgement| {
                (other.set, other.protocol, other.contender)
                    == (one.set, one.protocol, one.contender)
                    && other.kind == kind
            };
            judgements.iter().filter(beside).collect()
        };
        let (own, sound) = (of(&one.kind), of("sound"));
        let auroc = |value: fn(&Judgement) -> f64| -> Result<Option<Estimate>> {
            if one.kind == "sound" || sound.is_empty() {
                return Ok(None);
            }
            let side = |logs: &[&Judgement]| -> (Vec<Score>, Vec<usize>) {
                let scores = logs.iter().map(|log| Score::new(value(log)));
                (scores.collect(), (0..logs.len()).collect())
            };
            let ((id, id_logs), (ood, ood_logs)) = (side(&sound), side(&own));
            let (id, ood) = (
                Grouped {
                    scores: &id,
                    logs: &id_logs,
                },
                Grouped {
                    scores: &ood,
                    logs: &ood_logs,
                },
            );
            Ok(Some(estimate(Metric::Auroc, id, ood, bootstrap)?))
        };
        cells.push(RealCell {
            set: one.set,
            protocol: one.protocol,
            contender: one.contender,
            kind: one.kind.clone(),
            logs: own.len(),
            called: own.iter().filter(|log| log.called).count(),
            auroc_mean: auroc(|log| log.mean)?,
            auroc_worst: auroc(|log| log.worst)?,
        });
    }
    Ok(cells)
}

pub(crate) fn numbers(names: &[String]) -> Vec<usize> {
    let mut known: Vec<&String> = Vec::new();
    names
        .iter()
        .map(|name| match known.iter().position(|other| *other == name) {
            Some(number) => number,
            None => {
                known.push(name);
                known.len() - 1
            }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn estimators_name_one_recording_alike() {
        for (one, other) in [
            ("DAVIS240C_Boxes_6Dof", "davis240c_boxes_6dof"),
            ("EDS_00_Peanuts_Dark", "EDS00_peanuts_dark"),
            ("Mono-HKU_Vicon_Dark1", "mono_hku_vicon_dark1"),
            (
                "UZH-FPV_Indoor_Forward_10_Davis_With_Gt",
                "fpv_indoor_indoor_forward_10_davis_with_gt",
            ),
            ("DSEC_Dsec_Zurich_City_04_A", "DSEC_Dsec_Zurich_City_04_E"),
        ] {
            assert_eq!(recording(one), recording(other));
        }
        assert_ne!(
            recording("Mono-HKU_Vicon_Hdr1"),
            recording("Mono-HKU_Vicon_Hdr2")
        );
        let names = ["a", "b", "a"].map(str::to_owned);
        assert_eq!(numbers(&names), [0, 1, 0]);
        assert_eq!(estimator("scsfm_1_09"), "SC-SfM-Learner");
    }

    #[test]
    fn cells_count_by_kind() {
        let log = |kind: &str, mean: f64, called| Judgement {
            set: "vio",
            protocol: "every other",
            contender: "default",
            kind: kind.to_owned(),
            log: String::new(),
            windows: 5,
            called,
            chance: 0.5,
            mean,
            worst: -mean,
            defect: None,
        };
        let all = [
            log("sound", 0.0, false),
            log("sound", 1.0, true),
            log("wrong", 0.5, true),
            log("wrong", 3.0, true),
        ];
        let bootstrap = Bootstrap {
            resamples: 10,
            ..Bootstrap::default()
        };
        let cells = cells(&all, bootstrap).unwrap();
        assert_eq!(cells.len(), 2);
        assert_eq!((cells[0].called, cells[0].logs), (1, 2));
        assert!(cells[0].auroc_mean.is_none());
        assert_eq!((cells[1].called, cells[1].logs), (2, 2));
        assert_eq!(cells[1].auroc_mean.unwrap().value, 0.75);
        assert_eq!(cells[1].auroc_worst.unwrap().value, 0.25);
    }
}
