//! Every kind of damage a pose file can have: a clear error that names the place, or a counted repair.

mod common;

use std::fs;
use std::path::{Path, PathBuf};

use common::{
    drive, euroc, ins, kitti, kitti_times, npy, tum, vo, with_copy, with_field, with_line,
};
use dose3_datasets::{
    Error, Format, LoadOptions, LoadReport, Place, load, windows, windows_of_each, write,
};

/// What must come of a case.
enum Outcome {
    /// An error in this file at this place, whose message holds these words.
    Fails(&'static str, Place, &'static [&'static str]),
    /// A log of so many poses whose report is that of a clean file but for these changes.
    Repairs(usize, fn(&mut LoadReport)),
}
use Outcome::{Fails, Repairs};
use Place::{Array, File, Line};

/// One damaged file.
struct Case {
    name: &'static str,
    file: &'static str,
    content: Vec<u8>,
    outcome: Outcome,
}

fn case(
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

const REFLECTION: &str = "1 0 0 5  0 1 0 6  0 0 -1 7";
const ZERO: &str = "0 0 0 5  0 0 0 6  0 0 0 7";
const SCALED: &str = "2 0 0 5  0 2 0 6  0 0 2 7";
/// Off from a rotation by 2e-4: within the tolerance, beyond rounding.
const SKEWED: &str = "1.0001 0 0 5  0 1 0 6  0 0 1 7";

fn text_cases() -> Vec<Case> {
    let clean = |_: &mut LoadReport| {};
    vec![
        case("clean KITTI", "00.txt", kitti(6), Repairs(6, clean)),
        case("clean TUM", "a.txt", tum(6), Repairs(6, clean)),
        case("clean EuRoC", "data.csv", euroc(6), Repairs(6, clean)),
        case("clean INS", "ins.csv", ins(6), Repairs(6, clean)),
        case("clean VO", "vo.csv", vo(6), Repairs(6, clean)),
        // Truncated lines: within the file an error, at its end a recording cut off.
        case(
            "line cut within KITTI",
            "00.txt",
            with_line(&kitti(6), 3, "1 0 0 5 0 1 0"),
            Fails(
                "00.txt",
                Line(3),
                &["12 numbers", "7 in `1 0 0 5 0 1 0`", "3x4"],
            ),
        ),
        case(
            "line cut within TUM",
            "a.txt",
            with_line(&tum(6), 4, "1.5 0 0 0"),
            Fails("a.txt", Line(4), &["8 numbers", "qx qy qz qw"]),
        ),
        case(
            "line cut within EuRoC",
            "data.csv",
            with_line(&euroc(6), 4, "1403715524907143168,0.5"),
            Fails("data.csv", Line(4), &["at least 8 numbers", "found 2"]),
        ),
        case(
            "line cut within INS",
            "ins.csv",
            with_line(&ins(6), 4, "1547215350181028,1,2,3"),
            Fails(
                "ins.csv",
                Line(4),
                &["7 fields as in the header", "found 4", "cut off"],
            ),
        ),
        case(
            "KITTI cut off",
            "00.txt",
            cut(&kitti(6)),
            Repairs(5, |r| r.truncated_tail = 1),
        ),
        case(
            "TUM cut off",
            "a.txt",
            cut(&tum(6)),
            Repairs(5, |r| r.truncated_tail = 1),
        ),
        case(
            "EuRoC cut off",
            "data.csv",
            cut(&euroc(6)),
            Repairs(5, |r| r.truncated_tail = 1),
        ),
        case(
            "INS cut off",
            "ins.csv",
            cut(&ins(6)),
            Repairs(5, |r| r.truncated_tail = 1),
        ),
        case(
            "VO cut off",
            "vo.csv",
            cut(&vo(6)),
            Repairs(5, |r| r.truncated_tail = 1),
        ),
        case(
            "cut off within an exponent",
            "00.txt",
            kitti(6).trim_end().rsplit_once(' ').unwrap().0.to_owned() + " 1.5e",
            Repairs(5, |r| r.truncated_tail = 1),
        ),
        case(
            "no line end at the end",
            "00.txt",
            kitti(6).trim_end(),
            Repairs(6, clean),
        ),
        // Values that are no numbers.
        case(
            "NaN in KITTI",
            "00.txt",
            with_field(&kitti(6), 2, 4, "nan"),
            Fails(
                "00.txt",
                Line(2),
                &["finite", "(column 4)", "`nan`", "remove the poses"],
            ),
        ),
        case(
            "NaN in TUM",
            "a.txt",
            with_field(&tum(6), 3, 5, "NaN"),
            Fails("a.txt", Line(3), &["finite", "qx", "`NaN`"]),
        ),
        case(
            "infinity in EuRoC",
            "data.csv",
            with_field(&euroc(6), 3, 2, "-inf"),
            Fails("data.csv", Line(3), &["finite", "p_rs_r_x", "`-inf`"]),
        ),
        case(
            "infinity in INS",
            "ins.csv",
            with_field(&ins(6), 5, 6, "Infinity"),
            Fails("ins.csv", Line(5), &["finite", "pitch", "`Infinity`"]),
        ),
        case(
            "number too large for f64",
            "00.txt",
            with_field(&kitti(6), 2, 4, "1e999"),
            Fails("00.txt", Line(2), &["finite", "`1e999`"]),
        ),
        case(
            "word for a number",
            "00.txt",
            with_field(&kitti(6), 2, 4, "lost"),
            Fails("00.txt", Line(2), &["a number", "`lost`", "--format"]),
        ),
        case(
            "coordinate beyond the Earth",
            "00.txt",
            with_field(&kitti(6), 2, 4, "1e300"),
            Fails("00.txt", Line(2), &["below 1e9", "unit"]),
        ),
        // Rotations that are none.
        case(
            "reflection",
            "00.txt",
            with_line(&kitti(6), 4, REFLECTION),
            Fails(
                "00.txt",
                Line(4),
                &["rotation matrix", "reflection", "left-handed"],
            ),
        ),
        case(
            "zero matrix",
            "00.txt",
            with_line(&kitti(6), 4, ZERO),
            Fails(
                "00.txt",
                Line(4),
                &["rotation matrix", "singular", "never filled in"],
            ),
        ),
        case(
            "scaled matrix",
            "00.txt",
            with_line(&kitti(6), 4, SCALED),
            Fails("00.txt", Line(4), &["not orthogonal", "scaled"]),
        ),
        case(
            "nearly a rotation",
            "00.txt",
            with_line(&kitti(6), 4, SKEWED),
            Repairs(6, |r| r.rotations_projected = 1),
        ),
        case(
            "quaternion of norm 2",
            "a.txt",
            with_line(&tum(6), 3, "1547215350.1 0 0 0 0 0 0 2"),
            Fails(
                "a.txt",
                Line(3),
                &["unit quaternion", "norm 2.000000", "order"],
            ),
        ),
        case(
            "quaternion of norm 1.005",
            "a.txt",
            with_line(&tum(6), 3, "1547215350.1 0 0 0 0 0 0 1.005"),
            Repairs(6, |r| r.quaternions_normalised = 1),
        ),
        case(
            "zero quaternion in TUM",
            "a.txt",
            with_line(&tum(6), 3, "1547215350.1 0 0 0 0 0 0 0"),
            Fails(
                "a.txt",
                Line(3),
                &["unit quaternion", "norm 0.000000", "remove the line"],
            ),
        ),
        case(
            "zero quaternion in EuRoC",
            "data.csv",
            with_line(&euroc(6), 3, "1547215350100000000,0,0,0,0,0,0,0"),
            Fails("data.csv", Line(3), &["unit quaternion", "remove the line"]),
        ),
        case(
            "degrees for radians",
            "ins.csv",
            with_field(&ins(6), 3, 7, "179.5"),
            Fails("ins.csv", Line(3), &["yaw in radians", "179.5", "degrees"]),
        ),
        // Stamps.
        case(
            "line twice in TUM",
            "a.txt",
            with_copy(&tum(6), 4, 4),
            Repairs(6, |r| r.repeated_poses = 1),
        ),
        case(
            "line twice in INS",
            "ins.csv",
            with_copy(&ins(6), 4, 4),
            Repairs(6, |r| r.repeated_poses = 1),
        ),
        case(
            "one stamp, two poses",
            "ins.csv",
            with_field(&with_copy(&ins(6), 4, 4), 5, 2, "12.5"),
            Repairs(6, |r| r.conflicting_stamps = 1),
        ),
        case(
            "stamp backward in TUM",
            "a.txt",
            with_copy(&tum(6), 2, 5),
            Fails(
                "a.txt",
                Line(6),
                &["a stamp after", "0.300000 s back", "sort the file"],
            ),
        ),
        case(
            "stamp backward in EuRoC",
            "data.csv",
            with_copy(&euroc(6), 2, 5),
            Fails("data.csv", Line(6), &["a stamp after", "clock was reset"]),
        ),
        case(
            "stamp backward in INS",
            "ins.csv",
            with_copy(&ins(6), 2, 5),
            Fails("ins.csv", Line(6), &["a stamp after", "clock was reset"]),
        ),
        case(
            "motion that begins in the past",
            "vo.csv",
            with_copy(&vo(6), 2, 5),
            Fails("vo.csv", Line(6), &["begins at or after", "cut apart"]),
        ),
        case(
            "nanoseconds in TUM",
            "a.txt",
            with_field(&tum(6), 3, 1, "1547215350100000000"),
            Fails("a.txt", Line(3), &["stamp in seconds", "nanoseconds?"]),
        ),
        case(
            "seconds in EuRoC",
            "data.csv",
            with_field(&euroc(6), 3, 1, "1547215350.1"),
            Fails(
                "data.csv",
                Line(3),
                &["whole nanoseconds", "`1547215350.1`", "TUM"],
            ),
        ),
        case(
            "stamp that is no number",
            "ins.csv",
            with_field(&ins(6), 3, 1, "-"),
            Fails("ins.csv", Line(3), &["whole microseconds", "`-`"]),
        ),
        // Line ends, marks, blanks.
        case(
            "BOM in KITTI",
            "00.txt",
            "\u{feff}".to_owned() + &kitti(6),
            Repairs(6, |r| r.byte_order_mark = true),
        ),
        case(
            "BOM in TUM",
            "a.txt",
            "\u{feff}".to_owned() + &tum(6),
            Repairs(6, |r| r.byte_order_mark = true),
        ),
        case(
            "BOM in EuRoC",
            "data.csv",
            "\u{feff}".to_owned() + &euroc(6),
            Repairs(6, |r| r.byte_order_mark = true),
        ),
        case(
            "BOM in INS",
            "ins.csv",
            "\u{feff}".to_owned() + &ins(6),
            Repairs(6, |r| r.byte_order_mark = true),
        ),
        case(
            "CRLF in KITTI",
            "00.txt",
            crlf(&kitti(6)),
            Repairs(6, |r| r.crlf_lines = 6),
        ),
        case(
            "CRLF in TUM",
            "a.txt",
            crlf(&tum(6)),
            Repairs(6, |r| r.crlf_lines = 7),
        ),
        case(
            "CRLF in EuRoC",
            "data.csv",
            crlf(&euroc(6)),
            Repairs(6, |r| r.crlf_lines = 7),
        ),
        case(
            "CRLF in INS",
            "ins.csv",
            crlf(&ins(6)),
            Repairs(6, |r| r.crlf_lines = 7),
        ),
        case(
            "blank lines",
            "00.txt",
            kitti(6).replacen('\n', "\n\n \n", 2) + "\n\n",
            Repairs(6, |r| r.blank_lines = 4),
        ),
        // Files that are something else.
        case(
            "empty file",
            "00.txt",
            "",
            Fails("00.txt", File, &["an empty file", "may have failed"]),
        ),
        case(
            "blank file",
            "00.txt",
            " \n\n",
            Fails("00.txt", File, &["only blank lines"]),
        ),
        case(
            "only a BOM",
            "00.txt",
            "\u{feff}",
            Fails("00.txt", File, &["only blank lines"]),
        ),
        case(
            "INS header only",
            "ins.csv",
            ins(0),
            Fails(
                "ins.csv",
                File,
                &["at least two poses", "found none", "header"],
            ),
        ),
        case(
            "EuRoC header only",
            "data.csv",
            euroc(0),
            Fails("data.csv", File, &["at least two poses", "found none"]),
        ),
        case(
            "TUM comment only",
            "a.txt",
            tum(0),
            Fails("a.txt", File, &["only comments"]),
        ),
        case(
            "one pose",
            "00.txt",
            kitti(1),
            Fails("00.txt", File, &["at least two poses", "found one"]),
        ),
        case(
            "a letter",
            "a.txt",
            "Dear reader,\nno poses.",
            Fails(
                "a.txt",
                Line(1),
                &["KITTI (12 numbers a line)", "text without numbers"],
            ),
        ),
        case(
            "KITTI times",
            "times.txt",
            kitti_times(6),
            Fails(
                "times.txt",
                Line(1),
                &["one number a line", "give the pose file"],
            ),
        ),
        case(
            "one 4x4",
            "a.txt",
            "1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n",
            Fails("a.txt", Line(1), &["4 numbers", "Give the folder"]),
        ),
        case(
            "GPS without orientation",
            "gps.csv",
            "timestamp,num_satellites,latitude,longitude,altitude,northing,easting,down\n1,2,3,4,5,6,7,8\n",
            Fails(
                "gps.csv",
                Line(1),
                &["without roll, pitch and yaw", "gps/ins.csv"],
            ),
        ),
        case(
            "INS without yaw",
            "ins.csv",
            "timestamp,northing,easting,down,roll,pitch\n",
            Fails("ins.csv", Line(1), &["without roll, pitch and yaw"]),
        ),
        case(
            "random bytes",
            "00.txt",
            random_bytes(),
            Fails("00.txt", Line(1), &["bytes that are no text", "binary"]),
        ),
        case(
            "gzip",
            "00.txt",
            b"\x1f\x8b\x08\x00".to_vec(),
            Fails("00.txt", File, &["gzip", "unpack"]),
        ),
        case(
            "MCAP",
            "a.mcap",
            b"\x89MCAP0\r\n".to_vec(),
            Fails("a.mcap", File, &["MCAP", "TUM"]),
        ),
        case(
            "UTF-16",
            "00.txt",
            b"\xff\xfe1\0 \0".to_vec(),
            Fails("00.txt", File, &["UTF-16", "UTF-8"]),
        ),
        case(
            "text, then bytes",
            "00.txt",
            [kitti(2).into_bytes(), b"\xff\xfe\xfd".to_vec()].concat(),
            Fails("00.txt", Line(3), &["bytes that are no text"]),
        ),
    ]
}

fn npy_cases() -> Vec<Case> {
    let array = npy(6).len() / 6;
    let header = |text: &str| {
        let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
        bytes.extend((text.len() as u16).to_le_bytes());
        bytes.extend(text.as_bytes());
        bytes
    };
    let after_two = |bytes: Vec<u8>| [npy(2), bytes].concat();
    let patched = |at: usize, value: f32| {
        let mut bytes = npy(6);
        let place = 2 * array + (array - 64) + 4 * at;
        bytes[place..place + 4].copy_from_slice(&value.to_le_bytes());
        bytes
    };
    let mirrored = [
        1.0_f32, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0, 0.0, 1.0,
    ];
    let mirrored: Vec<u8> = mirrored
        .iter()
        .flat_map(|value| value.to_le_bytes())
        .collect();
    let f4 = header("{'descr': '<f4', 'fortran_order': False, 'shape': (4, 4), }");
    vec![
        case("clean npy", "a.npy", npy(6), Repairs(6, |_| {})),
        case(
            "last array cut off",
            "a.npy",
            npy(6)[..5 * array + 150].to_vec(),
            Repairs(5, |r| r.truncated_tail = 1),
        ),
        case(
            "last header cut off",
            "a.npy",
            npy(6)[..5 * array + 40].to_vec(),
            Repairs(5, |r| r.truncated_tail = 1),
        ),
        case(
            "last magic cut off",
            "a.npy",
            npy(6)[..5 * array + 3].to_vec(),
            Repairs(5, |r| r.truncated_tail = 1),
        ),
        case(
            "only array cut off",
            "a.npy",
            npy(1)[..150].to_vec(),
            Fails("a.npy", Array(0), &["end of the file", "cut off"]),
        ),
        case(
            "one array",
            "a.npy",
            npy(1),
            Fails("a.npy", File, &["at least two poses", "found one"]),
        ),
        case(
            "wrong shape",
            "a.npy",
            after_two(
                [
                    header("{'descr': '<f4', 'fortran_order': False, 'shape': (3, 4), }"),
                    vec![0; 48],
                ]
                .concat(),
            ),
            Fails("a.npy", Array(2), &["shape (4, 4)", "[3, 4]"]),
        ),
        case(
            "wrong dtype",
            "a.npy",
            after_two(
                [
                    header("{'descr': '<i8', 'fortran_order': False, 'shape': (4, 4), }"),
                    vec![0; 128],
                ]
                .concat(),
            ),
            Fails("a.npy", Array(2), &["f4 or f8", "`<i8`", "float32"]),
        ),
        case(
            "structured dtype",
            "a.npy",
            header("{'descr': [('x', '<f4')], 'fortran_order': False, 'shape': (4, 4), }"),
            Fails("a.npy", Array(0), &["f4 or f8"]),
        ),
        case(
            "pickled objects",
            "a.npy",
            header("{'descr': '|O', 'fortran_order': False, 'shape': (4, 4), }"),
            Fails("a.npy", Array(0), &["f4 or f8", "`|O`"]),
        ),
        case(
            "shape that overflows",
            "a.npy",
            header(
                "{'descr': '<f8', 'fortran_order': False, 'shape': (9223372036854775807, 4, 4), }",
            ),
            Fails("a.npy", Array(0), &["impossible shape"]),
        ),
        case(
            "header without shape",
            "a.npy",
            header("{'descr': '<f8', 'fortran_order': False}"),
            Fails("a.npy", Array(0), &["header without `shape`"]),
        ),
        case(
            "unknown version",
            "a.npy",
            b"\x93NUMPY\x09\x00\x10\x00".to_vec(),
            Fails("a.npy", Array(0), &["version 9"]),
        ),
        case(
            "endless header",
            "a.npy",
            b"\x93NUMPY\x02\x00\xff\xff\xff\xff".to_vec(),
            Fails("a.npy", Array(0), &["header of 4294967295 bytes"]),
        ),
        case(
            "bytes between arrays",
            "a.npy",
            after_two(b"garbage".to_vec()),
            Fails("a.npy", Array(2), &["magic number"]),
        ),
        case(
            "NaN in npy",
            "a.npy",
            patched(3, f32::NAN),
            Fails("a.npy", Array(2), &["finite", "NaN"]),
        ),
        case(
            "infinity in npy",
            "a.npy",
            patched(0, f32::INFINITY),
            Fails("a.npy", Array(2), &["finite", "infinity"]),
        ),
        case(
            "last row of npy",
            "a.npy",
            patched(12, 3.0),
            Fails("a.npy", Array(2), &["0 0 0 1", "3 0 0 1", "transposed"]),
        ),
        case(
            "mirrored npy",
            "a.npy",
            [npy(2), f4.clone(), mirrored].concat(),
            Fails("a.npy", Array(2), &["reflection", "left-handed"]),
        ),
        case(
            "zero npy",
            "a.npy",
            [
                npy(2),
                f4,
                [vec![0; 60], 1_f32.to_le_bytes().to_vec()].concat(),
            ]
            .concat(),
            Fails("a.npy", Array(2), &["singular"]),
        ),
    ]
}

#[test]
fn damaged_files() {
    for case in text_cases().into_iter().chain(npy_cases()) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(case.file);
        fs::write(&path, &case.content).unwrap();
        check(
            case.name,
            &path,
            folder.path(),
            &LoadOptions::default(),
            &case.outcome,
        );
    }
}

fn check(name: &str, path: &Path, folder: &Path, options: &LoadOptions, outcome: &Outcome) {
    let result = load(path, options);
    match (outcome, result) {
        (Repairs(poses, change), Ok(log)) => {
            let mut expected = LoadReport {
                largest_rotation_error: log.report.largest_rotation_error,
                ..LoadReport::default()
            };
            change(&mut expected);
            assert_eq!(log.report, expected, "{name}");
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

#[test]
fn wrong_format_forced() {
    let texts = [
        (Format::Kitti, "00.txt", kitti(6).into_bytes()),
        (Format::Tum, "a.txt", tum(6).into_bytes()),
        (Format::Euroc, "data.csv", euroc(6).into_bytes()),
        (Format::RobotCar, "ins.csv", ins(6).into_bytes()),
        (Format::Iros20, "a.npy", npy(6)),
    ];
    let folder = tempfile::tempdir().unwrap();
    for (own, file, content) in &texts {
        let path = folder.path().join(file);
        fs::write(&path, content).unwrap();
        for forced in Format::ALL {
            let options = LoadOptions {
                format: Some(forced),
                ..LoadOptions::default()
            };
            match load(&path, &options) {
                Ok(log) => assert_eq!((forced, log.format, log.len()), (*own, *own, 6)),
                // A file where a folder of one-pose files belongs is an error of the file system.
                Err(Error::Io { .. }) => assert_eq!(forced, Format::Iros20Poses),
                Err(Error::Input(fault)) => {
                    assert_ne!(forced, *own);
                    assert_eq!(fault.path, path);
                }
                Err(other) => panic!("{own} as {forced}: {other}"),
            }
        }
    }
}

#[test]
fn kitti_times_that_do_not_fit() {
    let stamps = |seconds: &[&str]| seconds.join("\n") + "\n";
    let clean = |_: &mut LoadReport| {};
    let cases = [
        ("fitting", kitti_times(6), Repairs(6, clean)),
        (
            "too few",
            kitti_times(5),
            Fails(
                "00_times.txt",
                File,
                &["6 stamps", "00.txt", "found 5", "nominal"],
            ),
        ),
        (
            "too many",
            kitti_times(7),
            Fails("00_times.txt", File, &["6 stamps", "found 7"]),
        ),
        (
            "not numbers",
            stamps(&["0", "1", "x", "3", "4", "5"]),
            Fails("00_times.txt", Line(3), &["stamp in seconds", "`x`"]),
        ),
        (
            "NaN",
            stamps(&["0", "nan", "2", "3", "4", "5"]),
            Fails("00_times.txt", Line(2), &["stamp in seconds", "`nan`"]),
        ),
        (
            "two columns",
            stamps(&["0 1", "1 2"]),
            Fails("00_times.txt", Line(1), &["one stamp"]),
        ),
        (
            "backward",
            stamps(&["0", "1", "2", "1.5", "4", "5"]),
            Fails("00_times.txt", Line(4), &["a stamp after 2000000000 ns"]),
        ),
        (
            "empty",
            String::new(),
            Fails("00_times.txt", File, &["empty"]),
        ),
        (
            "one stamp twice",
            stamps(&["0", "1", "1", "3", "4", "5"]),
            Repairs(5, |r| r.conflicting_stamps = 1),
        ),
    ];
    for (name, times, outcome) in cases {
        let folder = tempfile::tempdir().unwrap();
        let poses = folder.path().join("00.txt");
        fs::write(&poses, kitti(6)).unwrap();
        fs::write(folder.path().join("00_times.txt"), times).unwrap();
        check(
            name,
            &poses,
            folder.path(),
            &LoadOptions::default(),
            &outcome,
        );
    }
    let folder = tempfile::tempdir().unwrap();
    let poses = folder.path().join("00.txt");
    fs::write(&poses, kitti(6)).unwrap();
    let options = LoadOptions {
        times: Some(folder.path().join("none.txt")),
        ..LoadOptions::default()
    };
    let error = load(&poses, &options).unwrap_err();
    assert!(error.to_string().contains("none.txt"), "{error}");
}

#[test]
fn annotated_poses_with_faults() {
    let with = |damage: &dyn Fn(&Path)| -> (tempfile::TempDir, PathBuf) {
        let root = tempfile::tempdir().unwrap();
        let folder = root.path().join("mustard/annotated_poses");
        fs::create_dir_all(&folder).unwrap();
        write::iros20_poses(&folder, &drive(6)).unwrap();
        damage(&folder);
        (root, folder)
    };
    let identity = "1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n";
    let broken = |content: &'static str| {
        move |folder: &Path| fs::write(folder.join("0000003.txt"), content).unwrap()
    };
    type Damage<'a> = Box<dyn Fn(&Path) + 'a>;
    let cases: Vec<(&str, Damage<'_>, Outcome)> = vec![
        ("clean", Box::new(|_| {}), Repairs(6, |_| {})),
        (
            "missing frame",
            Box::new(|folder| fs::remove_file(folder.join("0000002.txt")).unwrap()),
            Repairs(5, |r| r.missing_frames = 1),
        ),
        (
            "another file",
            Box::new(|folder| fs::write(folder.join("notes.txt"), "hello").unwrap()),
            Repairs(6, |_| {}),
        ),
        (
            "number twice",
            Box::new(|folder| fs::write(folder.join("3.txt"), identity).unwrap()),
            Repairs(6, |r| r.conflicting_stamps = 1),
        ),
        (
            "cut off",
            Box::new(broken("1 0 0 0\n0 1 0 0\n")),
            Fails(
                "0000003.txt",
                File,
                &["four lines of 4 numbers", "2 lines", "missing"],
            ),
        ),
        (
            "five lines",
            Box::new(broken("1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n0 0 0 1\n")),
            Fails("0000003.txt", Line(5), &["four lines"]),
        ),
        (
            "short line",
            Box::new(broken("1 0 0 0\n0 1 0\n0 0 1 0\n0 0 0 1\n")),
            Fails("0000003.txt", Line(2), &["4 numbers"]),
        ),
        (
            "NaN",
            Box::new(broken("1 0 0 nan\n0 1 0 0\n0 0 1 0\n0 0 0 1\n")),
            Fails("0000003.txt", Line(1), &["finite"]),
        ),
        (
            "transposed",
            Box::new(broken("1 0 0 0\n0 1 0 0\n0 0 1 0\n5 6 7 1\n")),
            Fails("0000003.txt", File, &["5 6 7 1", "transposed"]),
        ),
        (
            "mirrored",
            Box::new(broken("1 0 0 0\n0 1 0 0\n0 0 -1 0\n0 0 0 1\n")),
            Fails("0000003.txt", File, &["reflection"]),
        ),
        (
            "empty",
            Box::new(broken("")),
            Fails("0000003.txt", File, &["empty"]),
        ),
        (
            "BOM and CRLF",
            Box::new(broken(
                "\u{feff}1 0 0 0\r\n0 1 0 0\r\n0 0 1 0\r\n0 0 0 1\r\n",
            )),
            Repairs(6, |r| {
                r.byte_order_mark = true;
                r.crlf_lines = 4;
            }),
        ),
    ];
    for (name, damage, outcome) in &cases {
        let (root, folder) = with(damage);
        // Given as itself, and found below its video's folder.
        for path in [folder.as_path(), root.path()] {
            check(name, path, &folder, &LoadOptions::default(), outcome);
        }
        if let Ok(log) = load(&folder, &LoadOptions::default()) {
            assert_eq!(
                (log.name.as_str(), log.format),
                ("mustard", Format::Iros20Poses)
            );
            assert_eq!(
                log.stamps.last(),
                Some(&166_666_667),
                "{name}: a missing frame keeps its place in time"
            );
        }
    }
}

#[test]
fn paths_that_are_not_one_log() {
    let root = tempfile::tempdir().unwrap();
    let options = LoadOptions::default();
    assert!(matches!(
        load(&root.path().join("none"), &options),
        Err(Error::Io { .. })
    ));
    let empty = load(root.path(), &options).unwrap_err();
    assert!(
        matches!(empty, Error::NotOneLog { found: 0, .. }),
        "{empty}"
    );
    fs::write(root.path().join("00.txt"), kitti(3)).unwrap();
    fs::write(root.path().join("01.txt"), kitti(3)).unwrap();
    let two = load(root.path(), &options).unwrap_err();
    assert!(matches!(two, Error::NotOneLog { found: 2, .. }));
    assert!(
        two.to_string().contains("00.txt") && two.to_string().contains("name one of them"),
        "{two}"
    );
}

#[test]
fn settings_out_of_range() {
    let path = Path::new("unused");
    for options in [
        LoadOptions {
            rotation_tolerance: f64::NAN,
            ..LoadOptions::default()
        },
        LoadOptions {
            rotation_tolerance: -1.0,
            ..LoadOptions::default()
        },
        LoadOptions {
            quaternion_tolerance: 1.0,
            ..LoadOptions::default()
        },
        LoadOptions {
            max_gap: Some(0.0),
            ..LoadOptions::default()
        },
        LoadOptions {
            max_gap: Some(f64::NAN),
            ..LoadOptions::default()
        },
    ] {
        assert!(
            matches!(load(path, &options), Err(Error::Parameter { .. })),
            "{options:?}"
        );
    }
}

#[test]
fn a_log_shorter_than_a_window() {
    let log = drive(100);
    assert!(windows(std::slice::from_ref(&log), 128, 64).is_empty());
    let message = windows_of_each(&[log], 128, 64).unwrap_err().to_string();
    for word in [
        "longest gap-free stretch has 100 poses",
        "a window needs 128",
        "shorter window",
    ] {
        assert!(message.contains(word), "{message}");
    }
}

/// The text without the second half of its last line.
fn cut(text: &str) -> String {
    let text = text.trim_end();
    let last = text.rfind('\n').unwrap_or(0);
    text[..last + (text.len() - last) / 2].to_owned()
}

fn crlf(text: &str) -> String {
    text.replace('\n', "\r\n")
}

fn random_bytes() -> Vec<u8> {
    use rand::{RngExt, SeedableRng};
    let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(1);
    std::iter::once(0xd7)
        .chain((0..4096).map(|_| rng.random::<u8>()))
        .filter(|byte| *byte != b'\n')
        .collect()
}
