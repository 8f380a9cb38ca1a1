//! Numbers and verdicts as people say them.

use dose3::Report;
use dose3::Verdict;
use dose3::report::Place;

/// A chance in digits that people read: `0.43`, `0.0012`, `3e-7`.
pub fn chance(p: f64) -> String {
    match p {
        p if p >= 0.0095 => format!("{p:.2}"),
        p if p >= 0.000_095 => format!("{p:.4}"),
        p => format!("{p:.0e}"),
    }
}

/// A chance as a share of cases: `41 in 100`, `1 in 820`, `less than 1 in a billion`.
pub fn odds(p: f64) -> String {
    match p {
        p if p >= 0.0995 => format!("{:.0} in 100", 100.0 * p),
        p if p >= 1e-9 => format!("1 in {}", two_digits_with_spaces(1.0 / p)),
        _ => "less than 1 in a billion".to_owned(),
    }
}

/// A number to two digits, its thousands apart: `1 200 000`.
fn two_digits_with_spaces(value: f64) -> String {
    let unit = 10_f64.powf((value.log10().floor() - 1.0).max(0.0));
    grouped(((value / unit).round() * unit) as u64)
}

/// A count, its thousands apart.
pub fn grouped(count: u64) -> String {
    let digits = count.to_string();
    let mut out = String::new();
    for (i, c) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            // A space that no line breaks at.
            out.push('\u{a0}');
        }
        out.push(c);
    }
    out
}

/// `12.4 s`, `3 min 20 s`, `1 h 02 min`.
pub fn duration(seconds: f64) -> String {
    match seconds {
        s if s < 99.95 => format!("{s:.1} s"),
        s if s < 3599.5 => {
            let whole = s.round() as u64;
            format!("{} min {:02} s", whole / 60, whole % 60)
        }
        s => {
            let minutes = (s / 60.0).round() as u64;
            format!("{} h {:02} min", minutes / 60, minutes % 60)
        }
    }
}

/// `820 m`, `12.3 km`, `0.45 m`.
pub fn distance(metres: f64) -> String {
    match metres {
        m if m >= 9995.0 => format!("{:.1} km", m / 1000.0),
        m if m >= 99.5 => format!("{m:.0} m"),
        m if m >= 9.95 => format!("{m:.1} m"),
        m => format!("{m:.2} m"),
    }
}

/// The verdict, and what it says in a sentence.
pub fn verdict(report: &Report) -> (&'static str, String) {
    let groups = report.evidence.basis.groups;
    let trusted = match groups {
        1 => "the one trusted log".to_owned(),
        n => format!("the {n} trusted logs"),
    };
    match report.verdict {
        Verdict::InDistribution => ("in distribution", format!("This log is like {trusted}.")),
        Verdict::OutOfDistribution => (
            "out of distribution",
            format!("This log is not like {trusted}."),
        ),
        Verdict::Like => (
            "like the trusted log",
            format!("This log is like {trusted}."),
        ),
        Verdict::Unlike => (
            "unlike the trusted log",
            format!("This log is not like {trusted}."),
        ),
    }
}

/// Rows of the file as it counts them: `lines 501 to 520`.
pub fn rows(report: &Report, place: &Place) -> String {
    let kind = report.log.row_kind;
    match (place.first_row, place.last_row) {
        (first, last) if first == last => format!("{kind} {first}"),
        (first, last) => format!("{kind}s {first} to {last}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn chances_and_counts() {
        assert_eq!(odds(0.41), "41 in 100");
        assert_eq!(odds(0.05), "1 in 20");
        assert_eq!(odds(1.0 / 1234.0), "1 in 1\u{a0}200");
        assert_eq!(odds(2e-15), "less than 1 in a billion");
        assert_eq!(
            (chance(0.41), chance(2e-15)),
            ("0.41".into(), "2e-15".into())
        );
        assert_eq!(grouped(1_234_567), "1\u{a0}234\u{a0}567");
        assert_eq!((grouped(0), grouped(999)), ("0".into(), "999".into()));
    }

    #[test]
    fn durations_and_distances() {
        assert_eq!(duration(99.94), "99.9 s");
        assert_eq!(duration(200.2), "3 min 20 s");
        assert_eq!(duration(3725.0), "1 h 02 min");
        assert_eq!(distance(12_345.0), "12.3 km");
        assert_eq!(
            (distance(0.449), distance(45.0)),
            ("0.45 m".into(), "45.0 m".into())
        );
    }
}
