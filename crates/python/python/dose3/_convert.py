"""What people hold poses and stamps in, as arrays."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]


def stamps_ns(stamps: ArrayLike) -> NDArray[np.int64]:
    """Stamps as nanoseconds: integers are nanoseconds, floats are seconds, ``datetime64`` is what it is."""
    found = np.asarray(stamps)
    if found.ndim != 1:
        raise ValueError(f"stamps: expected one number a pose, found an array of shape {found.shape}")
    if np.issubdtype(found.dtype, np.datetime64):
        return np.ascontiguousarray(found.astype("datetime64[ns]").astype(np.int64))
    if np.issubdtype(found.dtype, np.integer):
        return np.ascontiguousarray(found, dtype=np.int64)
    seconds = found.astype(np.float64)
    if not np.all(np.isfinite(seconds)):
        row = int(np.flatnonzero(~np.isfinite(seconds))[0])
        raise ValueError(f"stamps: stamp {row} is not finite")
    if np.any(np.abs(seconds) >= 9.2e9):
        row = int(np.flatnonzero(np.abs(seconds) >= 9.2e9)[0])
        raise ValueError(
            f"stamps: stamp {row} is {seconds[row]}, floats are seconds; hint: give nanoseconds as integers"
        )
    whole = np.floor(seconds)
    part = np.rint((seconds - whole) * 1e9)
    return whole.astype(np.int64) * 1_000_000_000 + part.astype(np.int64)


def positions_and_rotations(
    poses: Any, quaternions: Literal["xyzw", "wxyz"]
) -> tuple[Floats, Floats]:
    """Positions ``(n, 3)``, and quaternions ``(n, 4)`` (x, y, z, w) or matrices ``(n, 3, 3)``."""
    if quaternions not in ("xyzw", "wxyz"):
        raise ValueError(f"quaternions is {quaternions!r}, expected 'xyzw' or 'wxyz'")
    if isinstance(poses, tuple) and len(poses) == 2:
        positions, rotations = floats(poses[0]), _rotations(poses[1], quaternions)
        if positions.ndim != 2 or positions.shape[1] != 3:
            raise ValueError(f"positions: expected shape (n, 3), found {positions.shape}")
        if len(positions) != len(rotations):
            raise ValueError(f"found {len(positions)} positions and {len(rotations)} rotations")
        return positions, rotations
    if callable(getattr(poses, "as_matrix", None)):
        # scipy's RigidTransform.
        poses = poses.as_matrix()
    array = floats(poses)
    if array.ndim == 2 and array.shape[1] == 7:
        return np.ascontiguousarray(array[:, :3]), _wxyz_last(array[:, 3:], quaternions)
    if array.ndim == 3 and array.shape[1:] in ((4, 4), (3, 4)):
        if array.shape[1] == 4 and not np.array_equal(
            array[:, 3], np.broadcast_to([0.0, 0.0, 0.0, 1.0], (len(array), 4))
        ):
            raise ValueError("poses: the last row of each 4x4 matrix must be 0, 0, 0, 1")
        return np.ascontiguousarray(array[:, :3, 3]), np.ascontiguousarray(array[:, :3, :3])
    raise ValueError(
        f"poses: expected shape (n, 7), (n, 4, 4) or (n, 3, 4), or positions and rotations, found {array.shape}"
    )


def floats(values: ArrayLike) -> Floats:
    """An array of float64, row after row in memory."""
    return np.ascontiguousarray(values, dtype=np.float64)


def _rotations(rotations: Any, order: Literal["xyzw", "wxyz"]) -> Floats:
    if callable(getattr(rotations, "as_quat", None)):
        # scipy's Rotation: x, y, z, w.
        return floats(rotations.as_quat())
    array = floats(rotations)
    if array.ndim == 2 and array.shape[1] == 4:
        return _wxyz_last(array, order)
    if array.ndim == 3 and array.shape[1:] == (3, 3):
        return array
    raise ValueError(
        f"rotations: expected quaternions (n, 4), matrices (n, 3, 3) or scipy's Rotation, found shape {array.shape}"
    )


def _wxyz_last(quaternions: Floats, order: Literal["xyzw", "wxyz"]) -> Floats:
    return np.ascontiguousarray(np.roll(quaternions, -1, axis=1) if order == "wxyz" else quaternions)
