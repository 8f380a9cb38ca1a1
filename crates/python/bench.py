"""Measures the package: `python bench.py PROGRAM FOLDER`, FOLDER of `examples/fleet/make_logs.py`.

Import; throughput of `judge_many` against the program on the same files, in turns; memory over 10,000 logs; what one log
of ten minutes at 20 Hz costs. Prints JSON with the load of the machine beside the numbers.
"""

from __future__ import annotations

import json
import os
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from itertools import cycle, islice
from pathlib import Path

import dose3

TURNS = 7
MANY = 10_000


def importing() -> dict[str, float]:
    """Seconds of an interpreter that imports the package, and of one that imports nothing."""

    def seconds(code: str) -> float:
        def once() -> float:
            start = time.perf_counter()
            subprocess.run([sys.executable, "-c", code], check=True)
            return time.perf_counter() - start

        return min(once() for _ in range(TURNS))

    return {"import_s": seconds("import dose3") - seconds("pass")}


def throughput(program: str, folder: Path) -> dict[str, object]:
    """Logs a second of both, in turns; medians, and the median of the ratios: of seconds, and of processor time, which
    other work on the machine does not take away."""
    detector, new = folder / "detector.dose3", folder / "new"
    logs = len(list(new.iterdir()))
    theirs: list[tuple[float, float]] = []
    ours: list[tuple[float, float]] = []

    def timed(command: list[str]) -> tuple[float, float]:
        start, before = time.perf_counter(), resource.getrusage(resource.RUSAGE_CHILDREN)
        subprocess.run(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        seconds, after = time.perf_counter() - start, resource.getrusage(resource.RUSAGE_CHILDREN)
        return seconds, after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime

    command = [program, "score", "--detector", str(detector), "--frame", "body-flu", "--json", str(new)]
    script = (
        "import dose3, sys\n"
        "detector = dose3.Detector.load(sys.argv[1])\n"
        "print(sum(one.report is not None for one in detector.judge_many(sys.argv[2], frame='body-flu')))"
    )
    for _ in range(TURNS):
        theirs.append(timed(command))
        ours.append(timed([sys.executable, "-c", script, str(detector), str(new)]))
    ratio, cpu_ratio = (statistics.median(a[i] / b[i] for a, b in zip(theirs, ours, strict=True)) for i in (0, 1))
    return {
        "logs": logs,
        "program_logs_per_s": logs / statistics.median(seconds for seconds, _ in theirs),
        "judge_many_logs_per_s": logs / statistics.median(seconds for seconds, _ in ours),
        "ratio": ratio,
        "program_cpu_s": statistics.median(cpu for _, cpu in theirs),
        "judge_many_cpu_s": statistics.median(cpu for _, cpu in ours),
        "cpu_ratio": cpu_ratio,
    }


def resident() -> float:
    """Megabytes of this process."""
    with open("/proc/self/statm") as file:
        return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 1e6


def memory(folder: Path) -> dict[str, object]:
    """Resident megabytes after so many of 10,000 logs: the same files again and again."""
    detector = dose3.Detector.load(folder / "detector.dose3")
    paths = sorted((folder / "new").iterdir())
    after: dict[int, float] = {}
    judged = detector.judge_many(islice(cycle(paths), MANY), frame="body-flu")
    for number, _ in enumerate(judged, start=1):
        if number in (100, 1000, 2500, 5000, 7500, MANY):
            after[number] = round(resident(), 1)
    return {"resident_mb_after": after}


def unit_costs(folder: Path) -> dict[str, object]:
    """CPU seconds of one log of ten minutes at 20 Hz, read from text and from an array, and its bytes."""
    detector = dose3.Detector.load(folder / "detector.dose3")
    log = dose3.synthetic("vehicle", seed=77, poses=12_000, rate=20.0)
    sys.path.insert(0, str(Path(__file__).parents[2] / "examples" / "fleet"))
    from make_logs import write

    costs: dict[str, object] = {"poses": len(log)}
    with tempfile.TemporaryDirectory() as scratch:
        path = Path(scratch) / "long.tum"
        write(path, log)
        costs["text_bytes"] = path.stat().st_size

        def cpu(work: object, times: int = 20) -> float:
            before = time.process_time()
            for _ in range(times):
                work()  # type: ignore[operator]
            return (time.process_time() - before) / times

        costs["read_text_cpu_s"] = cpu(lambda: dose3.Trajectory.load(path, frame="body-flu"))
        rotations = log.quaternions
        costs["from_arrays_cpu_s"] = cpu(
            lambda: dose3.Trajectory(log.stamps, (log.positions, rotations), frame="body-flu")
        )
        costs["judge_cpu_s"] = cpu(lambda: detector.judge(log, threads=1))
    costs["peak_rss_mb"] = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e3
    return costs


if __name__ == "__main__":
    program, folder = sys.argv[1], Path(sys.argv[2])
    result: dict[str, object] = {"load_before": os.getloadavg(), "cores": os.cpu_count()}
    result |= importing() | unit_costs(folder) | memory(folder) | throughput(program, folder)
    result["load_after"] = os.getloadavg()
    print(json.dumps(result, indent=2))
