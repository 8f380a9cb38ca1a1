"""Generated logs to try engines on: `python make_logs.py FOLDER 200` writes trusted/, new/ and detector.dose3."""

from __future__ import annotations

import sys
from pathlib import Path

import dose3


def write(path: Path, log: dose3.Trajectory) -> None:
    """A TUM file, every digit kept."""
    with open(path, "w") as file:
        for stamp, position, quaternion in zip(log.stamps, log.positions, log.quaternions, strict=True):
            numbers = " ".join(repr(float(v)) for v in [*position, *quaternion])
            file.write(f"{stamp // 1_000_000_000}.{stamp % 1_000_000_000:09d} {numbers}\n")


def make(folder: Path, logs: int, poses: int = 1200, rate: float = 20.0) -> None:
    """Every tenth log has a fault, every fiftieth is broken."""
    for name in ("trusted", "new"):
        (folder / name).mkdir(parents=True, exist_ok=True)
    for seed in range(8):
        write(folder / "trusted" / f"trusted{seed}.tum", dose3.synthetic("vehicle", seed=seed, poses=poses, rate=rate))
    for seed in range(logs):
        path = folder / "new" / f"log{seed:05}.tum"
        log = dose3.synthetic("vehicle", seed=1000 + seed, poses=poses, rate=rate)
        if seed % 50 == 49:
            path.write_text("0.0 1 2 3 0 0 0 1\n0.1 1 2 three 0 0 0 1\n")
        elif seed % 10 == 9:
            write(path, dose3.inject("freeze:3.0s", log, seed=seed).log)
        else:
            write(path, log)
    dose3.Detector.fit([folder / "trusted"], frame="body-flu").save(folder / "detector.dose3")


if __name__ == "__main__":
    make(Path(sys.argv[1]), int(sys.argv[2]))
