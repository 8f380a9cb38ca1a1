//! Arrays of records with named fields, as numpy writes them.

use super::npz::zip;
use super::*;

/// A file as `numpy.save` writes it: the fields of the dtype, the shape, and the bytes of the records.
fn file(descr: &str, shape: &str, records: Vec<u8>) -> Vec<u8> {
    let text = format!("{{'descr': {descr}, 'fortran_order': False, 'shape': {shape}, }}\n");
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend((text.len() as u16).to_le_bytes());
    bytes.extend(text.as_bytes());
    bytes.extend(records);
    bytes
}

fn records(descr: &str, record: impl Fn(usize, [f64; 3], [f64; 4]) -> Vec<u8>) -> Vec<u8> {
    let rows = rows().into_iter().enumerate();
    let records = rows.flat_map(|(i, (p, q))| record(i, p, q)).collect();
    file(descr, &format!("({POSES},)"), records)
}

fn little(numbers: &[f64]) -> Vec<u8> {
    numbers
        .iter()
        .flat_map(|number| number.to_le_bytes())
        .collect()
}

fn big(numbers: &[f64]) -> Vec<u8> {
    numbers
        .iter()
        .flat_map(|number| number.to_be_bytes())
        .collect()
}

fn seconds(i: usize) -> f64 {
    1.6e9 + 0.1 * i as f64
}

fn nanoseconds(i: usize) -> i64 {
    1_600_000_000_000_000_000 + 100_000_000 * i as i64
}

fn load(bytes: &[u8], options: &LoadOptions) -> Result<Trajectory, dose3_datasets::Error> {
    load_bytes("log.npy", bytes, options)
}

/// Stamps within the 0.2 microseconds of floating-point seconds.
#[track_caller]
fn check_loosely(mut log: Trajectory) {
    for stamp in &mut log.stamps {
        *stamp = (*stamp + 500) / 1000 * 1000;
    }
    check(&log);
}

#[track_caller]
fn read(bytes: &[u8]) -> Trajectory {
    let log = load(bytes, &LoadOptions::default()).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!((log.format, log.row_kind), (Format::Npy, RowKind::Record));
    assert_eq!((log.rows[0], log.rows[5]), (0, 5));
    log
}

#[track_caller]
fn refused(bytes: &[u8], words: &[&str]) {
    refuse_bytes("log.npy", bytes, words);
}

#[test]
fn fields_are_taken_by_their_names() {
    let descr = "[('t', '<f8'), ('x', '<f8'), ('y', '<f8'), ('z', '<f8'), ('qw', '<f8'), ('qx', '<f8'), ('qy', '<f8'), ('qz', '<f8')]";
    let flat = |i, p: [f64; 3], q: [f64; 4]| [&[seconds(i)][..], &p, &q].concat();
    check_loosely(read(&records(descr, |i, p, q| little(&flat(i, p, q)))));
    let other = descr.replace('<', ">");
    check_loosely(read(&records(&other, |i, p, q| big(&flat(i, p, q)))));
    // w last, millimetres, a text that is no part of the pose, whole stamps of both kinds, and room between fields.
    let descr = "[('name', '<U3'), ('stamp_ns', '<u8'), ('x_mm', '<f8'), ('y_mm', '<f8'), ('z_mm', '<f8'), ('', '|V4'), ('seq', '|u1'), ('quaternion_xyzw', '<f8', (4,))]";
    let log = read(&records(descr, |i, p, [w, x, y, z]| {
        let p = little(&p.map(|value| 1000.0 * value));
        let stamp = (nanoseconds(i) as u64).to_le_bytes();
        [
            &[7; 12][..],
            &stamp,
            &p,
            &[9; 4],
            &[i as u8],
            &little(&[x, y, z, w]),
        ]
        .concat()
    }));
    check(&log);
    assert_eq!(log.stamps[1], nanoseconds(1));
    assert_eq!(log.report.length_unit, Some(0.001));
    // Fields within fields, dates, single precision.
    let descr = "[('header', [('stamp', '>M8[us]'), ('seq', '>i4')]), (('of the body', 'pose'), [('position', '>f8', (3,)), ('orientation', '>f8', 4)]), ('covariance', '>f4', (6, 6))]";
    let log = read(&records(descr, |i, p, [w, x, y, z]| {
        let stamp = (nanoseconds(i) / 1000).to_be_bytes();
        [
            &stamp[..],
            &(i as i32).to_be_bytes(),
            &big(&p),
            &big(&[x, y, z, w]),
            &[1; 144],
        ]
        .concat()
    }));
    check(&log);
    assert_eq!(log.stamps[2], nanoseconds(2));
    assert!(remarked(&log, RemarkKind::Columns).contains("stamps from `header.stamp`"));
    let descr = "[('t', '<i8'), ('pose', '<f4', (3, 4))]";
    check(&read(&records(descr, |i, p, [w, _, _, z]| {
        let (s, c) = (2.0 * z * w, 1.0 - 2.0 * z * z);
        let m = [c, -s, 0.0, p[0], s, c, 0.0, p[1], 0.0, 0.0, 1.0, p[2]];
        let m = m.iter().flat_map(|value| (*value as f32).to_le_bytes());
        nanoseconds(i).to_le_bytes().into_iter().chain(m).collect()
    })));
}

#[test]
fn of_several_bodies_one_is_chosen() {
    let of = |topic: &str| LoadOptions {
        topics: vec![topic.to_owned()],
        ..LoadOptions::default()
    };
    let flat = "[('t', '<f8'), ('gt_x', '<f8'), ('gt_y', '<f8'), ('gt_z', '<f8'), ('gt_qw', '<f8'), ('gt_qx', '<f8'), ('gt_qy', '<f8'), ('gt_qz', '<f8'), ('est_x', '<f8'), ('est_y', '<f8'), ('est_z', '<f8'), ('est_qw', '<f8'), ('est_qx', '<f8'), ('est_qy', '<f8'), ('est_qz', '<f8')]";
    let nested = "[('t', '<f8'), ('gt', [('p', '<f8', (3,)), ('q_wxyz', '<f8', (4,))]), ('est', [('p', '<f8', (3,)), ('q_wxyz', '<f8', (4,))])]";
    for descr in [flat, nested] {
        let both = records(descr, |i, p, q| {
            let elsewhere = [p[0] + 7.0, p[1], p[2]];
            little(&[&[seconds(i)][..], &elsewhere, &q, &p, &q].concat())
        });
        refused(&both, &["log.npy", "2 of them", "gt", "est"]);
        check_loosely(load(&both, &of("est")).unwrap());
        assert_eq!(load(&both, &of("gt")).unwrap().poses[0].translation.x, 7.0);
        assert!(load(&both, &of("middle")).is_err());
    }
}

#[test]
fn records_in_npz() {
    let descr = "[('x', '<f8'), ('y', '<f8'), ('z', '<f8'), ('qw', '<f8'), ('qx', '<f8'), ('qy', '<f8'), ('qz', '<f8')]";
    let poses = records(descr, |_, p, q| little(&[&p[..], &q].concat()));
    let stamps = array(
        &[POSES as u64],
        (0..POSES).map(nanoseconds).collect::<Vec<i64>>(),
    );
    let others = records("[('weight', '<f8')]", |_, p, _| little(&p[..1]));
    let members = [
        ("loss", others),
        ("poses", poses.clone()),
        ("stamps", stamps),
    ];
    let log = load(&zip(&members, true), &LoadOptions::default()).unwrap();
    check(&log);
    assert_eq!((log.format, log.stamps[1]), (Format::Npz, nanoseconds(1)));
    let two = zip(&[("gt", poses.clone()), ("est", poses)], false);
    refused(&two, &["2 lists of poses: gt, est"]);
    let options = LoadOptions {
        topics: vec!["est".to_owned()],
        rate: Some(10.0),
        ..LoadOptions::default()
    };
    check(&load(&two, &options).unwrap());
}

#[test]
fn records_without_a_pose_are_refused() {
    let zeros = |size: usize| vec![0; size];
    for (descr, shape, size, words) in [
        (
            "[('a', '<f8'), ('b', '<f8')]",
            "(3,)",
            48,
            &["npy with positions", "the names `a, b`"][..],
        ),
        (
            "[('t', '|O'), ('x', '<f8')]",
            "(3,)",
            48,
            &["array 0", "`t` of dtype `|O`", "astype"],
        ),
        (
            "[('x', '<f8'), ('qw', '<U8')]",
            "(3,)",
            120,
            &["`qw` of dtype `<U8`"],
        ),
        (
            "[('x', '<f2'), ('k', '<f8')]",
            "(3,)",
            30,
            &["`x` of dtype `<f2`"],
        ),
        (
            "[('x', '<f8')]",
            "(3, 3)",
            72,
            &["(n,)", "the shape [3, 3]"],
        ),
        ("[('x', '<f8')]", "()", 8, &["the shape []"]),
        ("[('name', '<U8')]", "(3,)", 96, &["no field of numbers"]),
        ("[('x', '<f8')]", "(4,)", 31, &["a whole array", "cut off"]),
        (
            "[('x', '<f8')]",
            "(18446744073709551615,)",
            31,
            &["impossible shape"],
        ),
        (
            "[('x', '<f8', (4294967296, 4294967296, 4294967296))]",
            "(3,)",
            9,
            &["damaged header"],
        ),
        (
            "[('x', '<f8', (99999999999999999999,))]",
            "(3,)",
            9,
            &["damaged header"],
        ),
        (
            "[('x', '<U9223372036854775807'), ('y', '<f8')]",
            "(3,)",
            9,
            &["damaged header"],
        ),
        (
            "[('a', [('b', [('c', [('d', [('x', '<f8')])])])])]",
            "(3,)",
            24,
            &["damaged header"],
        ),
        ("[('x', '<f8'", "(3,)", 24, &["damaged header"]),
        ("[('x', '<é8')]", "(3,)", 24, &["no field of numbers"]),
        ("[('x\\'', '<f8')]", "(3,)", 24, &["damaged header"]),
        ("[]", "(3,)", 24, &["no field of numbers"]),
    ] {
        refused(&file(descr, shape, zeros(size)), words);
    }
}

#[test]
fn damaged_headers_are_errors() {
    let descr = "[('t', '<f8'), ('pose', [('p', '<f4', (3,)), ('q', '>f4', (2, 2))])]";
    let whole = file(descr, "(3,)", vec![0; 108]);
    let data = whole.len() - 108;
    for at in 8..data {
        for byte in *b"0'9([)], <OU\0\xff" {
            let mut bytes = whole.clone();
            bytes[at] = byte;
            let _ = load(&bytes, &LoadOptions::default());
        }
        assert!(load(&whole[..at], &LoadOptions::default()).is_err());
    }
}
