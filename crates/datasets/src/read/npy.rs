//! Arrays of floating-point numbers in a stream of `.npy` arrays.
//!
//! Only what pose files need of the format (numpy, `numpy.lib.format`): versions 1 to 3, `f4` and `f8` of either
//! byte order, C and Fortran order. Written for streams of thousands of tiny arrays and for damaged files:
//! nothing is allocated from a number in the file before the bytes are known to be there.

const MAGIC: &[u8] = b"\x93NUMPY";
/// A header of a pose array has 118 bytes; anything much longer is not one.
const LONGEST_HEADER: usize = 4096;

/// Why there is no next array.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum NpyFault {
    /// The stream ends within the array.
    Truncated,
    /// The bytes are no `.npy` array; says what was found.
    NotNpy(String),
    /// An array of something else than f4 or f8; holds the dtype.
    Dtype(String),
}

/// One array.
#[derive(Debug)]
pub(crate) struct Array<'a> {
    shape: Vec<usize>,
    fortran: bool,
    element: Element,
    data: &'a [u8],
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Element {
    bytes: usize,
    big_endian: bool,
}

impl<'a> Array<'a> {
    /// Takes the next array off the front of `stream`.
    pub fn next(stream: &mut &'a [u8]) -> Result<Self, NpyFault> {
        let all = *stream;
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
        let version = *all.get(6).ok_or(NpyFault::Truncated)?;
        let (start, length) = match version {
            1 => (
                10,
                all.get(8..10)
                    .map(|b| usize::from(u16::from_le_bytes([b[0], b[1]]))),
            ),
            2 | 3 => (
                12,
                all.get(8..12)
                    .map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]) as usize),
            ),
            _ => {
                return Err(NpyFault::NotNpy(format!(
                    "version {version} of the npy format"
                )));
            }
        };
        let length = length.ok_or(NpyFault::Truncated)?;
        if length > LONGEST_HEADER {
            return Err(NpyFault::NotNpy(format!("a header of {length} bytes")));
        }
        let header = all.get(start..start + length).ok_or(NpyFault::Truncated)?;
        let (element, fortran, shape) = parse_header(header)?;
        let bytes = shape
            .iter()
            .try_fold(element.bytes, |product, size| product.checked_mul(*size))
            .ok_or_else(|| NpyFault::NotNpy(format!("the impossible shape {shape:?}")))?;
        let rest = &all[start + length..];
        let data = rest.get(..bytes).ok_or(NpyFault::Truncated)?;
        *stream = &rest[bytes..];
        Ok(Self {
            shape,
            fortran,
            element,
            data,
        })
    }

    /// Sizes of the dimensions.
    pub fn shape(&self) -> &[usize] {
        &self.shape
    }

    /// The element at an index with as many entries as the shape, each within its size.
    pub fn get(&self, index: &[usize]) -> f64 {
        let step = |offset: usize, (size, at): (&usize, &usize)| offset * size + at;
        let pairs = self.shape.iter().zip(index);
        let position = if self.fortran {
            pairs.rev().fold(0, step)
        } else {
            pairs.fold(0, step)
        };
        let mut bytes = [0; 8];
        let raw = &self.data[position * self.element.bytes..][..self.element.bytes];
        bytes[..raw.len()].copy_from_slice(raw);
        if self.element.big_endian {
            bytes[..raw.len()].reverse();
        }
        if self.element.bytes == 4 {
            let [a, b, c, d, ..] = bytes;
            f64::from(f32::from_le_bytes([a, b, c, d]))
        } else {
            f64::from_le_bytes(bytes)
        }
    }
}

/// Reads the Python dictionary `{'descr': '<f4', 'fortran_order': False, 'shape': (4, 4), }`.
fn parse_header(header: &[u8]) -> Result<(Element, bool, Vec<usize>), NpyFault> {
    let text = std::str::from_utf8(header)
        .map_err(|_| NpyFault::NotNpy("a header that is no text".to_owned()))?;
    let value = |key: &str| {
        let after = [format!("'{key}'"), format!("\"{key}\"")]
            .iter()
            .find_map(|quoted| {
                text.find(quoted.as_str())
                    .map(|at| &text[at + quoted.len()..])
            })
            .and_then(|rest| rest.trim_start().strip_prefix(':'))
            .map(str::trim_start);
        after.ok_or_else(|| NpyFault::NotNpy(format!("a header without `{key}`")))
    };
    let fortran = value("fortran_order")?.starts_with("True");
    let shape = value("shape")?
        .strip_prefix('(')
        .and_then(|rest| rest.split(')').next())
        .and_then(|inner| {
            let sizes = inner
                .split(',')
                .map(str::trim)
                .filter(|size| !size.is_empty());
            sizes
                .map(|size| size.trim_end_matches('L').parse().ok())
                .collect::<Option<Vec<usize>>>()
        })
        .ok_or_else(|| NpyFault::NotNpy("a header without a readable shape".to_owned()))?;
    let descr = value("descr")?;
    let name = descr
        .trim_start_matches(['\'', '"'])
        .split(['\'', '"'])
        .next()
        .unwrap_or("");
    let element = match name {
        "<f4" => Element {
            bytes: 4,
            big_endian: false,
        },
        ">f4" => Element {
            bytes: 4,
            big_endian: true,
        },
        "<f8" => Element {
            bytes: 8,
            big_endian: false,
        },
        ">f8" => Element {
            bytes: 8,
            big_endian: true,
        },
        _ => return Err(NpyFault::Dtype(super::table::shorten(name))),
    };
    Ok((element, fortran, shape))
}

/// The bytes of one 4x4 array in C order, as `numpy.save` writes it.
pub(crate) fn encode_4x4(values: &[f64; 16], single: bool) -> Vec<u8> {
    let descr = if single { "<f4" } else { "<f8" };
    let mut header = format!("{{'descr': '{descr}', 'fortran_order': False, 'shape': (4, 4), }}");
    // Magic, version, length and header together are a multiple of 64 bytes.
    while (10 + header.len() + 1) % 64 != 0 {
        header.push(' ');
    }
    header.push('\n');
    let mut bytes = MAGIC.to_vec();
    bytes.extend([1, 0]);
    bytes.extend((header.len() as u16).to_le_bytes());
    bytes.extend(header.as_bytes());
    for value in values {
        if single {
            bytes.extend((*value as f32).to_le_bytes());
        } else {
            bytes.extend(value.to_le_bytes());
        }
    }
    bytes
}
