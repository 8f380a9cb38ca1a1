"""Faults for people's own tests."""

from __future__ import annotations

from typing import NamedTuple

from dose3 import _native as core
from dose3._trajectory import Trajectory


class Injection(NamedTuple):
    """A log with a fault in it.

    Attributes
    ----------
    log
        The faulty log.
    affected
        Poses of it whose step from the pose before is faulty; empty for controls.
    """

    log: Trajectory
    affected: range


def inject(
    fault: str, log: Trajectory, *, start: int | None = None, stop: int | None = None, seed: int = 0
) -> Injection:
    """Puts a fault of a pose sensor into a log.

    Parameters
    ----------
    fault
        Its name with a severity, such as ``"jump:1.0m"``, ``"freeze:2.0s"``, ``"drift-yaw:0.5deg/s"``,
        ``"scale:1.2"`` or ``"attitude-late:0.1s"``; an unknown name is answered with all of them. The controls
        ``"reanchor"``, ``"rotate-world"`` and ``"resample"`` change what a detector must not see.
    log
        A sound log. It is not changed.
    start, stop
        The poses with the fault, ``stop`` not included; the middle half of the longest stretch where None.
    seed
        Seed of what is random in it; the same seed gives the same bytes.

    Raises
    ------
    Error
        A severity out of its range, poses that are not within one gap-free stretch.
    ValueError
        A name that no fault has.

    Examples
    --------
    >>> drive = synthetic("vehicle", seed=7, poses=400, rate=10.0)
    >>> inject("freeze:2.0s", drive, start=200, stop=300).affected
    range(201, 222)
    """
    faulty, first, last = core.inject(fault, log._native, start, stop, seed)
    return Injection(Trajectory._of_native(faulty), range(first, last))


def synthetic(platform: str, *, seed: int = 0, poses: int = 600, rate: float = 20.0) -> Trajectory:
    """A log that nobody recorded, for tests and examples.

    Parameters
    ----------
    platform
        ``"vehicle"``, ``"handheld"`` or ``"drone"``.
    seed
        Seed of its course and of the platform's parameters.
    poses
        How many poses, 2 to 10 million.
    rate
        Poses a second, 0.1 to 10,000 hertz.

    Raises
    ------
    ValueError
        Numbers out of range, another platform.
    """
    return Trajectory._of_native(core.synthetic(platform, seed, poses, rate))
