"""Is this pose log like the logs I trust? If not, where, and why?

A detector learns from trusted logs what motion looks like, through a diffusion model of poses that is built in; no
network is trained to fit one.

>>> import dose3
>>> trusted = [dose3.synthetic("vehicle", seed=seed, poses=600, rate=10.0) for seed in range(4)]
>>> detector = dose3.Detector.fit(trusted)
>>> report = detector.judge(dose3.synthetic("drone", seed=1, poses=600, rate=10.0))
>>> report.is_ood
True

Poses are ``T_world_body`` in metres, float64; stamps are integer nanoseconds; angles are radians; a higher score is
more out of distribution. The same input, seed and build give the same bytes for any number of threads.
"""

from dose3._detector import Counts, Detector, Judged
from dose3._faults import Injection, inject, synthetic
from dose3._native import Error, InternalError, __version__
from dose3._options import Frame, Reading
from dose3._report import Report
from dose3._stream import Stream
from dose3._training import Model, TrainingStep, train
from dose3._trajectory import Trajectory, load

__all__ = [
    "Counts",
    "Detector",
    "Error",
    "Frame",
    "Injection",
    "InternalError",
    "Judged",
    "Model",
    "Reading",
    "Report",
    "Stream",
    "TrainingStep",
    "Trajectory",
    "__version__",
    "inject",
    "load",
    "synthetic",
    "train",
]
