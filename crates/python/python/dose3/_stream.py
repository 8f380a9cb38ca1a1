"""Logs that are judged while they grow."""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from dose3 import _native as core
from dose3._trajectory import Trajectory

if TYPE_CHECKING:
    from typing_extensions import Self


class Stream:
    """Poses judged as they come; from :meth:`Detector.stream`.

    What it says are dicts with a ``kind``: ``window`` (score and chance of one window), ``alarm`` (raised or ended), and
    ``event`` (something is wrong with poses or stamps, which is no error). Memory is constant.

    Examples
    --------
    >>> trusted = [dose3.synthetic("vehicle", seed=seed, poses=600, rate=10.0) for seed in range(12)]
    >>> live = dose3.Detector.fit(trusted).stream("body-flu")
    >>> drive = dose3.synthetic("vehicle", seed=30, poses=300, rate=10.0)
    >>> windows = [said for said in live.judge(drive) if said["kind"] == "window"]
    >>> len(windows) == live.windows > 10
    True
    """

    __slots__ = ("_native",)

    _native: core.Stream

    def __init__(self) -> None:
        raise TypeError("a stream comes from Detector.stream")

    @classmethod
    def _of_native(cls, native: core.Stream) -> Self:
        stream = cls.__new__(cls)
        stream._native = native
        return stream

    def push(self, stamp: int | float, pose: Any) -> list[dict[str, Any]]:
        """Takes the next pose.

        Parameters
        ----------
        stamp
            Nanoseconds where it is an integer, seconds where it is a float.
        pose
            x, y, z in metres and the quaternion x, y, z, w: seven numbers, or a tuple of a position and a quaternion; or a
            matrix ``(4, 4)`` or ``(3, 4)``.

        Returns
        -------
        list of dict
            What there is to say, mostly nothing. Bad poses are left out and said; they are no errors.

        Raises
        ------
        ValueError
            Numbers of another shape, a stamp in seconds that is not finite.
        """
        ns = round(stamp * 1e9) if isinstance(stamp, float) else int(stamp)
        if isinstance(pose, tuple) and list(map(len, pose)) == [3, 4]:
            pose = [*pose[0], *pose[1]]
        if len(pose) == 7:
            x, y, z, *quaternion = map(float, pose)
            return _parsed(self._native.push(ns, [x, y, z], quaternion))
        if len(pose) not in (3, 4) or any(len(row) != 4 for row in pose):
            raise ValueError(f"pose: expected seven numbers, or a matrix (4, 4) or (3, 4), found {pose!r}")
        rows = [[float(value) for value in row] for row in pose]
        position = [row[3] for row in rows[:3]]
        return _parsed(self._native.push_matrix(ns, position, [value for row in rows[:3] for value in row[:3]]))

    def judge(self, log: Trajectory) -> Iterator[dict[str, Any]]:
        """What is said while a recorded log is pushed, pose by pose."""
        for stamp, pose in zip(log.stamps.tolist(), log.poses, strict=True):
            yield from self.push(stamp, pose)
        yield from self.finish()

    def finish(self) -> list[dict[str, Any]]:
        """Says that no pose is to come for now; poses may follow and begin a new stretch."""
        return _parsed(self._native.finish())

    def reset(self) -> None:
        """Forgets everything."""
        self._native.reset()

    @property
    def alarm(self) -> dict[str, Any] | None:
        """The alarm that is raised, as it stands."""
        alarm = self._native.alarm
        return None if alarm is None else json.loads(alarm)

    @property
    def windows(self) -> int:
        """Windows judged so far."""
        return self._native.windows

    @property
    def pushed(self) -> int:
        """Poses pushed so far, those left out included."""
        return self._native.pushed


def _parsed(said: list[str]) -> list[dict[str, Any]]:
    return [json.loads(one) for one in said]
