//! Protocol Buffers as they are written (<https://protobuf.dev/programming-guides/encoding>).

/// A message in the making. Fields are written with their numbers.
#[derive(Debug, Default)]
pub struct Wire(Vec<u8>);

impl Wire {
    /// The message as it is so far.
    pub fn bytes(self) -> Vec<u8> {
        self.0
    }

    pub fn double(mut self, number: u32, value: f64) -> Self {
        self.tag(number, 1);
        self.0.extend(value.to_le_bytes());
        self
    }

    /// A whole number of any type that is not `sint` or `fixed`; of a negative one its two's complement.
    pub fn whole(mut self, number: u32, value: u64) -> Self {
        self.tag(number, 0);
        self.varint(value);
        self
    }

    pub fn text(self, number: u32, value: &str) -> Self {
        self.block(number, value.as_bytes())
    }

    pub fn message(self, number: u32, value: Self) -> Self {
        self.block(number, &value.0)
    }

    /// The same field once for each message.
    pub fn messages(self, number: u32, values: impl IntoIterator<Item = Self>) -> Self {
        let add = |wire: Self, value| wire.message(number, value);
        values.into_iter().fold(self, add)
    }

    fn block(mut self, number: u32, bytes: &[u8]) -> Self {
        self.tag(number, 2);
        self.varint(bytes.len() as u64);
        self.0.extend(bytes);
        self
    }

    fn tag(&mut self, number: u32, kind: u32) {
        self.varint(u64::from(number << 3 | kind));
    }

    fn varint(&mut self, mut value: u64) {
        while value >= 0x80 {
            self.0.push(value as u8 | 0x80);
            value >>= 7;
        }
        self.0.push(value as u8);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_examples_of_the_specification() {
        assert_eq!(Wire::default().whole(1, 150).bytes(), [0x08, 0x96, 0x01]);
        let text = Wire::default().text(2, "testing").bytes();
        assert_eq!(text, [0x12, 0x07, 0x74, 0x65, 0x73, 0x74, 0x69, 0x6e, 0x67]);
        let inner = Wire::default().whole(1, 150);
        let outer = Wire::default().message(3, inner).bytes();
        assert_eq!(outer, [0x1a, 0x03, 0x08, 0x96, 0x01]);
        let double = Wire::default().double(1, 1.0).bytes();
        assert_eq!(double, [0x09, 0, 0, 0, 0, 0, 0, 0xf0, 0x3f]);
        let minus_one = Wire::default().whole(1, (-1_i64) as u64).bytes();
        assert_eq!(minus_one.len(), 11);
    }
}
