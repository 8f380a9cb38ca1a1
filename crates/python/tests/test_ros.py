"""The nodes for ROS judge by this package as by the program `dose3 watch`."""

from __future__ import annotations

import importlib
import sys
from pathlib import Path
from typing import Any

import dose3
import pytest

ROS = Path(__file__).parents[3] / "contrib" / "ros"


def said_of(backend: Any, log: dose3.Trajectory) -> list[dict[str, Any]]:
    for stamp, position, orientation in zip(log.stamps.tolist(), log.positions, log.quaternions, strict=True):
        backend.push(stamp, position.tolist(), orientation.tolist())
    backend.push(int(log.stamps[-1]) + 1, [float("nan")] * 3, [0.0, 0.0, 0.0, 1.0])
    backend.close()
    return list(backend.said())


def test_both_backends_say_the_same(
    program: str, detector: dose3.Detector, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "path", [str(ROS), *sys.path])
    backends = importlib.import_module("dose3_ros.backend")
    file = str(tmp_path / "detector.dose3")
    detector.save(file)
    sound = dose3.synthetic("vehicle", seed=20, poses=600, rate=10.0)
    log = dose3.inject("freeze:4.0s", sound, start=300, stop=400).log
    ours, theirs = (said_of(backend, log) for backend in (backends.Package(file), backends.Program(file, program=program)))
    kinds = ("window", "alarm", "event")
    assert [said for said in theirs if said["kind"] in kinds] == ours
    assert {said["kind"] for said in ours} == set(kinds)
    assert isinstance(backends.open_backend(file), backends.Package)
