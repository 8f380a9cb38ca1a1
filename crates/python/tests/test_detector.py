"""Fitting and judging."""

from __future__ import annotations

import json
import pickle
import threading
from pathlib import Path

import dose3
import numpy as np
import pytest


def test_a_detector_tells_a_fault_and_comes_back_from_its_file(detector: dose3.Detector, tmp_path: Path) -> None:
    log = dose3.synthetic("vehicle", seed=20, poses=600, rate=10.0)
    faulty, affected = dose3.inject("freeze:3.0s", log, start=200, stop=300)
    sound, frozen = detector.judge(log), detector.judge(faulty)
    assert (sound.is_ood, frozen.is_ood) == (False, True)
    assert frozen.verdict == "out-of-distribution" and 0.0 < frozen.chance <= detector.alpha < sound.chance
    assert any(s["first_pose"] <= affected.stop and affected.start <= s["last_pose"] for s in frozen.segments)
    assert frozen.pose_scores.shape == (600,) and np.nanargmax(frozen.pose_scores) in range(190, 235)
    file = tmp_path / "detector.dose3"
    detector.save(file)
    for copy in (
        dose3.Detector.load(file),
        dose3.Detector.from_bytes(file.read_bytes()),
        pickle.loads(pickle.dumps(detector)),
    ):
        assert copy.judge(faulty).to_json() == frozen.to_json()
        assert copy.judge(faulty, threads=1).to_json() == frozen.to_json()
    again = dose3.Report.from_json(frozen.to_json())
    assert again.to_dict() == frozen.to_dict() and str(again) == str(frozen)
    assert pickle.loads(pickle.dumps(frozen)).to_json() == frozen.to_json()
    page = frozen.to_html()
    assert page.startswith("<!doctype html>") and "out of distribution" in page.lower() and len(page) < 500_000
    assert frozen._repr_html_().startswith("<iframe srcdoc=") and again._repr_html_().startswith("<pre>")
    with pytest.raises(dose3.Error, match="keeps no log"):
        again.to_html()


def test_what_a_report_does_not_have_is_refused(detector: dose3.Detector) -> None:
    report = detector.judge(dose3.synthetic("drone", seed=3, poses=400, rate=10.0)).to_dict()
    assert str(dose3.Report.from_json(json.dumps(report)))
    run = report["evidence"]["tests"][0]["evidence"]["run"]
    for place, name, text in [
        (report["evidence"], "decided_by", "test 4000000000 decided, of"),
        (run, "last", "to 4000000000 stick out, of"),
        (run, "first", "windows 4000000000 to"),
        (report, "windows", "invalid type"),
    ]:
        before = place[name]
        place[name] = 4_000_000_000
        with pytest.raises(dose3.Error, match=text):
            dose3.Report.from_json(json.dumps(report))
        place[name] = before


def test_many_logs_come_in_order_and_a_bad_one_stops_nothing(detector: dose3.Detector, folder: Path) -> None:
    new = folder / "new"
    names = ["sound", "broken", "frozen", "drone", "missing"]
    paths = [new / f"{name}.tum" for name in names]
    judged = list(detector.judge_many(iter(paths), threads=3, frame="body-flu"))
    assert [Path(one.path).stem for one in judged] == names
    assert [one.report is None for one in judged] == [False, True, False, False, True]
    for one, path in zip(judged, paths, strict=True):
        if one.report is not None:
            assert one.report.to_json() == detector.judge(path, frame="body-flu").to_json()
        else:
            assert isinstance(one.error, dose3.Error)
            with pytest.raises(dose3.Error, match=path.stem):
                one.unwrap()
    # A folder is searched, and what is in memory is taken as well.
    log = dose3.synthetic("vehicle", seed=21, poses=300, rate=10.0)
    found = list(detector.judge_many([new, log], frame="body-flu"))
    assert [Path(one.path).stem for one in found] == ["broken", "drone", "frozen", "sound", ""]
    scores = detector.decision_function([log, new / "frozen.tum"], frame="body-flu")
    assert scores.dtype == np.float64 and scores[1] > scores[0]


def test_no_more_paths_are_taken_than_are_under_way(detector: dose3.Detector) -> None:
    taken = 0

    def logs() -> object:
        nonlocal taken
        for seed in range(200):
            taken += 1
            yield dose3.synthetic("vehicle", seed=seed, poses=200, rate=10.0)

    judged = detector.judge_many(logs(), threads=2)  # type: ignore[arg-type]
    assert next(judged).report is not None
    assert taken <= 8


def test_threads_of_python_judge_at_once(detector: dose3.Detector) -> None:
    logs = [dose3.synthetic("vehicle", seed=seed, poses=400, rate=10.0) for seed in range(30, 36)]
    alone = [detector.judge(log).to_json() for log in logs]
    together: dict[int, str] = {}

    def judge(i: int) -> None:
        together[i] = detector.judge(logs[i]).to_json()

    threads = [threading.Thread(target=judge, args=(i,)) for i in range(len(logs))]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert [together[i] for i in range(len(logs))] == alone


def test_groups_and_settings_are_those_of_the_program(trusted: list[dose3.Trajectory]) -> None:
    by_name = dose3.Detector.fit(trusted, group=[*"aaaabbbbcccc"], statistics="kinematic", density="mixture:1")
    assert by_name.statistics == "kinematic" and by_name.trusted == [log.name for log in trusted]
    told_apart = by_name.judge(trusted[0]).to_dict()["evidence"]["basis"]["groups"]
    assert told_apart == 3
    short = dose3.synthetic("vehicle", seed=9, poses=20, rate=10.0)
    left_out = dose3.Detector.fit([*trusted, short], statistics="kinematic", density="mixture:1")
    assert any(note.startswith("left out") for note in left_out.notes)
    with pytest.raises(dose3.Error, match="20 poses"):
        dose3.Detector.fit([*trusted, short], statistics="kinematic", density="mixture:1", strict=True)
    for settings, error, text in [
        ({"alpha": 2.0}, dose3.Error, "alpha"),
        ({"statistics": "nonsense"}, ValueError, "nonsense"),
        ({"statstics": "kinematic"}, TypeError, "statstics"),
        ({"group": ["a"]}, dose3.Error, "1 groups for 12 logs"),
        ({"model": "missing.dose3"}, dose3.Error, "missing.dose3"),
        ({"stride": "wide"}, TypeError, "stride='wide'"),
        ({"threads": 100_000}, ValueError, "at most 256"),
    ]:
        with pytest.raises(error, match=text):
            dose3.Detector.fit(trusted, **settings)  # type: ignore[arg-type]
    with pytest.raises(dose3.Error, match="no log to fit on"):
        dose3.Detector.fit([])


def test_a_report_as_a_table_and_as_a_plot(detector: dose3.Detector) -> None:
    report = detector.judge(dose3.synthetic("drone", seed=3, poses=400, rate=10.0))
    pandas = pytest.importorskip("pandas")
    frame = report.to_pandas()
    assert isinstance(frame, pandas.DataFrame) and len(frame) == len(report.windows) > 0
    assert {"log", "score", "p_value", "beyond", "first_stamp_ns"} <= set(frame.columns)
    matplotlib = pytest.importorskip("matplotlib")
    matplotlib.use("Agg")
    axes = report.plot()
    assert len(axes.lines[0].get_xdata()) == len(report.windows)


def test_a_model_is_trained_and_used(trusted: list[dose3.Trajectory], tmp_path: Path) -> None:
    heard: list[tuple[int, int]] = []
    model = dose3.train(
        trusted,
        steps=10,
        window=32,
        width=8,
        multipliers=[1, 2],
        batch=2,
        hold_out=0.0,
        progress=lambda done, total: heard.append((done, total)),
    )
    assert model.header["representation"]["kind"] == "motion" and model.log[-1]["step"] == 10
    file = tmp_path / "model.dose3"
    model.save(file)
    fitted = [dose3.Detector.fit(trusted, model=m, statistics="residual") for m in (model, file)]
    assert fitted[0].to_bytes() == fitted[1].to_bytes()
    assert pickle.loads(pickle.dumps(model)).to_bytes() == model.to_bytes()


def test_a_stream_says_what_a_judgement_says(detector: dose3.Detector) -> None:
    log = dose3.synthetic("vehicle", seed=20, poses=600, rate=10.0)
    live = detector.stream(rate=10.0)
    said = list(live.judge(log))
    windows = {one["first_stamp_ns"]: one["score"] for one in said if one["kind"] == "window" and one["in_verdict"]}
    expected = {one["first_stamp_ns"]: one["score"] for one in detector.judge(log).windows}
    assert windows == expected and live.pushed == 600 and live.windows > len(windows)
    live.reset()
    assert live.alarm is None and live.windows == 0
    seven = np.hstack([log.positions, log.quaternions])
    again = [one for stamp, pose in zip(log.stamps * 1e-9, seven, strict=True) for one in live.push(stamp, pose)]
    assert abs(len(again) - len(said)) <= 2
    live.reset()
    poses = zip(log.stamps.tolist(), zip(log.positions, log.quaternions, strict=True), strict=True)
    pairs = [one for stamp, pose in poses for one in live.push(stamp, pose)]
    assert len(pairs) == len(again)
    bad = live.push(0, [float("nan")] * 7)
    assert [one["kind"] for one in bad] == ["event"]
    with pytest.raises(ValueError, match="seven numbers"):
        live.push(0, [1.0, 2.0])
    with pytest.raises(dose3.Error, match="alarm"):
        detector.stream("body-flu", alarms_per_hour=-1.0)
