"""Reads a recording of `dose3 score --mcap` back with the PyPI packages mcap and mcap-protobuf-support, and has rerun
(PyPI rerun-sdk), where it is installed, check it and convert it: python check.py RECORDING LOG.txt (TUM)."""

import math
import shutil
import subprocess
import sys
import tempfile
from collections import Counter
from pathlib import Path

from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory

TOPICS = {
    "/dose3/pose": "foxglove.PoseInFrame",
    "/tf": "foxglove.FrameTransform",
    "/dose3/score": "dose3.Score",
    "/dose3/motion": "dose3.Motion",
    "/dose3/log": "foxglove.Log",
}
AXES = ("forward", "left", "up", "roll", "pitch", "yaw")


def seconds(stamp) -> float:
    return stamp.seconds + stamp.nanos * 1e-9


def read_back(recording: Path, log: Path) -> None:
    rows = [[float(x) for x in line.split()] for line in log.read_text().splitlines() if not line.startswith("#")]
    counts, kinds, poses, logs, last, scored, excess = Counter(), {}, [], [], -1, 0, 0.0
    with recording.open("rb") as file:
        reader = make_reader(file, validate_crcs=True, decoder_factories=[DecoderFactory()])
        summary = reader.get_summary()
        for schema, channel, message, decoded in reader.iter_decoded_messages():
            counts[channel.topic] += 1
            kinds[channel.topic] = schema.name
            assert message.log_time >= last, "messages are in order of time"
            last = message.log_time
            assert abs(seconds(decoded.timestamp) - message.log_time * 1e-9) < 1e-6
            if channel.topic == "/dose3/pose":
                p, q = decoded.pose.position, decoded.pose.orientation
                assert abs(math.hypot(q.x, q.y, q.z, q.w) - 1.0) < 1e-9
                poses.append((seconds(decoded.timestamp), p.x, p.y, p.z))
            elif channel.topic == "/dose3/score":
                scored += decoded.window_score != 0.0
                assert decoded.window_threshold > 0.0 and decoded.pose_threshold > 0.0
            elif channel.topic == "/dose3/motion":
                for axis in AXES:
                    of = getattr(decoded, axis)
                    assert of.trusted_low <= of.trusted_high
                    excess = max(excess, of.excess)
            elif channel.topic == "/dose3/log":
                logs.append((decoded.level, decoded.message))
        metadata = {found.name: found.metadata for found in reader.iter_metadata()}
    assert kinds == TOPICS, kinds
    for topic in ("/tf", "/dose3/score", "/dose3/motion"):
        assert counts[topic] == len(poses), (topic, counts)
    stored = {summary.channels[id].topic: n for id, n in summary.statistics.channel_message_counts.items()}
    assert stored == dict(counts), "the statistics count what is there"
    # The first pose is that of the log, also where it was resampled.
    assert all(abs(a - b) < 1e-9 for a, b in zip(poses[0], rows[0])), (poses[0], rows[0])
    assert scored > len(poses) // 2 and excess > 1.0
    verdict = metadata["dose3"]["verdict"]
    texts = [text for _, text in logs]
    assert verdict.replace("-", " ").upper() in texts[0].upper(), (verdict, texts[0])
    begun = [text for level, text in logs if level == 3 and text.startswith("unlike the trusted logs until")]
    assert begun, "bad stretches are said"
    print(f"{recording}: {sum(counts.values())} messages of {len(counts)} topics read back, verdict {verdict}")


def rerun(recording: Path) -> None:
    program = shutil.which("rerun") or shutil.which("rerun", path=str(Path(sys.executable).parent))
    if program is None:
        print("rerun is not installed: not tried")
        return
    with tempfile.TemporaryDirectory() as folder:
        converted = Path(folder) / "out.rrd"
        for command in (["mcap", "check", recording], ["mcap", "convert", recording, "-o", converted], ["rrd", "verify", converted]):
            done = subprocess.run([program, *map(str, command)], capture_output=True, text=True, timeout=300)
            assert done.returncode == 0, f"{command}: {done.stdout}{done.stderr}"
        shown = subprocess.run([program, "rrd", "print", "-v", str(converted)], capture_output=True, text=True, timeout=300)
        for wanted in ("/dose3/pose", "/tf", "/dose3/log"):
            assert wanted in shown.stdout, f"rerun does not show {wanted}"
    print("rerun checks, converts and shows it")


if __name__ == "__main__":
    read_back(Path(sys.argv[1]), Path(sys.argv[2]))
    rerun(Path(sys.argv[1]))
