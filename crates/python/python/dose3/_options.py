"""Keyword arguments that several functions take."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from typing import Literal, TypedDict, Union

#: What the axes of the moving body are: a camera (x right, y down, z forward), a vehicle (x forward, y right, z down;
#: or x forward, y left, z up), a tracked object, or a sensor of unknown mounting.
Frame = Literal["camera-rdf", "body-frd", "body-flu", "object", "sensor"]

PathLike = Union[str, "os.PathLike[str]"]


class Reading(TypedDict, total=False):
    """How files are read, where they do not say it themselves. The names are those of the program's flags.

    Attributes
    ----------
    format
        Format of the files; told by their content otherwise.
    frame
        Body frame of logs whose format does not say it.
    frames
        Body frames of single logs by name, whatever their format says.
    rate
        Poses a second, in place of the stamps in the file.
    nominal_rate
        Rate of logs without stamps, hertz.
    unit
        Metres in one unit of position; replaces what a header says.
    times
        File with the stamps of a KITTI log.
    max_gap
        Longest step between stamps that is not a gap, seconds.
    stamp_unit
        Unit of the stamps.
    columns
        Columns of text files: ``"t,x,y,z,qw,qx,qy,qz"``, or pairs such as ``"t=stamp,x=3,yaw=heading"``.
    log_column
        Column of tables that tells several logs apart.
    lost
        What marks rows without a pose.
    strict
        Whether lost tracking is an error instead of a gap, and a log that cannot be used stops a fit.
    topics
        Topics of a recording; topic, rigid body, list or array of a table, JSON or npz file with several.
    tf
        Parent and child frame to be looked up in a recording's transforms.
    stamp
        Whether a recording's stamps are those of message headers or the times of recording.
    """

    format: str
    frame: Frame
    frames: Mapping[str, Frame]
    rate: float
    nominal_rate: float
    unit: float
    times: PathLike
    max_gap: float
    stamp_unit: Literal["s", "ms", "us", "ns"]
    columns: str
    log_column: str
    lost: Sequence[Literal["nan", "zero", "identity"]]
    strict: bool
    topics: Sequence[str]
    tf: tuple[str, str]
    stamp: Literal["header", "record"]
