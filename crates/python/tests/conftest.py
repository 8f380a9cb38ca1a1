"""Logs and detectors that several tests share."""

from __future__ import annotations

import os
import shutil
from pathlib import Path

import dose3
import pytest


@pytest.fixture(scope="session")
def trusted() -> list[dose3.Trajectory]:
    return [dose3.synthetic("vehicle", seed=seed, poses=600, rate=10.0) for seed in range(12)]


@pytest.fixture(scope="session")
def detector(trusted: list[dose3.Trajectory]) -> dose3.Detector:
    return dose3.Detector.fit(trusted)


@pytest.fixture(scope="session")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Files of logs: twelve trusted ones, three to judge, one that is none."""
    folder = tmp_path_factory.mktemp("logs")
    (folder / "trusted").mkdir()
    (folder / "new").mkdir()
    for seed in range(12):
        log = dose3.synthetic("vehicle", seed=seed, poses=600, rate=10.0)
        write_tum(folder / "trusted" / f"run{seed}.tum", log)
    sound = dose3.synthetic("vehicle", seed=20, poses=600, rate=10.0)
    write_tum(folder / "new" / "sound.tum", sound)
    write_tum(folder / "new" / "frozen.tum", dose3.inject("freeze:3.0s", sound).log)
    write_tum(folder / "new" / "drone.tum", dose3.synthetic("drone", seed=1, poses=400, rate=20.0))
    (folder / "new" / "broken.tum").write_text("0.0 1 2 3 0 0 0 1\n0.1 1 2 three 0 0 0 1\n")
    return folder


def write_tum(path: Path, log: dose3.Trajectory) -> None:
    rows = zip(log.stamps, log.positions, log.quaternions, strict=True)
    with open(path, "w") as file:
        for stamp, position, quaternion in rows:
            numbers = " ".join(repr(float(v)) for v in [*position, *quaternion])
            file.write(f"{stamp // 1_000_000_000}.{stamp % 1_000_000_000:09d} {numbers}\n")


@pytest.fixture(scope="session")
def program() -> str:
    """The program of this repository."""
    named = os.environ.get("DOSE3_PROGRAM") or shutil.which("dose3")
    if not named:
        pytest.skip("no program: DOSE3_PROGRAM names it")
    return named
