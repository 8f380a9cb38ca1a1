"""Logs of poses."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any, Literal

from dose3 import _native as core
from dose3._options import Frame, PathLike, Reading

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import ArrayLike, NDArray
    from typing_extensions import Self, Unpack


class Trajectory:
    """Poses of a body in a fixed world, in order of time.

    Parameters
    ----------
    stamps
        One a pose, increasing: integers are nanoseconds, floats seconds, ``datetime64`` is taken as it is. None where
        nobody knows them; ``rate`` is needed then.
    poses
        ``T_world_body`` in metres: an array ``(n, 7)`` of x, y, z and a quaternion, an array ``(n, 4, 4)`` or
        ``(n, 3, 4)`` of matrices, scipy's ``RigidTransform``, or a tuple of positions ``(n, 3)`` and rotations:
        quaternions ``(n, 4)``, matrices ``(n, 3, 3)`` or scipy's ``Rotation``.
    frame
        What the axes of the body are.
    name
        Name of the log, for reports.
    group
        Logs of one group (a route, a recording) count as one; the name by default.
    rate
        Poses a second of a log without stamps.
    quaternions
        Order of the numbers of quaternions in arrays.

    Raises
    ------
    Error
        Stamps that do not increase, numbers that are not finite, rotations that are none; the text names the pose.
    ValueError
        Arrays of other shapes.

    Examples
    --------
    >>> import numpy as np
    >>> poses = np.tile(np.eye(4), (50, 1, 1))
    >>> poses[:, 0, 3] = np.linspace(0.0, 4.9, 50)
    >>> log = Trajectory(np.arange(50) * 100_000_000, poses, frame="body-flu", name="ahead")
    >>> len(log), log.rate, round(log.distance, 6)
    (50, 10.0, 4.9)
    """

    __slots__ = ("_native",)

    _native: core.Trajectory

    def __init__(
        self,
        stamps: ArrayLike | None,
        poses: Any,
        *,
        frame: Frame = "sensor",
        name: str = "log",
        group: str | None = None,
        rate: float | None = None,
        quaternions: Literal["xyzw", "wxyz"] = "xyzw",
    ) -> None:
        import numpy as np

        from dose3 import _convert

        positions, rotations = _convert.positions_and_rotations(poses, quaternions)
        if stamps is None:
            if rate is None or not 0.0 < rate <= 1e6:
                raise ValueError(f"a log without stamps needs a rate above 0 and at most 1e6 hertz, found {rate}")
            ns = np.rint(np.arange(len(positions)) * (1e9 / rate)).astype(np.int64)
        elif rate is not None:
            raise ValueError("a log with stamps has their rate; leave rate out, or stamps")
        else:
            ns = _convert.stamps_ns(stamps)
        self._native = core.Trajectory(name, group, frame, ns, positions, rotations, rate)

    @classmethod
    def _of_native(cls, native: core.Trajectory) -> Self:
        log = cls.__new__(cls)
        log._native = native
        return log

    @classmethod
    def of(cls, log: Any, **reading: Unpack[Reading]) -> Trajectory:
        """The log in whatever holds it.

        Parameters
        ----------
        log
            A trajectory, a path, the bytes of a file, evo's ``PoseTrajectory3D``, or a table with named columns that
            has ``__arrow_c_stream__``: of pyarrow, polars, pandas.
        **reading
            How it is read (:class:`Reading`); of logs in memory only ``frame`` matters.

        Raises
        ------
        Error
            What cannot be read, or is not exactly one log.
        TypeError
            Something else.
        """
        if isinstance(log, Trajectory):
            return log
        if isinstance(log, (str, os.PathLike)):
            return cls.load(log, **reading)
        if isinstance(log, (bytes, bytearray, memoryview)):
            return cls.from_bytes(bytes(log), **reading)
        if hasattr(log, "positions_xyz") and hasattr(log, "orientations_quat_wxyz"):
            return cls.from_evo(log, frame=reading.get("frame", "sensor"))
        if hasattr(log, "__arrow_c_stream__"):
            return cls._one(core.read_table("table", log, dict(reading)), "table")
        raise TypeError(f"expected a log, a path, bytes, a table or a trajectory of evo, found {type(log).__name__}")

    @classmethod
    def load(cls, path: PathLike, **reading: Unpack[Reading]) -> Self:
        """Reads exactly one log from a file, or a folder that holds one; formats are told by content.

        Raises
        ------
        Error
            What cannot be read, with file and line, what was found and what was expected.
        """
        return cls._one(core.read([path], dict(reading)), os.fspath(path))

    @classmethod
    def from_bytes(cls, data: bytes, *, name: str = "log", **reading: Unpack[Reading]) -> Self:
        """Reads exactly one log from the bytes of a file; ``name`` stands for its path.

        Raises
        ------
        Error
            As :meth:`load`.
        """
        return cls._one(core.read_bytes(name, data, dict(reading)), name)

    @classmethod
    def _one(cls, logs: list[core.Trajectory], where: str) -> Self:
        if len(logs) != 1:
            raise core.Error(f"{where}: expected exactly one log, found {len(logs)}; hint: dose3.load reads several")
        return cls._of_native(logs[0])

    @classmethod
    def from_evo(cls, trajectory: Any, *, frame: Frame = "sensor", name: str | None = None) -> Self:
        """From evo's ``PoseTrajectory3D``. Its poses have no stamps in ``PosePath3D``: give those to the constructor.

        Raises
        ------
        Error
            As the constructor.
        """
        meta = getattr(trajectory, "meta", {})
        return cls(
            trajectory.timestamps,
            (trajectory.positions_xyz, trajectory.orientations_quat_wxyz),
            frame=frame,
            name=name or str(meta.get("name", "log")),
            quaternions="wxyz",
        )

    def __len__(self) -> int:
        return len(self._native)

    def __repr__(self) -> str:
        return (
            f"<Trajectory {self.name!r}: {len(self)} poses at {self.rate:.2f} Hz, {self.duration:.1f} s, "
            f"{self.distance:.2f} m, frame {self.frame}>"
        )

    @property
    def name(self) -> str:
        """Short name, unique among the logs read together."""
        return self._native.name

    @property
    def group(self) -> str:
        """Logs of one group count as one."""
        return self._native.group

    @property
    def path(self) -> str:
        """The file; empty for poses that were in memory."""
        return self._native.path

    @property
    def format(self) -> str:
        """How it was written."""
        return self._native.format

    @property
    def frame(self) -> str:
        """What the axes of the body are."""
        return self._native.frame

    @property
    def rate(self) -> float:
        """Poses a second, hertz."""
        return self._native.rate

    @property
    def has_stamps(self) -> bool:
        """Whether the stamps are the log's own, not put in by a rate."""
        return self._native.has_stamps

    @property
    def duration(self) -> float:
        """Seconds from the first to the last stamp."""
        return self._native.duration

    @property
    def distance(self) -> float:
        """Metres travelled within gap-free stretches."""
        return self._native.distance

    @property
    def notes(self) -> list[str]:
        """What was repaired and assumed while reading, in sentences."""
        return self._native.notes

    @property
    def fingerprint(self) -> str:
        """SHA-256 over stamps and poses."""
        return self._native.fingerprint

    @property
    def stamps(self) -> NDArray[np.int64]:
        """Nanoseconds, ``(n,)``: a read-only view, nothing is copied."""
        return self._native.stamps

    @property
    def positions(self) -> NDArray[np.float64]:
        """Metres, ``(n, 3)``: a read-only view, nothing is copied."""
        return self._native.positions

    @property
    def rotations(self) -> NDArray[np.float64]:
        """Rotation matrices, ``(n, 3, 3)``: a read-only view, nothing is copied."""
        return self._native.rotations

    @property
    def poses(self) -> NDArray[np.float64]:
        """Homogeneous matrices, ``(n, 4, 4)``, read-only: made at the first call, the same array from then on."""
        return self._native.poses

    @property
    def quaternions(self) -> NDArray[np.float64]:
        """Quaternions x, y, z, w with w not negative, ``(n, 4)``, made at each call."""
        return self._native.quaternions


def load(paths: Any, **reading: Unpack[Reading]) -> list[Trajectory]:
    """Reads every log under some paths: files, or folders that are searched; or every log in a table.

    Parameters
    ----------
    paths
        One path, or several; or a table with ``__arrow_c_stream__``. A table is read as the csv file with the same
        columns would be, line 1 being its header; ``log_column`` names the column that tells several logs apart.
    **reading
        How they are read (:class:`Reading`).

    Returns
    -------
    list of Trajectory
        With unique names; logs of one recording share a group.

    Raises
    ------
    Error
        The first log that cannot be read, a path without a log.
    """
    if hasattr(paths, "__arrow_c_stream__"):
        natives = core.read_table("table", paths, dict(reading))
        return [Trajectory._of_native(native) for native in natives]
    if isinstance(paths, (str, os.PathLike)):
        paths = [paths]
    return [Trajectory._of_native(native) for native in core.read(list(paths), dict(reading))]
