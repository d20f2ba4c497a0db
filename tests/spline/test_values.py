"""Curves as values: copies, comparison, and how they print."""

import copy
import io
import pickle

import numpy as np
import pytest
from cases import loop_over
from curves import (
    KNOTS,
    S2,
    THREE,
    every_batch,
    every_common,
    every_kind,
    found,
    points_on,
    same,
    same_curve,
    with_ends,
)

import symspline as ss


def saved_and_loaded(spline):
    file = io.BytesIO()
    spline.save(file)
    file.seek(0)
    return ss.load(file)


COPIES = {
    "file": saved_and_loaded,
    "pickle": lambda spline: pickle.loads(pickle.dumps(spline)),
    "copy": copy.copy,
    "deepcopy": copy.deepcopy,
}


@every_kind
@every_batch
@loop_over("how", COPIES)
def test_copies_are_bit_identical(space, batch, how):
    p = points_on(space, batch=batch, step=0.5)
    spline = ss.CubicSpline(KNOTS, p, space, bc_type=with_ends(space, p), extrapolate="geodesic")
    made = COPIES[how](spline)
    assert type(made) is type(spline) and same_curve(made, spline)
    assert made.space == space and made.extrapolate == "geodesic" and repr(made) == repr(spline)
    for ours, theirs in zip(spline.bc_type, made.bc_type, strict=True):
        assert ours[0] == theirs[0] and type(ours[1]) is type(theirs[1])
        assert same(ours[1], theirs[1]) and found(ours[1]) == found(theirs[1])
    x = [-1.0, 0.3, 4.0, 9.0]
    for nu in range(3):
        assert same(made(x, nu), spline(x, nu))
    # End conditions that were read back say the same again.
    again = ss.CubicSpline(KNOTS, p, space, bc_type=made.bc_type, extrapolate="geodesic")
    assert same_curve(again, spline)


@pytest.mark.parametrize("how", COPIES)
def test_splines_over_dates_copy(how):
    spline = ss.CubicSpline(np.datetime64("2024-01-01") + np.arange(3), THREE, S2)
    made = COPIES[how](spline)
    assert made == spline and made.t.dtype == spline.t.dtype
    assert same(made(spline.t), spline(spline.t))


@pytest.mark.parametrize("how", ["file", "pickle", "deepcopy"])
def test_the_arrays_of_a_copy_cannot_be_changed(how):
    made = COPIES[how](ss.CubicSpline(None, THREE, S2))
    assert not made.points.flags.writeable and not made.velocities.flags.writeable


def test_splines_compare():
    spline = ss.CubicSpline(None, THREE, S2)
    assert spline == ss.CubicSpline([0, 1, 2], THREE, "sphere:2")
    assert spline != ss.CubicSpline([0, 1, 3], THREE, S2)
    assert spline != ss.CubicSpline(None, THREE[::-1], S2)
    assert spline != ss.CubicSpline(None, THREE, S2, bc_type="clamped")
    assert spline != ss.CubicSpline(None, THREE, "r:3")
    assert spline != ss.CubicSpline(None, [THREE], S2)
    assert spline != ss.CubicSpline(None, (THREE, THREE), "sphere:2 x r:3")
    assert spline != "spline"
    with pytest.raises(TypeError, match="unhashable"):
        hash(spline)


@every_common
@every_batch
def test_curves_print(space, batch):
    line = repr(ss.CubicSpline(KNOTS, points_on(space, batch=batch, step=0.5), space))
    assert line.startswith("<CubicSpline") and repr(space) in line and "6 points, natural" in line
    assert "\n" not in line
    assert not batch or " x ".join(map(str, batch)) in line
