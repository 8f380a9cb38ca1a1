"""Models, and training one."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Sequence
from typing import TYPE_CHECKING, Any, Literal, TypedDict

from dose3 import _native as core
from dose3._options import PathLike
from dose3._trajectory import Trajectory

if TYPE_CHECKING:
    from typing_extensions import Self, Unpack


class Model:
    """Two networks that estimate noise on poses; what a detector measures logs with."""

    __slots__ = ("_native", "log")

    _native: core.Model
    #: The training log, a row every few steps; empty for a model from a file.
    log: list[TrainingStep]

    def __init__(self) -> None:
        raise TypeError("a model comes from dose3.train or Model.load")

    @classmethod
    def _of_native(cls, native: core.Model, log: list[TrainingStep]) -> Self:
        model = cls.__new__(cls)
        model._native = native
        model.log = log
        return model

    @classmethod
    def load(cls, path: PathLike) -> Self:
        """A built-in model by its name (``"motion"``, ``"paper"``), else a model file.

        Raises
        ------
        Error
            A file that is no model.
        """
        return cls._of_native(core.Model.load(path), [])

    @classmethod
    def from_bytes(cls, data: bytes) -> Self:
        """Reads the bytes of a model file.

        Raises
        ------
        Error
            As :meth:`load`.
        """
        return cls._of_native(core.Model.from_bytes(data), [])

    def save(self, path: PathLike, *, half: bool = False) -> None:
        """Writes a model file, whole or not at all; ``half`` stores weights in 16 bits."""
        self._native.save(path, half)

    def to_bytes(self) -> bytes:
        """The bytes of a model file."""
        return self._native.to_bytes()

    @property
    def header(self) -> dict[str, Any]:
        """What the file says about itself: representation, window, rate, frame, process, training."""
        parsed: dict[str, Any] = json.loads(self._native.header())
        return parsed

    def __reduce__(self) -> tuple[Any, ...]:
        return Model.from_bytes, (self.to_bytes(),)

    def __repr__(self) -> str:
        header = self.header
        kind = header["representation"]["kind"]
        return f"<Model of {kind} windows of {header['window']} at {header['rate']:g} Hz>"


class TrainingStep(TypedDict):
    """One row of a training log: means over a batch, validation losses where they were computed."""

    step: int
    learning_rate: float
    translation_eps: float
    translation_x0: float
    rotation_eps: float
    rotation_x0: float
    translation_validation: float | None
    rotation_validation: float | None


class TrainSettings(TypedDict, total=False):
    """Settings of :func:`train` beside those that it names."""

    window: int
    width: int
    multipliers: Sequence[int]
    diffusion_steps: int
    batch: int
    learning_rate: float
    hold_out: float | Sequence[str]
    resample: float
    checkpoint: PathLike


def train(
    logs: Iterable[Any],
    *,
    representation: Literal["motion", "paper"] = "motion",
    steps: int = 4000,
    seed: int = 0,
    threads: int = 0,
    progress: Callable[[int, int], object] | None = None,
    **settings: Unpack[TrainSettings],
) -> Model:
    """Trains a model. A detector needs none: two are built in.

    Parameters
    ----------
    logs
        Whatever :meth:`Trajectory.of` takes. Training wants many hours of motion.
    representation
        ``"motion"``: body-frame increments; ``"paper"``: positions from the window's start.
    steps
        Optimiser steps.
    seed
        Seed of everything random.
    threads
        Threads; 0 for one a core.
    progress
        Called now and then with steps done; what it raises ends the training. Ctrl-C does too, and a checkpoint stays.
    **settings
        ``window`` (poses), ``width`` and ``multipliers`` of the networks, ``diffusion_steps``, ``batch``,
        ``learning_rate``, ``hold_out`` (a share of the logs, or names), ``resample`` (hertz), ``checkpoint`` (a file
        from which a run goes on).

    Raises
    ------
    Error
        Logs shorter than a window or of different frames, settings out of range, divergence.
    """
    natives = [Trajectory.of(log)._native for log in logs]
    chosen = {"representation": representation, "steps": steps, "seed": seed, "threads": threads, **settings}
    native, log = core.train(natives, chosen, progress)
    return Model._of_native(native, json.loads(log))
