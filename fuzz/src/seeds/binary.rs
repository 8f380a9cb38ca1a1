//! Arrays, flight logs, poses as words.

use super::logs;
use dose3_datasets::write;

fn array(descr: &str, shape: &str, content: &[u8]) -> Vec<u8> {
    let mut header = format!("{{'descr': {descr}, 'fortran_order': False, 'shape': {shape}, }}");
    while (header.len() + 11) % 64 != 0 {
        header.push(' ');
    }
    header.push('\n');
    let length = (header.len() as u16).to_le_bytes();
    [
        b"\x93NUMPY\x01\x00",
        &length[..],
        header.as_bytes(),
        content,
    ]
    .concat()
}

/// Arrays of matrices, of positions with quaternions, and of the same as records.
pub fn npy() -> Vec<Vec<u8>> {
    let log = &logs()[0];
    let count = log.len();
    let matrices: Vec<u8> = log
        .poses
        .iter()
        .flat_map(|pose| {
            pose.rotation
                .to_homogeneous()
                .append_translation(&pose.translation)
                .transpose()
                .iter()
                .copied()
                .collect::<Vec<f64>>()
        })
        .flat_map(f64::to_le_bytes)
        .collect();
    let rows: Vec<u8> = log
        .poses
        .iter()
        .zip(&log.stamps)
        .flat_map(|(pose, stamp)| {
            let q = dose3_lie::nalgebra::UnitQuaternion::from_rotation_matrix(&pose.rotation);
            let t = pose.translation;
            [*stamp as f64 * 1e-9, t.x, t.y, t.z, q.i, q.j, q.k, q.w]
        })
        .flat_map(|value| (value as f32).to_le_bytes())
        .collect();
    vec![
        array("'<f8'", &format!("({count}, 4, 4)"), &matrices),
        array("'<f4'", &format!("({count}, 8)"), &rows),
        array(
            "[('t', '<f4'), ('position', '<f4', (3,)), ('q', [('x', '<f4'), ('y', '<f4'), ('z', '<f4'), ('w', '<f4')])]",
            &format!("({count},)"),
            &rows,
        ),
    ]
}

/// A zip file of arrays, none of them packed.
pub fn zip(members: &[(&str, &[u8])]) -> Vec<u8> {
    let (mut out, mut list) = (Vec::new(), Vec::new());
    for (name, content) in members {
        let mut crc = flate2::Crc::new();
        crc.update(content);
        let size = (content.len() as u32).to_le_bytes();
        let fields = [
            &[0; 8][..],
            &crc.sum().to_le_bytes(),
            &size,
            &size,
            &(name.len() as u16).to_le_bytes(),
        ]
        .concat();
        list.extend(b"PK\x01\x02\x14\0\x14\0");
        list.extend(&fields);
        list.extend([0; 12]);
        list.extend((out.len() as u32).to_le_bytes());
        list.extend(name.as_bytes());
        out.extend(b"PK\x03\x04\x14\0");
        out.extend(&fields);
        out.extend([0; 2]);
        out.extend(name.as_bytes());
        out.extend(*content);
    }
    let (at, count) = (out.len() as u32, members.len() as u16);
    out.extend(&list);
    out.extend(b"PK\x05\x06\0\0\0\0");
    out.extend([count.to_le_bytes(); 2].concat());
    out.extend((list.len() as u32).to_le_bytes());
    out.extend(at.to_le_bytes());
    out.extend([0, 0]);
    out
}

/// Arrays side by side, one behind the other: matrices and stamps; positions, quaternions and dates.
pub fn arrays() -> Vec<Vec<u8>> {
    let log = &logs()[0];
    let n = log.len();
    let floats = |shape: &str, values: Vec<f64>| {
        let bytes: Vec<u8> = values.into_iter().flat_map(f64::to_le_bytes).collect();
        array("'<f8'", &format!("({n}{shape})"), &bytes)
    };
    let stamps: Vec<u8> = log
        .stamps
        .iter()
        .flat_map(|stamp| stamp.to_le_bytes())
        .collect();
    let positions = log
        .poses
        .iter()
        .flat_map(|pose| pose.translation.iter().copied().collect::<Vec<_>>());
    let quaternions = log.poses.iter().flat_map(|pose| {
        let q = dose3_lie::nalgebra::UnitQuaternion::from_rotation_matrix(&pose.rotation);
        [q.i, q.j, q.k, q.w]
    });
    vec![
        [
            &b"\0\x01"[..],
            &npy()[0],
            &array("'<i8'", &format!("({n},)"), &stamps),
        ]
        .concat(),
        [
            &b"\x02\x03\x01"[..],
            &floats(", 3", positions.collect()),
            &floats(", 4", quaternions.collect()),
            &array("'<M8[ns]'", &format!("({n},)"), &stamps),
        ]
        .concat(),
    ]
}

/// Names of arrays, chosen by the bytes before them.
const NAMES: [&str; 6] = [
    "poses.npy",
    "timestamps.npy",
    "positions.npy",
    "quaternions.npy",
    "R.npy",
    "t_us.npy",
];

/// The zip file of the arrays in some bytes, each of which begins with its magic number; those before the first choose names.
pub fn zip_of(bytes: &[u8]) -> Vec<u8> {
    let magic = b"\x93NUMPY";
    let starts: Vec<usize> = (0..bytes.len())
        .filter(|at| bytes[*at..].starts_with(magic))
        .collect();
    let ends = starts.iter().skip(1).copied().chain([bytes.len()]);
    let names = &bytes[..starts.first().copied().unwrap_or(0)];
    let members = starts
        .iter()
        .zip(ends)
        .take(8)
        .enumerate()
        .map(|(index, (start, end))| {
            let choice = names.get(index).copied().unwrap_or(index as u8);
            (
                NAMES[usize::from(choice) % NAMES.len()],
                &bytes[*start..end],
            )
        });
    zip(&members.collect::<Vec<_>>())
}

/// The same as zip files.
pub fn npz() -> Vec<Vec<u8>> {
    arrays().iter().map(|bytes| zip_of(bytes)).collect()
}

/// One 4x4 array after another.
pub fn iros20() -> Vec<Vec<u8>> {
    [write::Precision::Single, write::Precision::Double]
        .map(|precision| {
            let mut bytes = Vec::new();
            write::iros20(&mut bytes, &logs()[0], precision)
                .unwrap_or_else(|error| panic!("{error}"));
            bytes
        })
        .to_vec()
}

/// A flight log with attitude and position.
pub fn ulog() -> Vec<Vec<u8>> {
    let mut bytes = b"ULog\x01\x12\x35\x01".to_vec();
    bytes.extend(77_u64.to_le_bytes());
    let record = |bytes: &mut Vec<u8>, kind: u8, content: &[u8]| {
        bytes.extend((content.len() as u16).to_le_bytes());
        bytes.push(kind);
        bytes.extend(content);
    };
    record(&mut bytes, b'B', &[0; 40]);
    record(&mut bytes, b'F', b"vehicle_odometry:uint64_t timestamp;uint64_t timestamp_sample;uint8_t pose_frame;uint8_t[7] _padding0;float[3] position;float[4] q;");
    record(
        &mut bytes,
        b'F',
        b"vehicle_attitude:uint64_t timestamp;float[4] q;",
    );
    record(&mut bytes, b'A', b"\x00\x01\x00vehicle_odometry");
    record(&mut bytes, b'A', b"\x00\x02\x00vehicle_attitude");
    for (index, pose) in logs()[1].poses.iter().enumerate() {
        let q = dose3_lie::nalgebra::UnitQuaternion::from_rotation_matrix(&pose.rotation);
        let t = pose.translation;
        let stamp = (1_000_000 + 50_000 * index as u64).to_le_bytes();
        let numbers = |values: &[f64]| {
            values
                .iter()
                .flat_map(|v| (*v as f32).to_le_bytes())
                .collect::<Vec<u8>>()
        };
        let quaternion = numbers(&[q.w, q.i, q.j, q.k]);
        let odometry = [
            &1_u16.to_le_bytes()[..],
            &stamp,
            &stamp,
            &[1; 8],
            &numbers(&[t.x, t.y, t.z]),
            &quaternion,
        ]
        .concat();
        record(&mut bytes, b'D', &odometry);
        record(
            &mut bytes,
            b'D',
            &[&2_u16.to_le_bytes()[..], &stamp, &quaternion].concat(),
        );
    }
    vec![bytes]
}

/// Poses as words: a stamp and the twelve numbers of a 3x4 matrix.
pub fn poses() -> Vec<Vec<u8>> {
    logs()
        .iter()
        .map(|log| {
            log.poses
                .iter()
                .zip(&log.stamps)
                .flat_map(|(pose, stamp)| {
                    let r = pose.rotation.matrix();
                    let t = pose.translation;
                    let rows = (0..3).flat_map(|i| [r[(i, 0)], r[(i, 1)], r[(i, 2)], t[i]]);
                    let words: Vec<u8> = rows.flat_map(f64::to_le_bytes).collect();
                    [stamp.to_le_bytes().to_vec(), words].concat()
                })
                .collect()
        })
        .collect()
}
