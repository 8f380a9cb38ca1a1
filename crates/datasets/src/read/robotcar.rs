//! Oxford RobotCar: INS and RTK poses, and visual odometry as relative poses, columns by header name.
//!
//! World: UTM north, east, down in metres. Body: forward, right, down. `R = Rz(yaw) Ry(pitch) Rx(roll)` in
//! radians, as in the data set's development kit (Maddern et al. 2017).

use std::collections::HashMap;
use std::path::Path;

use dose3_lie::{Pose, Rotation, Vector};

use super::collect::{Collector, euler_rotation, pose};
use super::guess;
use super::table::{Row, Separator, is_no_value, shorten};
use super::text::Text;
use crate::error::Place;
use crate::{
    Error, Format, LoadOptions, LostKind, ReadOption, Remark, RemarkKind, StampUnit, Trajectory,
};

const COMMA: Separator = Separator::Character(',');

/// Two turns: larger angles are degrees, not radians.
const LARGEST_ANGLE: f64 = 4.0 * std::f64::consts::PI;

pub(crate) fn read(path: &Path, bytes: &[u8], options: &LoadOptions) -> Result<Trajectory, Error> {
    let mut collector = Collector::new(path, options);
    collector.stamps_in(StampUnit::Microseconds);
    let text = Text::new(path, bytes, &mut collector.report)?;
    let mut lines = text.lines();
    let mut fields = Vec::new();
    let header = lines.next();
    if let Some(header) = &header {
        COMMA.split(header.text, &mut fields);
    }
    let columns = Columns::new(
        path,
        header.as_ref().map(|line| Row::new(path, line, &fields)),
    );
    let relative = columns.index.contains_key("source_timestamp");
    let reader = if relative {
        Reader::relative(&columns)?
    } else {
        Reader::absolute(&columns)?
    };
    let unit = options.stamp_unit.unwrap_or(StampUnit::Microseconds);
    let mut readings = Readings::default();
    for line in lines {
        COMMA.split(line.text, &mut fields);
        let row = Row::new(path, &line, &fields);
        if row.is_cut_off(columns.count, None) {
            collector.report.truncated_tail += 1;
            continue;
        }
        if row.len() != columns.count {
            let expected = format!("{} fields as in the header", columns.count);
            return Err(row.wrong_length(expected, "the line is cut off or two lines ran together"));
        }
        if !relative && reader.is_empty(&row) && collector.looks_for(LostKind::Nan) {
            let stamp = row.stamp(reader.stamps[0], unit).ok();
            collector.lose(row.place(), line.number as u64, stamp, LostKind::Nan)?;
            continue;
        }
        let stamp = row.stamp(reader.stamps[0], unit)?;
        let value = reader.pose(path, &row)?;
        if relative {
            let other = row.stamp(reader.stamps[1], unit)?;
            let stamps = [stamp.min(other), stamp.max(other)];
            chain(&mut collector, path, row.place(), stamps, value)?;
        } else {
            readings.take(reader.angles(path, &row)?, value);
            collector.push(row.place(), stamp, value)?;
        }
    }
    collector.report.remarks.extend(readings.remark());
    collector.finish(Format::RobotCar)
}

/// The first poses read as radians, as they must be, and as degrees.
#[derive(Default)]
struct Readings {
    positions: Vec<Vector>,
    radians: Vec<Rotation>,
    degrees: Vec<Rotation>,
}

impl Readings {
    fn take(&mut self, [roll, pitch, yaw]: [f64; 3], pose: Pose) {
        const ENOUGH: usize = 5000;
        if self.positions.len() < ENOUGH {
            self.positions.push(pose.translation);
            self.radians.push(pose.rotation);
            let [roll, pitch, yaw] = [roll, pitch, yaw].map(f64::to_radians);
            self.degrees.push(euler_rotation(roll, pitch, yaw));
        }
    }

    fn remark(&self) -> Option<Remark> {
        let ratio = guess::preference(&self.positions, &self.radians, &self.degrees);
        (ratio * guess::OVERRULED < 1.0).then(|| {
            let text = format!(
                "the angles are read as radians, but as degrees the body would move {:.0} times more evenly along its own axes: are they degrees?",
                1.0 / ratio
            );
            Remark::new(RemarkKind::ImplausibleAttitude, text).option(ReadOption::Columns)
        })
    }
}

/// Appends a relative pose: `T(later) = T(earlier) * relative`, as the development kit chains them, whichever
/// of source and destination is the later one.
fn chain(
    collector: &mut Collector<'_>,
    path: &Path,
    place: Place,
    [earlier, later]: [i64; 2],
    relative: Pose,
) -> Result<(), Error> {
    let start = match collector.last() {
        None => {
            collector.chained = true;
            collector.push(place, earlier, Pose::identity())?;
            Pose::identity()
        }
        Some((last, _)) if earlier < last => {
            let expected = format!("a motion that begins at or after {last} ns");
            let hint = "relative poses are chained in order of time; two runs in one file have to be cut apart";
            return Err(Error::input(
                path,
                place,
                expected,
                format!("{earlier} ns"),
                hint,
            ));
        }
        Some((last, pose)) => {
            if last < earlier {
                // The motion between is unknown. The position is carried on, but no window may see the joint.
                collector.report.chain_breaks += 1;
                collector.start_stretch();
                collector.push(place, earlier, pose)?;
            }
            pose
        }
    };
    collector.push(place, later, start.compose(&relative))
}

/// The header.
struct Columns<'a> {
    path: &'a Path,
    place: Place,
    header: String,
    index: HashMap<String, usize>,
    count: usize,
}

impl<'a> Columns<'a> {
    fn new(path: &'a Path, header: Option<Row<'_, '_>>) -> Self {
        let fields = header.map_or(&[][..], |row| row.fields());
        let mut index = HashMap::new();
        for (column, name) in fields.iter().enumerate() {
            index.entry(name.to_ascii_lowercase()).or_insert(column);
        }
        Self {
            path,
            place: header.map_or(Place::File, |row| row.place()),
            header: fields.join(","),
            index,
            count: fields.len(),
        }
    }

    fn find(&self, name: &str) -> Result<usize, Error> {
        self.index.get(name).copied().ok_or_else(|| {
            Error::input(
                self.path,
                self.place,
                format!("a header with the column `{name}`"),
                format!("`{}`", shorten(&self.header)),
                "RobotCar poses are in gps/ins.csv, gps/rtk.csv and vo/vo.csv; gps/gps.csv has no orientation",
            )
        })
    }
}

/// Where the numbers of a pose are.
struct Reader {
    stamps: [usize; 2],
    translation: [(usize, &'static str); 3],
    angles: [(usize, &'static str); 3],
}

impl Reader {
    fn absolute(columns: &Columns<'_>) -> Result<Self, Error> {
        let stamp = columns.find("timestamp")?;
        Self::new(columns, [stamp, stamp], ["northing", "easting", "down"])
    }

    fn relative(columns: &Columns<'_>) -> Result<Self, Error> {
        let stamps = [
            columns.find("source_timestamp")?,
            columns.find("destination_timestamp")?,
        ];
        Self::new(columns, stamps, ["x", "y", "z"])
    }

    fn new(
        columns: &Columns<'_>,
        stamps: [usize; 2],
        names: [&'static str; 3],
    ) -> Result<Self, Error> {
        let find = |name: &'static str| Ok::<_, Error>((columns.find(name)?, name));
        let [a, b, c] = names;
        Ok(Self {
            stamps,
            translation: [find(a)?, find(b)?, find(c)?],
            angles: [find("roll")?, find("pitch")?, find("yaw")?],
        })
    }

    /// True where a number of the pose is missing.
    fn is_empty(&self, row: &Row<'_, '_>) -> bool {
        let columns = self.translation.iter().chain(&self.angles);
        let mut fields = columns.filter_map(|(column, _)| row.fields().get(*column));
        fields.any(|field| is_no_value(field))
    }

    fn pose(&self, path: &Path, row: &Row<'_, '_>) -> Result<Pose, Error> {
        let mut translation = [0.0; 3];
        for (value, (column, name)) in translation.iter_mut().zip(self.translation) {
            *value = row.coordinate(column, name)?;
        }
        let [roll, pitch, yaw] = self.angles(path, row)?;
        Ok(pose(euler_rotation(roll, pitch, yaw), translation))
    }

    fn angles(&self, path: &Path, row: &Row<'_, '_>) -> Result<[f64; 3], Error> {
        let mut angle = [0.0; 3];
        for (value, (column, name)) in angle.iter_mut().zip(self.angles) {
            *value = row.number(column, name)?;
            if value.abs() > LARGEST_ANGLE {
                return Err(Error::input(
                    path,
                    row.place(),
                    format!("{name} in radians"),
                    value.to_string(),
                    "the angles look like degrees; RobotCar files hold radians",
                ));
            }
        }
        Ok(angle)
    }
}
