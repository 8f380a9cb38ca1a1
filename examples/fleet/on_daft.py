"""Daft: `python on_daft.py DETECTOR PATHS.txt results.parquet`, a path a line."""

from __future__ import annotations

import sys
from typing import Any

import daft
import pyarrow as pa
from daft import DataFrame, DataType, Series, col
from judging import SCHEMA, Judge

ROW = DataType.from_arrow_type(pa.struct(list(SCHEMA)))
POSE = ("t", "x", "y", "z", "qx", "qy", "qz", "qw")


def judge_paths(paths: DataFrame, workers: int, **judge: Any) -> DataFrame:
    """Judges the files in column `path`, each worker a process."""

    @daft.cls(max_concurrency=workers, use_process=True)
    class Paths(Judge):
        @daft.method.batch(return_dtype=DataType.list(ROW), batch_size=16)
        def rows(self, path: Series) -> list[list[dict[str, Any]]]:
            return self.paths(path.to_pylist())

    rows = paths.select(Paths(**judge).rows(col("path")).alias("row"))
    return rows.explode("row").select(col("row").unnest())


def judge_poses(poses: DataFrame, **judge: Any) -> DataFrame:
    """Judges the logs that column `log` tells apart. Daft runs groups on threads of its own; dose3 lets them."""

    @daft.cls
    class Poses(Judge):
        @daft.method.batch(return_dtype=ROW)
        def row(self, log: Series, *columns: Series) -> list[dict[str, Any]]:
            named = dict(zip(("log", *POSE), (log, *columns), strict=True))
            return [self.poses(pa.table({name: series.to_arrow() for name, series in named.items()}))]

    judged = Poses(**judge).row(col("log"), *[col(name) for name in POSE])
    return poses.groupby("log").map_groups(judged.alias("row")).select(col("row").unnest())


if __name__ == "__main__":
    detector, listed, out = sys.argv[1:]
    with open(listed) as lines:
        paths = [line.strip() for line in lines if line.strip()]
    judge_paths(daft.from_pydict({"path": paths}), 2, detector=detector).write_parquet(out)
