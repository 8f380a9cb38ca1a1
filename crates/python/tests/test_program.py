"""The same bytes as the program for the same input."""

from __future__ import annotations

import json
import subprocess
import textwrap
from pathlib import Path

import dose3
import pytest


def run(program: str, *arguments: str | Path, codes: tuple[int, ...] = (0,)) -> str:
    done = subprocess.run([program, *map(str, arguments)], capture_output=True, text=True)
    assert done.returncode in codes, done.stderr
    return done.stdout


def test_a_fit_writes_the_same_file(program: str, folder: Path, tmp_path: Path) -> None:
    theirs, ours = tmp_path / "theirs.dose3", tmp_path / "ours.dose3"
    run(program, "fit", "--trusted", folder / "trusted", "--frame", "body-flu", "--out", theirs)
    dose3.Detector.fit([folder / "trusted"], frame="body-flu").save(ours)
    assert ours.read_bytes() == theirs.read_bytes()


def test_reports_are_the_same_bytes(program: str, folder: Path, tmp_path: Path) -> None:
    file = tmp_path / "detector.dose3"
    detector = dose3.Detector.fit([folder / "trusted"], frame="body-flu")
    detector.save(file)
    out = run(program, "score", "--detector", file, folder / "new", "--frame", "body-flu", "--json", codes=(2,))
    judged = list(detector.judge_many(folder / "new", frame="body-flu"))
    reports = [one.report for one in judged if one.report is not None]
    assert len(reports) == 3 == len(json.loads(out)["logs"])
    for report in reports:
        assert textwrap.indent(report.to_json(pretty=True), "    ") in out
    errors = [error["error"] for error in json.loads(out)["errors"]]
    ours = [str(one.error) for one in judged if one.error is not None]
    # The program adds the flag that helps, where one does.
    assert len(errors) == len(ours) == 1 and errors[0].startswith(ours[0])


@pytest.mark.parametrize("name", ["sound", "drone"])
def test_arrays_give_what_their_file_gives(folder: Path, detector: dose3.Detector, name: str) -> None:
    log = dose3.Trajectory.load(folder / "new" / f"{name}.tum", frame="body-flu")
    same = dose3.Trajectory(log.stamps, log.poses, frame="body-flu", name=name)
    assert same.fingerprint == log.fingerprint
    assert detector.judge(same).chance == detector.judge(log).chance
