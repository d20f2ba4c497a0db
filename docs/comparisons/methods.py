"""Curves through the samples that were kept: those of symspline, and those of SciPy."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from angles import body_rate, from_body_rate
from numpy.typing import NDArray
from recordings import Recording
from scipy.interpolate import CubicSpline, make_interp_spline
from scipy.spatial.transform import Rotation, RotationSpline, Slerp

import symspline as ss

Array = NDArray[np.float64]
Curve = Callable[[Array], Array]


class Motion(NamedTuple):
    """A reconstructed motion, by time."""

    rotations: Curve
    """Rotation matrices."""
    positions: Curve | None = None
    """Positions in metres; of recordings that have them."""
    rates: Curve | None = None
    """Angular velocity in the frame of the body, rad/s; of recordings that have it."""


def of_poses(kept: Recording) -> dict[str, Motion]:
    """Motions through poses."""
    poses = np.zeros((len(kept.t), 4, 4))
    poses[:, :3, :3], poses[:, :3, 3], poses[:, 3, 3] = kept.rotations, kept.positions, 1
    apart = ss.Product(ss.SpecialOrthogonal(3), ss.Euclidean(3))
    motions = {}
    for ends in ("natural", "not-a-knot"):
        pair = ss.CubicSpline(kept.t, (kept.rotations, kept.positions), apart, bc_type=ends)
        motions[f"symspline, SO(3) × R³, {ends}"] = Motion(*_parts(pair))
    for ends in ("natural", "not-a-knot"):
        screw = ss.CubicSpline(kept.t, poses, ss.SpecialEuclidean(3), bc_type=ends)
        motions[f"symspline, SE(3), {ends}"] = Motion(*_pose_parts(screw))
    motions["SciPy, RotationSpline and CubicSpline"] = Motion(
        _scipy_spline(kept)[0], CubicSpline(kept.t, kept.positions)
    )
    motions["SciPy, Slerp and straight lines"] = Motion(
        _slerp(kept)[0], make_interp_spline(kept.t, kept.positions, k=1)
    )
    return motions


def of_orientations(kept: Recording, end_rates: Array | None = None) -> dict[str, Motion]:
    """Motions through orientations, one of them with these angular velocities at both ends, shape (2, 3)."""
    conditions: dict[str, Any] = {"natural": "natural", "not-a-knot": "not-a-knot"}
    if end_rates is not None:
        first, last = from_body_rate(kept.rotations[[0, -1]], end_rates)
        conditions["end velocities measured"] = ((1, first), (1, last))
    motions = {}
    for name, ends in conditions.items():
        spline = ss.CubicSpline(kept.t, kept.rotations, ss.SpecialOrthogonal(3), bc_type=ends)
        motions[f"symspline, {name}"] = Motion(spline, None, _rates(spline))
    for name, (rotations, rates) in (("RotationSpline", _scipy_spline(kept)), ("Slerp", _slerp(kept))):
        motions[f"SciPy, {name}"] = Motion(rotations, None, rates)
    return motions


def _rates(spline: Any) -> Curve:
    return lambda x: body_rate(spline(x), spline(x, nu=1))


def _parts(spline: Any) -> tuple[Curve, Curve]:
    return lambda x: spline(x)[0], lambda x: spline(x)[1]


def _pose_parts(spline: Any) -> tuple[Curve, Curve]:
    return lambda x: spline(x)[:, :3, :3], lambda x: spline(x)[:, :3, 3]


def _scipy_spline(kept: Recording) -> tuple[Curve, Curve]:
    spline = RotationSpline(kept.t, Rotation.from_matrix(kept.rotations))
    return lambda x: spline(x).as_matrix(), lambda x: spline(x, 1)


def _slerp(kept: Recording) -> tuple[Curve, Curve]:
    rotations = Rotation.from_matrix(kept.rotations)
    slerp = Slerp(kept.t, rotations)
    # The angular velocity of a turn about a fixed axis is the same in the world and in the body.
    turns = (rotations[:-1].inv() * rotations[1:]).as_rotvec() / np.diff(kept.t)[:, None]
    last = len(turns) - 1
    return (
        lambda x: slerp(x).as_matrix(),
        lambda x: turns[np.clip(np.searchsorted(kept.t, x, side="right") - 1, 0, last)],
    )
