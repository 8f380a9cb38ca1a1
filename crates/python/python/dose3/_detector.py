"""Detectors."""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

from dose3 import _native as core
from dose3._options import Frame, PathLike, Reading
from dose3._report import Report
from dose3._stream import Stream
from dose3._training import Model
from dose3._trajectory import Trajectory

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray
    from typing_extensions import Self, Unpack


class FitSettings(Reading, total=False):
    """Settings of :meth:`Detector.fit` beside those of reading."""

    statistics: str
    density: str
    combination: Literal["joint", "fisher", "harmonic-mean", "maximum"]
    shares: Sequence[float]
    overlap: bool
    timing: bool
    calibration: bool
    keep_all: bool
    resample: float
    window: int
    stride: int
    steps: int
    draws: int
    noise: Literal["shared", "own"]


@dataclass(frozen=True)
class Judged:
    """What came of one log of :meth:`Detector.judge_many`: a report, or an error.

    Attributes
    ----------
    path
        The file as it was named; empty for poses that were in memory.
    report
        What is said of the log; None where it could not be judged.
    error
        Why not; None where it could.
    """

    path: str
    report: Report | None
    error: core.Error | None

    def unwrap(self) -> Report:
        """The report.

        Raises
        ------
        Error
            Why there is none.
        """
        if self.report is None:
            raise self.error or core.Error("no report")
        return self.report


class Counts(NamedTuple):
    """How many logs could be judged, are out of distribution, and could not be judged."""

    judged: int
    ood: int
    failed: int


class Detector:
    """Judges logs by what it learnt from trusted ones.

    It carries its model, so one value (and one file) judges a log. Detector files hold numbers and JSON, no code:
    loading one from a stranger runs nothing.

    Examples
    --------
    >>> trusted = [dose3.synthetic("vehicle", seed=seed, poses=600, rate=10.0) for seed in range(12)]
    >>> detector = Detector.fit(trusted)
    >>> log = dose3.synthetic("vehicle", seed=20, poses=600, rate=10.0)
    >>> faulty = dose3.inject("freeze:2.0s", log, start=300, stop=400).log
    >>> [detector.judge(log).is_ood for log in (log, faulty)]
    [False, True]
    """

    __slots__ = ("_native", "notes")

    _native: core.Detector
    #: What there is to know of the fit, in sentences; empty for a detector from a file.
    notes: list[str]

    def __init__(self) -> None:
        raise TypeError("a detector comes from Detector.fit or Detector.load")

    @classmethod
    def _of_native(cls, native: core.Detector, notes: list[str]) -> Self:
        detector = cls.__new__(cls)
        detector._native = native
        detector.notes = notes
        return detector

    @classmethod
    def fit(
        cls,
        logs: Iterable[Any] | PathLike,
        group: str | Sequence[str] | None = None,
        *,
        model: Model | PathLike | None = None,
        alpha: float = 0.05,
        seed: int = 0,
        threads: int = 0,
        progress: Callable[[int, int], object] | None = None,
        **settings: Unpack[FitSettings],
    ) -> Self:
        """Learns what trusted logs look like. No network is trained.

        Parameters
        ----------
        logs
            Trusted logs: paths of files and folders, or whatever :meth:`Trajectory.of` takes.
        group
            Which logs count as one, because they are runs of one route or parts of one recording: ``"folder"``, a
            pattern of file names with {} for the group's name (``"{}_run*"``), or a name for each log.
        model
            A model, the name of a built-in one (``"motion"``, the usual one, or ``"paper"``), or a file.
        alpha
            Share of trusted logs, and of trusted windows, that may be rejected, in (0, 1).
        seed
            Seed of noise and fit.
        threads
            Threads; 0 for one a core. The result does not depend on it.
        progress
            Called now and then with windows done and windows in all; what it raises ends the fit.
        **settings
            How files are read (:class:`Reading`), and: ``statistics`` (named sets, ``+`` for one density, ``,`` for a
            density each, ``/`` for a test of their own), ``density``, ``combination``, ``shares`` of alpha of the tests,
            ``overlap`` (whether logs that share a recording are joined), ``timing`` and ``calibration`` (whether these
            are asked), ``keep_all``, ``resample`` (rate at which logs are measured, hertz), ``window`` (its steps),
            ``stride`` of windows in poses, ``steps``, ``draws`` and ``noise``. What is not
            given is what the program takes.

        Returns
        -------
        Detector
            What was left out and found while fitting is in its ``notes``.

        Raises
        ------
        Error
            No log; logs that do not fit together or are shorter than a window; too few windows.
        """
        if isinstance(logs, (str, os.PathLike)):
            logs = [logs]
        sources = [_source(log, settings) for log in logs]
        chosen = {"alpha": alpha, "seed": seed, "threads": threads, **settings}
        named = model._native if isinstance(model, Model) else model
        native, notes = core.Detector.fit(sources, named, group, chosen, progress)
        return cls._of_native(native, notes)

    @classmethod
    def load(cls, path: PathLike) -> Self:
        """Reads a detector file of this package or the program, and checks all of it.

        Raises
        ------
        Error
            A file that is no detector, or of a version from the future.
        """
        return cls._of_native(core.Detector.load(path), [])

    @classmethod
    def from_bytes(cls, data: bytes) -> Self:
        """Reads the bytes of a detector file.

        Raises
        ------
        Error
            As :meth:`load`.
        """
        return cls._of_native(core.Detector.from_bytes(data), [])

    def save(self, path: PathLike) -> None:
        """Writes a detector file, whole or not at all.

        Raises
        ------
        Error
            A file that cannot be written.
        """
        self._native.save(path)

    def to_bytes(self) -> bytes:
        """The bytes of a detector file."""
        return self._native.to_bytes()

    def judge(
        self, log: Any, *, alpha: float | None = None, threads: int = 0, **reading: Unpack[Reading]
    ) -> Report:
        """Judges a log.

        Parameters
        ----------
        log
            Whatever :meth:`Trajectory.of` takes: a trajectory, a path, bytes, a trajectory of evo.
        alpha
            Share of trusted logs that may be rejected, in (0, 1); the detector's where None.
        threads
            Threads; 0 for one a core. The report does not depend on it.
        **reading
            How it is read (:class:`Reading`).

        Raises
        ------
        Error
            A log in another frame, in another unit, too slow, without one window, or that cannot be read.
        """
        log = Trajectory.of(log, **reading)
        return Report._of_native(self._native.judge(log._native, alpha, threads))

    def judge_many(
        self,
        logs: Iterable[Any] | PathLike,
        *,
        threads: int = 0,
        alpha: float | None = None,
        **reading: Unpack[Reading],
    ) -> Iterator[Judged]:
        """Judges many logs at once, a log a thread; a log that cannot be judged does not stop the others.

        Results come in the order of the paths, as soon as they are there; only a few logs are in memory at a time, and
        no more of an iterable is taken than that needs. A sequence of paths is searched first, so that logs have the
        names that the program gives them; the items of an iterator are named one by one, and ``path`` tells them apart.

        Parameters
        ----------
        logs
            Paths of files and of folders that are searched, or whatever :meth:`Trajectory.of` takes.
        threads
            Threads; 0 for one a core. Reports do not depend on it.
        alpha
            Share of trusted logs that may be rejected, in (0, 1); the detector's where None.
        **reading
            How they are read (:class:`Reading`).

        Yields
        ------
        Judged
            A report, or the error, for each log.
        """
        return _judged(self._native.judge_many(_sources(logs, reading), alpha, threads, dict(reading)))

    def write_table(
        self,
        path: PathLike,
        logs: Iterable[Any] | PathLike,
        *,
        threads: int = 0,
        alpha: float | None = None,
        **reading: Unpack[Reading],
    ) -> Counts:
        """Judges logs as :meth:`judge_many` does and writes a row for each to a Parquet file, whole or not at all.

        The columns are those of ``dose3 score --out results.parquet``: log, path, verdict, chance, score, stretches as
        lists, the error of a log that could not be judged, versions, and more. Memory does not grow with the number of
        logs.

        Parameters
        ----------
        path
            The file; one that is there is replaced.
        logs, threads, alpha, **reading
            As :meth:`judge_many` takes them.

        Raises
        ------
        Error
            A file that cannot be written.
        """
        counts = self._native.write_table(path, _sources(logs, reading), alpha, threads, dict(reading))
        return Counts(*counts)

    def row(self, judged: Judged) -> dict[str, Any]:
        """The row of a log as :meth:`write_table` writes it, for tables of other engines."""
        error = None if judged.error is None else str(judged.error)
        report = None if judged.report is None else judged.report._native
        row: dict[str, Any] = json.loads(self._native.row(judged.path, report, error))
        return row

    def stream(
        self,
        frame: Frame | None = None,
        *,
        alarms_per_hour: float = 1.0,
        every: int | None = None,
        rate: float | None = None,
        max_gap: float | None = None,
        reset: float | None = None,
        windows: bool = True,
    ) -> Stream:
        """Judges poses as they come.

        Parameters
        ----------
        frame
            What the axes of the body are; those of the trusted logs where None.
        alarms_per_hour
            False alarms an hour that are allowed on logs like the trusted ones, above 0 and at most 60.
        every
            Poses at the detector's rate from one window to the next, a divisor of its stride; a quarter of that where
            None.
        rate
            Poses a second that will come; measured from the first ones where None.
        max_gap
            Seconds without a pose that end a stretch.
        reset
            Metres from one pose to the next that are a jump of the estimator's world, not a motion.
        windows
            Whether every window is answered, or alarms and events only.

        Raises
        ------
        Error
            Settings out of range, another frame, a detector of windows that count poses, not time.
        """
        settings = {
            "alarms_per_hour": alarms_per_hour,
            "every": every,
            "rate": rate,
            "max_gap": max_gap,
            "reset": reset,
            "windows": windows,
        }
        return Stream._of_native(self._native.stream(frame or self.frame, settings))

    def decision_function(
        self, logs: Iterable[Any] | PathLike, *, threads: int = 0, **reading: Unpack[Reading]
    ) -> NDArray[np.float64]:
        """The score of each log, as in PyOD: higher is more out of distribution.

        It is the mean score of the log's windows, by which ``dose3 eval`` ranks logs. The verdict rests on the
        calibrated chance instead (:attr:`Report.chance`).

        Raises
        ------
        Error
            The first log that cannot be judged.
        """
        import numpy as np

        judged = self.judge_many(logs, threads=threads, **reading)
        return np.array([one.unwrap().score for one in judged], dtype=np.float64)

    def __reduce__(self) -> tuple[Any, ...]:
        return Detector.from_bytes, (self.to_bytes(),)

    def __repr__(self) -> str:
        return (
            f"<Detector of {len(self.trusted)} trusted logs: {self.statistics} at {self.rate:g} Hz, "
            f"frame {self.frame}, alpha {self.alpha:g}>"
        )

    @property
    def alpha(self) -> float:
        """Share of trusted logs that may be rejected."""
        return self._native.alpha

    @property
    def statistics(self) -> str:
        """The statistics."""
        return self._native.statistics

    @property
    def rate(self) -> float:
        """Rate at which logs are measured, hertz."""
        return self._native.rate

    @property
    def frame(self) -> str:
        """Body frame of the trusted logs."""
        return self._native.frame

    @property
    def trusted(self) -> list[str]:
        """Names of the trusted logs."""
        return self._native.trusted

    @property
    def version(self) -> str:
        """Version of dose3 that fitted it."""
        return self._native.version


def _sources(logs: Iterable[Any] | PathLike, reading: Reading) -> Iterable[Any]:
    """A list where ``logs`` is a sequence."""
    if isinstance(logs, (str, os.PathLike)):
        logs = [logs]
    if isinstance(logs, Sequence):
        return [_source(log, reading) for log in logs]
    return (_source(log, reading) for log in logs)


def _source(log: Any, reading: Reading) -> Any:
    if isinstance(log, (str, os.PathLike)):
        return log
    if isinstance(log, Trajectory):
        return log._native
    names = Reading.__annotations__
    return Trajectory.of(log, **{k: v for k, v in reading.items() if k in names})._native  # type: ignore[arg-type]


def _judged(native: core.Judging) -> Iterator[Judged]:
    for path, report, error in native:
        yield Judged(path, None if report is None else Report._of_native(report), error)
