//! A file that says its own SHA-256, so that an altered byte is found wherever it is.
//!
//! The metadata has two entries: [`KEY`] with the digest, 64 hexadecimal digits, and [`MARK`], which says that there is
//! one. The digest is that of the whole file with zeros in its own place. It is no signature: who alters a file on
//! purpose can seal it again.

use crate::error::{Error, Result};
use dose3_datasets::hex;
use sha2::{Digest, Sha256};
use std::collections::BTreeMap;

/// Metadata entry with the digest.
pub const KEY: &str = "dose3.sha256";
/// Metadata entry of every sealed file: were the name of the other altered, this one still asks for it.
pub const MARK: &str = "dose3.sealed";

/// Hexadecimal digits of a digest.
const DIGITS: usize = 64;

/// The entries to put into the metadata before [`close`].
pub fn entries() -> [(&'static str, String); 2] {
    [(KEY, "0".repeat(DIGITS)), (MARK, "sha256".to_owned())]
}

/// Writes the digest of a file with [`entries`] into its place.
pub fn close(what: &'static str, mut bytes: Vec<u8>) -> Result<Vec<u8>> {
    let place = place(&bytes).ok_or_else(|| Error::unsound(what, "no place for its digest"))?;
    let digest = hex(Sha256::digest(&bytes));
    bytes[place..place + DIGITS].copy_from_slice(digest.as_bytes());
    Ok(bytes)
}

/// Checks the digest of a file and takes the entries out of its metadata. Files of before this existed have none;
/// `required` refuses those.
pub fn check(
    what: &'static str,
    bytes: &[u8],
    metadata: &mut BTreeMap<String, String>,
    required: bool,
) -> Result<()> {
    let said = metadata.remove(KEY);
    let marked = metadata.remove(MARK).is_some();
    if said.is_none() && !marked {
        return match required {
            false => Ok(()),
            true => Err(Error::unsound(
                what,
                "it does not say the digest of its content: it was altered, or an early build wrote it; make it again",
            )),
        };
    }
    let altered = || {
        Error::unsound(
            what,
            "its content is not what was written: it was altered or damaged; take another copy",
        )
    };
    let place = place(bytes).ok_or_else(altered)?;
    let mut hash = Sha256::new();
    hash.update(&bytes[..place]);
    hash.update([b'0'; DIGITS]);
    hash.update(&bytes[place + DIGITS..]);
    if said.is_none_or(|said| said != hex(hash.finalize())) {
        return Err(altered());
    }
    Ok(())
}

/// Whether a file says its own digest.
pub fn is_sealed(bytes: &[u8]) -> bool {
    place(bytes).is_some()
}

/// Where the digits stand: in the header of the safetensors file, JSON without blanks. In strings of the metadata the
/// quotes are escaped, so that no other text looks like this.
fn place(bytes: &[u8]) -> Option<usize> {
    let length = u64::from_le_bytes(bytes.get(..8)?.try_into().ok()?);
    let end = usize::try_from(length).ok()?.checked_add(8)?;
    let header = bytes.get(..end)?;
    let before = format!("\"{KEY}\":\"");
    let found = header
        .windows(before.len())
        .position(|window| window == before.as_bytes())?;
    let place = found + before.len();
    (place + DIGITS < end).then_some(place)
}
