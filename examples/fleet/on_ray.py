"""Ray Data: `python on_ray.py DETECTOR PATHS.txt results.parquet`, a path a line."""

from __future__ import annotations

import sys
from typing import Any

import pyarrow as pa
import ray
from judging import SCHEMA, Judge
from ray.data import ActorPoolStrategy, Dataset

#: Files that a worker takes at a time. A worker that dies loses at most this much work.
BATCH = 16


class Paths(Judge):
    """One row a file path."""

    def __call__(self, batch: pa.Table) -> pa.Table:
        rows = [row for rows in self.paths(batch["path"].to_pylist()) for row in rows]
        return pa.Table.from_pylist(rows, SCHEMA)


class Poses(Judge):
    """One row a pose, all rows of one log."""

    def __call__(self, group: pa.Table) -> pa.Table:
        return pa.Table.from_pylist([self.poses(group)], SCHEMA)


def judge_paths(paths: Dataset, workers: int, **judge: Any) -> Dataset:
    """Judges the files in column `path`. Workers that die are started again, and their batch is judged again."""
    return paths.map_batches(
        Paths,
        fn_constructor_kwargs=judge,
        batch_format="pyarrow",
        batch_size=BATCH,
        compute=ActorPoolStrategy(size=workers),
    )


def judge_poses(poses: Dataset, workers: int, **judge: Any) -> Dataset:
    """Judges the logs that column `log` tells apart."""
    return poses.groupby("log").map_groups(
        Poses,
        fn_constructor_kwargs=judge,
        batch_format="pyarrow",
        compute=ActorPoolStrategy(size=workers),
    )


if __name__ == "__main__":
    detector, listed, out = sys.argv[1:]
    with open(listed) as lines:
        paths = [line.strip() for line in lines if line.strip()]
    workers = int(ray.cluster_resources()["CPU"]) if ray.is_initialized() else 2
    found = ray.data.from_arrow(pa.table({"path": paths})).repartition(max(workers * 4, len(paths) // 1000))
    judge_paths(found, workers, detector=detector).write_parquet(out)
