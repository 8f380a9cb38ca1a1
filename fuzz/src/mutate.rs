//! Seeded damage to well-formed inputs.

use rand::{Rng, RngExt};

/// Longest input made.
const LONGEST: usize = 1 << 16;

/// Numbers at the edges of what readers expect.
const NUMBERS: &[&str] = &[
    "0",
    "-0",
    "1",
    "-1",
    "nan",
    "inf",
    "-inf",
    "1e308",
    "-1e308",
    "1e-320",
    "5e-324",
    "1e400",
    "9223372036854775807",
    "-9223372036854775808",
    "18446744073709551616",
    "1e19",
    "0x10",
    "1_000",
    "1,5",
    "1.7976931348623157e308",
    "",
    "+",
    ".",
    "1e",
    "--1",
    "4294967296",
    "1e-9",
    "999999999999999999999999",
];

/// Integers that counts and lengths break at.
const COUNTS: &[u64] = &[
    0,
    1,
    2,
    127,
    128,
    255,
    256,
    0x7fff,
    0xffff,
    0x7fff_ffff,
    0xffff_ffff,
    0x1_0000_0000,
    0x7fff_ffff_ffff_ffff,
    0x8000_0000_0000_0000,
    0xffff_ffff_ffff_fff0,
    0xffff_ffff_ffff_ffff,
];

/// `seed` with one to six kinds of damage; `other` lends parts, `dictionary` words.
pub fn mutate(rng: &mut impl Rng, seed: &[u8], other: &[u8], dictionary: &[&[u8]]) -> Vec<u8> {
    let mut bytes = seed.to_vec();
    for _ in 0..rng.random_range(1..=6_u32) {
        once(rng, &mut bytes, other, dictionary);
        bytes.truncate(LONGEST);
    }
    bytes
}

fn once(rng: &mut impl Rng, bytes: &mut Vec<u8>, other: &[u8], dictionary: &[&[u8]]) {
    if bytes.is_empty() {
        bytes.extend(other);
        return;
    }
    let at = rng.random_range(0..bytes.len());
    match rng.random_range(0..12_u32) {
        0 => bytes[at] ^= 1 << rng.random_range(0..8_u32),
        1 => bytes[at] = rng.random(),
        2 => bytes.truncate(at),
        3 => {
            let end = (at + span(rng)).min(bytes.len());
            bytes.drain(at..end);
        }
        4 => {
            let end = (at + span(rng)).min(bytes.len());
            let part = bytes[at..end].to_vec();
            insert(bytes, at, &part);
        }
        5 if !other.is_empty() => {
            let from = rng.random_range(0..other.len());
            let end = (from + span(rng)).min(other.len());
            insert(bytes, at, &other[from..end]);
        }
        6 if !dictionary.is_empty() => {
            let word = dictionary[rng.random_range(0..dictionary.len())];
            insert(bytes, at, word);
        }
        7 => integer(rng, bytes, at),
        8 => line(rng, bytes, at),
        _ => number(rng, bytes, at),
    }
}

/// Mostly short, now and then long.
fn span(rng: &mut impl Rng) -> usize {
    1 << rng.random_range(0..13_u32)
}

fn insert(bytes: &mut Vec<u8>, at: usize, part: &[u8]) {
    bytes.splice(at..at, part.iter().copied());
}

/// Overwrites a binary integer of 1, 2, 4 or 8 bytes.
fn integer(rng: &mut impl Rng, bytes: &mut [u8], at: usize) {
    let value = COUNTS[rng.random_range(0..COUNTS.len())];
    let size = 1 << rng.random_range(0..4_u32);
    let little = value.to_le_bytes();
    let big = value.to_be_bytes();
    let part = if rng.random_bool(0.8) {
        &little[..size]
    } else {
        &big[8 - size..]
    };
    let end = (at + size).min(bytes.len());
    bytes[at..end].copy_from_slice(&part[..end - at]);
}

/// Replaces the number in text around `at`.
fn number(rng: &mut impl Rng, bytes: &mut Vec<u8>, at: usize) {
    let of_number = |byte: &u8| byte.is_ascii_digit() || b"+-.eE".contains(byte);
    let start = bytes[..at]
        .iter()
        .rposition(|byte| !of_number(byte))
        .map_or(0, |last| last + 1);
    let end = bytes[at..]
        .iter()
        .position(|byte| !of_number(byte))
        .map_or(bytes.len(), |length| at + length);
    if start < end && end - start < 40 {
        let word = NUMBERS[rng.random_range(0..NUMBERS.len())];
        bytes.splice(start..end, word.bytes());
    }
}

/// Drops, doubles or moves the line around `at`.
fn line(rng: &mut impl Rng, bytes: &mut Vec<u8>, at: usize) {
    let start = bytes[..at]
        .iter()
        .rposition(|byte| *byte == b'\n')
        .map_or(0, |last| last + 1);
    let end = bytes[at..]
        .iter()
        .position(|byte| *byte == b'\n')
        .map_or(bytes.len(), |length| at + length + 1);
    let text: Vec<u8> = bytes[start..end].to_vec();
    match rng.random_range(0..3_u32) {
        0 => drop(bytes.drain(start..end)),
        1 => insert(bytes, end, &text),
        _ => {
            bytes.drain(start..end);
            insert(bytes, 0, &text);
        }
    }
}
