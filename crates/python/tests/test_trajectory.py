"""Poses in and out."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import dose3
import numpy as np
import pytest


def drive(n: int = 40) -> tuple[np.ndarray, np.ndarray]:
    """Stamps and matrices of a bend."""
    matrices = np.tile(np.eye(4), (n, 1, 1))
    for i in range(n):
        yaw = 0.02 * i
        matrices[i, :2, :2] = [[np.cos(yaw), -np.sin(yaw)], [np.sin(yaw), np.cos(yaw)]]
        matrices[i, :3, 3] = [0.5 * i, 0.1 * np.sin(i), -0.25]
    return np.arange(n, dtype=np.int64) * 100_000_000, matrices


def test_matrices_come_back_bit_for_bit_and_views_are_not_copied() -> None:
    stamps, matrices = drive()
    log = dose3.Trajectory(stamps, matrices, frame="body-flu", name="bend", group="route")
    assert (log.name, log.group, log.frame, log.format) == ("bend", "route", "body-flu", "memory")
    np.testing.assert_array_equal(log.poses, matrices)
    np.testing.assert_array_equal(log.positions, matrices[:, :3, 3])
    np.testing.assert_array_equal(log.rotations, matrices[:, :3, :3])
    np.testing.assert_array_equal(log.stamps, stamps)
    for name in ("poses", "positions", "rotations", "stamps"):
        first, second = getattr(log, name), getattr(log, name)
        assert np.shares_memory(first, second), name
        with pytest.raises(ValueError, match="read-only"):
            first[0] = 0
    # A view outlives the name of its log.
    positions = log.positions
    del log
    np.testing.assert_array_equal(positions, matrices[:, :3, 3])


def test_every_way_of_saying_a_pose_says_the_same() -> None:
    rotation = pytest.importorskip("scipy.spatial.transform").Rotation
    stamps, matrices = drive()
    positions, rotations = matrices[:, :3, 3], rotation.from_matrix(matrices[:, :3, :3])
    xyzw = rotations.as_quat()
    wxyz = np.roll(xyzw, 1, axis=1)
    ways: dict[str, dose3.Trajectory] = {
        "n34": dose3.Trajectory(stamps, matrices[:, :3]),
        "n7": dose3.Trajectory(stamps, np.hstack([positions, xyzw])),
        "n7 wxyz": dose3.Trajectory(stamps, np.hstack([positions, wxyz]), quaternions="wxyz"),
        "scipy": dose3.Trajectory(stamps, (positions, rotations)),
        "quaternions": dose3.Trajectory(stamps, (positions.tolist(), xyzw.tolist())),
        "float32": dose3.Trajectory(stamps, matrices.astype(np.float32)),
        "fortran": dose3.Trajectory(stamps, np.asfortranarray(matrices)),
        "seconds": dose3.Trajectory(stamps * 1e-9, matrices),
        "datetime": dose3.Trajectory(stamps.astype("datetime64[ns]"), matrices),
        "rate": dose3.Trajectory(None, matrices, rate=10.0),
        "evo": dose3.Trajectory.of(
            SimpleNamespace(positions_xyz=positions, orientations_quat_wxyz=wxyz, timestamps=stamps * 1e-9)
        ),
    }
    for way, log in ways.items():
        np.testing.assert_allclose(log.poses, matrices, atol=1e-6, err_msg=way)
        np.testing.assert_array_equal(log.stamps, stamps, err_msg=way)
        np.testing.assert_allclose(np.abs(log.quaternions), np.abs(xyzw), atol=1e-6, err_msg=way)
    assert not ways["rate"].has_stamps and ways["seconds"].has_stamps


def test_a_trajectory_of_evo_is_taken() -> None:
    trajectory = pytest.importorskip("evo.core.trajectory")
    stamps, matrices = drive()
    theirs = trajectory.PoseTrajectory3D(poses_se3=list(matrices), timestamps=stamps * 1e-9)
    log = dose3.Trajectory.of(theirs, frame="body-flu")
    np.testing.assert_allclose(log.poses, matrices, atol=1e-12)
    assert log.frame == "body-flu"


@pytest.mark.parametrize(
    ("stamps", "poses", "settings", "error", "text"),
    [
        ([0, 1, 1], np.tile(np.eye(4), (3, 1, 1)), {}, dose3.Error, "a stamp later than the one before"),
        ([0, 1], np.tile(np.eye(4), (3, 1, 1)), {}, dose3.Error, "2 stamps and 3 poses"),
        ([0, 1], np.tile(2 * np.eye(3, 4), (2, 1, 1)), {}, dose3.Error, "expected a rotation"),
        ([0, 1], np.zeros((2, 7)), {}, dose3.Error, "expected a unit quaternion, found norm 0"),
        ([0, 1], np.full((2, 7), np.nan), {}, dose3.Error, "pose 0"),
        ([0, 1], np.zeros((2, 5)), {}, ValueError, r"found \(2, 5\)"),
        ([0.0, np.nan], np.zeros((2, 7)), {}, ValueError, "stamp 1 is not finite"),
        ([0.0, 1.7e18], np.zeros((2, 7)), {}, ValueError, "floats are seconds"),
        (None, np.zeros((2, 7)), {}, ValueError, "needs a rate"),
        ([0, 1], np.zeros((2, 7)), {"frame": "sideways"}, ValueError, "unknown frame `sideways`"),
        ([0, 1], np.full((2, 4, 4), 1.0), {}, ValueError, "last row"),
    ],
)
def test_what_is_no_log_is_refused(
    stamps: Any, poses: np.ndarray, settings: dict[str, Any], error: type[Exception], text: str
) -> None:
    with pytest.raises(error, match=text):
        dose3.Trajectory(stamps, poses, **settings)


def test_files_and_their_bytes_are_the_same_log(folder: Path) -> None:
    path = folder / "trusted" / "run1.tum"
    from_path = dose3.Trajectory.of(path, frame="body-flu")
    from_bytes = dose3.Trajectory.from_bytes(path.read_bytes(), name=str(path), frame="body-flu")
    assert from_path.fingerprint == from_bytes.fingerprint
    assert (from_path.name, from_bytes.name) == ("run1", "run1")
    assert from_path.frame == "body-flu" and len(dose3.load(folder / "trusted")) == 12
    with pytest.raises(dose3.Error, match=r"broken.tum:2: .*three"):
        dose3.load(folder / "new" / "broken.tum")
    with pytest.raises(dose3.Error, match="expected exactly one log, found 12"):
        dose3.Trajectory.load(folder / "trusted")
    with pytest.raises(TypeError, match="unexpected keyword argument 'fromat'"):
        dose3.load(path, fromat="tum")  # type: ignore[call-arg]
    with pytest.raises(ValueError, match="unknown format `tom`"):
        dose3.load(path, format="tom")


@pytest.mark.parametrize("settings", [{"poses": 1}, {"poses": 2**62}, {"rate": 1e-300}, {"rate": float("nan")}])
def test_logs_that_no_machine_holds_are_refused(settings: dict[str, Any]) -> None:
    with pytest.raises(ValueError, match=f"{next(iter(settings))} is"):
        dose3.synthetic("vehicle", **settings)
