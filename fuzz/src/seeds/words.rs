//! Words of the formats.

/// Settings as people type them.
pub fn settings() -> Vec<Vec<u8>> {
    [
        "kinematic,differences,lin/cc",
        "residual+eps-mean,kinematic\nmixture:5\nkernel\nneighbours:3",
        "tum\nbody-flu\nt,x,y,z,qw,qx,qy,qz\nfolder\nnan\nns",
    ]
    .map(|text| text.as_bytes().to_vec())
    .to_vec()
}

/// Of settings.
pub const SETTINGS: &[&[u8]] = &[
    b"kinematic",
    b"lin",
    b"cc",
    b"/",
    b",",
    b"+",
    b"=",
    b"mixture:",
    b"paper24",
    b"x=",
    b"|",
    b"*",
    b"name:",
    b"(",
    b")",
];

/// Of text.
pub const TEXT: &[&[u8]] = &[
    b"\xef\xbb\xbf",
    b"\xff\xfe",
    b"\xfe\xff",
    b"\r\n",
    b"\r",
    b"#",
    b"nan",
    b"inf",
    b"-nan(ind)",
    b",",
    b";",
    b"\t",
    b"\"",
    b"timestamp",
    b"qw",
    b"q_x",
    b"[ns]",
    b"_us",
    b"secs",
    b"\x1f\x8b\x08",
    b"\x28\xb5\x2f\xfd",
    b"1e309",
    b"\0",
];

/// Of graphs and JSON.
pub const GRAPHS: &[&[u8]] = &[
    b"VERTEX_SE3:QUAT",
    b"VERTEX_SE2",
    b"FIX",
    b"EDGE_SE3:QUAT",
    b"transform_matrix",
    b"frames",
    b"[",
    b"]",
    b"{",
    b"}",
    b"null",
    b"1e999",
    b"[[[[[[",
    b"NaN",
    b"position",
    b"orientation",
    b"rotation",
    b"transform",
    b"stamp",
];

/// Of arrays.
pub const BINARY: &[&[u8]] = &[
    b"\x93NUMPY\x01\x00",
    b"PK\x03\x04",
    b"PK\x01\x02",
    b"PK\x05\x06",
    b"PK\x06\x06",
    b"PK\x06\x07",
    b"<M8[ns]",
    b"'descr'",
    b"<f8",
    b">f4",
    b"<i8",
    b"'shape': (",
    b"('x', '<f4', (3,))",
    b"(('title', 'x'), '|S8')",
    b"[('x', '<f8')]",
    b"True",
    b"(18446744073709551615, 4, 4)",
    b"(0, 4, 4)",
    b"\xff\xff\xff\xff",
];

/// Of recordings.
pub const RECORDINGS: &[&[u8]] = &[
    b"\x89MCAP0\r\n",
    b"#ROSBAG V2.0\n",
    b"SQLite format 3\0",
    b"ULog\x01\x12\x35",
    b"lz4",
    b"zstd",
    b"bz2",
    b"none",
    b"geometry_msgs/msg/PoseStamped",
    b"nav_msgs/Odometry",
    b"tf2_msgs/TFMessage",
    b"map",
    b"base_link",
    b"odom",
    b"cdr",
    b"ros1",
    b"op=",
    b"\x04\x22\x4d\x18",
    b"\x28\xb5\x2f\xfd",
    b"\xff\xff\xff\xff\xff\xff\xff\x7f",
    b"\xff\xff\xff\xff",
];

/// Of JSON.
pub const JSON: &[&[u8]] = &[
    b"null",
    b"1e999",
    b"-1",
    b"[]",
    b"{}",
    b"18446744073709551615",
    b"\"",
    b"0.0",
    b"1e-320",
    b"true",
    b"\\u0000",
];

/// Of states of streams.
pub const STATES: &[&[u8]] = &[
    b"null",
    b"9223372036854775807",
    b"-9223372036854775808",
    b"18446744073709551615",
    b"1e308",
    b"5e-324",
    b"-1.0",
    b"true",
    b"false",
    b"[]",
    b"{}",
];

/// Of command lines.
pub const ARGUMENTS: &[&[u8]] = &[
    b"\n--\n",
    b"\n-\n",
    b"=",
    b",",
    b":",
    b"\n--detector\n",
    b"\n--frame\n",
    b"\n--columns\n",
    b"\n--statistics\n",
    b"\n--unit\n",
    b"\n--alpha\n",
    b"\n--shares\n",
    b"\n--threads\n",
    b"\n--tf\n",
    b"\n--lost\n",
    b"\n--out\n",
    b"\n--help\n",
    b"\n-v\n",
    b"\n-q\n",
    b"\xff",
    b"'",
    b"\\",
    b"{}",
    b"*",
];

/// Of lines of poses and of lists.
pub const LINES: &[&[u8]] = &[
    b"{\"stamp_ns\": ",
    b"\"position\": [",
    b"\"orientation\": ",
    b"\"t\": ",
    b"\"p\"",
    b"\"q\"",
    b"null",
    b"nan",
    b"1e999",
    b"path",
    b"group",
    b"\xef\xbb\xbf",
    b"\r\n",
    b"\"",
    b"#",
    b";",
    b",",
];
