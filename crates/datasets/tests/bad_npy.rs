//! Damaged streams of `.npy` arrays: a clear error that names the array, or a counted repair.

mod common;

use common::bad::Outcome::{Fails, Loses, Repairs};
use common::bad::{Case, case, check_all};
use common::npy;
use dose3_datasets::LostKind;
use dose3_datasets::Place::{Array, File};

#[test]
fn damaged_streams() {
    check_all(cases());
}

fn cases() -> Vec<Case> {
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
            Fails("a.npy", Array(0), &["(n,)", "the shape [4, 4]"]),
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
            "shape in hexadecimal",
            "a.npy",
            header(
                "{'descr': '<f8', 'fortran_order': False, 'shape': (0xffffffffffffffff, 4, 4), }",
            ),
            Fails("a.npy", Array(0), &["impossible shape", "0xffff"]),
        ),
        case(
            "negative shape",
            "a.npy",
            header("{'descr': '<f8', 'fortran_order': False, 'shape': (-4, 4), }"),
            Fails("a.npy", Array(0), &["damaged header", "negative"]),
        ),
        case(
            "deep nesting",
            "a.npy",
            header(&"[".repeat(60_000)),
            Fails("a.npy", Array(0), &["deeply nested"]),
        ),
        case(
            "fourteen brackets within each other",
            "a.npy",
            header(&format!("{{'descr': {} (", "{".repeat(13))),
            Fails("a.npy", Array(0), &["deeply nested"]),
        ),
        case(
            "brackets hidden by text in other quotes",
            "a.npy",
            header(&format!("{{\"it's\": {} (", "{".repeat(13))),
            Fails("a.npy", Array(0), &["deeply nested"]),
        ),
        case(
            "records of records",
            "a.npy",
            header(&format!(
                "{{'descr': [('x', '<f4', ({}))], 'fortran_order': False, 'shape': (4, 4), }}",
                "1,".repeat(30_000)
            )),
            Fails("a.npy", Array(0), &["impossible shape"]),
        ),
        case(
            "header longer than the file",
            "a.npy",
            b"\x93NUMPY\x02\x00\x00\xf0\x00\x00{'descr': '<f4'".to_vec(),
            Fails("a.npy", Array(0), &["end of the file", "cut off"]),
        ),
        case(
            "header without shape",
            "a.npy",
            header("{'descr': '<f8', 'fortran_order': False}"),
            Fails(
                "a.npy",
                Array(0),
                &["damaged header", "missing key 'shape'"],
            ),
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
            Loses(5, LostKind::Nan, &[2]),
        ),
        case(
            "infinity in npy",
            "a.npy",
            patched(0, f32::INFINITY),
            Loses(5, LostKind::Nan, &[2]),
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
            Loses(2, LostKind::Zero, &[2]),
        ),
    ]
}
