//! Lines of poses: TUM or JSON.

use dose3_datasets::StampUnit;
use serde::Deserialize;
use serde_json::{Number, Value};

/// Longest line that is read, bytes.
pub const LONGEST: usize = 1 << 16;

/// A pose as a line has it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Line {
    /// Nanoseconds.
    pub stamp_ns: i64,
    /// x, y, z, metres.
    pub position: [f64; 3],
    /// x, y, z, w.
    pub orientation: [f64; 4],
}

#[derive(Deserialize)]
struct Object {
    stamp_ns: Option<i64>,
    #[serde(alias = "t", alias = "timestamp")]
    stamp: Option<Value>,
    #[serde(alias = "p", alias = "translation")]
    position: Vector,
    #[serde(alias = "q", alias = "rotation")]
    orientation: Vector,
}

/// `[x, y, z, w]` or `{"x": .., "y": ..}`; NaN and infinity are null in JSON.
#[derive(Deserialize)]
#[serde(untagged)]
enum Vector {
    List(Vec<Option<f64>>),
    Named {
        x: Option<f64>,
        y: Option<f64>,
        z: Option<f64>,
        w: Option<f64>,
    },
}

impl Vector {
    fn numbers<const N: usize>(self) -> Option<[f64; N]> {
        let list = match self {
            Self::List(list) => list,
            Self::Named { x, y, z, w } if N == 4 => vec![x, y, z, w],
            Self::Named { x, y, z, .. } => vec![x, y, z],
        };
        let numbers: Vec<f64> = list.into_iter().map(|x| x.unwrap_or(f64::NAN)).collect();
        numbers.try_into().ok()
    }
}

/// The pose of a line; `None` for an empty line or a comment.
///
/// # Errors
/// What was expected in its place.
pub fn parse(line: &str, unit: StampUnit) -> Result<Option<Line>, String> {
    if line.len() > LONGEST {
        return Err(format!("longer than {LONGEST} bytes"));
    }
    let line = line.trim();
    if line.is_empty() || line.starts_with('#') {
        return Ok(None);
    }
    match line.starts_with('{') {
        true => json(line, unit),
        false => text(line, unit),
    }
    .map(Some)
}

fn text(line: &str, unit: StampUnit) -> Result<Line, String> {
    let separators = |c: char| c.is_whitespace() || c == ',' || c == ';';
    let words: Vec<&str> = line.split(separators).filter(|w| !w.is_empty()).collect();
    if words.len() != 8 {
        let found = words.len();
        return Err(format!(
            "{found} numbers, expected 8: stamp x y z qx qy qz qw"
        ));
    }
    let mut numbers = [0.0; 7];
    for (number, word) in numbers.iter_mut().zip(&words[1..]) {
        *number = word.parse().map_err(|_| format!("{word:?} is no number"))?;
    }
    let [x, y, z, qx, qy, qz, qw] = numbers;
    Ok(Line {
        stamp_ns: stamp(words[0], unit)?,
        position: [x, y, z],
        orientation: [qx, qy, qz, qw],
    })
}

fn json(line: &str, unit: StampUnit) -> Result<Line, String> {
    let object: Object = serde_json::from_str(line).map_err(|error| error.to_string())?;
    let stamp_ns = match (object.stamp_ns, object.stamp) {
        (Some(stamp), _) => stamp,
        (None, Some(Value::Number(number))) => stamp(&decimal(&number), unit)?,
        (None, Some(Value::String(text))) => stamp(&text, unit)?,
        (None, _) => return Err("no `stamp_ns`, and no `stamp` that is a number".into()),
    };
    Ok(Line {
        stamp_ns,
        position: object.position.numbers().ok_or("a position is x, y, z")?,
        orientation: object
            .orientation
            .numbers()
            .ok_or("an orientation is x, y, z, w")?,
    })
}

/// The shortest decimal that is this number: what its writer wrote, up to 17 digits.
fn decimal(number: &Number) -> String {
    number.to_string()
}

fn stamp(text: &str, unit: StampUnit) -> Result<i64, String> {
    let expected = || format!("{text:?} is no stamp in {}", unit.symbol());
    unit.parse_stamp(text).ok_or_else(expected)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(line: &str) -> Result<Option<Line>, String> {
        parse(line, StampUnit::Seconds)
    }

    #[test]
    fn both_kinds_of_lines_say_the_same() {
        let tum = of("1305031098.665912 1 2 -3.5 0 0 0.6 0.8")
            .unwrap()
            .unwrap();
        assert_eq!(tum.stamp_ns, 1_305_031_098_665_912_000);
        assert_eq!(tum.position, [1.0, 2.0, -3.5]);
        assert_eq!(tum.orientation, [0.0, 0.0, 0.6, 0.8]);
        for line in [
            r#"{"stamp": 1305031098.665912, "position": [1, 2, -3.5], "orientation": [0, 0, 0.6, 0.8]}"#,
            r#"{"t": "1305031098.665912", "p": [1, 2, -3.5], "q": [0, 0, 0.6, 0.8], "more": 1}"#,
            r#"{"stamp_ns": 1305031098665912000, "position": {"x": 1, "y": 2, "z": -3.5},
                "orientation": {"x": 0, "y": 0, "z": 0.6, "w": 0.8}}"#,
            "1305031098.665912,1,2,-3.5,0,0,0.6,0.8",
        ] {
            assert_eq!(of(line).unwrap().unwrap(), tum, "{line}");
        }
        assert_eq!(of("# stamp x y z").unwrap(), None);
        assert_eq!(of("  ").unwrap(), None);
        // NaN is a pose that the stream refuses, not a line that cannot be read.
        assert!(of("1 nan 2 3 0 0 0 1").unwrap().unwrap().position[0].is_nan());
        let null = r#"{"t": 1, "p": [null, 2, 3], "q": [0, 0, 0, 1]}"#;
        assert!(of(null).unwrap().unwrap().position[0].is_nan());
    }

    #[test]
    fn what_is_no_pose_is_said() {
        for (line, expected) in [
            ("1 2 3", "expected 8"),
            ("x 1 2 3 0 0 0 1", "no stamp"),
            ("1 2 3 4 0 0 zero 1", "no number"),
            ("{\"stamp\": 1}", "position"),
            ("{\"p\": [1, 2, 3], \"q\": [0, 0, 0, 1]}", "stamp"),
            ("{\"t\": 1, \"p\": [1, 2], \"q\": [0, 0, 0, 1]}", "x, y, z"),
            ("{", "EOF"),
            (&" ".repeat(LONGEST + 1), "longer than"),
        ] {
            let error = of(line).unwrap_err();
            assert!(error.contains(expected), "{line}: {error}");
        }
    }
}
