//! What the names of a header say.

use super::Role;
use crate::StampUnit;

/// One name of a header, taken apart.
#[derive(Debug, Clone)]
pub(crate) struct Name {
    /// As in the file.
    pub text: String,
    /// Lower case, without the unit.
    pub plain: String,
    /// What stands in brackets, or after the last underscore of a stamp: `ns`, `rad`, `deg`.
    pub unit: Option<String>,
    tokens: Vec<String>,
}

/// Words before a name that say nothing of what it is.
const NOISE: [&str; 31] = [
    "field",
    "pose",
    "poses",
    "header",
    "transform",
    "msg",
    "message",
    "data",
    "odom",
    "odometry",
    "state",
    "gt",
    "ground",
    "truth",
    "groundtruth",
    "est",
    "world",
    "map",
    "base",
    "link",
    "body",
    "rs",
    "wb",
    "wc",
    "wi",
    "ws",
    "gw",
    "ref",
    "stamped",
    "g",
    "w",
];
/// Words that make a column something else than a pose.
const OTHER: [&str; 18] = [
    "twist",
    "vel",
    "velocity",
    "linear",
    "angular",
    "acc",
    "accel",
    "acceleration",
    "cov",
    "covariance",
    "bias",
    "gyro",
    "gravity",
    "omega",
    "v",
    "a",
    "angvel",
    "std",
];

/// Words of the name of a field at most, as in `pose.pose.position.x`.
const FIELD_WORDS: usize = 4;

impl Name {
    pub fn new(text: &str) -> Self {
        let trimmed = text
            .trim()
            .trim_start_matches(['#', '%'])
            .trim()
            .trim_matches('"');
        let lower = indices(&words(trimmed));
        let (mut plain, mut unit) = match lower.find(['[', '(']) {
            Some(at) => {
                let inner = lower[at + 1..].trim_end_matches([']', ')']).trim();
                (lower[..at].trim().to_owned(), Some(inner.to_owned()))
            }
            None => (lower, None),
        };
        unit = unit.filter(|unit| !unit.is_empty());
        if unit.is_none() {
            for suffix in [
                "_ns", "_us", "_ms", "_deg", "_rad", "_degrees", "_radians", "_s", "_mm", "_cm",
                "_m",
            ] {
                if let Some(rest) = plain.strip_suffix(suffix)
                    && (rest.len() > 1 || matches!(rest, "t" | "x" | "y" | "z"))
                {
                    unit = Some(suffix[1..].to_owned());
                    plain = rest.to_owned();
                    break;
                }
            }
        }
        let tokens = plain
            .split(|c: char| !c.is_ascii_alphanumeric())
            .filter(|token| !token.is_empty())
            .map(str::to_owned)
            .collect();
        Self {
            text: trimmed.to_owned(),
            plain,
            unit,
            tokens,
        }
    }

    /// Every way to take it as words before the name of a field, and that field alone; the fewest words first.
    pub fn parts(&self) -> impl Iterator<Item = (String, Self)> + '_ {
        let first = self.tokens.len().saturating_sub(FIELD_WORDS).max(1);
        (first..self.tokens.len()).map(|at| {
            let field = Self {
                text: self.text.clone(),
                plain: self.tokens[at..].join("_"),
                unit: self.unit.clone(),
                tokens: self.tokens[at..].to_vec(),
            };
            (self.tokens[..at].join(" "), field)
        })
    }

    /// The unit behind it, where that is one of stamps.
    fn stamp_unit(&self) -> Option<StampUnit> {
        stamp_unit(self.unit.as_deref()?)
    }

    /// The role that the name says, with a rank: of several columns for one role the lowest is taken.
    pub fn role(&self) -> Option<(Role, usize)> {
        let mut tokens: Vec<&str> = self.tokens.iter().map(String::as_str).collect();
        // `tx_world_device`: of the device in the world.
        if let [field, "world" | "odometry" | "odom" | "map", _] = tokens[..]
            && field.len() == 2
        {
            tokens.truncate(1);
        }
        let last = *tokens.last()?;
        let rest = &tokens[..tokens.len() - 1];
        let own: Vec<&str> = rest
            .iter()
            .copied()
            .filter(|token| !NOISE.contains(token))
            .collect();
        if let Some(found) = time_role(&tokens, last) {
            return Some(found);
        }
        // `time_boot_ms`.
        if matches!(tokens[0], "time" | "timestamp") && self.stamp_unit().is_some() {
            return Some((Role::Stamp, 4));
        }
        if rest.iter().any(|token| OTHER.contains(token)) {
            return None;
        }
        let base = own.join(" ");
        // EuRoC: `p_RS_R_x` is the position in the frame R.
        let base = base.strip_suffix(" r").unwrap_or(&base).to_owned();
        let position = |axis: char| "xyz".find(axis);
        let quaternion = |axis: char| "wxyz".find(axis);
        let only = |word: &str| {
            let mut characters = word.chars();
            characters.next().filter(|_| characters.next().is_none())
        };
        if let Some(axis) = only(last) {
            match base.as_str() {
                "" | "p" | "pos" | "position" | "t" | "trans" | "translation" | "tran" | "loc"
                | "location" | "point" | "xyz" => {
                    if let Some(axis) = position(axis) {
                        return Some((Role::Position(axis), rest.len().min(1)));
                    }
                }
                _ => {}
            }
            if matches!(
                base.as_str(),
                "q" | "quat"
                    | "quaternion"
                    | "orientation"
                    | "ori"
                    | "rot"
                    | "rotation"
                    | "att"
                    | "attitude"
                    | "r"
            ) && let Some(part) = quaternion(axis)
            {
                return Some((Role::Quaternion(part), 0));
            }
            if matches!(
                base.as_str(),
                "rotvec" | "rvec" | "rotation vector" | "rot vec" | "axis angle" | "axisangle"
            ) && let Some(axis) = position(axis)
            {
                return Some((Role::Vector(axis), 0));
            }
            if let Some(found) = tool_pose(&tokens) {
                return Some(found);
            }
        }
        if !own.is_empty()
            && !matches!(
                base.as_str(),
                "orientation"
                    | "rotation"
                    | "attitude"
                    | "euler"
                    | "rpy"
                    | "angle"
                    | "position"
                    | "pos"
            )
        {
            return None;
        }
        let found = match last {
            "tx" | "px" | "posx" | "positionx" | "easting" | "pn" => Role::Position(0),
            "ty" | "py" | "posy" | "positiony" | "northing" | "pe" => Role::Position(1),
            "tz" | "pz" | "posz" | "positionz" | "altitude" | "height" | "elevation" | "pd" => {
                Role::Position(2)
            }
            "qw" | "quatw" => Role::Quaternion(0),
            "qx" | "quatx" => Role::Quaternion(1),
            "qy" | "quaty" => Role::Quaternion(2),
            "qz" | "quatz" => Role::Quaternion(3),
            "roll" | "phi" => Role::Angle(0),
            "pitch" | "theta" => Role::Angle(1),
            "yaw" | "psi" => Role::Angle(2),
            "heading" | "azimuth" => return Some((Role::Angle(2), 1)),
            _ => {
                let digits = last
                    .strip_prefix(['r', 'm'])
                    .filter(|rest| rest.len() == 2)?;
                let entry: Vec<usize> = digits
                    .chars()
                    .filter_map(|c| c.to_digit(10))
                    .map(|d| d as usize)
                    .collect();
                // r11 to r33; r00 to r22 is told apart where the header has r00.
                return match entry[..] {
                    [row @ 1..=3, column @ 1..=3] => {
                        Some((Role::Matrix(3 * (row - 1) + column - 1), 1))
                    }
                    _ => None,
                };
            }
        };
        Some((found, 0))
    }
}

/// Stamps: the header's before the time of recording, whole ones before pairs of seconds and nanoseconds.
fn time_role(tokens: &[&str], last: &str) -> Option<(Role, usize)> {
    let stamp = tokens.contains(&"stamp") || tokens.contains(&"timestamp");
    let rank = usize::from(!tokens.contains(&"header"));
    // `time` is the stamp rather than `exposure_time`.
    let is_other = |token: &&str| !NOISE.contains(token);
    let others = usize::from(tokens[..tokens.len() - 1].iter().any(is_other));
    match last {
        "stamp" | "stamps" | "timestamp" | "timestamps" => {
            Some((Role::Stamp, rank * (1 + 2 * others)))
        }
        "time" | "times" | "gpstime" | "utime" | "unixtime" | "ts" => {
            Some((Role::Stamp, 2 + 2 * others))
        }
        "t" | "tow" | "sow" | "elapsed" if tokens.len() == 1 => Some((Role::Stamp, 2)),
        _ if !(stamp || tokens.len() == 1 || tokens[0] == "tv") => None,
        "secs" | "sec" | "seconds" => Some((Role::Seconds, rank)),
        "nsecs" | "nsec" | "nanosec" | "nanosecs" | "nanoseconds" => {
            Some((Role::Part(StampUnit::Nanoseconds), rank))
        }
        "usecs" | "usec" | "microsec" | "microsecs" | "microseconds" => {
            Some((Role::Part(StampUnit::Microseconds), rank))
        }
        "msecs" | "msec" | "millisec" | "millisecs" | "milliseconds" => {
            Some((Role::Part(StampUnit::Milliseconds), rank))
        }
        _ => None,
    }
}

/// A name in lower case, its words joined by underscores: `head_pos_x` of `HeadPosX`.
fn words(name: &str) -> String {
    let mut words = String::with_capacity(name.len());
    let mut before = ' ';
    for character in name.chars() {
        if before.is_ascii_lowercase() && character.is_ascii_uppercase() {
            words.push('_');
        }
        words.push(character.to_ascii_lowercase());
        before = character;
    }
    words
}

/// The entries of arrays that PX4 writes, `position[0]` to 2 and `q[0]` to 3 with w first, by the names of their axes.
fn indices(name: &str) -> String {
    let Some((array, index)) = name
        .strip_suffix(']')
        .and_then(|name| name.rsplit_once('['))
    else {
        return name.to_owned();
    };
    let axes = match array.rsplit(['.', '/', '_']).next() {
        Some("position" | "pos") => "xyz",
        Some("q") => "wxyz",
        _ => return name.to_owned(),
    };
    let axis = index
        .parse::<usize>()
        .ok()
        .and_then(|at| axes.chars().nth(at));
    axis.map_or_else(|| name.to_owned(), |axis| format!("{array}_{axis}"))
}

/// Universal Robots: `actual_TCP_pose_0` to 5 are position and rotation vector, as are those of `target_TCP_pose`.
fn tool_pose(tokens: &[&str]) -> Option<(Role, usize)> {
    let (rank, number) = match tokens {
        ["actual", "tcp", "pose", number] => (0, number),
        ["target", "tcp", "pose", number] => (1, number),
        _ => return None,
    };
    match number.parse() {
        Ok(axis @ 0..3) => Some((Role::Position(axis), rank)),
        Ok(axis @ 3..6) => Some((Role::Vector(axis - 3), rank)),
        _ => None,
    }
}

/// Whether a name of the third angle is that of a heading, which may be clockwise.
pub(crate) fn is_heading(name: &str) -> bool {
    let name = name.to_ascii_lowercase();
    name.contains("heading") || name.contains("azimuth")
}

/// Metres in the unit that a header writes behind a coordinate.
pub(crate) fn length_unit(unit: &str) -> Option<f64> {
    match unit.trim() {
        "m" | "meter" | "meters" | "metre" | "metres" => Some(1.0),
        "cm" | "centimeter" | "centimeters" | "centimetre" | "centimetres" => Some(0.01),
        "mm" | "millimeter" | "millimeters" | "millimetre" | "millimetres" => Some(0.001),
        "km" => Some(1000.0),
        "ft" | "foot" | "feet" => Some(0.3048),
        "in" | "inch" | "inches" => Some(0.0254),
        _ => None,
    }
}

/// The unit that a header writes behind a stamp.
pub(crate) fn stamp_unit(unit: &str) -> Option<StampUnit> {
    match unit.trim() {
        "s" | "sec" | "secs" | "second" | "seconds" => Some(StampUnit::Seconds),
        "ms" | "msec" | "millisecond" | "milliseconds" => Some(StampUnit::Milliseconds),
        "us" | "usec" | "\u{b5}s" | "\u{3bc}s" | "microsecond" | "microseconds" => {
            Some(StampUnit::Microseconds)
        }
        "ns" | "nsec" | "nanosecond" | "nanoseconds" => Some(StampUnit::Nanoseconds),
        _ => None,
    }
}

/// Roles by the names of a header: for each role the column that says it best, the first one of equals.
pub(crate) fn by_header(names: &[Name]) -> Vec<(Role, usize)> {
    let mut best: Vec<(Role, usize, usize)> = Vec::new();
    let zero_based = names
        .iter()
        .any(|name| matches!(name.plain.as_str(), "r00" | "m00"));
    for (column, name) in names.iter().enumerate() {
        let found = match matrix_from_zero(&name.plain).filter(|_| zero_based) {
            Some(entry) => Some((Role::Matrix(entry), 0)),
            None => name.role(),
        };
        let Some((role, rank)) = found else { continue };
        match best.iter_mut().find(|(known, _, _)| *known == role) {
            Some(known) if rank < known.1 => *known = (role, rank, column),
            Some(_) => {}
            None => best.push((role, rank, column)),
        }
    }
    let mut roles: Vec<(Role, usize)> = best
        .into_iter()
        .map(|(role, _, column)| (role, column))
        .collect();
    if !roles
        .iter()
        .any(|(role, _)| matches!(role, Role::Quaternion(_)))
    {
        roles.extend(unusual_quaternion(names));
        roles.extend(second_triple(names));
    }
    // In any language: a first column in a unit of time.
    let is_stamp = |name: &Name| name.text.contains(['[', '(']) && name.stamp_unit().is_some();
    if !roles.iter().any(|(role, _)| role.is_time()) && names.first().is_some_and(is_stamp) {
        roles.push((Role::Stamp, 0));
    }
    roles
}

/// `x, y, z, w` behind another `x, y, z`, as tools write it that turn messages into columns.
fn second_triple(names: &[Name]) -> Vec<(Role, usize)> {
    let plain: Vec<&str> = names.iter().map(|name| name.plain.as_str()).collect();
    let count = |wanted: &str| plain.iter().filter(|name| **name == wanted).count();
    let at = plain
        .windows(4)
        .position(|four| four == ["x", "y", "z", "w"]);
    match at {
        Some(at) if count("x") == 2 && count("w") == 1 && plain[..at].contains(&"x") => (0..4)
            .map(|part| (Role::Quaternion((part + 1) % 4), at + part))
            .collect(),
        _ => Vec::new(),
    }
}

/// Four columns that only together are a quaternion: `rx, ry, rz, rw` of Unity, `ox, oy, oz, ow` of ZED, `q0` to `q3` of
/// autopilots.
fn unusual_quaternion(names: &[Name]) -> Vec<(Role, usize)> {
    let known = [
        ["rw", "rx", "ry", "rz"],
        ["ow", "ox", "oy", "oz"],
        ["q0", "q1", "q2", "q3"],
        ["qr", "qi", "qj", "qk"],
    ];
    let column = |wanted: &str| {
        let is = |name: &Name| name.tokens.last().is_some_and(|last| last == wanted);
        names.iter().position(is)
    };
    let columns = known.into_iter().find_map(|four| {
        let columns: Option<Vec<usize>> = four.into_iter().map(column).collect();
        columns
    });
    let columns = columns.into_iter().flatten().enumerate();
    columns
        .map(|(part, column)| (Role::Quaternion(part), column))
        .collect()
}

fn matrix_from_zero(name: &str) -> Option<usize> {
    let digits = name
        .strip_prefix(['r', 'm'])
        .filter(|rest| rest.len() == 2)?;
    let mut digits = digits.chars().map(|c| c.to_digit(10).map(|d| d as usize));
    match (digits.next()??, digits.next()??) {
        (row @ 0..=2, column @ 0..=2) => Some(3 * row + column),
        _ => None,
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    fn roles(header: &str) -> Vec<(Role, usize)> {
        let names: Vec<Name> = header.split(',').map(Name::new).collect();
        let mut roles = by_header(&names);
        roles.sort_by_key(|(_, column)| *column);
        roles
    }

    pub fn pose(start: usize, order: [usize; 4]) -> Vec<(Role, usize)> {
        let position = (0..3).map(|axis| (Role::Position(axis), start + axis));
        let quaternion = order.into_iter().enumerate();
        position
            .chain(quaternion.map(|(at, part)| (Role::Quaternion(part), start + 3 + at)))
            .collect()
    }

    #[test]
    fn names_of_many_tools_are_understood() {
        let x_first = [1, 2, 3, 0];
        let w_first = [0, 1, 2, 3];
        for (header, start, order) in [
            ("# timestamp,tx,ty,tz,qw,qx,qy,qz", 1, w_first),
            (
                "#timestamp [ns],p_x [m],p_y [m],p_z [m],q_w,q_x,q_y,q_z",
                1,
                w_first,
            ),
            (
                "#timestamp, p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_w [], q_RS_x [], q_RS_y [], q_RS_z [], v_RS_R_x [m s^-1], b_w_RS_S_x [rad s^-1]",
                1,
                w_first,
            ),
            (
                "VehicleName,TimeStamp,POS_X,POS_Y,POS_Z,Q_W,Q_X,Q_Y,Q_Z,ImageFile",
                2,
                w_first,
            ),
            ("num,t,x,y,z,qx,qy,qz,qw", 2, x_first),
            (
                "time,pose.position.x,pose.position.y,pose.position.z,pose.orientation.x,pose.orientation.y,pose.orientation.z,pose.orientation.w,twist.linear.x",
                1,
                x_first,
            ),
            (
                "stamp,transform.translation.x,transform.translation.y,transform.translation.z,transform.rotation.x,transform.rotation.y,transform.rotation.z,transform.rotation.w",
                1,
                x_first,
            ),
        ] {
            let found: Vec<_> = roles(header)
                .into_iter()
                .filter(|(role, _)| *role != Role::Stamp)
                .collect();
            assert_eq!(found, pose(start, order), "{header}");
            assert!(
                roles(header).contains(&(Role::Stamp, start - 1)),
                "{header}"
            );
        }
        let echo = "%time,field.header.seq,field.header.stamp,field.pose.pose.position.x,field.twist.twist.linear.x";
        assert_eq!(roles(echo), [(Role::Stamp, 2), (Role::Position(0), 3)]);
        let boreas =
            "GPSTime,easting,northing,altitude,vel_east,vel_north,roll,pitch,heading,angvel_z";
        assert_eq!(
            roles(boreas)[4..],
            [
                (Role::Angle(0), 6),
                (Role::Angle(1), 7),
                (Role::Angle(2), 8)
            ]
        );
        assert_eq!(
            roles("sec,nsec,x")[..2],
            [(Role::Seconds, 0), (Role::Part(StampUnit::Nanoseconds), 1)]
        );
        let unit = Name::new("stamp_us").unit;
        assert_eq!(
            unit.as_deref().and_then(stamp_unit),
            Some(StampUnit::Microseconds)
        );
    }
}
