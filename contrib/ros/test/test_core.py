"""The core without ROS: ``python3 -m unittest discover -s contrib/ros/test``."""

import pathlib
import sys
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))

from dose3_ros.core import ERROR, OK, STALE, WARN, Core  # noqa: E402


class Script:
    """A backend that says what it is told to."""

    def __init__(self):
        self.waiting = []
        self.pushed = 0
        self.closed = False

    def push(self, _stamp_ns, _position, _orientation):
        self.pushed += 1

    def said(self):
        said, self.waiting = self.waiting, []
        return said

    def close(self):
        self.closed = True


def alarm(kind, number=1):
    return {
        "kind": "alarm",
        "alarm": kind,
        "number": number,
        "since_ns": 5_000_000_000,
        "worst_excess": 3.0,
        "why": ["sideways speed 3 m/s (trusted: -0.1 to 0.1 m/s)"],
        "groups": [{"group": "kinematic", "chance": 1e-6}],
    }


class CoreTest(unittest.TestCase):
    def setUp(self):
        self.backend = Script()
        self.core = Core(self.backend, hold=10.0, silence=2.0)

    def push(self, now):
        self.core.push(now, int(now * 1e9), (0, 0, 0), (0, 0, 0, 1))

    def test_levels_follow_alarms_and_hold(self):
        self.assertEqual(self.core.status(0.0).level, STALE)
        self.push(1.0)
        self.assertEqual(self.core.status(1.0).message, "too few poses for a window yet")
        self.backend.waiting.append({"kind": "window", "number": 0, "excess": 0.2})
        self.push(2.0)
        status = self.core.status(2.0)
        self.assertEqual((status.level, status.values["windows"]), (OK, 1))
        self.backend.waiting.append(alarm("raised"))
        self.push(6.0)
        status = self.core.status(6.0)
        self.assertEqual(status.level, ERROR)
        self.assertIn("sideways speed", status.values["why"])
        self.backend.waiting.append(alarm("ended"))
        self.push(8.0)
        self.assertEqual(self.core.status(8.0).level, WARN)
        self.push(17.9)
        self.assertEqual(self.core.status(17.9).level, WARN)
        self.push(18.1)
        self.assertEqual(self.core.status(18.1).level, OK)

    def test_silence_is_stale_but_an_alarm_stays_an_alarm(self):
        self.push(1.0)
        self.assertEqual(self.core.status(3.5).level, STALE)
        self.backend.waiting.append(alarm("raised"))
        self.push(4.0)
        self.assertEqual(self.core.status(9.0).level, ERROR)

    def test_events_are_counted_and_the_notable_ones_warn(self):
        self.backend.waiting.append({"kind": "event", "event": "rate"})
        self.push(1.0)
        self.assertEqual(self.core.status(1.0).level, OK)
        self.backend.waiting.append({"kind": "event", "event": "gap"})
        self.push(2.0)
        status = self.core.status(2.0)
        self.assertEqual((status.level, status.values["event gap"]), (WARN, 1))
        self.core.close()
        self.assertTrue(self.backend.closed)


if __name__ == "__main__":
    unittest.main()
