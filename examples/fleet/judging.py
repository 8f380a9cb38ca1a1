"""What each worker does, on any engine: rows of paths or poses in, a row for each log out.

The detector is loaded when a worker begins and kept. One worker judges with one thread: the engine starts as many
workers as it has cores.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import dose3
import numpy as np
import pyarrow as pa

#: The columns of results, those of `dose3 score --out results.parquet`.
STRETCH = pa.struct(
    [
        ("first_row", pa.int64()),
        ("last_row", pa.int64()),
        ("start_s", pa.float64()),
        ("end_s", pa.float64()),
        ("worst_score", pa.float64()),
    ]
)
SCHEMA = pa.schema(
    [
        ("log", pa.string()),
        ("path", pa.string()),
        ("verdict", pa.string()),
        ("chance", pa.float64()),
        ("alpha", pa.float64()),
        ("decided_by", pa.string()),
        ("excess", pa.float64()),
        ("score", pa.float64()),
        ("worst_score", pa.float64()),
        ("threshold", pa.float64()),
        ("windows", pa.int64()),
        ("beyond", pa.int64()),
        ("poses", pa.int64()),
        ("rate_hz", pa.float64()),
        ("stretches", pa.list_(STRETCH)),
        ("reasons", pa.list_(pa.string())),
        ("notes", pa.list_(pa.string())),
        ("error", pa.string()),
        ("dose3_version", pa.string()),
        ("detector_version", pa.string()),
    ]
)


class Judge:
    """A worker.

    Parameters
    ----------
    detector
        A detector file that every worker can read, or its bytes.
    reading
        How logs are read, as `dose3.load` takes it.
    """

    def __init__(self, detector: str | bytes, reading: Mapping[str, Any] | None = None) -> None:
        load = dose3.Detector.from_bytes if isinstance(detector, bytes) else dose3.Detector.load
        self.detector = load(detector)
        self.reading = dict(reading or {})

    def paths(self, paths: Iterable[str]) -> list[list[dict[str, Any]]]:
        """Rows of the logs in each file: one, unless the file holds several."""
        rows: dict[str, list[dict[str, Any]]] = {path: [] for path in paths}
        for judged in self.detector.judge_many(list(rows), threads=1, **self.reading):
            rows[judged.path].append(self.detector.row(judged))
        return list(rows.values())

    def files(self, files: Iterable[tuple[str, bytes]]) -> list[list[dict[str, Any]]]:
        """As `paths`, for files whose bytes were read elsewhere: from an object store."""
        return [
            [self._row(path, lambda: dose3.Trajectory.from_bytes(data, name=path, **self.reading))]
            for path, data in files
        ]

    def poses(self, table: pa.Table) -> dict[str, Any]:
        """The row of one log from its poses, in any order: columns `log`, `t` (nanoseconds), `x`, `y`, `z`, `qx`, `qy`,
        `qz`, `qw`."""
        name = str(table["log"][0].as_py())

        def log() -> dose3.Trajectory:
            ordered = table.sort_by("t")
            columns = [ordered[c].to_numpy() for c in ("x", "y", "z", "qx", "qy", "qz", "qw")]
            frame = self.reading.get("frame", "sensor")
            return dose3.Trajectory(ordered["t"].to_numpy(), np.stack(columns, axis=1), frame=frame, name=name)

        return self._row(name, log)

    def _row(self, path: str, log: Any) -> dict[str, Any]:
        try:
            judged = dose3.Judged(path, self.detector.judge(log(), threads=1), None)
        except dose3.Error as error:
            judged = dose3.Judged(path, None, error)
        return self.detector.row(judged)
