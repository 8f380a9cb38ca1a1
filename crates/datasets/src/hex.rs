//! Bytes as text.

use std::fmt::Write;

/// Lower-case hexadecimal digits, two a byte: how digests are written everywhere.
///
/// ```
/// assert_eq!(dose3_datasets::hex(&[0, 0xa5, 255]), "00a5ff");
/// ```
pub fn hex(bytes: impl AsRef<[u8]>) -> String {
    let mut text = String::new();
    for byte in bytes.as_ref() {
        // Writing to a String cannot fail.
        let _ = write!(text, "{byte:02x}");
    }
    text
}
