//! Arrays under names, in a zip file as numpy writes it.

use std::io::Write as _;

use super::*;

/// A zip file; numpy writes 64-bit sizes before each member.
pub fn zip(members: &[(&str, Vec<u8>)], deflated: bool) -> Vec<u8> {
    let (mut out, mut list) = (Vec::new(), Vec::new());
    for (name, content) in members {
        let mut crc = flate2::Crc::new();
        crc.update(content);
        let packed = match deflated {
            true => {
                let level = flate2::Compression::default();
                let mut encoder = flate2::write::DeflateEncoder::new(Vec::new(), level);
                encoder.write_all(content).unwrap();
                encoder.finish().unwrap()
            }
            false => content.clone(),
        };
        let start = out.len() as u32;
        let method = [if deflated { 8 } else { 0 }, 0];
        let name = format!("{name}.npy");
        let sizes = [content.len() as u64, packed.len() as u64];
        out.extend(b"PK\x03\x04\x2d\0\0\0");
        out.extend(method);
        out.extend([0, 0, 0x21, 0]);
        out.extend(crc.sum().to_le_bytes());
        out.extend([0xff; 8]);
        out.extend((name.len() as u16).to_le_bytes());
        out.extend([20, 0]);
        out.extend(name.as_bytes());
        out.extend([1, 0, 16, 0]);
        out.extend(sizes.map(u64::to_le_bytes).concat());
        out.extend(&packed);
        list.extend(b"PK\x01\x02\x2d\0\x2d\0\0\0");
        list.extend(method);
        list.extend([0, 0, 0x21, 0]);
        list.extend(crc.sum().to_le_bytes());
        list.extend((packed.len() as u32).to_le_bytes());
        list.extend((content.len() as u32).to_le_bytes());
        list.extend((name.len() as u16).to_le_bytes());
        list.extend([0; 12]);
        list.extend(start.to_le_bytes());
        list.extend(name.as_bytes());
    }
    let at = out.len() as u32;
    out.extend(&list);
    out.extend(b"PK\x05\x06\0\0\0\0");
    out.extend([(members.len() as u16).to_le_bytes(); 2].concat());
    out.extend((list.len() as u32).to_le_bytes());
    out.extend(at.to_le_bytes());
    out.extend([0, 0]);
    out
}

fn load(bytes: &[u8], options: &LoadOptions) -> Result<Trajectory, dose3_datasets::Error> {
    load_bytes("log.npz", bytes, options)
}

#[track_caller]
fn read(members: &[(&str, Vec<u8>)]) -> Trajectory {
    let options = LoadOptions::default();
    let [stored, deflated] = [false, true].map(|deflated| {
        let log = load(&zip(members, deflated), &options);
        log.unwrap_or_else(|error| panic!("{error}"))
    });
    assert_eq!(stored, deflated);
    check(&stored);
    assert_eq!(
        (stored.format, stored.row_kind),
        (Format::Npz, RowKind::Record)
    );
    assert_eq!((stored.rows[0], stored.rows[5]), (0, 5));
    stored
}

#[track_caller]
fn refused(bytes: &[u8], words: &[&str]) {
    refuse_bytes("log.npz", bytes, words);
}

const N: u64 = POSES as u64;

fn matrices() -> Vec<u8> {
    let values = truth().iter().flat_map(|pose| matrix(pose, 4)).collect();
    array(&[N, 4, 4], values)
}

fn positions() -> Vec<u8> {
    array(&[N, 3], rows().iter().flat_map(|(p, _)| *p).collect())
}

fn quaternions() -> Vec<u8> {
    let w_last = rows()
        .into_iter()
        .flat_map(|(_, [w, x, y, z])| [x, y, z, w]);
    array(&[N, 4], w_last.collect())
}

fn seconds() -> Vec<u8> {
    array(&[N], (0..POSES).map(|i| 1.6e9 + 0.1 * i as f64).collect())
}

fn nanoseconds() -> Vec<u8> {
    let of = |i: usize| 1_600_000_000_000_000_000 + 100_000_000 * i as i64;
    array(&[N], (0..POSES).map(of).collect::<Vec<i64>>())
}

/// An array with dates for its whole numbers.
fn dates() -> Vec<u8> {
    let mut bytes = nanoseconds();
    let at = bytes.windows(3).position(|part| part == b"<i8").unwrap();
    // The header is padded with blanks, of which four go.
    let end = bytes.iter().position(|byte| *byte == b'\n').unwrap();
    bytes.splice(at..at + 3, *b"<M8[ns]");
    bytes.drain(end..end + 4);
    bytes
}

#[test]
fn poses_in_one_array() {
    let log = read(&[("anything", matrices())]);
    assert_eq!(log.rate.source, RateSource::Unknown);
    for stamps in [seconds(), nanoseconds(), dates()] {
        let log = read(&[("poses", matrices()), ("timestamps", stamps)]);
        assert!((log.stamps[0] - 1_600_000_000_000_000_000).abs() < 1000);
        let said = remarked(&log, RemarkKind::Columns);
        assert!(
            said.contains("stamps from `timestamps`, poses from `poses`"),
            "{said}"
        );
    }
    let top: Vec<f64> = truth().iter().flat_map(|pose| matrix(pose, 3)).collect();
    read(&[("camera", array(&[N, 3, 4], top.clone()))]);
    read(&[
        ("poses", array(&[N, 12], top)),
        ("image", array(&[40, 30], vec![0.0; 1200])),
    ]);
    // Of two arrays of matrices one must be chosen.
    let two = zip(
        &[("gt", matrices()), ("est", matrices()), ("t", seconds())],
        false,
    );
    refused(&two, &["2 arrays of matrices: gt, est"]);
    let options = LoadOptions {
        topics: vec!["est".to_owned()],
        ..LoadOptions::default()
    };
    let log = load(&two, &options).unwrap();
    check(&log);
    assert_eq!(log.rate.source, RateSource::Stamps);
}

#[test]
fn poses_in_arrays_side_by_side() {
    let log = read(&[
        ("t_ns", nanoseconds()),
        ("pos", positions()),
        ("quat", quaternions()),
    ]);
    assert_eq!(log.stamps[0], 1_600_000_000_000_000_000);
    read(&[("positions", positions()), ("orientations", quaternions())]);
    let rotations: Vec<f64> = truth()
        .iter()
        .flat_map(|pose| matrix(pose, 3))
        .enumerate()
        .filter(|(at, _)| at % 4 != 3)
        .map(|(_, value)| value)
        .collect();
    read(&[("R", array(&[N, 3, 3], rotations)), ("t", positions())]);
}

#[test]
fn what_is_no_log_is_refused() {
    refused(
        &zip(&[("weights", array(&[N, 5], vec![0.0; 5 * POSES]))], false),
        &["npz with positions", "the names `weights`"],
    );
    refused(
        &zip(
            &[("poses", matrices()), ("stamps", array(&[9], vec![0.0; 9]))],
            false,
        ),
        &["a stamp for each of 24 poses", "9 stamps in `stamps`"],
    );
    let whole = zip(&[("poses", matrices())], true);
    for cut in [1, 30, whole.len() / 2, whole.len() - 60] {
        refused(&whole[..whole.len() - cut], &["a whole zip file"]);
    }
    let mut altered = zip(&[("poses", matrices())], false);
    altered[300] ^= 1;
    refused(&altered, &["other content of `poses.npy` than was written"]);
    let mut locked = zip(&[("poses", matrices())], false);
    let list = locked
        .windows(4)
        .rposition(|part| part == b"PK\x01\x02")
        .unwrap();
    locked[list + 8] |= 1;
    refused(&locked, &["with a password"]);
    // A list that names the same bytes again and again.
    let big = array(&[4000, 16], vec![0.0; 64_000]);
    let one = zip(&[("a", big)], false);
    let at = one
        .windows(4)
        .rposition(|part| part == b"PK\x01\x02")
        .unwrap();
    let end = one
        .windows(4)
        .rposition(|part| part == b"PK\x05\x06")
        .unwrap();
    let entries = one[at..end].repeat(400);
    let mut tail = one[end..].to_vec();
    tail[8..12].copy_from_slice(&[400_u16.to_le_bytes(); 2].concat());
    refused(
        &[&one[..at], &entries, &tail].concat(),
        &["MiB of unpacked data"],
    );
    // A zip file of something else.
    let other = zip(&[("poses", matrices())], false);
    let other: Vec<u8> = String::from_utf8_lossy(&other)
        .replace(".npy", ".txt")
        .into_bytes();
    refused(&other, &["a zip archive without numpy arrays"]);
}
