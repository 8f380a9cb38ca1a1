"""Tables in and out."""

from __future__ import annotations

import importlib.util
import json
import subprocess
from pathlib import Path
from typing import Any

import dose3
import numpy as np
import pytest

pa = pytest.importorskip("pyarrow")
parquet = pytest.importorskip("pyarrow.parquet")


def columns(log: dose3.Trajectory) -> dict[str, Any]:
    names = ("x", "y", "z", "qx", "qy", "qz", "qw")
    numbers = np.hstack([log.positions, log.quaternions])
    return {"t": log.stamps.astype("datetime64[ns]"), **{name: numbers[:, i] for i, name in enumerate(names)}}


def test_tables_of_every_library_are_the_same_log() -> None:
    log = dose3.synthetic("vehicle", seed=2, poses=60, rate=10.0)
    table = pa.table({**columns(log), "comment": ["a, b"] * 60, "speed": pa.nulls(60, pa.float64())})
    tables: dict[str, Any] = {
        "pyarrow": table,
        "batches": pa.Table.from_batches(table.to_batches(max_chunksize=7)),
        "integers": table.set_column(0, "t", pa.array(log.stamps)),
        "reader": pa.RecordBatchReader.from_batches(table.schema, table.to_batches()),
    }
    pandas = pytest.importorskip("pandas")
    tables["pandas"] = pandas.DataFrame(columns(log))
    if importlib.util.find_spec("polars"):
        tables["polars"] = importlib.import_module("polars").DataFrame(columns(log))
    for library, held in tables.items():
        options: Any = {"stamp_unit": "ns"} if library == "integers" else {}
        read = dose3.Trajectory.of(held, frame="body-flu", **options)
        np.testing.assert_array_equal(read.stamps, log.stamps, err_msg=library)
        np.testing.assert_array_equal(read.positions, log.positions, err_msg=library)
        np.testing.assert_allclose(read.rotations, log.rotations, atol=1e-14, err_msg=library)
        assert read.frame == "body-flu"


def test_a_column_tells_several_logs_apart() -> None:
    logs = [dose3.synthetic("drone", seed=seed, poses=40, rate=10.0) for seed in range(3)]
    parts = [pa.table({**columns(log), "run": [f"run {i}"] * 40}) for i, log in enumerate(logs)]
    read = dose3.load(pa.concat_tables(parts), log_column="run")
    assert [log.name for log in read] == ["run 0", "run 1", "run 2"]
    for ours, theirs in zip(read, logs, strict=True):
        np.testing.assert_array_equal(ours.positions, theirs.positions)


def test_what_is_no_table_of_poses_is_refused() -> None:
    with pytest.raises(dose3.Error, match="table"):
        dose3.Trajectory.of(pa.table({"a": [1.0, 2.0], "b": [3.0, 4.0]}))
    with pytest.raises(dose3.Error, match="no rows"):
        dose3.load(pa.table({"a": pa.array([], pa.float64())}))
    log = dose3.synthetic("drone", seed=1, poses=40, rate=10.0)
    commas = pa.table({**columns(log), "run": ["a, b"] * 40})
    with pytest.raises(dose3.Error, match="without commas"):
        dose3.load(commas, log_column="run")


def test_results_are_a_parquet_file(detector: dose3.Detector, folder: Path, tmp_path: Path) -> None:
    file = tmp_path / "results.parquet"
    counts = detector.write_table(file, folder / "new", frame="body-flu")
    assert counts == (3, 2, 1)
    rows = parquet.read_table(file).to_pylist()
    judged = list(detector.judge_many(folder / "new", frame="body-flu"))
    assert json.dumps(rows) == json.dumps([detector.row(one) for one in judged])
    by_name = {row["log"]: row for row in rows}
    frozen = by_name["frozen"]
    assert frozen["verdict"] == "out-of-distribution" and frozen["stretches"][0]["worst_score"] > frozen["threshold"]
    assert by_name["sound"]["stretches"] == [] and by_name["sound"]["error"] is None
    assert by_name[None]["verdict"] == "error" and "three" in by_name[None]["error"]
    assert frozen["dose3_version"] == dose3.__version__
    with pytest.raises(dose3.Error, match="cannot"):
        detector.write_table(folder / "new" / "sound.tum" / "no", folder / "new")


def test_the_program_writes_the_same_table(program: str, folder: Path, tmp_path: Path) -> None:
    detector = dose3.Detector.fit([folder / "trusted"], frame="body-flu")
    detector.save(tmp_path / "detector.dose3")
    theirs, ours = tmp_path / "theirs.parquet", tmp_path / "ours.parquet"
    command = [program, "score", "--detector", str(tmp_path / "detector.dose3"), "--frame", "body-flu"]
    done = subprocess.run([*command, "--out", str(theirs), str(folder / "new")], capture_output=True)
    assert done.returncode == 2
    detector.write_table(ours, folder / "new", frame="body-flu")
    rows = [parquet.read_table(file).to_pylist() for file in (theirs, ours)]
    # The program adds the flag that helps, where one does.
    for row, own in zip(*rows, strict=True):
        assert (row.pop("error") or "").startswith(own.pop("error") or "")
    assert rows[0] == rows[1]
