//! Compressed files, unpacked up to a limit.

use std::borrow::Cow;
use std::path::Path;

use crate::Error;
use crate::error::Place;

/// What a compressed file may become, bytes: a pose log of 100 million poses.
const LARGEST: u64 = 4 << 30;
/// ... and how many times its size, beyond the first 16 MiB: text of poses packs to a third or a tenth.
const LARGEST_RATIO: u64 = 200;
const FREE: u64 = 16 << 20;
/// ... of a chunk of a recording.
#[cfg(feature = "recordings")]
const FREE_CHUNK: u64 = 64 << 20;

/// The content of a file, unpacked where it is gzip or zstd.
pub(crate) fn unpack<'a>(path: &Path, bytes: &'a [u8]) -> Result<Cow<'a, [u8]>, Error> {
    if bytes.starts_with(b"\x1f\x8b") {
        return gzip(path, bytes).map(Cow::Owned);
    }
    if bytes.starts_with(b"\x28\xb5\x2f\xfd") {
        return zstd(path, bytes).map(Cow::Owned);
    }
    Ok(Cow::Borrowed(bytes))
}

/// Bytes that `packed` bytes of a file may become.
pub(super) fn limit(packed: usize) -> u64 {
    (FREE + packed as u64 * LARGEST_RATIO).min(LARGEST)
}

/// Bytes that `packed` bytes of a chunk of a recording may become: a single image of one colour packs to nothing.
#[cfg(feature = "recordings")]
pub(crate) fn chunk_limit(packed: usize) -> u64 {
    (FREE_CHUNK + packed as u64 * LARGEST_RATIO).min(LARGEST)
}

/// Unpacks a frame of zstd, which may look back no further than `limit` bytes: that much is kept apart from what is
/// unpacked.
#[cfg(feature = "compression")]
fn zstd_frame<R: std::io::Read>(
    packed: R,
    limit: u64,
) -> Result<impl std::io::Read, ruzstd::decoding::errors::FrameDecoderError> {
    let mut decoder = ruzstd::decoding::FrameDecoder::new();
    decoder.set_max_window_size(limit.min(ruzstd::decoding::DEFAULT_MAX_WINDOW_SIZE));
    ruzstd::decoding::StreamingDecoder::new_with_decoder(packed, decoder)
}

/// The same of a chunk of a recording. Its window may be far larger than what it unpacks to.
#[cfg(feature = "recordings")]
pub(crate) fn zstd_chunk(
    packed: &[u8],
) -> Result<impl std::io::Read, ruzstd::decoding::errors::FrameDecoderError> {
    zstd_frame(packed, chunk_limit(packed.len()))
}

/// The content of a member of a zip file, `left` bytes at most.
#[cfg(feature = "compression")]
pub(super) fn deflate(path: &Path, bytes: &[u8], left: u64) -> Result<Vec<u8>, Error> {
    let mut out = Vec::new();
    let decoder = flate2::read::DeflateDecoder::new(bytes);
    read_into(path, decoder, left, &mut out, "deflate")?;
    Ok(out)
}

/// The checksum of a member of a zip file; `None` where this build cannot tell.
#[cfg(feature = "compression")]
pub(super) fn crc(content: &[u8]) -> Option<u32> {
    let mut crc = flate2::Crc::new();
    crc.update(content);
    Some(crc.sum())
}

#[cfg(feature = "compression")]
fn gzip(path: &Path, bytes: &[u8]) -> Result<Vec<u8>, Error> {
    read_all(
        path,
        flate2::read::MultiGzDecoder::new(bytes),
        bytes.len(),
        "gzip",
    )
}

#[cfg(feature = "compression")]
pub(crate) fn zstd(path: &Path, bytes: &[u8]) -> Result<Vec<u8>, Error> {
    let mut out = Vec::new();
    let mut rest = bytes;
    // A file may hold several frames.
    while !rest.is_empty() {
        let limit = limit(bytes.len());
        let decoder =
            zstd_frame(&mut rest, limit).map_err(|fault| damaged(path, "zstd", &fault))?;
        let left = limit.saturating_sub(out.len() as u64);
        read_into(path, decoder, left, &mut out, "zstd")?;
    }
    Ok(out)
}

#[cfg(feature = "compression")]
pub(crate) fn read_all(
    path: &Path,
    reader: impl std::io::Read,
    packed: usize,
    kind: &str,
) -> Result<Vec<u8>, Error> {
    let mut out = Vec::new();
    read_into(path, reader, limit(packed), &mut out, kind)?;
    Ok(out)
}

#[cfg(feature = "compression")]
fn read_into(
    path: &Path,
    reader: impl std::io::Read,
    limit: u64,
    out: &mut Vec<u8>,
    kind: &str,
) -> Result<(), Error> {
    use std::io::Read as _;
    let read = reader
        .take(limit + 1)
        .read_to_end(out)
        .map_err(|fault| damaged(path, kind, &fault))?;
    match read as u64 > limit {
        true => Err(beyond(path, limit)),
        false => Ok(()),
    }
}

fn beyond(path: &Path, limit: u64) -> Error {
    let found = format!("more than {} MiB of unpacked data", limit >> 20);
    let hint = "a file that unpacks to so many times its size is no pose log";
    Error::input(path, Place::File, "a pose log", found, hint)
}

/// The error for a file of `packed` bytes that holds more than it may.
pub(super) fn too_much(path: &Path, packed: usize) -> Error {
    beyond(path, limit(packed))
}

#[cfg(feature = "compression")]
fn damaged(path: &Path, kind: &str, fault: &(dyn std::error::Error + 'static)) -> Error {
    let hint = "the file is cut off or damaged; copy it again";
    let expected = format!("whole {kind} data");
    Error::input(path, Place::File, expected, broken(kind, fault), hint)
}

/// What packed data are that cannot be unpacked, in words: the libraries' own name their types.
#[cfg(feature = "compression")]
pub(crate) fn broken(kind: &str, fault: &(dyn std::error::Error + 'static)) -> String {
    use ruzstd::decoding::errors::FrameDecoderError;
    let mut next = Some(fault);
    while let Some(fault) = next {
        match fault.downcast_ref() {
            Some(FrameDecoderError::DictNotProvided { .. }) => {
                return format!("{kind} data that need a dictionary");
            }
            Some(FrameDecoderError::WindowSizeTooBig { .. }) => {
                return format!("{kind} data that need too much memory at a time");
            }
            _ => {}
        }
        let io = fault.downcast_ref::<std::io::Error>();
        if io.is_some_and(|io| io.kind() == std::io::ErrorKind::UnexpectedEof) {
            return format!("{kind} data that end early");
        }
        // An error of input and output names the cause of what it holds as its own.
        next = match io.and_then(std::io::Error::get_ref) {
            Some(inner) => Some(inner),
            None => fault.source(),
        };
    }
    format!("damaged {kind} data")
}

#[cfg(not(feature = "compression"))]
fn gzip(path: &Path, _: &[u8]) -> Result<Vec<u8>, Error> {
    Err(not_built(path, "a gzip archive"))
}

#[cfg(not(feature = "compression"))]
pub(crate) fn zstd(path: &Path, _: &[u8]) -> Result<Vec<u8>, Error> {
    Err(not_built(path, "a zstd archive"))
}

#[cfg(not(feature = "compression"))]
pub(super) fn deflate(path: &Path, _: &[u8], _: u64) -> Result<Vec<u8>, Error> {
    Err(not_built(path, "a packed zip archive"))
}

#[cfg(not(feature = "compression"))]
pub(super) fn crc(_: &[u8]) -> Option<u32> {
    None
}

#[cfg(not(feature = "compression"))]
fn not_built(path: &Path, found: &str) -> Error {
    Error::input(
        path,
        Place::File,
        "poses",
        found,
        "this build does not unpack; unpack the file first",
    )
}
