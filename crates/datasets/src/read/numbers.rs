//! Decimal stamps read exactly, without a detour through floating point.

/// Largest stamp in nanoseconds, about the year 2096: differences of two stamps then never overflow.
const LARGEST_STAMP: i128 = 4_000_000_000_000_000_000;

/// Why a text is not a stamp.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum StampFault {
    /// Not a decimal number.
    NotANumber,
    /// A number, but beyond the range of stamps: the unit is another one.
    OutOfRange,
}

/// Reads a decimal number (sign, digits, point, exponent) times `10^shift`, rounded to the nearest integer.
///
/// An f64 holds 1305031098.665912 s only to 0.2 microseconds, and two stamps may collapse into one; decimal
/// arithmetic keeps every digit.
pub(crate) fn decimal(text: &str, shift: i32) -> Result<i64, StampFault> {
    if let Some(value) = short_decimal(text.as_bytes(), shift) {
        return Ok(value);
    }
    let (negative, unsigned) = match text.as_bytes().first() {
        Some(b'-') => (true, &text[1..]),
        Some(b'+') => (false, &text[1..]),
        _ => (false, text),
    };
    let (mantissa, exponent) = match unsigned.find(['e', 'E']) {
        Some(at) => {
            let exponent: i32 = unsigned[at + 1..]
                .parse()
                .map_err(|_| StampFault::NotANumber)?;
            if exponent.abs() > 40 {
                return Err(StampFault::OutOfRange);
            }
            (&unsigned[..at], exponent)
        }
        None => (unsigned, 0),
    };
    let (whole, fraction) = mantissa.split_once('.').unwrap_or((mantissa, ""));
    let digits = whole.len() + fraction.len();
    if digits == 0
        || !whole
            .bytes()
            .chain(fraction.bytes())
            .all(|byte| byte.is_ascii_digit())
    {
        return Err(StampFault::NotANumber);
    }
    let mut value: i128 = 0;
    for digit in whole.bytes().chain(fraction.bytes()) {
        value = value.checked_mul(10).ok_or(StampFault::OutOfRange)? + i128::from(digit - b'0');
        if value > i128::MAX / 100 {
            return Err(StampFault::OutOfRange);
        }
    }
    let power = exponent + shift - fraction.len() as i32;
    if value != 0 && power > 0 {
        let factor = 10_i128
            .checked_pow(power.unsigned_abs())
            .ok_or(StampFault::OutOfRange)?;
        value = value.checked_mul(factor).ok_or(StampFault::OutOfRange)?;
    } else if power < 0 {
        value = match 10_i128.checked_pow(power.unsigned_abs()) {
            Some(divisor) => (value + divisor / 2) / divisor,
            None => 0,
        };
    }
    if value > LARGEST_STAMP {
        return Err(StampFault::OutOfRange);
    }
    Ok(if negative { -value } else { value } as i64)
}

/// The same for the numbers that files are full of: at most 18 digits, no exponent, nothing to round.
fn short_decimal(text: &[u8], shift: i32) -> Option<i64> {
    let (mut value, mut digits, mut after) = (0_i64, 0, None);
    for byte in text {
        match byte {
            b'0'..=b'9' => {
                value = 10 * value + i64::from(byte - b'0');
                digits += 1;
                if digits > 18 {
                    return None;
                }
            }
            b'.' if after.is_none() => after = Some(digits),
            _ => return None,
        }
    }
    let power = u32::try_from(shift - (digits - after.unwrap_or(digits))).ok()?;
    let value = value.checked_mul(10_i64.checked_pow(power)?)?;
    (digits > 0 && i128::from(value) <= LARGEST_STAMP).then_some(value)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn seconds_keep_every_digit() {
        assert_eq!(decimal("1305031098.6659", 9), Ok(1_305_031_098_665_900_000));
        assert_eq!(
            decimal("1305031098.665912345", 9),
            Ok(1_305_031_098_665_912_345)
        );
        assert_eq!(
            decimal("1.305031098665912345e+09", 9),
            Ok(1_305_031_098_665_912_345)
        );
        assert_eq!(decimal("1.037359e-01", 9), Ok(103_735_900));
        assert_eq!(decimal("-0.5", 9), Ok(-500_000_000));
        assert_eq!(decimal("+7", 9), Ok(7_000_000_000));
        assert_eq!(decimal(".25", 9), Ok(250_000_000));
    }

    #[test]
    fn the_short_way_agrees_with_the_long_one() {
        for text in [
            "0",
            "1600000000.1",
            "1600000000100000000",
            ".5",
            "5.",
            "12.000000001",
        ] {
            for shift in [0, 3, 6, 9] {
                let long = decimal(&format!("+{text}"), shift);
                assert_eq!(decimal(text, shift), long, "{text} {shift}");
            }
        }
    }

    #[test]
    fn below_a_nanosecond_it_rounds_to_nearest() {
        assert_eq!(decimal("0.0000000014", 9), Ok(1));
        assert_eq!(decimal("0.0000000015", 9), Ok(2));
        assert_eq!(decimal("1e-30", 9), Ok(0));
    }

    #[test]
    fn other_units_are_told_from_noise() {
        assert_eq!(
            decimal("1403715524907143168", 9),
            Err(StampFault::OutOfRange)
        );
        assert_eq!(
            decimal("1403715524907143168", 0),
            Ok(1_403_715_524_907_143_168)
        );
        assert_eq!(decimal("9e40", 9), Err(StampFault::OutOfRange));
        for text in [
            "",
            "-",
            ".",
            "nan",
            "inf",
            "1_000",
            "0x10",
            "1e",
            "1.2.3",
            "e5",
            "1e99999999999",
            "é",
        ] {
            assert_eq!(decimal(text, 9), Err(StampFault::NotANumber), "{text}");
        }
    }
}
