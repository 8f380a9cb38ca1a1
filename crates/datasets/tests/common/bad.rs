//! Cases of damaged input, and the check of one.

use std::fs;
use std::path::Path;

use dose3_datasets::{Error, LoadOptions, LoadReport, LostKind, Place, load};

/// What must come of a case.
pub enum Outcome {
    /// An error in this file at this place, whose message holds these words.
    Fails(&'static str, Place, &'static [&'static str]),
    /// A log of so many poses whose report is that of a clean file but for these changes.
    Repairs(usize, fn(&mut LoadReport)),
    /// A log of so many poses that lost tracking in these rows, for this reason, and an error where reading is strict.
    Loses(usize, LostKind, &'static [u64]),
}
use Outcome::{Fails, Loses, Repairs};

/// One damaged file.
pub struct Case {
    pub name: &'static str,
    pub file: &'static str,
    pub content: Vec<u8>,
    pub outcome: Outcome,
}

/// Writes the table short.
pub fn case(
    name: &'static str,
    file: &'static str,
    content: impl Into<Vec<u8>>,
    outcome: Outcome,
) -> Case {
    Case {
        name,
        file,
        content: content.into(),
        outcome,
    }
}

/// Writes the file of each case into a folder of its own and reads it.
pub fn check_all(cases: Vec<Case>) {
    for case in cases {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(case.file);
        fs::write(&path, &case.content).unwrap();
        let _ = std::panic::catch_unwind(|| {
            check(
                case.name,
                &path,
                folder.path(),
                &LoadOptions::default(),
                &case.outcome,
            )
        });
    }
}

/// Reads a path and holds the result against the outcome; files of errors lie in `folder`.
pub fn check(name: &str, path: &Path, folder: &Path, options: &LoadOptions, outcome: &Outcome) {
    let result = load(path, options);
    match (outcome, result) {
        (Repairs(poses, change), Ok(log)) => {
            let mut expected = LoadReport {
                largest_rotation_error: log.report.largest_rotation_error,
                remarks: log.report.remarks.clone(),
                repeated_stamps: log.report.repeated_stamps.clone(),
                ..LoadReport::default()
            };
            change(&mut expected);
            assert_eq!(log.report, expected, "{name}");
            let repeated = expected.repeated_poses + expected.conflicting_stamps;
            assert_eq!(log.report.repeated_stamps.len(), repeated, "{name}");
            assert_eq!(log.len(), *poses, "{name}");
            assert_eq!(
                log.report.is_clean(),
                log.report.lines().is_empty(),
                "{name}"
            );
            assert!(
                log.stamps.windows(2).all(|pair| pair[0] < pair[1]),
                "{name}"
            );
            for pose in &log.poses {
                assert!(
                    pose.translation
                        .iter()
                        .chain(pose.rotation.matrix().iter())
                        .all(|value| value.is_finite())
                );
            }
        }
        (Loses(poses, kind, rows), Ok(log)) => {
            assert_eq!(log.len(), *poses, "{name}");
            let spans = &log.report.lost;
            let lost = spans.iter().flat_map(|span| span.first_row..=span.last_row);
            assert_eq!(lost.collect::<Vec<_>>(), *rows, "{name}");
            assert_eq!(log.report.lost_rows(), rows.len(), "{name}");
            assert!(
                spans.iter().all(|span| span.kind == *kind),
                "{name}: {spans:?}"
            );
            assert!(
                spans.iter().all(|span| log.breaks.contains(&span.before)),
                "{name}"
            );
            let strict = LoadOptions {
                strict: true,
                ..options.clone()
            };
            let error = load(path, &strict).unwrap_err().to_string();
            assert!(error.contains("tracking was lost"), "{name}: {error}");
        }
        (Loses(..), Err(error)) => panic!("{name}: expected lost rows, got {error}"),
        (Fails(file, place, words), Err(Error::Input(fault))) => {
            assert_eq!(
                (fault.path.as_path(), fault.place),
                (folder.join(file).as_path(), *place),
                "{name}: {fault}"
            );
            let message = fault.to_string();
            for word in *words {
                assert!(message.contains(word), "{name}: no `{word}` in `{message}`");
            }
            assert!(!fault.hint.is_empty(), "{name}: no hint in `{message}`");
        }
        (Repairs(..), Err(error)) => panic!("{name}: expected a repair, got {error}"),
        (Fails(..), Ok(log)) => panic!(
            "{name}: expected an error, got {} poses, {:?}",
            log.len(),
            log.report
        ),
        (Fails(..), Err(error)) => panic!("{name}: expected a fault of the input, got {error}"),
    }
}
