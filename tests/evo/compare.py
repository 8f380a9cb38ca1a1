"""Every kind of file that evo reads is read to the same poses; and how long both take.

    python3 -m venv VENV && VENV/bin/pip install evo==1.38.0 rosbags mcap
    cargo build --release -p dose3-datasets --examples
    VENV/bin/python tests/evo/compare.py [--data DIR] [--speed]

Files are made here; --data adds the recordings of a folder `bags` and `formats`, where there is one. Prints a row a
file and exits with 1 where poses differ. evo looks up TF only where ROS is installed, so transforms are compared with
the odometry topic that the same robot publishes.
"""

import argparse
import math
import pathlib
import statistics
import subprocess
import sys
import tempfile
import time

import numpy as np
from evo.tools import file_interface

EXAMPLES = pathlib.Path(__file__).parents[2] / "target/release/examples"
PROGRAM = EXAMPLES / "to_tum"
POSES = 500


def truth(poses):
    """A bend: stamps, positions, quaternions (w first)."""
    i = np.arange(poses)
    yaw = 0.3 * np.sin(i / 50)
    xyz = np.stack([np.cumsum(0.5 * np.cos(yaw)), np.cumsum(0.5 * np.sin(yaw)), 0.01 * np.sin(i / 9)], 1)
    q = np.stack([np.cos(yaw / 2), 0 * yaw, 0 * yaw, np.sin(yaw / 2)], 1)
    return 1.6e9 + i / 10, xyz, q


def tum(path, poses=POSES, separator=" "):
    t, p, q = truth(poses)
    rows = np.column_stack([p, q[:, [1, 2, 3, 0]]])
    with open(path, "w") as out:
        for stamp, row in zip(t, rows):
            out.write(separator.join([f"{stamp:.6f}"] + [f"{v:.9f}" for v in row]) + "\n")


def kitti(path, poses=POSES):
    _, p, q = truth(poses)
    with open(path, "w") as out:
        for (x, y, z), (w, _, _, s) in zip(p, q):
            c, s = 1 - 2 * s * s, 2 * w * s
            out.write(" ".join(f"{v:.9e}" for v in (c, -s, 0, x, s, c, 0, y, 0, 0, 1, z)) + "\n")


def euroc(path):
    t, p, q = truth(POSES)
    with open(path, "w") as out:
        out.write("#timestamp, p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_w [], q_RS_x [], q_RS_y [], q_RS_z []\n")
        for stamp, a, b in zip(t, p, q):
            out.write(",".join([str(round(stamp * 1e9) // 1000 * 1000)] + [f"{v:.9f}" for v in (*a, *b)]) + "\n")


def ours(path, what=None):
    """Stamps, positions and quaternions (w first) as this project reads them."""
    command = [str(PROGRAM), str(path)] + ([what] if what else [])
    run = subprocess.run(command, capture_output=True, text=True)
    if run.returncode:
        raise RuntimeError(run.stderr.strip())
    rows = np.loadtxt(run.stdout.splitlines(), ndmin=2)
    return rows[:, 0], rows[:, 1:4], rows[:, [7, 4, 5, 6]]


def evo_recording(path, topic):
    from rosbags.rosbag1 import Reader as Reader1
    from rosbags.rosbag2 import Reader as Reader2

    reader = Reader1 if path.suffix == ".bag" else Reader2
    with reader(path) as reader:
        return file_interface.read_bag_trajectory(reader, topic)


def compare(name, theirs, own, stamps=True):
    t, p, q = own
    if len(p) != theirs.num_poses:
        return f"{name:<44} {theirs.num_poses} poses, here {len(p)}", False
    metres = np.abs(theirs.positions_xyz - p).max()
    # evo keeps quaternions as they are written, here they have norm 1; q and -q are the same rotation.
    a = theirs.orientations_quat_wxyz / np.linalg.norm(theirs.orientations_quat_wxyz, axis=1)[:, None]
    chord = np.minimum(np.linalg.norm(a - q, axis=1), np.linalg.norm(a + q, axis=1)).max()
    degrees = math.degrees(4 * math.asin(min(1.0, chord / 2)))
    seconds = np.abs(theirs.timestamps - t).max() if stamps else 0.0
    # evo keeps stamps in f64 seconds, a quarter of a microsecond for dates.
    good = metres < 1e-9 and degrees < 1e-4 and seconds < 1e-6
    return f"{name:<44} {len(p):>6} poses  {metres:.1e} m  {degrees:.1e} deg  {seconds:.1e} s", good


def speed(folder, pairs=5):
    """Loading 300,000 poses: evo's reader in this process and the library's in another, in turn."""
    for name, write, read in (
        ("tum", tum, file_interface.read_tum_trajectory_file),
        ("kitti", kitti, file_interface.read_kitti_poses_file),
    ):
        path = folder / f"long.{name}"
        write(path, 300_000)
        measured = []
        for _ in range(pairs):
            begin = time.perf_counter()
            read(path)
            evo = time.perf_counter() - begin
            run = subprocess.run([str(EXAMPLES / "read"), str(path)], capture_output=True, text=True, check=True)
            own = float(run.stdout.split()[-2])
            measured.append((evo, own, evo / own))
        evo, own, ratio = (statistics.median(column) for column in zip(*measured))
        print(f"{name}: evo loads 300,000 poses in {evo:.3f} s, here {own:.3f} s, {ratio:.1f} times as fast")


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--data", type=pathlib.Path)
    parser.add_argument("--speed", action="store_true")
    args = parser.parse_args()
    bad = 0
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        tum(folder / "a.tum")
        tum(folder / "a_comment.tum")
        text = (folder / "a_comment.tum").read_text()
        (folder / "a_comment.tum").write_text("# timestamp tx ty tz qx qy qz qw\n" + text)
        kitti(folder / "a.kitti")
        euroc(folder / "a.csv")
        rows = [
            (folder / "a.tum", file_interface.read_tum_trajectory_file, None, True),
            (folder / "a_comment.tum", file_interface.read_tum_trajectory_file, None, True),
            (folder / "a.kitti", file_interface.read_kitti_poses_file, None, False),
            (folder / "a.csv", file_interface.read_euroc_csv_trajectory, None, True),
        ]
        if args.data and (args.data / "bags").is_dir():
            for path in sorted((args.data / "bags").iterdir()):
                if not path.name.startswith("tf"):
                    rows.append((path, lambda p: evo_recording(p, "/odom"), "/odom", True))
        if args.data and (args.data / "formats").is_dir():
            formats = args.data / "formats"
            rows += [
                (formats / "tum_freiburg1_xyz_groundtruth.txt", file_interface.read_tum_trajectory_file, None, True),
                (formats / "euroc_V102_groundtruth.csv", file_interface.read_euroc_csv_trajectory, None, True),
                (formats / "ros2_nav2_turtlebot.mcap", lambda p: evo_recording(p, "/odom"), "/odom", True),
                (formats / "ros2_nav2_turtlebot.mcap", lambda p: evo_recording(p, "/amcl_pose"), "/amcl_pose", True),
            ]
        for path, read, what, stamps in rows:
            name = path.name + (f" {what}" if what else "")
            try:
                line, good = compare(name, read(path), ours(path, what), stamps)
            except Exception as error:  # a row of its own, the others go on
                line, good = f"{name:<44} {error}", False
            print(line if good else f"{line}  DIFFERS")
            bad += not good
        if args.speed:
            speed(folder)
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
