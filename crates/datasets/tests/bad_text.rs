//! Every kind of damage a text file of poses can have: a clear error that names the line, or a counted repair.

mod common;

use common::bad::Outcome::{Fails, Loses, Repairs};
use common::bad::{Case, case, check_all};
use common::{euroc, ins, kitti, kitti_times, tum, vo, with_copy, with_field, with_line};
use dose3_datasets::Place::{File, Line};
use dose3_datasets::{LoadReport, LostKind};

#[test]
fn damaged_text_files() {
    check_all(lines_and_numbers());
    check_all(rotations());
    check_all(stamps());
    check_all(line_ends());
    check_all(other_files());
}

const REFLECTION: &str = "1 0 0 5  0 1 0 6  0 0 -1 7";
const ZERO: &str = "0 0 0 5  0 0 0 6  0 0 0 7";
const SCALED: &str = "2 0 0 5  0 2 0 6  0 0 2 7";
/// Off from a rotation by 2e-4: within the tolerance, beyond rounding.
const SKEWED: &str = "1.0001 0 0 5  0 1 0 6  0 0 1 7";

fn clean(_: &mut LoadReport) {}

fn lines_and_numbers() -> Vec<Case> {
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
            Loses(5, LostKind::Nan, &[2]),
        ),
        case(
            "NaN in TUM",
            "a.txt",
            with_field(&tum(6), 3, 5, "NaN"),
            Loses(5, LostKind::Nan, &[3]),
        ),
        case(
            "infinity in EuRoC",
            "data.csv",
            with_field(&euroc(6), 3, 2, "-inf"),
            Loses(5, LostKind::Nan, &[3]),
        ),
        case(
            "infinity in INS",
            "ins.csv",
            with_field(&ins(6), 5, 6, "Infinity"),
            Loses(5, LostKind::Nan, &[5]),
        ),
        case(
            "stray quote in INS",
            "ins.csv",
            with_field(&ins(6), 3, 2, "\"12"),
            Fails("ins.csv", Line(3), &["a number for northing", "`\"12`"]),
        ),
        case(
            "word after blank lines of EuRoC",
            "data.csv",
            with_field(&euroc(6), 3, 2, "lost").replacen('\n', "\n\n \r\n\n", 2),
            Fails("data.csv", Line(9), &["a number for p_RS_R_x", "`lost`"]),
        ),
        case(
            "number too large for f64",
            "00.txt",
            with_field(&kitti(6), 2, 4, "1e999"),
            Loses(5, LostKind::Nan, &[2]),
        ),
        case(
            "word for a number",
            "00.txt",
            with_field(&kitti(6), 2, 4, "lost"),
            Fails("00.txt", Line(2), &["a number", "`lost`", "format"]),
        ),
        case(
            "coordinate beyond the Earth",
            "00.txt",
            with_field(&kitti(6), 2, 4, "1e300"),
            Fails("00.txt", Line(2), &["below 1e9", "unit"]),
        ),
    ]
}

fn rotations() -> Vec<Case> {
    vec![
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
            Loses(5, LostKind::Zero, &[4]),
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
            Loses(5, LostKind::Zero, &[3]),
        ),
        case(
            "zero quaternion in EuRoC",
            "data.csv",
            with_line(&euroc(6), 3, "1547215350100000000,0,0,0,0,0,0,0"),
            Loses(5, LostKind::Zero, &[3]),
        ),
        case(
            "degrees for radians",
            "ins.csv",
            with_field(&ins(6), 3, 7, "179.5"),
            Fails("ins.csv", Line(3), &["yaw in radians", "179.5", "degrees"]),
        ),
    ]
}

fn stamps() -> Vec<Case> {
    vec![
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
                &["a stamp after", "1547215350000000000 ns"],
            ),
        ),
        case(
            "stamp that is no number",
            "ins.csv",
            with_field(&ins(6), 3, 1, "-"),
            Fails("ins.csv", Line(3), &["a stamp in microseconds", "`-`"]),
        ),
    ]
}

fn line_ends() -> Vec<Case> {
    vec![
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
    ]
}

fn other_files() -> Vec<Case> {
    vec![
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
            Fails("data.csv", File, &["only comments"]),
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
            Fails("a.txt", Line(1), &["KITTI", "text without numbers"]),
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
                &["positions without a rotation", "gps/ins.csv"],
            ),
        ),
        case(
            "INS without yaw",
            "ins.csv",
            "timestamp,northing,easting,down,roll,pitch\n",
            Fails("ins.csv", Line(1), &["positions without a rotation"]),
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
            Fails("00.txt", File, &["gzip", "cut off"]),
        ),
        case(
            "MCAP",
            "a.mcap",
            b"\x89MCAP0\r\n".to_vec(),
            Fails("a.mcap", File, &["a topic of poses"]),
        ),
        case(
            "UTF-16",
            "00.txt",
            b"\xff\xfe1\0 \0".to_vec(),
            Fails("00.txt", Line(1), &["one number a line"]),
        ),
        case(
            "text, then bytes",
            "00.txt",
            [kitti(2).into_bytes(), b"\xff\xfe\xfd".to_vec()].concat(),
            Fails("00.txt", Line(3), &["bytes that are no text"]),
        ),
    ]
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
