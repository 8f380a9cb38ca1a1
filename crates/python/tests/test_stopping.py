"""Long calls end, and faults of the library are exceptions."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import textwrap
import threading
import time

import dose3
import pytest

LONG = """
import dose3, signal, sys
# A check that runs in the background has its signals ignored.
signal.signal(signal.SIGINT, signal.default_int_handler)
logs = [dose3.synthetic("vehicle", seed=s, poses=2000, rate=10.0) for s in range(4)]
print("ready", flush=True)
try:
    {call}
except KeyboardInterrupt:
    print("interrupted", flush=True)
    sys.exit(7)
"""
CALLS = {
    "train": 'dose3.train(logs, steps=1_000_000, window=32, width=8, multipliers=[1, 2], batch=2)',
    "fit": 'dose3.Detector.fit(logs * 200, statistics="residual+eps-mean", stride=1, overlap=False)',
    "judge_many": (
        "detector = dose3.Detector.fit(logs);"
        "[None for _ in detector.judge_many(log for _ in range(10**9) for log in logs)]"
    ),
}


@pytest.mark.parametrize("call", CALLS)
def test_ctrl_c_ends_a_long_call(call: str) -> None:
    script = textwrap.dedent(LONG).format(call=CALLS[call])
    child = subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE, text=True)
    assert child.stdout is not None
    assert child.stdout.readline().strip() == "ready"
    time.sleep(1.5)
    child.send_signal(signal.SIGINT)
    out, _ = child.communicate(timeout=120)
    assert (child.returncode, out.strip()) == (7, "interrupted")


def test_other_threads_go_on_while_one_fits(trusted: list[dose3.Trajectory]) -> None:
    """The main thread lets the other one run at each turn, and gets a turn only where that one lets go of the lock."""
    turns, seen = 0, []

    def fit() -> None:
        seen.append(turns)
        dose3.Detector.fit(trusted)
        seen.append(turns)

    interval = sys.getswitchinterval()
    sys.setswitchinterval(1000.0)
    try:
        thread = threading.Thread(target=fit)
        thread.start()
        while thread.is_alive():
            turns += 1
            time.sleep(0)
        thread.join()
    finally:
        sys.setswitchinterval(interval)
    assert seen[1] > seen[0]


def test_what_a_listener_raises_ends_the_call(trusted: list[dose3.Trajectory]) -> None:
    def enough(done: int, total: int) -> None:
        raise RuntimeError(f"enough after {done}")

    with pytest.raises(RuntimeError, match="enough after"):
        dose3.train(trusted, steps=1_000_000, window=32, width=8, multipliers=[1, 2], batch=2, progress=enough)


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork")
def test_a_fork_judges_with_threads_of_its_own(detector: dose3.Detector) -> None:
    log = dose3.synthetic("vehicle", seed=40, poses=300, rate=10.0)
    before = detector.judge(log).to_json()
    reader, writer = os.pipe()
    child = os.fork()
    if child == 0:
        os.write(writer, b"same" if detector.judge(log).to_json() == before else b"other")
        os._exit(0)
    os.close(writer)
    assert os.read(reader, 16) == b"same"
    os.waitpid(child, 0)
