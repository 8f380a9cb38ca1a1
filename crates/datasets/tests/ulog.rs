//! Flight logs of PX4: the right poses from every topic that holds some, and no panic on damage.

use dose3_datasets::{
    Error, Format, Frame, LoadOptions, LostKind, RateSource, ReadOption, RemarkKind, RowKind,
    Trajectory, load_bytes, load_several_bytes,
};

const SYNC: [u8; 8] = [0x2f, 0x73, 0x13, 0x20, 0x25, 0x0c, 0xbb, 0x12];

/// Writes a log record by record.
struct Writer(Vec<u8>);

impl Writer {
    fn new() -> Self {
        let mut bytes = b"ULog\x01\x12\x35\x01".to_vec();
        bytes.extend(77_u64.to_le_bytes());
        let mut writer = Self(bytes);
        writer.record(b'B', &[0; 40]);
        writer
    }

    fn record(&mut self, kind: u8, content: &[u8]) {
        self.0.extend((content.len() as u16).to_le_bytes());
        self.0.push(kind);
        self.0.extend(content);
    }

    fn format(&mut self, text: &str) {
        self.record(b'F', text.as_bytes());
    }

    fn subscribe(&mut self, instance: u8, id: u16, name: &str) {
        let content = [&[instance][..], &id.to_le_bytes(), name.as_bytes()].concat();
        self.record(b'A', &content);
    }

    fn data(&mut self, id: u16, stamp: u64, parts: &[&[u8]]) {
        let mut content = [&id.to_le_bytes()[..], &stamp.to_le_bytes()].concat();
        parts.iter().for_each(|part| content.extend(*part));
        self.record(b'D', &content);
    }
}

fn floats(values: &[f64]) -> Vec<u8> {
    let values = values.iter();
    values
        .flat_map(|value| (*value as f32).to_le_bytes())
        .collect()
}

/// Position, north-east-down, and w, x, y, z of a flight that yaws by 0.02 a step; all but the yaw exact in f32.
fn truth(index: usize) -> ([f64; 3], [f64; 4]) {
    let half = 0.01 * index as f64;
    (
        [0.25 * index as f64, -1.5, -30.0],
        [half.cos(), 0.0, 0.0, half.sin()],
    )
}

fn stamp(index: usize) -> u64 {
    5_000_000 + 20_000 * index as u64
}

const ODOMETRY: &str = "vehicle_odometry:uint64_t timestamp;uint64_t timestamp_sample;uint8_t pose_frame;tag_s[2] tags;\
    float[3] position;float[4] q;uint8_t[3] _padding0;";

/// A log with `vehicle_odometry` as of PX4 1.14, with a format within it.
fn odometry(count: usize, each: impl Fn(&mut Writer, usize)) -> Vec<u8> {
    let mut writer = Writer::new();
    writer.format(ODOMETRY);
    writer.format("tag_s:uint8_t a;int16_t b;");
    writer.record(b'I', b"\x0achar[3] sysPX4");
    writer.subscribe(1, 4, "vehicle_odometry");
    writer.subscribe(0, 3, "vehicle_odometry");
    for index in 0..count {
        each(&mut writer, index);
        let (p, q) = truth(index);
        let head = [&stamp(index).to_le_bytes()[..], &[1], &[9; 6]].concat();
        writer.data(3, stamp(index), &[&head, &floats(&p), &floats(&q)]);
        writer.data(4, stamp(index), &[&head, &floats(&[0.0; 3]), &floats(&q)]);
    }
    writer.0
}

fn read(bytes: &[u8]) -> Result<Trajectory, Error> {
    load_bytes("flight.ulg", bytes, &LoadOptions::default())
}

fn topic(name: &str) -> LoadOptions {
    LoadOptions {
        topics: vec![name.to_owned()],
        ..LoadOptions::default()
    }
}

fn check(log: &Trajectory, angle: f64) {
    for (pose, row) in log.poses.iter().zip(&log.rows) {
        let index = *row as usize;
        let (p, _) = truth(index);
        assert_eq!(pose.translation.as_slice(), p);
        let (roll, pitch, yaw) = pose.rotation.euler_angles();
        assert!(roll.abs() < 1e-9 && pitch.abs() < 1e-9);
        assert!(
            (yaw - 0.02 * index as f64).abs() < angle,
            "{yaw} at {index}"
        );
    }
}

fn remarked(log: &Trajectory, kind: RemarkKind) -> String {
    let remarks = log
        .report
        .remarks
        .iter()
        .filter(|remark| remark.kind == kind);
    remarks.map(|remark| remark.text.clone() + "\n").collect()
}

#[test]
fn odometry_of_the_first_instance_is_read() {
    let log = read(&odometry(30, |_, _| {})).unwrap();
    assert_eq!((log.name.as_str(), log.len()), ("flight", 30));
    assert_eq!((log.format, log.frame), (Format::Ulog, Frame::BodyFrd));
    assert_eq!(
        (log.row_kind, log.rate.source),
        (RowKind::Message, RateSource::Stamps)
    );
    assert!((log.rate.hertz - 50.0).abs() < 1e-9);
    assert_eq!(log.stamps[29], 5_580_000_000);
    check(&log, 1e-6);
    assert!(remarked(&log, RemarkKind::Columns).contains("topic vehicle_odometry"));
    assert_eq!(remarked(&log, RemarkKind::DamagedRecording), "");
}

/// Local positions at 50 Hz beside attitudes at 40 Hz, with visual odometry in the older form.
fn estimator() -> Vec<u8> {
    let mut writer = Writer::new();
    writer
        .format("vehicle_local_position:uint64_t timestamp;bool xy_valid;float x;float y;float z;");
    writer.format("vehicle_attitude:uint64_t timestamp;float[4] q;");
    writer.format("vehicle_visual_odometry:uint64_t timestamp;float x;float y;float z;float[4] q;");
    writer.format("battery_status:uint64_t timestamp;float voltage_v;");
    let names = [
        "vehicle_local_position",
        "vehicle_attitude",
        "vehicle_visual_odometry",
        "battery_status",
    ];
    for (id, name) in names.iter().enumerate() {
        writer.subscribe(0, id as u16, name);
    }
    for index in 0..50 {
        let (p, q) = truth(index);
        writer.data(0, stamp(index), &[&[u8::from(index != 7)], &floats(&p)]);
        writer.data(3, stamp(index), &[&floats(&[16.2])]);
        if index < 20 {
            writer.data(2, stamp(index), &[&floats(&p), &floats(&q)]);
        }
    }
    for index in 0..39 {
        let half = 0.0125 * index as f64;
        let q = floats(&[half.cos(), 0.0, 0.0, half.sin()]);
        writer.data(1, 5_000_000 + 25_000 * index, &[&q]);
    }
    writer.0
}

#[test]
fn positions_are_joined_with_attitudes_on_the_geodesic() {
    let log = read(&estimator()).unwrap();
    // The last attitude is at 0.95 s, the positions go on to 0.98 s; message 7 is not valid.
    let rows: Vec<u64> = (0..48).filter(|row| *row != 7).collect();
    assert_eq!(log.rows, rows);
    check(&log, 1e-6);
    let said = remarked(&log, RemarkKind::Columns);
    for words in [
        "vehicle_attitude at its stamps",
        "also vehicle_visual_odometry",
        "2 position(s) left out",
    ] {
        assert!(said.contains(words), "{said}");
    }
    let lost = &log.report.lost[0];
    assert_eq!(
        (lost.kind, lost.first_row, lost.rows, lost.before),
        (LostKind::Nan, 7, 1, 7)
    );
    assert_eq!(log.breaks, [7]);
}

#[test]
fn topics_are_chosen_by_name() {
    let bytes = estimator();
    let log = load_bytes("flight.ulg", &bytes, &topic("/vehicle_visual_odometry")).unwrap();
    assert_eq!(log.len(), 20);
    check(&log, 1e-6);
    let mut both = topic("vehicle_local_position");
    both.topics.push("vehicle_visual_odometry".to_owned());
    let logs = load_several_bytes("flight.ulg", &bytes, &both).unwrap();
    let names: Vec<(&str, usize)> = logs
        .iter()
        .map(|log| (log.name.as_str(), log.len()))
        .collect();
    assert_eq!(
        names,
        [
            ("flight:vehicle_local_position", 47),
            ("flight:vehicle_visual_odometry", 20)
        ]
    );
    for name in ["battery_status", "vehicle_attitude", "vehicle_odometry"] {
        let fault = load_bytes("flight.ulg", &bytes, &topic(name)).unwrap_err();
        assert_eq!(fault.read_option(), Some(ReadOption::Topic));
        assert!(
            fault
                .to_string()
                .contains("vehicle_local_position, vehicle_visual"),
            "{fault}"
        );
    }
}

#[test]
fn dropouts_that_cost_messages_start_a_stretch() {
    let mut bytes = odometry(12, |writer, index| {
        if index == 3 {
            writer.record(b'O', &6_u16.to_le_bytes());
        }
    });
    let late = odometry(20, |_, _| {});
    let one = (late.len() - odometry(0, |_, _| {}).len()) / 20;
    let mut writer = Writer(std::mem::take(&mut bytes));
    writer.record(b'O', &90_u16.to_le_bytes());
    writer.0.extend(&late[late.len() - 3 * one..]);
    let log = read(&writer.0).unwrap();
    assert_eq!((log.len(), &log.breaks[..]), (15, &[12][..]));
    assert_eq!(log.stamps[12], 5_340_000_000);
    let said = remarked(&log, RemarkKind::DamagedRecording);
    assert!(
        said.contains("2 dropout(s) of the logger, 96 ms") && said.contains("at 1 of them"),
        "{said}"
    );
}

#[test]
fn damage_is_passed_over_and_said() {
    let whole = odometry(30, |writer, index| {
        if index == 15 {
            writer.record(b'S', &SYNC);
        }
    });
    let cut = read(&whole[..whole.len() - 70]).unwrap();
    assert_eq!(cut.len(), 29);
    assert!(remarked(&cut, RemarkKind::DamagedRecording).contains("ends within a record"));
    // A hole of zeros between messages 10 and the mark before message 15.
    let (start, end) = (odometry(10, |_, _| {}).len(), odometry(15, |_, _| {}).len());
    let mut hole = whole.clone();
    hole[start..end].fill(0);
    let log = read(&hole).unwrap();
    assert_eq!((log.len(), log.stamps[10]), (25, 5_300_000_000));
    assert!(
        remarked(&log, RemarkKind::DamagedRecording)
            .contains(&format!("no record at byte {start}"))
    );
    let mut newer = whole.clone();
    newer[16 + 3 + 9] = 1;
    let fault = read(&newer).unwrap_err().to_string();
    assert!(
        fault.contains("features that this reader does not know"),
        "{fault}"
    );
}

#[test]
fn data_appended_behind_a_cut_record_are_read() {
    let whole = odometry(30, |_, _| {});
    let start = odometry(12, |_, _| {}).len();
    // Message 12 is cut off after 20 bytes; the log goes on with message 13.
    let next = odometry(13, |_, _| {}).len();
    let mut bytes = [&whole[..start + 20], &whole[next..]].concat();
    bytes[16 + 3 + 8] = 1;
    bytes[16 + 3 + 16..16 + 3 + 24].copy_from_slice(&(start as u64 + 20).to_le_bytes());
    let log = read(&bytes).unwrap();
    assert_eq!((log.len(), log.stamps[12]), (29, 5_260_000_000));
    assert_eq!(remarked(&log, RemarkKind::DamagedRecording), "");
}

#[test]
fn damaged_logs_never_panic() {
    use rand::{RngExt, SeedableRng};
    let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(1);
    for bytes in [odometry(12, |_, _| {}), estimator()] {
        for _ in 0..1500 {
            let mut damaged = bytes.clone();
            for _ in 0..rng.random_range(1..4) {
                let reach = if rng.random() { 500 } else { bytes.len() };
                let at = rng.random_range(0..reach);
                damaged[at] = if rng.random() { rng.random() } else { 0xff };
            }
            if rng.random() {
                damaged.truncate(rng.random_range(0..bytes.len()));
            }
            if let Ok(log) = read(&damaged) {
                assert!(log.len() >= 2 && log.stamps.windows(2).all(|pair| pair[0] < pair[1]));
            }
        }
    }
    // Formats that hold themselves or are larger than memory.
    for format in [
        "vehicle_odometry:vehicle_odometry q;",
        "vehicle_odometry:uint64_t[99999999999999999] a;float[4] q;",
    ] {
        let mut writer = Writer::new();
        writer.format(format);
        writer.subscribe(0, 0, "vehicle_odometry");
        writer.data(0, 5, &[]);
        assert!(read(&writer.0).is_err());
    }
}
