"""Who judges: the Python package where it has streams, else the program ``dose3 watch`` beside this one."""

import json
import queue
import shutil
import subprocess
import threading


class Program:
    """``dose3 watch`` as a process of its own: poses as JSON lines in, JSON lines out."""

    def __init__(self, detector, frame=None, alarms_per_hour=1.0, program="dose3"):
        if shutil.which(program) is None:
            raise FileNotFoundError(f"{program} is not on the path: install dose3")
        command = [program, "watch", "--detector", detector, "--windows", "--quiet", "--heartbeat", "0"]
        command += ["--alarms-per-hour", str(alarms_per_hour)]
        if frame:
            command += ["--frame", frame]
        self.process = subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, bufsize=1
        )
        self.lines = queue.Queue()
        self.reader = threading.Thread(target=self._read, daemon=True)
        self.reader.start()

    def _read(self):
        for line in self.process.stdout:
            self.lines.put(json.loads(line))

    def push(self, stamp_ns, position, orientation):
        def number(x):
            # JSON has no NaN; null is one to the program.
            return x if x == x and abs(x) != float("inf") else None

        line = {
            "stamp_ns": int(stamp_ns),
            "position": [number(x) for x in position],
            "orientation": [number(x) for x in orientation],
        }
        self.process.stdin.write(json.dumps(line) + "\n")

    def said(self):
        while True:
            try:
                yield self.lines.get_nowait()
            except queue.Empty:
                return

    def close(self):
        self.process.stdin.close()
        self.process.wait()
        self.reader.join()


class Package:
    """The Python package ``dose3``."""

    def __init__(self, detector, frame=None, alarms_per_hour=1.0):
        import dose3

        loaded = dose3.Detector.load(detector)
        self.stream = loaded.stream(frame, alarms_per_hour=alarms_per_hour)
        self.waiting = []

    def push(self, stamp_ns, position, orientation):
        self.waiting.extend(self.stream.push(int(stamp_ns), (position, orientation)))

    def said(self):
        said, self.waiting = self.waiting, []
        return said

    def close(self):
        self.waiting.extend(self.stream.finish())


def open_backend(detector, frame=None, alarms_per_hour=1.0):
    """The package where it is installed with streams, else the program."""
    try:
        import dose3

        has_streams = hasattr(dose3.Detector, "stream")
    except ImportError:
        has_streams = False
    backend = Package if has_streams else Program
    return backend(detector, frame, alarms_per_hour)
