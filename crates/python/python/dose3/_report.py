"""What is said of a log."""

from __future__ import annotations

import html
import json
from typing import TYPE_CHECKING, Any

from dose3 import _native as core

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray
    from typing_extensions import Self


class Report:
    """The verdict on one log, with what it rests on, where in the log, and why.

    ``print(report)`` is the summary that the program prints.
    """

    __slots__ = ("_dict", "_native")

    _native: core.Report
    _dict: dict[str, Any] | None

    def __init__(self) -> None:
        raise TypeError("a report comes from Detector.judge, or Report.from_json")

    @classmethod
    def _of_native(cls, native: core.Report) -> Self:
        report = cls.__new__(cls)
        report._native = native
        report._dict = None
        return report

    @classmethod
    def from_json(cls, text: str) -> Self:
        """The report in the JSON of :meth:`to_json`, or in one of the ``logs`` of ``dose3 score --json``. It has no
        :attr:`pose_scores`.

        Raises
        ------
        Error
            Text that is no report.
        """
        return cls._of_native(core.Report.from_json(text))

    def to_json(self, *, pretty: bool = False) -> str:
        """Everything but :attr:`pose_scores` as JSON, byte for byte as the program writes it."""
        return self._native.to_json(pretty)

    def to_dict(self) -> dict[str, Any]:
        """Everything but :attr:`pose_scores` as Python's own types; the names are those of ``dose3 score --json``."""
        parsed: dict[str, Any] = json.loads(self._native.to_json(False))
        return parsed

    def _parsed(self) -> dict[str, Any]:
        if self._dict is None:
            self._dict = self.to_dict()
        return self._dict

    def __str__(self) -> str:
        return str(self._native)

    def __repr__(self) -> str:
        return f"<Report {self.name!r}: {self.verdict}, chance {self.chance:.3g}, score {self.score:.3g}>"

    def __reduce__(self) -> tuple[Any, ...]:
        return Report.from_json, (self.to_json(),)

    @property
    def name(self) -> str:
        """Name of the log."""
        return self._native.name

    @property
    def path(self) -> str:
        """File of the log; empty for poses that were in memory."""
        return self._native.path

    @property
    def verdict(self) -> str:
        """``in-distribution`` or ``out-of-distribution``; ``like`` or ``unlike`` the only trusted log."""
        return str(self._parsed()["verdict"])

    @property
    def is_ood(self) -> bool:
        """Whether the log is out of distribution."""
        return self._native.is_ood

    @property
    def chance(self) -> float:
        """Chance that a log like the trusted ones is so unusual, in (0, 1]; the log differs at alpha or less."""
        return self._native.chance

    @property
    def score(self) -> float:
        """Mean score of its windows; higher is more out of distribution."""
        return self._native.score

    @property
    def notes(self) -> list[str]:
        """What there is to know, in sentences."""
        return self._native.notes

    @property
    def segments(self) -> list[dict[str, Any]]:
        """Where: runs of windows beyond the threshold, and the run that decided where the log differs."""
        return list(self._parsed()["segments"])

    @property
    def pose_spans(self) -> list[dict[str, Any]]:
        """Runs of poses that stick out within the segments, the worst first."""
        return list(self._parsed()["pose_spans"])

    @property
    def reasons(self) -> list[dict[str, Any]]:
        """Why, in plain quantities: the strongest reasons of all segments, each with its ``sentence``."""
        return list(self._parsed()["reasons"])

    @property
    def contributions(self) -> list[dict[str, Any]]:
        """Which groups of statistics drove the scores, the strongest first."""
        return list(self._parsed()["contributions"])

    @property
    def windows(self) -> list[dict[str, Any]]:
        """Every window, in order."""
        return list(self._parsed()["windows"])

    @property
    def pose_scores(self) -> NDArray[np.float64]:
        """Score of every pose as judged, ``(n,)``: 1 is what one trusted pose in a thousand reaches; NaN where no
        window reaches. Empty in a report from JSON."""
        return self._native.pose_scores

    def to_pandas(self) -> Any:
        """Every window as a row of a ``pandas.DataFrame``: poses, rows and stamps, score, p-value, beyond."""
        import pandas as pd

        frame = pd.DataFrame(self.windows)
        frame.insert(0, "log", self.name)
        return frame

    def plot(self, ax: Any = None) -> Any:
        """Window scores over time, the threshold, and the segments; needs matplotlib.

        Parameters
        ----------
        ax
            Axes to draw on; new ones where None.

        Returns
        -------
        matplotlib.axes.Axes
        """
        if ax is None:
            import matplotlib.pyplot as plt

            _, ax = plt.subplots(figsize=(9, 3))
        windows = self.windows
        start = windows[0]["first_stamp_ns"] if windows else 0
        middle = [((w["first_stamp_ns"] + w["last_stamp_ns"]) / 2 - start) * 1e-9 for w in windows]
        ax.plot(middle, [w["score"] for w in windows], marker=".", linewidth=1, label="window score")
        ax.axhline(self._parsed()["evidence"]["threshold"], linestyle="--", linewidth=1, label="threshold")
        for segment in self.segments:
            ax.axvspan(segment["start_s"], segment["end_s"], alpha=0.2)
        ax.set_xlabel("seconds")
        ax.set_ylabel("score (higher: more unusual)")
        ax.set_title(f"{self.name}: {self.verdict}, chance {self.chance:.2g}")
        ax.legend()
        return ax

    def to_html(self) -> str:
        """The page that ``dose3 score --html`` writes: verdict, path, scores and motion in one file that needs no network.

        Raises
        ------
        Error
            A report from JSON, a pickle or :meth:`Detector.judge_many`: those keep no log. ``Detector.judge`` does.
        """
        page = self._native.to_html()
        if page is None:
            raise core.Error(f"the report of {self.name} keeps no log to show; judge it with Detector.judge")
        return page

    def _repr_html_(self) -> str:
        page = self._native.to_html()
        if page is None:
            return f"<pre>{html.escape(str(self))}</pre>"
        # A document of its own, so that its styles do not reach the notebook's.
        return f'<iframe srcdoc="{html.escape(page)}" width="100%" height="700" style="border:0"></iframe>'
