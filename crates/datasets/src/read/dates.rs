//! Stamps written as dates.

use super::numbers::decimal;

/// Nanoseconds since 1970 of a date with a time of day as ISO 8601 and RFC 3339 write it, `2023-11-14T22:13:20.123456Z`, with a
/// blank for the `T`, and with an offset from UTC or without one, which counts as UTC. `None` for anything else, and for times
/// before 1970 or after 2096.
pub(crate) fn nanoseconds(text: &str) -> Option<i64> {
    let bytes = text.as_bytes();
    let [
        y @ ..,
        b'-',
        m1,
        m2,
        b'-',
        d1,
        d2,
        b'T' | b't' | b' ',
        h1,
        h2,
        b':',
        n1,
        n2,
        b':',
    ] = bytes.get(..17)?
    else {
        return None;
    };
    let two = |a: &u8, b: &u8| {
        let digit = |byte: &u8| byte.is_ascii_digit().then(|| i64::from(byte - b'0'));
        Some(10 * digit(a)? + digit(b)?)
    };
    let year = 100 * two(y.first()?, y.get(1)?)? + two(y.get(2)?, y.get(3)?)?;
    let (month, day) = (two(m1, m2)?, two(d1, d2)?);
    let (hour, minute) = (two(h1, h2)?, two(n1, n2)?);
    let rest = text.get(17..)?;
    let end = rest
        .find(|c: char| !(c.is_ascii_digit() || c == '.'))
        .unwrap_or(rest.len());
    let (seconds, zone) = rest.split_at(end);
    let whole = seconds.find('.').unwrap_or(seconds.len());
    let in_day = hour < 24 && minute < 60;
    if year < 1970 || !(1..=12).contains(&month) || day < 1 || day > days_in(year, month) || !in_day
    {
        return None;
    }
    if whole != 2 || seconds.ends_with('.') {
        return None;
    }
    let seconds = decimal(seconds, 9).ok()?;
    // A leap second is the last one of a minute of 61.
    if seconds >= 61_000_000_000 {
        return None;
    }
    let minutes = (days_before(year, month) + day - 1) * 1440 + hour * 60 + minute - offset(zone)?;
    let nanoseconds = minutes.checked_mul(60_000_000_000)?.checked_add(seconds)?;
    (0..=super::numbers::LARGEST_STAMP as i64)
        .contains(&nanoseconds)
        .then_some(nanoseconds)
}

/// Minutes by which a clock with this zone is ahead of UTC.
fn offset(zone: &str) -> Option<i64> {
    let zone = zone.trim();
    if matches!(zone, "" | "Z" | "z" | "UTC" | " UTC") {
        return Some(0);
    }
    let (sign, digits) = match zone.split_at_checked(1)? {
        ("+", digits) => (1, digits),
        ("-", digits) => (-1, digits),
        _ => return None,
    };
    let digits: String = digits.split(':').collect();
    if !matches!(digits.len(), 2 | 4) || !digits.bytes().all(|byte| byte.is_ascii_digit()) {
        return None;
    }
    let hours: i64 = digits[..2].parse().ok()?;
    let minutes: i64 = digits.get(2..4).unwrap_or("0").parse().unwrap_or(0);
    (hours < 24 && minutes < 60).then_some(sign * (60 * hours + minutes))
}

fn is_leap(year: i64) -> bool {
    year % 4 == 0 && (year % 100 != 0 || year % 400 == 0)
}

fn days_in(year: i64, month: i64) -> i64 {
    match month {
        2 => 28 + i64::from(is_leap(year)),
        4 | 6 | 9 | 11 => 30,
        _ => 31,
    }
}

/// Days from the beginning of 1970 to that of a month of a year since then.
fn days_before(year: i64, month: i64) -> i64 {
    let leaps = |year: i64| year / 4 - year / 100 + year / 400;
    let years = 365 * (year - 1970) + leaps(year - 1) - leaps(1969);
    years + (1..month).map(|month| days_in(year, month)).sum::<i64>()
}

#[cfg(test)]
mod tests {
    use super::nanoseconds;

    #[test]
    fn dates_are_nanoseconds_since_1970() {
        for (text, wanted) in [
            ("1970-01-01T00:00:00Z", 0),
            ("2023-11-14T22:13:20Z", 1_700_000_000_000_000_000),
            ("2023-11-14 22:13:20", 1_700_000_000_000_000_000),
            (
                "2023-11-14T23:13:20.123456789+01:00",
                1_700_000_000_123_456_789,
            ),
            ("2023-11-14 16:43:20.5-0530", 1_700_000_000_500_000_000),
            ("2023-11-14T14:13:20-08", 1_700_000_000_000_000_000),
            ("2024-02-29T00:00:00.000001Z", 1_709_164_800_000_001_000),
            ("2000-02-29t00:00:00z", 951_782_400_000_000_000),
            ("2016-12-31T23:59:60Z", 1_483_228_800_000_000_000),
        ] {
            assert_eq!(nanoseconds(text), Some(wanted), "{text}");
        }
    }

    #[test]
    fn what_is_no_date_is_none() {
        for text in [
            "",
            "1700000000.5",
            "2023-11-14",
            "2023-11-14T22:13",
            "2023-11-14T22:13:2",
            "2023-11-14T22:13:20.",
            "2023-11-14T22:13:20X",
            "2023-11-14T22:13:20+1",
            "2023-11-14T22:13:20+25:00",
            "2023-13-14T22:13:20Z",
            "2023-02-29T22:13:20Z",
            "2023-11-00T22:13:20Z",
            "2023-11-14T24:13:20Z",
            "2023-11-14T22:60:20Z",
            "2023-11-14T22:13:61Z",
            "1969-12-31T23:59:59Z",
            "2199-01-01T00:00:00Z",
            "2023/11/14T22:13:20Z",
            "é023-11-14T22:13:20Z",
            "2023-11-14T22:13:20é",
        ] {
            assert_eq!(nanoseconds(text), None, "{text}");
        }
    }
}
