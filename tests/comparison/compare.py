"""What other tools say of the same sound and faulty logs; docs/COMPARISON.md has the table.

    python3 -m venv VENV
    VENV/bin/pip install evo==1.38.1 deepen-grade==0.4.1 clockdoctor==0.1.0 backplane-tracecheck==0.3.0 baglint==0.2.1 \
        mcap-ros2-support pyyaml rich typer
    VENV/bin/pip install --no-deps lerobot-lint==0.1.1
    cargo build --release -p dose3-cli && cargo build --release -p dose3-datasets --example faulty_logs
    VENV/bin/python tests/comparison/compare.py [--keep FOLDER]

Logs are made here: eight trusted drives, eight others, one more sound and with each fault. Every tool gets them in a form that it
reads (TUM, MCAP with nav_msgs/Odometry and tf, arrays of states) and, where it takes one, a specification that its own
command derives from the sound log. Prints a row a log: what each tool calls beyond what it calls on the sound log, and
the words it uses; and how many of eight other sound drives it calls in the same way.
"""

import argparse
import json
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import types

import numpy as np
from mcap_ros2.writer import Writer

ROOT = pathlib.Path(__file__).parents[2]
DOSE3 = pathlib.Path(os.environ.get("DOSE3", ROOT / "target/release/dose3"))
LOGS = pathlib.Path(os.environ.get("FAULTY_LOGS", ROOT / "target/release/examples/faulty_logs"))
BIN = pathlib.Path(sys.executable).parent
FAULTS = [
    "freeze:1s", "jump:1m", "drop:0.3", "jitter-position:0.05m", "jitter-rotation:1deg", "drift-yaw:2deg/s",
    "slip:1m/s", "reversal", "scale:1.2x", "mounting:5deg", "roll-pitch-swap", "mirrored-positions:left",
    "position-late:0.2s", "stall:1s", "burst:1s", "stamp-jitter:0.1s", "rate:2x",
]
ODOMETRY = """std_msgs/Header header
string child_frame_id
geometry_msgs/PoseWithCovariance pose
geometry_msgs/TwistWithCovariance twist
================================================================================
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
================================================================================
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
================================================================================
MSG: geometry_msgs/PoseWithCovariance
geometry_msgs/Pose pose
float64[36] covariance
================================================================================
MSG: geometry_msgs/Pose
geometry_msgs/Point position
geometry_msgs/Quaternion orientation
================================================================================
MSG: geometry_msgs/Point
float64 x
float64 y
float64 z
================================================================================
MSG: geometry_msgs/Quaternion
float64 x
float64 y
float64 z
float64 w
================================================================================
MSG: geometry_msgs/TwistWithCovariance
geometry_msgs/Twist twist
float64[36] covariance
================================================================================
MSG: geometry_msgs/Twist
geometry_msgs/Vector3 linear
geometry_msgs/Vector3 angular
================================================================================
MSG: geometry_msgs/Vector3
float64 x
float64 y
float64 z
"""
JOINTS = """std_msgs/Header header
string[] name
float64[] position
float64[] velocity
float64[] effort
================================================================================
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
================================================================================
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
"""
TF = """geometry_msgs/TransformStamped[] transforms
================================================================================
MSG: geometry_msgs/TransformStamped
std_msgs/Header header
string child_frame_id
geometry_msgs/Transform transform
================================================================================
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
================================================================================
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
================================================================================
MSG: geometry_msgs/Transform
geometry_msgs/Vector3 translation
geometry_msgs/Quaternion rotation
================================================================================
MSG: geometry_msgs/Vector3
float64 x
float64 y
float64 z
================================================================================
MSG: geometry_msgs/Quaternion
float64 x
float64 y
float64 z
float64 w
"""


def rows(path):
    return np.loadtxt(path)


def states(table):
    """Positions, and roll, pitch and yaw without jumps of a turn: six numbers a row, as a robot's joints."""
    qx, qy, qz, qw = table[:, 4:].T
    roll = np.arctan2(2 * (qw * qx + qy * qz), 1 - 2 * (qx**2 + qy**2))
    pitch = np.arcsin(np.clip(2 * (qw * qy - qz * qx), -1, 1))
    yaw = np.unwrap(np.arctan2(2 * (qw * qz + qx * qy), 1 - 2 * (qy**2 + qz**2)))
    return np.column_stack([table[:, 1:4], roll, pitch, yaw])


def to_mcap(tum, path):
    """Odometry and tf as a driver publishes them, recorded 2 ms after their stamps, and the same as joint states, which
    deepen-grade looks at."""
    with open(path, "wb") as stream:
        writer = Writer(stream)
        odometry = writer.register_msgdef("nav_msgs/msg/Odometry", ODOMETRY)
        tf = writer.register_msgdef("tf2_msgs/msg/TFMessage", TF)
        joints = writer.register_msgdef("sensor_msgs/msg/JointState", JOINTS)
        table = rows(tum)
        for number, ((t, x, y, z, qx, qy, qz, qw), state) in enumerate(zip(table, states(table))):
            stamp = round(t * 1e9)
            header = {"stamp": {"sec": stamp // 10**9, "nanosec": stamp % 10**9}, "frame_id": "odom"}
            place = dict(x=x, y=y, z=z)
            turn = dict(x=qx, y=qy, z=qz, w=qw)
            zero = dict(x=0.0, y=0.0, z=0.0)
            message = {
                "header": header, "child_frame_id": "base_link",
                "pose": {"pose": {"position": place, "orientation": turn}, "covariance": [0.0] * 36},
                "twist": {"twist": {"linear": zero, "angular": zero}, "covariance": [0.0] * 36},
            }
            times = dict(log_time=stamp + 2_000_000, publish_time=stamp, sequence=number)
            writer.write_message("/odom", odometry, message, **times)
            transform = {"header": header, "child_frame_id": "base_link", "transform": {"translation": place, "rotation": turn}}
            names = ["x", "y", "z", "roll", "pitch", "yaw"]
            joint = {"header": header, "name": names, "position": [float(v) for v in state], "velocity": [], "effort": []}
            writer.write_message("/joint_states", joints, joint, **times)
            writer.write_message("/tf", tf, {"transforms": [transform]}, **times)
        writer.finish()


def run(*args, **kwargs):
    return subprocess.run([str(a) for a in args], capture_output=True, text=True, **kwargs)


def dose3(folder, log):
    if not (folder / "d.dose3").exists():
        done = run(DOSE3, "fit", "--trusted", folder / "trusted", "--out", folder / "d.dose3")
        assert done.returncode == 0, done.stderr
    done = run(DOSE3, "score", "--detector", folder / "d.dose3", "--json", log)
    report = json.loads(done.stdout)["logs"][0]
    test = report["evidence"]["tests"][report["evidence"]["decided_by"]]["name"]
    where = report["segments"][0] if report["segments"] else {}
    called = report["verdict"] == "out-of-distribution"
    words = f"chance {report['evidence']['p_value']:.1g} ({test})"
    if called and where:
        words += f", rows {where['first_row']} to {where['last_row']}"
    return {"out of distribution: " + words} if called else set()


def evo_check(folder, log):
    """evo_traj --full_check: what it does not find in order."""
    done = run(BIN / "evo_traj", "tum", log, "--full_check", "--no_warnings")
    text = done.stdout + done.stderr
    checks = re.search(r"checks:\n(.*?)stats:", text, re.S)
    if not checks:
        return {text.strip().splitlines()[-1]}
    return {" ".join(line.split()) for line in checks[1].splitlines() if line.strip() and not re.search(r"\b(ok|yes)$", line)}


def evo_ape(folder, log):
    """evo_ape against the sound log, which a user of a new log does not have: root mean square, metres."""
    done = run(BIN / "evo_ape", "tum", folder / "new/sound.txt", log, "--no_warnings")
    found = re.search(r"rmse\s+([\d.]+)", done.stdout)
    if not found:
        return {"cannot compare: " + (done.stdout + done.stderr).strip().splitlines()[-1]}
    return {f"rmse {float(found[1]):.2f} m"} if float(found[1]) > 1e-3 else set()


def deepen(folder, log):
    done = run(BIN / "deepen", "grade", log.with_suffix(".mcap"), "--json", "--quiet")
    report = json.loads(done.stdout)
    findings = set()

    def walk(node):
        for value in node.values() if isinstance(node, dict) else node:
            if isinstance(value, dict):
                if value.get("severity") in ("warn", "fail"):
                    findings.add(f"{value['severity']} {value['name']} ({value['claim_type']})")
            if isinstance(value, (dict, list)):
                walk(value)

    walk(report)
    return findings


def clockdoctor(folder, log):
    done = run(BIN / "clockdoctor", log.with_suffix(".mcap"), "--out-dir", folder / "clock")
    flags = done.stdout.partition("Flags:")[2].partition("Wrote")[0]
    return {re.sub(r"[\d.]+", "#", line.strip()) for line in flags.splitlines() if line.strip().startswith("[/odom]")}


def tracecheck(folder, log):
    contract = folder / "contract.json"
    contract.write_text(json.dumps({"version": 1, "name": "odometry", "topics": {"/odom": {
        "required": True, "min_count": 1100, "min_rate_hz": 19, "max_rate_hz": 21, "max_gap_ns": 100_000_000, "clock_confirmed": True,
        "check_regression": True, "time_basis": "publish_time"}}}))
    valid = run(BIN / "tracecheck", "validate-contract", contract)
    assert valid.returncode == 0, valid.stdout + valid.stderr
    out = folder / "trace" / log.stem
    out.parent.mkdir(exist_ok=True)
    done = run(BIN / "tracecheck", "check", log.with_suffix(".mcap"), "--contract", contract, "--out", out, "--ignore-missing-crc")
    assert done.returncode in (0, 1), done.stdout + done.stderr
    report = json.loads(next(out.glob("*.json")).read_text())
    return {f"{check['status']} {check['name']}" for check in report["checks"] if check["status"] in ("fail", "warn")}


def baglint(folder, log):
    spec = folder / "baglint.yaml"
    if not spec.exists():
        spec.write_text(run(BIN / "baglint", folder / "new/sound.mcap", "--init").stdout)
    done = run(BIN / "baglint", log.with_suffix(".mcap"), "--spec", spec, "-f", "json")
    findings = json.loads(done.stdout)["findings"]
    return {f"{f['level']} {f['code']}: {f['message']}" for f in findings if f["topic"] == "/odom"}


def lerobot_lint(folder, log):
    """Its checks of an episode, through its own engine: the loader wants a LeRobot dataset and the package lerobot with
    torch. States are positions and angles as six joints, actions the same."""
    sys.modules.setdefault("lerobot_lint.loader", types.SimpleNamespace(iter_episodes=None))
    from lerobot_lint import engine
    from lerobot_lint.config import load_profile
    from lerobot_lint.types import EpisodeData

    table = rows(log)
    state = states(table).astype(np.float32)
    episode = EpisodeData(states=state, actions=state, timestamps=table[:, 0], fps=20.0, task="drive", camera_handles={})
    registry = engine.build_episode_check_registry(load_profile("default"))
    found = registry.run_all(episode, 0)
    return {f"{f.severity} {f.check}" for f in found if f.severity != "info"}


TOOLS = {"dose3": dose3, "evo_traj --full_check": evo_check, "evo_ape": evo_ape, "deepen-grade": deepen,
         "clockdoctor": clockdoctor, "tracecheck": tracecheck, "baglint": baglint, "lerobot-lint": lerobot_lint}


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--keep", type=pathlib.Path)
    args = parser.parse_args()
    folder = args.keep or pathlib.Path(tempfile.mkdtemp())
    done = run(LOGS, folder, *FAULTS)
    assert done.returncode == 0, done.stderr
    logs = [folder / "new/sound.txt"] + [folder / "new" / (re.sub("[:/]", "_", fault) + ".txt") for fault in FAULTS]
    others = sorted((folder / "others").glob("*.txt"))
    for log in logs + others:
        to_mcap(log, log.with_suffix(".mcap"))
    for name, tool in TOOLS.items():
        sound = tool(folder, logs[0])
        print(f"== {name}\n  sound: {'; '.join(sorted(sound)) or 'nothing'}")
        found = 0
        for log in logs[1:]:
            new = tool(folder, log) - sound
            found += bool(new)
            print(f"  {log.stem}: {'; '.join(sorted(new))[:300] or '-'}")
        print(f"  {found} of {len(FAULTS)} faulty logs", flush=True)
        if tool is not evo_ape:
            called = [other.stem + ": " + "; ".join(sorted(new)) for other in others if (new := tool(folder, other) - sound)]
            print(f"  {len(called)} of {len(others)} other sound drives  {' | '.join(called)[:400]}", flush=True)


if __name__ == "__main__":
    main()
