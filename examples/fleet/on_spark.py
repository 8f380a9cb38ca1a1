"""Spark 4: `python on_spark.py DETECTOR PATHS.txt results.parquet`, a path a line."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Mapping
from functools import cache
from typing import Any

import pyarrow as pa
from judging import SCHEMA, Judge
from pyspark.sql import DataFrame, SparkSession
from pyspark.sql.pandas.types import from_arrow_schema

#: Files that are judged at a time.
BATCH = 16


@cache
def worker(detector: str | bytes, reading: tuple[tuple[str, Any], ...]) -> Judge:
    """Python workers of Spark live on from task to task, and so does the detector."""
    return Judge(detector, dict(reading))


def judge_paths(paths: DataFrame, detector: str | bytes, reading: Mapping[str, Any]) -> DataFrame:
    """Judges the files in column `path`. A task takes a partition: make some for each core."""
    settings = tuple(reading.items())

    def judge(batches: Iterator[pa.RecordBatch]) -> Iterator[pa.RecordBatch]:
        for batch in batches:
            for start in range(0, len(batch), BATCH):
                found = batch.column("path").slice(start, BATCH).to_pylist()
                rows = [row for rows in worker(detector, settings).paths(found) for row in rows]
                yield pa.RecordBatch.from_pylist(rows, SCHEMA)

    return paths.mapInArrow(judge, from_arrow_schema(SCHEMA))


def judge_poses(poses: DataFrame, detector: str | bytes, reading: Mapping[str, Any]) -> DataFrame:
    """Judges the logs that column `log` tells apart."""
    settings = tuple(reading.items())

    def judge(group: pa.Table) -> pa.Table:
        return pa.Table.from_pylist([worker(detector, settings).poses(group)], SCHEMA)

    arrow: Callable[[pa.Table], pa.Table] = judge
    return poses.groupBy("log").applyInArrow(arrow, from_arrow_schema(SCHEMA))


if __name__ == "__main__":
    detector, listed, out = sys.argv[1:]
    spark = SparkSession.builder.getOrCreate()
    found = spark.read.text(listed).withColumnRenamed("value", "path").where("path != ''")
    cores = spark.sparkContext.defaultParallelism
    judge_paths(found.repartition(4 * cores), detector, {}).write.parquet(out)
