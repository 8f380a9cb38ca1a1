//! What the KITTI odometry ground truth is, to the last bit.
//!
//! The authors publish no checksum of their archive, so the pose files in it are pinned instead:
//! a repacked archive with the same poses is as good as the first one.

use dose3_datasets::hex;
use sha2::{Digest, Sha256};

/// One pose file and what it must hash to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PoseFile<'a> {
    /// File name without folder, such as `00.txt`.
    pub name: &'a str,
    /// SHA-256 of the content, 64 lower-case hexadecimal digits.
    pub sha256: &'a str,
}

/// The eleven sequences with public ground truth (00 to 10; 23,201 poses in all).
#[rustfmt::skip]
pub const KITTI: [PoseFile<'static>; 11] = [
    PoseFile { name: "00.txt", sha256: "90791a4113df979b149fa9e1104e960ea59f525a8318a202dbb6aec1a3d88793" },
    PoseFile { name: "01.txt", sha256: "099889e883d91525934a575db9fbec66f7239f09217f575a4e823d8ab7dd22d8" },
    PoseFile { name: "02.txt", sha256: "8e6c37071db06dfc31db9c2f354bfeb4bb23d1fa2ab28937cb27dae03dc49812" },
    PoseFile { name: "03.txt", sha256: "5475332c7e90cd6b0f9f948efff69e747dbba81d006efed4298f3d31b5773b67" },
    PoseFile { name: "04.txt", sha256: "4e1e0a630543706d76904b45f6ee2dbfa8b03b6e4319d6fc268ef302062806e1" },
    PoseFile { name: "05.txt", sha256: "56420ca617a1eb446b2955d187ba4af2912af54a8b458de0602ab3636b43f297" },
    PoseFile { name: "06.txt", sha256: "823a613b515dbfaaac0ed2942cf866154cc16edf7fbf2edbea57c70828b27a59" },
    PoseFile { name: "07.txt", sha256: "7eb020916003a09a6b9c2744748eaadef54b96f6df22ee703a05a1d19bfe913a" },
    PoseFile { name: "08.txt", sha256: "cd7177170c7d7ba98cdbfe9417f97bd9586da5c70cbd5ccefa5db6bf88a5fe88" },
    PoseFile { name: "09.txt", sha256: "e29c10964d558536e225e052f386723a515ad574b6ce14b91a86c94e5ad94014" },
    PoseFile { name: "10.txt", sha256: "b29cfbc423220a7bc163ef53d0e0a362f8206f006eb2db690d8b48795327380e" },
];

/// SHA-256 as 64 lower-case hexadecimal digits.
///
/// ```
/// let empty = xtask::fetch::checksums::sha256(b"");
/// assert!(empty.starts_with("e3b0c44298fc1c14"));
/// ```
pub fn sha256(content: &[u8]) -> String {
    hex(Sha256::digest(content))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn table_holds_eleven_different_digests_in_order() {
        for (sequence, file) in KITTI.iter().enumerate() {
            assert_eq!(file.name, format!("{sequence:02}.txt"));
            assert_eq!(file.sha256.len(), 64);
            assert!(
                file.sha256
                    .bytes()
                    .all(|c| matches!(c, b'0'..=b'9' | b'a'..=b'f'))
            );
            assert!(
                KITTI[..sequence]
                    .iter()
                    .all(|other| other.sha256 != file.sha256)
            );
        }
    }
}
