//! Bytes of a recording at random places, from memory or from a file that is too large for it.

use std::borrow::Cow;
use std::fs::File;
use std::io;
use std::ops::Range;

/// Where the bytes are.
pub(crate) enum Data<'a> {
    /// In memory.
    Bytes(&'a [u8]),
    /// In memory, of its own.
    Owned(Vec<u8>),
    /// In a file of this length; only what is asked for is read, so that memory stays small whatever the file is.
    File(File, u64),
}

impl Data<'_> {
    /// Number of bytes.
    pub fn len(&self) -> u64 {
        match self {
            Self::Bytes(bytes) => bytes.len() as u64,
            Self::Owned(bytes) => bytes.len() as u64,
            Self::File(_, length) => *length,
        }
    }

    /// `length` bytes from `offset` on; an error of the kind `UnexpectedEof` beyond the end.
    pub fn read(&self, offset: u64, length: u64) -> io::Result<Cow<'_, [u8]>> {
        let end = offset.checked_add(length).filter(|end| *end <= self.len());
        let end = end.ok_or(io::ErrorKind::UnexpectedEof)?;
        match self {
            Self::Bytes(bytes) => Ok(Cow::Borrowed(&bytes[offset as usize..end as usize])),
            Self::Owned(bytes) => Ok(Cow::Borrowed(&bytes[offset as usize..end as usize])),
            Self::File(file, _) => {
                let mut buffer = vec![0; length as usize];
                read_exact_at(file, &mut buffer, offset)?;
                Ok(Cow::Owned(buffer))
            }
        }
    }

    /// As [`Self::read`], fewer bytes at the end of a range.
    pub fn read_up_to(&self, range: &Range<u64>, length: u64) -> io::Result<Cow<'_, [u8]>> {
        self.read(
            range.start,
            length.min(range.end.saturating_sub(range.start)),
        )
    }
}

#[cfg(unix)]
fn read_exact_at(file: &File, buffer: &mut [u8], offset: u64) -> io::Result<()> {
    std::os::unix::fs::FileExt::read_exact_at(file, buffer, offset)
}

#[cfg(windows)]
fn read_exact_at(file: &File, mut buffer: &mut [u8], mut offset: u64) -> io::Result<()> {
    while !buffer.is_empty() {
        let read = std::os::windows::fs::FileExt::seek_read(file, buffer, offset)?;
        if read == 0 {
            return Err(io::ErrorKind::UnexpectedEof.into());
        }
        buffer = &mut buffer[read..];
        offset += read as u64;
    }
    Ok(())
}

#[cfg(not(any(unix, windows)))]
fn read_exact_at(_: &File, _: &mut [u8], _: u64) -> io::Result<()> {
    Err(io::ErrorKind::Unsupported.into())
}

/// Little-endian numbers and strings off the front of a slice; `None` at its end.
pub(crate) struct Cursor<'a>(pub &'a [u8]);

impl<'a> Cursor<'a> {
    pub fn take(&mut self, length: usize) -> Option<&'a [u8]> {
        let (front, rest) = self.0.split_at_checked(length)?;
        self.0 = rest;
        Some(front)
    }

    pub fn u8(&mut self) -> Option<u8> {
        Some(self.take(1)?[0])
    }

    pub fn u16(&mut self) -> Option<u16> {
        Some(u16::from_le_bytes(self.take(2)?.try_into().ok()?))
    }

    pub fn u32(&mut self) -> Option<u32> {
        Some(u32::from_le_bytes(self.take(4)?.try_into().ok()?))
    }

    pub fn u64(&mut self) -> Option<u64> {
        Some(u64::from_le_bytes(self.take(8)?.try_into().ok()?))
    }

    /// Bytes after their length in 32 bits.
    pub fn block(&mut self) -> Option<&'a [u8]> {
        let length = self.u32()? as usize;
        self.take(length)
    }

    pub fn text(&mut self) -> Option<String> {
        Some(String::from_utf8_lossy(self.block()?).into_owned())
    }
}
