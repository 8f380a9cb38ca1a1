//! Lines of plain numbers, taken apart and read in one pass over their bytes.
//!
//! What is not plain (words, quotes, missing values, comments, blank lines) is left to the general way, which reads the
//! same numbers to the last bit.

use super::super::numbers::{Digits, decimal};
use super::super::table::Separator;

/// Numbers of a line at most; longer ones go the general way.
const MOST: usize = 48;

/// The numbers of one line.
pub(super) struct Numbers<'a> {
    text: &'a str,
    found: [Field; MOST],
    count: usize,
}

/// One number and where it stands.
#[derive(Clone, Copy, Default)]
struct Field {
    digits: Digits,
    start: usize,
    end: usize,
}

impl<'a> Numbers<'a> {
    pub fn new() -> Self {
        Self {
            text: "",
            found: [Field::default(); MOST],
            count: 0,
        }
    }

    /// Takes the first line of a text apart; the place behind its line end, `None` where it is not plain.
    pub fn take(&mut self, text: &'a str, separator: Separator) -> Option<usize> {
        self.text = text;
        self.count = 0;
        let bytes = text.as_bytes();
        let between = match separator {
            Separator::Blanks => None,
            Separator::Character(character) => Some(u8::try_from(character).ok()?),
        };
        // A tab is a blank, unless it separates.
        let blank = |byte: u8| byte == b' ' || byte == b'\t' && between != Some(b'\t');
        let skip = |mut at: usize| {
            while at < bytes.len() && blank(bytes[at]) {
                at += 1;
            }
            at
        };
        let mut at = skip(0);
        loop {
            let (digits, end) = Digits::read(bytes, at)?;
            let field = self.found.get_mut(self.count)?;
            *field = Field {
                digits,
                start: at,
                end,
            };
            self.count += 1;
            at = skip(end);
            match bytes.get(at) {
                None => return Some(at),
                Some(b'\n') => return Some(at + 1),
                Some(b'\r') => {
                    return match bytes.get(at + 1) {
                        Some(b'\n') => Some(at + 2),
                        _ => None,
                    };
                }
                Some(byte) if between == Some(*byte) => at = skip(at + 1),
                Some(_) if between.is_none() && at > end => {}
                Some(_) => return None,
            }
        }
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        self.count
    }

    /// The finite number in a column.
    pub fn get(&self, column: usize) -> Option<f64> {
        let field = self.found[..self.count].get(column)?;
        let value = match field.digits.value() {
            Some(value) => value,
            None => self.written(field).parse().ok()?,
        };
        value.is_finite().then_some(value)
    }

    /// The number in a column times `10^shift`, rounded to the nearest integer.
    pub fn stamp(&self, column: usize, shift: i32) -> Option<i64> {
        let field = self.found[..self.count].get(column)?;
        field
            .digits
            .whole(shift)
            .or_else(|| decimal(self.written(field), shift).ok())
    }

    fn written(&self, field: &Field) -> &'a str {
        &self.text[field.start..field.end]
    }
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};

    use super::*;
    use crate::read::numbers::float;

    /// Texts that the two ways must read alike.
    fn texts() -> Vec<String> {
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(11);
        let mut texts = [
            "0",
            "-0.0",
            "+1.5",
            ".5",
            "5.",
            "1e22",
            "1e+23",
            "-1E-22",
            "9007199254740993",
            "00000000000000000001.5",
            "123456789012345678901234567890",
            "1600000000.123456789",
            "1e-400",
            "-7",
            "1.000000000000000000e+00",
        ]
        .map(str::to_owned)
        .to_vec();
        for _ in 0..5000 {
            let value: f64 = rng.random_range(-1e5..1e5);
            texts.push(format!("{value:.9}"));
            texts.push(format!("{value}"));
            texts.push(format!("{value:.18e}"));
            texts.push(
                format!("{:e}", f64::from_bits(rng.random()))
                    .replace("NaN", "1")
                    .replace("inf", "1"),
            );
        }
        texts
    }

    #[test]
    fn numbers_and_stamps_are_those_of_the_general_way() {
        let texts = texts();
        for (separator, between) in [
            (Separator::Blanks, " "),
            (Separator::Blanks, "\t  "),
            (Separator::Character(','), ","),
            (Separator::Character(';'), " ; "),
            (Separator::Character('\t'), "\t"),
        ] {
            for row in texts.chunks(8) {
                for end in ["", "\n1 2", "\r\n", " \n"] {
                    let line = format!("{}{end}", row.join(between));
                    let mut numbers = Numbers::new();
                    let rest = numbers.take(&line, separator).expect("plain");
                    assert_eq!(&line[rest..], if end == "\n1 2" { "1 2" } else { "" });
                    assert_eq!(numbers.len(), row.len());
                    for (column, text) in row.iter().enumerate() {
                        let bits =
                            |value: Option<f64>| value.filter(|v| v.is_finite()).map(f64::to_bits);
                        assert_eq!(bits(numbers.get(column)), bits(float(text)), "{text}");
                        for shift in [0, 3, 9] {
                            assert_eq!(
                                numbers.stamp(column, shift),
                                decimal(text, shift).ok(),
                                "{text}"
                            );
                        }
                    }
                }
            }
        }
    }

    #[test]
    fn what_is_not_plain_is_left() {
        let mut numbers = Numbers::new();
        let blanks = [
            "", "\n", "# 1", "1 nan", "1 2a", "1,2", "1 - 2", "1 2\r3", "1e 2", "\u{a0}1", "1 . 2",
            "--1", "1e5.2",
        ];
        for text in blanks {
            assert_eq!(numbers.take(text, Separator::Blanks), None, "{text:?}");
        }
        for text in ["1,,2", "1 2,3", "\"1\",2", ",1", "1,"] {
            assert_eq!(
                numbers.take(text, Separator::Character(',')),
                None,
                "{text:?}"
            );
        }
        assert_eq!(
            numbers.take(&"1 ".repeat(MOST + 1), Separator::Blanks),
            None
        );
    }
}
