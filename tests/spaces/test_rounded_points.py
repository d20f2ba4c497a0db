"""Tolerance for points off a manifold: one rule, by the accuracy of their numbers, in every function."""

import io

import numpy as np
import pytest
from curves import points_on
from refused import raises
from scipy.spatial.transform import Rotation

import symspline as ss
from symspline._spaces import point_tol

SPACES = ["sphere:2", "sphere:3", "so:3", "se:3", "rp:2", "gr:2,5", "cp:2", "u:2", "spd:3", "h:2"]


def as_text(x, form):
    flat = np.stack([x.real, x.imag]) if np.iscomplexobj(x) else x[None]
    flat = np.array([float(form % y) for y in flat.ravel()]).reshape(flat.shape)
    return flat[0] + 1j * flat[1] if np.iscomplexobj(x) else flat[0]


WAYS = {
    "single precision": lambda x: x.astype(np.complex64 if np.iscomplexobj(x) else np.float32),
    "single precision in a list": lambda x: WAYS["single precision"](x).tolist(),
    "single precision in double": lambda x: WAYS["single precision"](x).astype(x.dtype),
    "single precision as text": lambda x: as_text(WAYS["single precision"](x).astype(x.dtype), "%.9g"),
    "single precision as long text": lambda x: as_text(WAYS["single precision"](x).astype(x.dtype), "%.12f"),
    "six significant digits": lambda x: as_text(x, "%.6g"),
    "six decimals": lambda x: x.round(6),
    "seven decimals": lambda x: x.round(7),
    "three decimals": lambda x: x.round(3),
}


@pytest.mark.parametrize("name", SPACES)
@pytest.mark.parametrize("way", WAYS)
def test_rounded_points_are_accepted_and_errors_are_not(name, way):
    space = ss.space(name)
    exact = points_on(space, 12, step=0.3)
    rounded = WAYS[way](exact)
    space.check_point(rounded)
    curve = ss.CubicSpline(None, rounded, space)
    assert np.abs(curve.points - exact).max() < (2e-3 if way == "three decimals" else 6e-6) * np.abs(exact).max()
    ss.HermiteSpline.from_points(None, rounded, space)
    ss.PiecewiseGeodesic(None, rounded, space)
    ss.GridSpline([np.arange(3), np.arange(4)], np.reshape(rounded, (3, 4, *space.point_shape)), space)
    # More than rounding.
    wrong = np.array(rounded, exact.dtype)
    wrong[5] *= 1.02
    if name == "se:3":
        wrong[5, 3, 3] = 1
    if name != "spd:3":
        for call in (ss.CubicSpline, ss.HermiteSpline.from_points, ss.PiecewiseGeodesic):
            raises(r"points\[5\] is off the space", call, None, wrong, space)


@pytest.mark.parametrize("seed", range(20))
def test_numbers_with_full_precision_have_the_small_tolerance(seed):
    rng = np.random.default_rng(seed)
    x = rng.normal(size=(rng.integers(2, 50), 3))
    assert point_tol(x) == 1e-8
    # This also holds among other numbers with few digits.
    x[1:] = np.eye(3)[0]
    assert point_tol(x) == 1e-8
    assert point_tol(x.astype(np.float32)) == point_tol(x.astype(np.float32).astype(float)) == 1e-4
    # Missing points are ignored.
    x[-1] = np.nan
    assert point_tol(x) == 1e-8
    assert point_tol(x.astype(np.float32).astype(float)) == 1e-4


@pytest.mark.parametrize("way", [way for way in WAYS if way != "three decimals"])
def test_rotations_in_every_form(way):
    """Quaternions, matrices, files and poses of the same rotations give the same curve."""
    turns = Rotation.from_rotvec(np.cumsum(np.random.default_rng(3).normal(0, 0.3, (20, 3)), axis=0))
    exact = turns.as_matrix()
    q = WAYS[way](turns.as_quat())
    found = [
        ss.rotations.from_quaternions(q, scalar_first=False),
        ss.rotations.from_quaternions(q, scalar_first=False),
    ]
    x = np.arange(60.0).reshape(20, 3) / 7
    lines = [
        " ".join(map(repr, [i, *a, *b]))
        for i, (a, b) in enumerate(zip(x.tolist(), np.asarray(q, float).tolist(), strict=True))
    ]
    found.append(ss.poses.read_tum(io.StringIO("\n".join(lines)))[1][:, :3, :3])
    m = WAYS[way](exact)
    found.append(ss.rotations.from_quaternions(ss.rotations.as_quaternions(m, scalar_first=True), scalar_first=True))
    found.append(ss.poses.join(m, x)[:, :3, :3])
    # The positions have full precision.
    found.append(ss.CubicSpline(None, ss.poses.join(m, x), "se:3").points[:, :3, :3])
    rows = np.concatenate([np.asarray(m, float), x[..., None]], axis=-1).reshape(20, 12).tolist()
    found.append(ss.poses.read_kitti(io.StringIO("\n".join(" ".join(map(repr, row)) for row in rows)))[1][:, :3, :3])
    for r in found:
        assert np.abs(r - exact).max() < 4e-6


def test_quaternions_that_are_off_by_more_raise_everywhere():
    q = Rotation.random(6, rng=2).as_quat()
    for factor, given in ((1 + 1e-6, q), (1.01, q.astype(np.float32)), (1.01, q.round(6))):
        wrong = np.asarray(given * factor)
        rows = "\n".join(" ".join(map(repr, [i, 0, 0, 0, *row])) for i, row in enumerate(wrong.tolist()))
        raises("not a unit quaternion", ss.rotations.from_quaternions, wrong, scalar_first=False)
        raises("the quaternion has length 1", ss.poses.read_tum, io.StringIO(rows))
