"""Both engines over 200 generated logs on two workers: what they say is what the program says, to the last bit.

`examples/fleet/check` makes the environment and runs this.
"""

from __future__ import annotations

import json
import os
import random
import shutil
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path
from typing import Any

import daft
import dose3
import make_logs
import on_daft
import on_ray
import pyarrow as pa
import pytest
import ray
from judging import SCHEMA, Judge

LOGS = 200
READING = {"frame": "body-flu"}
POSE_COLUMNS = ("x", "y", "z", "qx", "qy", "qz", "qw")


@pytest.fixture(scope="module")
def fleet(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("fleet")
    make_logs.make(folder, LOGS)
    return folder


@pytest.fixture(scope="module")
def paths(fleet: Path) -> list[str]:
    return sorted(str(path) for path in (fleet / "new").iterdir())


@pytest.fixture(scope="module")
def expected(fleet: Path) -> dict[str, dict[str, Any]]:
    """Rows of what the program says, by path."""
    program = os.environ["DOSE3_PROGRAM"]
    detector = fleet / "detector.dose3"
    command = [program, "score", "--detector", detector, "--frame", "body-flu", "--json", fleet / "new"]
    out = json.loads(subprocess.run(command, capture_output=True, text=True).stdout)
    judge = dose3.Detector.load(detector)
    judged = [
        dose3.Judged(log["log"]["path"], dose3.Report.from_json(json.dumps(log)), None) for log in out["logs"]
    ]
    rows = {one.path: judge.row(one) for one in judged}
    rows |= {fault["path"]: {"error": fault["error"]} for fault in out["errors"]}
    assert len(rows) == LOGS and len(out["errors"]) == LOGS // 50
    return rows


def agree(rows: list[dict[str, Any]], expected: dict[str, dict[str, Any]]) -> None:
    assert sorted(row["path"] for row in rows) == sorted(expected)
    for row in rows:
        wanted = expected[row["path"]]
        if row["error"] is not None:
            # The program adds the flag that helps, where one does.
            assert row["verdict"] == "error" and wanted["error"].startswith(row["error"])
        else:
            assert json.dumps(row) == json.dumps(wanted)


@pytest.fixture(scope="module")
def poses(paths: list[str]) -> pa.Table:
    """One row a pose, in no order; the broken logs have one pose twice."""
    columns: dict[str, list[Any]] = {name: [] for name in ("log", "t", *POSE_COLUMNS)}
    for path in paths:
        if "three" in Path(path).read_text():
            lines = [["0.0", *"0000001"]] * 2
        else:
            lines = [line.split() for line in Path(path).read_text().splitlines()]
        for line in lines:
            seconds, _, part = line[0].partition(".")
            columns["log"].append(path)
            columns["t"].append(int(seconds) * 1_000_000_000 + int(part.ljust(9, "0")))
            for name, value in zip(POSE_COLUMNS, line[1:], strict=True):
                columns[name].append(float(value))
    table = pa.table(columns)
    order = list(range(len(table)))
    random.Random(1).shuffle(order)
    return table.take(order)


def agree_on_poses(rows: list[dict[str, Any]], expected: dict[str, dict[str, Any]]) -> None:
    assert sorted(row["path"] for row in rows) == sorted(expected)
    for row in rows:
        wanted = expected[row["path"]]
        if "chance" not in wanted:
            assert "a stamp later than the one before" in row["error"]
            continue
        for name in ("verdict", "chance", "score", "excess", "worst_score", "threshold", "windows", "beyond"):
            assert row[name] == wanted[name], (row["path"], name)


@pytest.fixture(scope="module")
def cluster() -> Any:
    ray.init(num_cpus=3, include_dashboard=False, logging_level="ERROR")
    yield
    ray.shutdown()


def from_ray(dataset: ray.data.Dataset) -> list[dict[str, Any]]:
    # Blocks without a row have no columns.
    blocks = [block.cast(SCHEMA) for block in ray.get(dataset.to_arrow_refs()) if len(block) > 0]
    rows: list[dict[str, Any]] = pa.concat_tables(blocks).to_pylist()
    return rows


def test_daft_with_a_row_a_path(fleet: Path, paths: list[str], expected: dict[str, Any]) -> None:
    frame = daft.from_pydict({"path": paths})
    rows = on_daft.judge_paths(frame, 2, detector=str(fleet / "detector.dose3"), reading=READING)
    agree(rows.to_pylist(), expected)


def test_daft_with_a_row_a_pose(fleet: Path, poses: pa.Table, expected: dict[str, Any]) -> None:
    frame = daft.from_arrow(poses)
    rows = on_daft.judge_poses(frame, detector=str(fleet / "detector.dose3"), reading=READING)
    agree_on_poses(rows.to_pylist(), expected)


def test_ray_with_a_row_a_path(cluster: None, fleet: Path, paths: list[str], expected: dict[str, Any]) -> None:
    found = ray.data.from_arrow(pa.table({"path": paths})).repartition(8)
    rows = on_ray.judge_paths(found, 2, detector=str(fleet / "detector.dose3"), reading=READING)
    agree(from_ray(rows), expected)


def test_ray_with_a_row_a_pose(cluster: None, fleet: Path, poses: pa.Table, expected: dict[str, Any]) -> None:
    found = ray.data.from_arrow(poses)
    rows = on_ray.judge_poses(found, 2, detector=str(fleet / "detector.dose3"), reading=READING)
    agree_on_poses(from_ray(rows), expected)


class Slow(on_ray.Paths):
    """Says which process it is, and takes its time, so that it can be killed in the middle."""

    def __init__(self, said: str, **judge: Any) -> None:
        super().__init__(**judge)
        Path(said, str(os.getpid())).touch()

    def __call__(self, batch: pa.Table) -> pa.Table:
        time.sleep(0.5)
        return super().__call__(batch)


def test_ray_survives_a_worker_that_is_killed(
    cluster: None, fleet: Path, paths: list[str], expected: dict[str, Any], tmp_path: Path
) -> None:
    killed: list[int] = []

    def kill() -> None:
        while not any(tmp_path.iterdir()):
            time.sleep(0.05)
        time.sleep(1.0)
        process = int(next(tmp_path.iterdir()).name)
        os.kill(process, signal.SIGKILL)
        killed.append(process)

    killer = threading.Thread(target=kill)
    killer.start()
    found = ray.data.from_arrow(pa.table({"path": paths})).repartition(25)
    rows = found.map_batches(
        Slow,
        fn_constructor_kwargs={
            "said": str(tmp_path),
            "detector": str(fleet / "detector.dose3"),
            "reading": READING,
        },
        batch_format="pyarrow",
        batch_size=8,
        compute=ray.data.ActorPoolStrategy(size=2),
    )
    agree(from_ray(rows), expected)
    killer.join()
    assert killed and len(list(tmp_path.iterdir())) >= 3


@pytest.fixture(scope="module")
def spark() -> Any:
    if shutil.which("java") is None:
        pytest.skip("Spark needs Java")
    session = pytest.importorskip("pyspark.sql").SparkSession
    os.environ["PYSPARK_PYTHON"] = sys.executable
    yield session.builder.master("local[2]").config("spark.ui.enabled", "false").getOrCreate()


def test_spark_with_a_row_a_path(spark: Any, fleet: Path, paths: list[str], expected: dict[str, Any]) -> None:
    import on_spark

    found = spark.createDataFrame([(path,) for path in paths], "path string").repartition(8)
    judged = on_spark.judge_paths(found, str(fleet / "detector.dose3"), READING)
    agree(judged.toArrow().cast(SCHEMA).to_pylist(), expected)


def test_spark_with_a_row_a_pose(spark: Any, fleet: Path, poses: pa.Table, expected: dict[str, Any]) -> None:
    import on_spark
    import pyarrow.parquet as parquet

    parquet.write_table(poses, fleet / "poses.parquet")
    found = spark.read.parquet(str(fleet / "poses.parquet"))
    judged = on_spark.judge_poses(found, str(fleet / "detector.dose3"), READING)
    agree_on_poses(judged.toArrow().cast(SCHEMA).to_pylist(), expected)


def test_bytes_that_an_engine_has_read(fleet: Path, paths: list[str], expected: dict[str, dict[str, Any]]) -> None:
    judge = Judge((fleet / "detector.dose3").read_bytes(), READING)
    files = ((path, Path(path).read_bytes()) for path in paths[:60])
    rows = [row for rows in judge.files(files) for row in rows]
    assert len(rows) == 60 and any(row["error"] for row in rows)
    agree(rows, {path: expected[path] for path in paths[:60]})
