//! Arrays of floating-point numbers in a stream of `.npy` arrays.
//!
//! `npyz` reads them; what it takes on trust is checked first: it allocates a header of the length that a damaged
//! file claims, its parser recurses at every bracket and tries each
//! level of them many times over, and it multiplies the sizes of the shape without a check.

mod structured;

use std::io::{self, Write};

use npyz::{DType, NpyFile, NpyHeader, TimeUnits, TypeChar, WriterBuilder};

use super::table::shorten;
use crate::StampUnit;

pub(crate) use structured::Structured;

const MAGIC: &[u8] = b"\x93NUMPY";
/// A header of a pose array has 118 bytes; this is all that version 1 of the format can have.
const LONGEST_HEADER: usize = 65_535;
/// Brackets in a header: a pose array has two; arrays of records are read elsewhere.
const MOST_BRACKETS: usize = 16;
/// Brackets within brackets: the shape of a field of a record is at the fourth level. The parser takes seconds for 14 of them.
const DEEPEST: usize = 4;
/// Decimal digits in a header: with all of them in the shape, the product of its sizes still fits 64 bits.
const MOST_DIGITS: usize = 18;

/// Why there is no next array.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum NpyFault {
    /// The stream ends within the array.
    Truncated,
    /// The bytes are no `.npy` array; says what was found.
    NotNpy(String),
    /// An array of something else than f4 or f8; holds the dtype.
    Dtype(String),
    /// Records that hold no poses; says why.
    Records(String),
}

/// Arrays one after another.
pub(crate) struct Stream<'a> {
    rest: &'a [u8],
    /// The last header as bytes and as parsed: the thousands of poses of a log share one.
    known: Option<(&'a [u8], NpyHeader)>,
}

/// An array of any kind.
#[derive(Debug)]
pub(crate) enum Values {
    Floats(Array),
    Whole(Whole),
    /// What holds no numbers that a pose has.
    Other,
}

/// An array of whole numbers or dates, in the order of its indices.
#[derive(Debug)]
pub(crate) struct Whole {
    pub shape: Vec<u64>,
    /// `None` where there is no date, or a number beyond 63 bits.
    pub values: Vec<Option<i64>>,
    /// The unit of dates.
    pub unit: Option<StampUnit>,
}

/// One array.
#[derive(Debug)]
pub(crate) struct Array {
    shape: Vec<u64>,
    strides: Vec<u64>,
    values: Vec<f64>,
}

impl<'a> Stream<'a> {
    pub fn new(bytes: &'a [u8]) -> Self {
        Self {
            rest: bytes,
            known: None,
        }
    }

    /// True after the last array.
    pub fn is_empty(&self) -> bool {
        self.rest.is_empty()
    }

    /// The shape of the next array.
    pub fn shape(&self) -> Result<Vec<u64>, NpyFault> {
        let bytes = header_bytes(self.rest)?;
        check_header(bytes)?;
        let header = NpyHeader::from_reader(bytes)
            .map_err(|fault| NpyFault::NotNpy(format!("a damaged header: {fault}")))?;
        Ok(header.shape().to_vec())
    }

    /// Takes the next array off the front.
    pub fn take(&mut self) -> Result<Array, NpyFault> {
        let bytes = header_bytes(self.rest)?;
        let header = match &self.known {
            Some((known, header)) if *known == bytes => header.clone(),
            _ => {
                check_header(bytes)?;
                NpyHeader::from_reader(bytes)
                    .map_err(|fault| NpyFault::NotNpy(format!("a damaged header: {fault}")))?
            }
        };
        let size = element_size(&header)?;
        let after = &self.rest[bytes.len()..];
        let length = header
            .len()
            .checked_mul(size)
            .and_then(|length| usize::try_from(length).ok())
            .ok_or_else(|| impossible_shape(bytes))?;
        let data = after.get(..length).ok_or(NpyFault::Truncated)?;
        let file = NpyFile::with_header(header.clone(), data);
        let values = match size {
            4 => file
                .into_vec::<f32>()
                .map(|values| values.into_iter().map(f64::from).collect()),
            _ => file.into_vec::<f64>(),
        };
        let array = Array {
            shape: header.shape().to_vec(),
            strides: header.strides().to_vec(),
            values: values.map_err(|fault| NpyFault::NotNpy(fault.to_string()))?,
        };
        self.rest = &after[length..];
        self.known = Some((bytes, header));
        Ok(array)
    }
}

impl Stream<'_> {
    /// The first array, of any kind.
    pub fn take_any(&mut self) -> Result<Values, NpyFault> {
        let bytes = header_bytes(self.rest)?;
        check_header(bytes)?;
        let header = NpyHeader::from_reader(bytes)
            .map_err(|fault| NpyFault::NotNpy(format!("a damaged header: {fault}")))?;
        if element_size(&header).is_ok() {
            return self.take().map(Values::Floats);
        }
        let DType::Plain(element) = header.dtype() else {
            return Ok(Values::Other);
        };
        let unit = match element.time_units() {
            Some(TimeUnits::Second) => Some(StampUnit::Seconds),
            Some(TimeUnits::Millisecond) => Some(StampUnit::Milliseconds),
            Some(TimeUnits::Microsecond) => Some(StampUnit::Microseconds),
            Some(TimeUnits::Nanosecond) => Some(StampUnit::Nanoseconds),
            _ => None,
        };
        let kind = element.type_char();
        let size = element.size_field();
        let readable = match kind {
            TypeChar::Int | TypeChar::Uint => matches!(size, 4 | 8),
            TypeChar::DateTime => size == 8 && unit.is_some(),
            _ => false,
        };
        let rows_first = header.order() == npyz::Order::C || header.shape().len() < 2;
        if !readable || !rows_first {
            return Ok(Values::Other);
        }
        let length = header
            .len()
            .checked_mul(size)
            .and_then(|length| usize::try_from(length).ok())
            .ok_or_else(|| impossible_shape(bytes))?;
        let data = self.rest[bytes.len()..].get(..length);
        let little = element.endianness() != npyz::Endianness::Big;
        let value = |bytes: &[u8]| {
            let mut wide = [0; 8];
            wide[..bytes.len()].copy_from_slice(bytes);
            if !little {
                wide[..bytes.len()].reverse();
            }
            let unsigned = u64::from_le_bytes(wide);
            match (kind, bytes.len()) {
                (TypeChar::Uint, _) => i64::try_from(unsigned).ok(),
                (_, 4) => Some(i64::from(unsigned as u32 as i32)),
                // The smallest number stands for no date.
                (TypeChar::DateTime, _) => Some(unsigned as i64).filter(|date| *date != i64::MIN),
                _ => Some(unsigned as i64),
            }
        };
        let values = data.ok_or(NpyFault::Truncated)?.chunks_exact(size as usize);
        Ok(Values::Whole(Whole {
            shape: header.shape().to_vec(),
            values: values.map(value).collect(),
            unit,
        }))
    }
}

impl Array {
    /// Sizes of the dimensions.
    pub fn shape(&self) -> &[u64] {
        &self.shape
    }

    /// The element at an index with as many entries as the shape, each within its size.
    pub fn get(&self, index: &[usize]) -> f64 {
        let offsets = index.iter().zip(&self.strides);
        let position: usize = offsets.map(|(at, stride)| at * *stride as usize).sum();
        self.values[position]
    }
}

/// The first bytes of an array up to its data: magic number, version, length, text.
fn header_bytes(all: &[u8]) -> Result<&[u8], NpyFault> {
    let overlap = MAGIC.len().min(all.len());
    if all[..overlap] != MAGIC[..overlap] {
        let found: Vec<String> = all[..overlap]
            .iter()
            .map(|byte| format!("{byte:02x}"))
            .collect();
        return Err(NpyFault::NotNpy(format!(
            "the bytes {} instead of the magic number",
            found.join(" ")
        )));
    }
    let version = *all.get(MAGIC.len()).ok_or(NpyFault::Truncated)?;
    let (start, length) = match (version, all) {
        (1, [_, _, _, _, _, _, _, _, a, b, ..]) => (10, u16::from_le_bytes([*a, *b]).into()),
        (2 | 3, [_, _, _, _, _, _, _, _, a, b, c, d, ..]) => {
            (12, u32::from_le_bytes([*a, *b, *c, *d]) as usize)
        }
        (1..=3, _) => return Err(NpyFault::Truncated),
        _ => {
            let found = format!("version {version} of the npy format");
            return Err(NpyFault::NotNpy(found));
        }
    };
    if length > LONGEST_HEADER {
        return Err(NpyFault::NotNpy(format!("a header of {length} bytes")));
    }
    all.get(..start + length).ok_or(NpyFault::Truncated)
}

/// Refuses what the parser would recurse into too deeply or multiply beyond 64 bits.
fn check_header(bytes: &[u8]) -> Result<(), NpyFault> {
    let count = |wanted: fn(&u8) -> bool| {
        bytes[MAGIC.len() + 4..]
            .iter()
            .copied()
            .filter(wanted)
            .count()
    };
    if count(|byte| b"([{".contains(byte)) > MOST_BRACKETS
        || depth(bytes).is_none_or(|deepest| deepest > DEEPEST)
    {
        let found = "a header of deeply nested brackets".to_owned();
        return Err(NpyFault::NotNpy(found));
    }
    let hexadecimal = bytes.windows(2).any(|pair| matches!(pair, b"0x" | b"0X"));
    if hexadecimal || count(u8::is_ascii_digit) > MOST_DIGITS {
        return Err(impossible_shape(bytes));
    }
    Ok(())
}

/// How deep brackets lie within brackets, outside of text in single quotes, the only kind that `numpy` writes in a header;
/// `None` where another kind or an escape could hide some.
fn depth(bytes: &[u8]) -> Option<usize> {
    let text = &bytes[MAGIC.len() + 4..];
    if text.windows(3).any(|three| three == b"'''") || text.iter().any(|b| b"\"\\".contains(b)) {
        return None;
    }
    let (mut depth, mut deepest, mut quoted) = (0_usize, 0, false);
    for byte in text {
        match byte {
            b'\'' => quoted = !quoted,
            b'(' | b'[' | b'{' if !quoted => depth += 1,
            b')' | b']' | b'}' if !quoted => depth = depth.saturating_sub(1),
            _ => {}
        }
        deepest = deepest.max(depth);
    }
    Some(deepest)
}

fn impossible_shape(header: &[u8]) -> NpyFault {
    let text = String::from_utf8_lossy(&header[MAGIC.len() + 4..]);
    NpyFault::NotNpy(format!("an impossible shape in {}", shorten(text.trim())))
}

/// Bytes of an element, 4 or 8.
fn element_size(header: &NpyHeader) -> Result<u64, NpyFault> {
    match header.dtype() {
        DType::Plain(element) => match (element.type_char(), element.size_field()) {
            (TypeChar::Float, size @ (4 | 8)) => Ok(size),
            _ => Err(NpyFault::Dtype(shorten(&element.to_string()))),
        },
        other => Err(NpyFault::Dtype(shorten(&other.descr()))),
    }
}

/// One 4x4 array in C order, as `numpy.save` writes it.
pub(crate) fn write_4x4(sink: &mut impl Write, values: &[f64; 16], single: bool) -> io::Result<()> {
    if single {
        write_as(sink, values.map(|value| value as f32))
    } else {
        write_as(sink, *values)
    }
}

fn write_as<T: npyz::AutoSerialize>(sink: &mut impl Write, values: [T; 16]) -> io::Result<()> {
    let mut writer = npyz::WriteOptions::new()
        .default_dtype()
        .shape(&[4, 4])
        .writer(sink)
        .begin_nd()?;
    writer.extend(values)?;
    writer.finish()
}
