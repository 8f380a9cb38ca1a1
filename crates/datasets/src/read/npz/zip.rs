//! The members of a zip file as `numpy` writes it: stored or deflated, with 64-bit sizes where it likes.

use std::borrow::Cow;
use std::path::Path;

use crate::Error;
use crate::error::Place;
use crate::read::unpack;

/// Bytes of the record at the end of a zip file, without the comment behind it, and of the longest comment.
const END: usize = 22;
const LONGEST_COMMENT: usize = 65_535;

/// One member.
pub(super) struct Member<'a> {
    pub name: String,
    pub content: Cow<'a, [u8]>,
}

/// The name of the first member of a zip file.
pub(super) fn first_name(bytes: &[u8]) -> Option<&str> {
    let header = bytes.strip_prefix(b"PK\x03\x04")?;
    let length = usize::from(u16_at(header, 22)?);
    std::str::from_utf8(header.get(26..26 + length)?).ok()
}

/// The members whose names `wanted` takes.
///
/// # Errors
/// A file that is cut off or damaged, that is encrypted or packed in another way, or that unpacks to too much.
pub(super) fn members<'a>(
    path: &Path,
    bytes: &'a [u8],
    wanted: impl Fn(&str) -> bool,
) -> Result<Vec<Member<'a>>, Error> {
    let damaged = |found: &str| damaged(path, found);
    let (count, mut at) = directory(bytes).ok_or_else(|| damaged("no list of its members"))?;
    let (mut members, mut left) = (Vec::new(), unpack::limit(bytes.len()));
    for _ in 0..count {
        let entry = Entry::read(bytes, at).ok_or_else(|| damaged("a damaged list of members"))?;
        at = entry.next;
        if !wanted(&entry.name) {
            continue;
        }
        if entry.encrypted {
            let hint = "save it without a password";
            let found = format!("`{}` with a password", entry.name);
            return Err(Error::input(path, Place::File, "numpy arrays", found, hint));
        }
        let packed = entry
            .packed(bytes)
            .ok_or_else(|| damaged("a member beyond the end of the file"))?;
        let content = match entry.method {
            0 => Cow::Borrowed(packed),
            8 => Cow::Owned(unpack::deflate(path, packed, left)?),
            other => return Err(damaged(&format!("a member packed by method {other}"))),
        };
        // Entries may name the same bytes again and again.
        left = left
            .checked_sub(content.len() as u64)
            .ok_or_else(|| unpack::too_much(path, bytes.len()))?;
        if content.len() as u64 != entry.size {
            return Err(damaged("a member of another size than is said"));
        }
        if unpack::crc(&content).is_some_and(|crc| crc != entry.crc) {
            return Err(damaged(&format!(
                "other content of `{}` than was written",
                entry.name
            )));
        }
        members.push(Member {
            name: entry.name,
            content,
        });
    }
    Ok(members)
}

fn damaged(path: &Path, found: &str) -> Error {
    let hint = "the file is cut off or damaged; copy it again";
    Error::input(path, Place::File, "a whole zip file", found, hint)
}

fn u16_at(bytes: &[u8], at: usize) -> Option<u16> {
    Some(u16::from_le_bytes(*bytes.get(at..)?.first_chunk()?))
}

fn u32_at(bytes: &[u8], at: usize) -> Option<u32> {
    Some(u32::from_le_bytes(*bytes.get(at..)?.first_chunk()?))
}

fn u64_at(bytes: &[u8], at: usize) -> Option<u64> {
    Some(u64::from_le_bytes(*bytes.get(at..)?.first_chunk()?))
}

/// How many members there are, and where their list begins.
fn directory(bytes: &[u8]) -> Option<(u64, usize)> {
    let last = bytes.len().checked_sub(END)?;
    let first = last.saturating_sub(LONGEST_COMMENT);
    let end = (first..=last)
        .rev()
        .find(|at| bytes[*at..].starts_with(b"PK\x05\x06"))?;
    let (count, at) = (u16_at(bytes, end + 10)?, u32_at(bytes, end + 16)?);
    let locator = end
        .checked_sub(20)
        .filter(|at| bytes[*at..].starts_with(b"PK\x06\x07"));
    match locator {
        Some(locator) => {
            let end = usize::try_from(u64_at(bytes, locator + 8)?).ok()?;
            if !bytes.get(end..)?.starts_with(b"PK\x06\x06") {
                return None;
            }
            let at = u64_at(bytes, end.checked_add(48)?)?;
            Some((u64_at(bytes, end + 32)?, usize::try_from(at).ok()?))
        }
        None => Some((count.into(), at as usize)),
    }
}

/// One entry of the list.
struct Entry {
    name: String,
    method: u16,
    encrypted: bool,
    crc: u32,
    packed: u64,
    size: u64,
    /// Where the member begins.
    start: u64,
    /// Where the next entry does.
    next: usize,
}

impl Entry {
    fn read(bytes: &[u8], at: usize) -> Option<Self> {
        let entry = bytes.get(at..)?;
        if !entry.starts_with(b"PK\x01\x02") {
            return None;
        }
        let length = |at: usize| u16_at(entry, at).map(usize::from);
        let (name, extra, comment) = (length(28)?, length(30)?, length(32)?);
        let mut sizes = [
            u32_at(entry, 24)?.into(),
            u32_at(entry, 20)?.into(),
            u32_at(entry, 42)?.into(),
        ];
        // Sizes that need more than 32 bits stand behind the name, in this order.
        let mut more = entry.get(46 + name..46 + name + extra)?;
        while let (Some(kind), Some(length)) = (u16_at(more, 0), u16_at(more, 2)) {
            let field = more.get(4..4 + usize::from(length))?;
            if kind == 1 {
                let mut at = 0;
                for size in &mut sizes {
                    if *size == u64::from(u32::MAX) {
                        *size = u64_at(field, at)?;
                        at += 8;
                    }
                }
            }
            more = &more[4 + usize::from(length)..];
        }
        let [size, packed, start] = sizes;
        Some(Self {
            name: String::from_utf8_lossy(entry.get(46..46 + name)?).into_owned(),
            method: u16_at(entry, 10)?,
            encrypted: u16_at(entry, 8)? & 1 == 1,
            crc: u32_at(entry, 16)?,
            packed,
            size,
            start,
            next: at + 46 + name + extra + comment,
        })
    }

    /// The bytes of the member as they are packed.
    fn packed<'a>(&self, bytes: &'a [u8]) -> Option<&'a [u8]> {
        let member = bytes.get(usize::try_from(self.start).ok()?..)?;
        if !member.starts_with(b"PK\x03\x04") {
            return None;
        }
        let lead = 30 + usize::from(u16_at(member, 26)?) + usize::from(u16_at(member, 28)?);
        let length = usize::try_from(self.packed).ok()?;
        member.get(lead..)?.get(..length)
    }
}
