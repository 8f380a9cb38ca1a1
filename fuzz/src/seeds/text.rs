//! Logs in text.

use super::logs;
use dose3_datasets::{Trajectory, write};
use std::fmt::Write as _;

fn written(writer: impl Fn(&mut Vec<u8>, &Trajectory) -> std::io::Result<()>) -> Vec<Vec<u8>> {
    logs()
        .iter()
        .map(|log| {
            let mut bytes = Vec::new();
            writer(&mut bytes, log).unwrap_or_else(|error| panic!("{error}"));
            bytes
        })
        .collect()
}

/// Twelve numbers a line.
pub fn kitti() -> Vec<Vec<u8>> {
    written(write::kitti)
}

/// Stamp, position, quaternion.
pub fn tum() -> Vec<Vec<u8>> {
    written(write::tum)
}

/// Nanoseconds, position, quaternion with w first.
pub fn euroc() -> Vec<Vec<u8>> {
    written(write::euroc)
}

/// The two tables of RobotCar.
pub fn robotcar() -> Vec<Vec<u8>> {
    [written(write::robotcar_ins), written(write::robotcar_vo)].concat()
}

/// Lines made of the numbers of a pose: stamp, x, y, z, qx, qy, qz, qw.
fn lines(head: &str, line: impl Fn(usize, &[f64; 7]) -> String) -> Vec<u8> {
    let mut text = head.to_owned();
    for (index, pose) in logs()[0].poses.iter().enumerate() {
        let q = dose3_lie::nalgebra::UnitQuaternion::from_rotation_matrix(&pose.rotation);
        let [x, y, z] = pose.translation.into();
        let _ = writeln!(text, "{}", line(index, &[x, y, z, q.i, q.j, q.k, q.w]));
    }
    text.into_bytes()
}

/// Tables with names, separators, units and orders of their own.
pub fn csv() -> Vec<Vec<u8>> {
    vec![
        lines(
            "timestamp [ns],pos_x,pos_y,pos_z,q_w,q_x,q_y,q_z\n",
            |i, [x, y, z, a, b, c, w]| {
                format!(
                    "{},{x},{y},{z},{w},{a},{b},{c}",
                    1_600_000_000_000_000_000_u64 + 100_000_000 * i as u64
                )
            },
        ),
        lines("time;x;y;z;roll;pitch;yaw\n", |i, [x, y, z, ..]| {
            format!(
                "{};{x:.6};{y:.6};{z:.6};0.01;-0.02;{}",
                i as f64 * 0.1,
                0.03 * i as f64
            )
        }),
        lines(
            "run,sec,nsec,x,y,z,qx,qy,qz,qw\n",
            |i, [x, y, z, a, b, c, w]| {
                format!(
                    "{},{},{},{x},{y},{z},{a},{b},{c},{w}",
                    ["a", "b"][i / 12],
                    i / 10,
                    i % 10 * 100_000_000
                )
            },
        ),
        lines("", |i, [x, y, z, a, b, c, w]| {
            format!(
                "{} {x} {y} {z} {a} {b} {c} {w} 0.1 0 0 0 0 0",
                i as f64 * 0.05
            )
        }),
        lines(
            "t\tx\ty\tz\tqw\tqx\tqy\tqz\n",
            |i, [x, y, z, a, b, c, w]| {
                let line = format!("{}\t{x}\t{y}\t{z}\t{w}\t{a}\t{b}\t{c}", i as f64 * 0.1);
                line.replace('.', ",")
            },
        ),
        lines(
            "__time,/odom/pose/position/x,/odom/pose/position/y,/odom/pose/position/z,/odom/pose/orientation/x,/odom/pose/orientation/y,/odom/pose/orientation/z,/odom/pose/orientation/w,/imu/angle\n",
            |i, [x, y, z, a, b, c, w]| {
                let time = i as f64 * 0.1;
                format!("{time},{x},{y},{z},{a},{b},{c},{w},\n{time},,,,,,,,1")
            },
        ),
        lines(
            "Format Version,1.23,Rotation Type,Quaternion,Length Units,Millimeters\n\n,Type,Rigid Body,Rigid Body,Rigid Body,Rigid Body,Rigid Body,Rigid Body,Rigid Body\n,Name,a,a,a,a,a,a,a\n,,Rotation,Rotation,Rotation,Rotation,Position,Position,Position\nFrame,Time (Seconds),X,Y,Z,W,X,Y,Z\n",
            |i, [x, y, z, a, b, c, w]| {
                format!("{i},{},{a},{b},{c},{w},{x},{y},{z}", 0.1 * i as f64)
            },
        ),
        lines(
            "t,gt_x,gt_y,gt_z,gt_qx,gt_qy,gt_qz,gt_qw,note\n[ms],[cm],[cm],[cm],[],[],[],[],\n",
            |i, [x, y, z, a, b, c, w]| format!("{},{x},{y},{z},{a},{b},{c},{w},\"a, b\"", 100 * i),
        ),
        lines("", |i, [x, y, z, a, b, c, w]| {
            format!("2020-09-13T12:26:{:02}.5Z,{x},{y},{z},{a},{b},{c},{w},", i)
        }),
    ]
}

/// Messages as ROS prints them.
pub fn echo() -> Vec<Vec<u8>> {
    let poses = lines("", |i, [x, y, z, a, b, c, w]| {
        format!(
            "header:\n  stamp:\n    sec: 7\n    nanosec: {}\npose:\n  position:\n    x: {x}\n    y: {y}\n    z: {z}\n  orientation:\n    x: {a}\n    y: {b}\n    z: {c}\n    w: {w}\n  covariance:\n  - 0.0\n---",
            10_000_000 * i
        )
    });
    let transforms = lines("", |i, [x, y, z, a, b, c, w]| {
        let child = ["base", "camera"][i % 2];
        format!(
            "transforms:\n- header:\n    stamp:\n      sec: {i}\n      nanosec: 0\n    frame_id: odom\n  child_frame_id: {child}\n  transform:\n    translation:\n      x: {x}\n      y: {y}\n      z: {z}\n    rotation:\n      x: {a}\n      y: {b}\n      z: {c}\n      w: {w}\n---"
        )
    });
    vec![poses, transforms]
}

/// JSON of many shapes: a list of objects, an object a line, lists side by side, matrices under numbers.
pub fn json() -> Vec<Vec<u8>> {
    let poses: Vec<serde_json::Value> = (0..12)
        .map(|i| {
            let pose = &logs()[0].poses[i];
            let q = dose3_lie::nalgebra::UnitQuaternion::from_rotation_matrix(&pose.rotation);
            let p: [f64; 3] = pose.translation.into();
            serde_json::json!({"stamp": 0.1 * i as f64, "position": p, "orientation": [q.i, q.j, q.k, q.w]})
        })
        .collect();
    let column = |name: &str| {
        poses
            .iter()
            .map(|pose| pose[name].clone())
            .collect::<Vec<_>>()
    };
    let matrices: serde_json::Map<String, serde_json::Value> = (0..12)
        .map(|i| (format!("{i}"), serde_json::json!({"transform": matrix(i)})))
        .collect();
    let side_by_side = serde_json::json!({"t": column("stamp"), "pos": column("position"), "rotation": column("orientation")});
    let lines: Vec<String> = poses.iter().map(ToString::to_string).collect();
    vec![
        serde_json::json!({"track": {"poses": poses}}).to_string(),
        lines.join("\n").replacen("[0.0,", "[NaN,", 1),
        side_by_side.to_string(),
        serde_json::Value::Object(matrices).to_string(),
    ]
    .into_iter()
    .map(String::into_bytes)
    .collect()
}

/// A first line that chooses columns, and a table.
pub fn columns() -> Vec<Vec<u8>> {
    [
        "t,x,y,z,qw,qx,qy,qz",
        "1,2,3,4,5,6,7,8",
        "x=2,y=3,z=4,yaw=8",
        "sec=2,nsec=3,x=x,y=y,z=z,qx=7,qy=8,qz=9,qw=10;run",
    ]
    .iter()
    .zip(csv())
    .map(|(words, table)| [words.as_bytes(), b"\n", &table].concat())
    .collect()
}

/// A pose graph.
pub fn g2o() -> Vec<Vec<u8>> {
    let graph = lines("FIX 0\n", |i, [x, y, z, a, b, c, w]| {
        format!(
            "VERTEX_SE3:QUAT {i} {x} {y} {z} {a} {b} {c} {w}\nEDGE_SE3:QUAT {i} {} 1 0 0 0 0 0 1 1 0 0",
            i + 1
        )
    });
    let flat = lines("", |i, [x, y, ..]| {
        format!("VERTEX_SE2 {i} {x} {y} {}", 0.02 * i as f64)
    });
    vec![graph, flat]
}

/// Two lines an image.
pub fn colmap() -> Vec<Vec<u8>> {
    let head = "# Image list with two lines of data per image:\n#   IMAGE_ID, QW, QX, QY, QZ, TX, TY, TZ, CAMERA_ID, NAME\n";
    vec![lines(head, |i, [x, y, z, a, b, c, w]| {
        format!(
            "{} {w} {a} {b} {c} {x} {y} {z} 1 frame{i:05}.png\n1.0 2.0 -1",
            i + 1
        )
    })]
}

fn matrix(index: usize) -> [[f64; 4]; 4] {
    let pose = &logs()[0].poses[index];
    let r = pose.rotation.matrix();
    let t = pose.translation;
    let row = |i: usize| [r[(i, 0)], r[(i, 1)], r[(i, 2)], t[i]];
    [row(0), row(1), row(2), [0.0, 0.0, 0.0, 1.0]]
}

/// A list of matrices in JSON.
pub fn transforms() -> Vec<Vec<u8>> {
    let frames: Vec<_> = (0..12)
        .map(|i| serde_json::json!({"file_path": format!("images/{i:04}.png"), "transform_matrix": matrix(i)}))
        .collect();
    vec![
        serde_json::json!({"camera_angle_x": 0.7, "frames": frames})
            .to_string()
            .into_bytes(),
    ]
}

/// Three numbers, then a matrix.
pub fn open3d() -> Vec<Vec<u8>> {
    let mut text = String::new();
    for i in 0..12 {
        let _ = writeln!(text, "{i} {i} {}", i + 1);
        for row in matrix(i) {
            let _ = writeln!(text, "{} {} {} {}", row[0], row[1], row[2], row[3]);
        }
    }
    vec![text.into_bytes()]
}
