//! Arrays, flight logs, poses as words.

use super::logs;
use dose3_datasets::write;

fn array(kind: &str, shape: &str, content: &[u8]) -> Vec<u8> {
    let mut header = format!("{{'descr': '{kind}', 'fortran_order': False, 'shape': {shape}, }}");
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

/// Arrays of matrices and of positions with quaternions.
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
        array("<f8", &format!("({count}, 4, 4)"), &matrices),
        array("<f4", &format!("({count}, 8)"), &rows),
    ]
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
