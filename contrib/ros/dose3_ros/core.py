"""From poses to diagnostics, without ROS.

A ``Core`` takes poses as they come and answers, when asked, with one ``Status``: what a
``diagnostic_msgs/DiagnosticStatus`` holds. It knows time only as it is told, so it can be tested without a clock.
"""

from dataclasses import dataclass, field

OK, WARN, ERROR, STALE = 0, 1, 2, 3


@dataclass
class Status:
    """What there is to publish."""

    level: int
    message: str
    values: dict = field(default_factory=dict)


class Core:
    """Poses in, status out, with hysteresis.

    ERROR while an alarm stands; WARN for ``hold`` seconds after it has ended and for ``hold`` seconds after
    an event such as a gap; STALE after ``silence`` seconds without a pose; else OK. An alarm itself has
    hysteresis already: it ends after a quarter of a window without an unusual window.
    """

    # Events that a person wants to see; the others are only counted.
    NOTABLE = {"gap", "reset", "clock-back", "too-slow", "bad-pose", "stamps", "unmeasured"}

    def __init__(self, backend, hold=10.0, silence=2.0):
        self.backend = backend
        self.hold = hold
        self.silence = silence
        self.poses = 0
        self.alarms = 0
        self.windows = 0
        self.alarm = None
        self.excess = None
        self.ended_at = None
        self.event = None
        self.event_at = None
        self.events = {}
        self.last_pose_at = None

    def push(self, now, stamp_ns, position, orientation):
        """Takes a pose: stamp in nanoseconds, metres, quaternion x, y, z, w; ``now`` in seconds."""
        self.poses += 1
        self.last_pose_at = now
        self.backend.push(stamp_ns, position, orientation)
        self.listen(now)

    def listen(self, now):
        """Takes what the backend has said since."""
        for said in self.backend.said():
            kind = said.get("kind")
            if kind == "window":
                self.windows = said["number"] + 1
                self.excess = said["excess"]
            elif kind == "alarm":
                self._alarm(now, said)
            elif kind == "event":
                self._event(now, said)

    def _alarm(self, now, said):
        self.alarms = max(self.alarms, said["number"])
        if said["alarm"] == "ended":
            self.alarm, self.ended_at = None, now
        else:
            self.alarm = said

    def _event(self, now, said):
        name = said["event"]
        self.events[name] = self.events.get(name, 0) + 1
        if name in self.NOTABLE:
            self.event, self.event_at = name, now

    def status(self, now):
        """What to publish at ``now``."""
        self.listen(now)
        values = {
            "poses": self.poses,
            "windows": self.windows,
            "alarms": self.alarms,
        }
        if self.excess is not None:
            values["excess"] = f"{self.excess:.2f}"
        for name, count in sorted(self.events.items()):
            values[f"event {name}"] = count
        recent = lambda at: at is not None and now - at <= self.hold
        silent = None if self.last_pose_at is None else now - self.last_pose_at
        if self.alarm is not None:
            alarm = self.alarm
            values["since"] = f"{alarm['since_ns'] * 1e-9:.3f}"
            values["worst excess"] = f"{alarm['worst_excess']:.2f}"
            values["why"] = "; ".join(alarm["why"]) or ", ".join(g["group"] for g in alarm["groups"])
            return Status(ERROR, f"the motion is unlike the trusted logs since {values['since']}", values)
        if silent is None:
            return Status(STALE, "no pose yet", values)
        if silent > self.silence:
            return Status(STALE, f"no pose for {silent:.1f} s", values)
        if recent(self.ended_at):
            return Status(WARN, "an alarm has ended", values)
        if recent(self.event_at):
            return Status(WARN, f"event: {self.event}", values)
        if self.windows == 0:
            return Status(OK, "too few poses for a window yet", values)
        return Status(OK, "the motion is like the trusted logs", values)

    def close(self):
        """Ends the backend."""
        self.backend.close()
