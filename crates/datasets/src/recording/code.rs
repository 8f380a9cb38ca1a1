//! Codes of the records of MCAP.

pub const MAGIC: &[u8] = b"\x89MCAP0\r\n";
pub const HEADER: u8 = 0x01;
pub const FOOTER: u8 = 0x02;
pub const SCHEMA: u8 = 0x03;
pub const CHANNEL: u8 = 0x04;
pub const MESSAGE: u8 = 0x05;
pub const CHUNK: u8 = 0x06;
pub const MESSAGE_INDEX: u8 = 0x07;
pub const CHUNK_INDEX: u8 = 0x08;
pub const STATISTICS: u8 = 0x0b;
pub const METADATA: u8 = 0x0c;
pub const METADATA_INDEX: u8 = 0x0d;
pub const SUMMARY_OFFSET: u8 = 0x0e;
pub const DATA_END: u8 = 0x0f;
