"""How Ray scales from one worker to two: `python scaling.py FOLDER 1280 [BATCH]`, FOLDER of `make_logs.py`.

Workers note when each batch began and ended and what processor time it took, so that starting them is not measured.
Prints JSON; on a machine with other work, `wall` shows what was left of it and `cpu` what a log costs.
"""

from __future__ import annotations

import json
import os
import sys
import tempfile
import time
from itertools import cycle, islice
from pathlib import Path
from typing import Any

import on_ray
import pyarrow as pa
import ray


class Timed(on_ray.Paths):
    def __init__(self, notes: str, **judge: Any) -> None:
        super().__init__(**judge)
        self.notes = Path(notes, str(os.getpid()))

    def __call__(self, batch: pa.Table) -> pa.Table:
        began, cpu = time.time(), time.process_time()
        rows = super().__call__(batch)
        note = {"began": began, "ended": time.time(), "cpu": time.process_time() - cpu, "logs": len(rows)}
        with open(self.notes, "a") as file:
            file.write(json.dumps(note) + "\n")
        return rows


def run(folder: Path, logs: int, batch: int, workers: int) -> dict[str, float]:
    paths = list(islice(cycle(sorted(str(path) for path in (folder / "new").iterdir())), logs))
    with tempfile.TemporaryDirectory() as notes:
        found = ray.data.from_arrow(pa.table({"path": paths})).repartition(logs // batch)
        found.map_batches(
            Timed,
            fn_constructor_kwargs={
                "notes": notes,
                "detector": str(folder / "detector.dose3"),
                "reading": {"frame": "body-flu"},
            },
            batch_format="pyarrow",
            batch_size=batch,
            compute=ray.data.ActorPoolStrategy(size=workers),
        ).materialize()
        all_notes = [json.loads(line) for file in Path(notes).iterdir() for line in file.open()]
    wall = max(note["ended"] for note in all_notes) - min(note["began"] for note in all_notes)
    judged = sum(note["logs"] for note in all_notes)
    return {"logs_per_s": judged / wall, "cpu_s_per_log": sum(note["cpu"] for note in all_notes) / judged}


if __name__ == "__main__":
    folder, logs = Path(sys.argv[1]), int(sys.argv[2])
    batch = int(sys.argv[3]) if len(sys.argv) > 3 else on_ray.BATCH
    ray.init(num_cpus=3, include_dashboard=False, logging_level="ERROR")
    before = os.getloadavg()
    turns = [(run(folder, logs, batch, 1), run(folder, logs, batch, 2)) for _ in range(3)]
    wall = sorted(two["logs_per_s"] / one["logs_per_s"] for one, two in turns)
    cpu = sorted(2 * one["cpu_s_per_log"] / two["cpu_s_per_log"] for one, two in turns)
    print(json.dumps({"load": (before, os.getloadavg()), "turns": turns, "wall": wall[1], "cpu": cpu[1]}, indent=2))
