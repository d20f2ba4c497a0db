"""Neighbours almost at the cut locus: which way round the curve goes is decided by what nobody measured."""

import re
import warnings

import numpy as np
import pytest

import symspline as ss

BEGIN = "neighbours almost at the cut locus"
MARK = pytest.mark.parametrize(
    "name",
    ["sphere:2", "sphere:4", "rp:2", "cp:2", "gr:2,5", "cgr:2,4", "so:3", "so:5", "u:2", "su:3", "se:3"],
)


def cut_in(space, p, v):
    """How many times as long as v a geodesic is where others get shorter, by bisection."""
    low, high = 0.0, 20.0
    for _ in range(60):
        middle = (low + high) / 2
        shortest = space.distance(p, space.exp(p, middle * v)) > middle * space.norm(p, v) * (1 - 1e-9)
        low, high = (middle, high) if shortest else (low, middle)
    return low


def rotations(*angles):
    """Turned by these angles in degrees, one after the other, about one axis."""
    return ss.rotations.from_rotation_vectors(np.radians(np.cumsum([0, *angles]))[:, None] * [0, 0, 1])


def silent(call):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        return call()


def warned(call):
    with pytest.warns(UserWarning) as caught:
        result = call()
    (warning,) = caught
    # It points to the line that called, not into the package.
    assert warning.filename == __file__
    return result, str(warning.message)


@MARK
def test_within_a_hundred_thousandth(name):
    space = ss.space(name)
    rng = np.random.default_rng(3)
    p = space.random_point(rng)
    v = space.random_tangent(rng, p)
    cut = cut_in(space, p, v)

    def points(part):
        return np.stack([space.exp(p, x * v) for x in (0, 0.3 * cut, (0.3 + part) * cut)])

    silent(lambda: ss.CubicSpline(None, points(1 - 1.2e-5), space))
    with pytest.warns(UserWarning, match=rf"{BEGIN}: between points\[1\] and points\[2\] the angle is"):
        ss.CubicSpline(None, points(1 - 8e-6), space)


def test_the_warning_says_where_and_why():
    _, said = warned(lambda: ss.CubicSpline(None, rotations(20, 179.9999, 30), "so:3"))
    head, angle, tail = re.split(r"([\d.]+)(?=, limit)", said)
    assert head == f"{BEGIN}: between points[1] and points[2] the angle is "
    assert float(angle) == pytest.approx(np.radians(179.9999), rel=1e-14)
    assert tail == (
        f", limit {np.pi}; had it been a little more, the curve would go the other way round: put a point between them"
    )


def test_curves_of_a_batch():
    good, almost, bad = rotations(20, 30), rotations(20, 179.9999), rotations(180, 30)
    batch = np.stack([[good, almost], [almost, good]])
    _, said = warned(lambda: ss.CubicSpline(None, batch, "so:3"))
    assert "between points[1] and points[2] of curve 0,1 the" in said and said.endswith("(and 1 more curves)")
    _, said = warned(lambda: ss.fit_many([(None, good), (None, almost)], "so:3"))
    assert "between points[1] and points[2] of curve 1 the" in said
    silent(lambda: ss.CubicSpline(None, batch, "so:3", where=[[True, False], [False, True]]))
    _, said = warned(lambda: ss.CubicSpline(None, batch, "so:3", where=[[False, False], [True, True]]))
    assert "of curve 1,0 the" in said
    # What failed comes first.
    with pytest.raises(ss.CutLocusError, match="of curve 0 lie at or past"):
        silent(lambda: ss.CubicSpline(None, np.stack([bad, almost]), "so:3"))
    curves, said = warned(lambda: ss.CubicSpline(None, np.stack([bad, almost]), "so:3", on_failure="ignore"))
    assert "of curve 1 the" in said
    assert curves.report.converged.tolist() == [False, True]


def test_any_factor_of_a_product():
    almost, flat = rotations(20, 179.9999), np.zeros((3, 2))
    opposite = np.array([[1.0, 0, 0], [-1, 0, 0], [0, 1, 0]])
    warned(lambda: ss.CubicSpline(None, (flat, almost), "r:2 x so:3"))
    with pytest.raises(ss.CutLocusError, match="lie at or past"):
        silent(lambda: ss.CubicSpline(None, (almost, opposite), "so:3 x sphere:2"))


@pytest.mark.parametrize("bc_type", ["natural", "periodic"])
def test_long_curves_that_are_solved_in_pieces(bc_type):
    angles = np.full(4000, 360 / 4000)
    angles[3210] = 179.9999
    points = rotations(*angles[:-1], 360 - angles[:-1].sum() % 360)
    points[-1] = points[0]
    _, said = warned(lambda: ss.CubicSpline(None, points, "so:3", bc_type=bc_type, method="newton"))
    assert "between points[3210] and points[3211] the" in said


def test_in_the_span_of_the_points():
    e = np.eye(3, 50_000)
    turn = np.pi - 1e-6
    points = [e[2], e[0], np.cos(turn) * e[0] + np.sin(turn) * e[1]]
    warned(lambda: ss.CubicSpline(None, points, "sphere:49999"))
