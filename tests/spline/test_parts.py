"""Parts of curves between knots, reversed curves, and curves at later times."""

from datetime import timedelta

import numpy as np
import pytest
from compare import close, each
from curves import KNOTS, every_batch, every_kind, points_on
from refused import raises
from stored import restored

import symspline as ss

X = np.linspace(KNOTS[0], KNOTS[-1], 41)


@every_kind
@every_batch
def test_parts_and_copies_are_exact(space, batch):
    curve = ss.CubicSpline(KNOTS, points_on(space, batch=batch, step=0.5), space)
    part, back, later = curve.restrict(KNOTS[1], KNOTS[-2]), curve.reverse(), curve.shift(0.75)
    # At the last knot, points of quotient spaces have the representative of the next segment in the whole curve.
    inner = np.linspace(KNOTS[1], KNOTS[-2], 20, endpoint=False)
    mirrored = np.clip(KNOTS[0] + KNOTS[-1] - X, KNOTS[0], KNOTS[-1])
    for nu in (0, 1, 2):
        assert close(part(inner, nu), curve(inner, nu), 1e-12 if nu < 2 else 1e-11)
        assert close(later(X + 0.75, nu), curve(X, nu), 1e-12 if nu < 2 else 1e-11)
        # Points of quotient spaces are compared below: their representatives depend on the direction.
        if not any(name in str(space) for name in ("cp:", "gr:")):
            # At knots the accelerations of the two sides agree up to the residual.
            expected = each(lambda v, nu=nu: (-1) ** nu * v, curve(mirrored, nu))
            assert close(back(X, nu), expected, 1e-9 if nu == 2 else 1e-12)
    assert np.max(space.distance(back(X), curve(mirrored))) < 1e-7
    assert close(back.speed(X), curve.speed(mirrored))
    assert part.t.tolist() == list(KNOTS[1:-1]) and back.domain == curve.domain


def test_dates_and_policies(rng):
    days = np.arange("2024-02-27", "2024-03-04", dtype="M8[D]")
    points = ss.Sphere(2).project(rng.standard_normal((6, 3)) * 0.3 + [1, 0, 0])
    points[-1] = points[0]
    curve = ss.CubicSpline(days, points, "sphere:2", bc_type="periodic")
    later = curve.shift(timedelta(hours=6))
    assert later.t[0] == np.datetime64("2024-02-27T06") and later.extrapolate == "periodic"
    assert close(later(days[0]), curve(days[0] - np.timedelta64(6, "h")))
    assert close(curve.reverse()(days), curve(days[::-1]))
    part = curve.restrict(b=days[3])
    assert part.domain == (days[0], days[3]) and part.extrapolate is None
    assert restored(part) == part
    assert curve.shift(np.timedelta64(0, "s")).restrict(days[1]).length() == pytest.approx(curve.length(days[1]))


def test_invalid_times_of_parts_raise(rng):
    curve = ss.CubicSpline(None, rng.standard_normal((5, 2)), "r:2")
    raises(r"b = 9\.0 is outside the domain", curve.restrict, 0, 9)
    raises("b must be after a", curve.restrict, 3, 3)
    raises("a must be a single time", curve.restrict, [0, 1])
    raises("dt must be a finite number", curve.shift, np.inf)
    raises("knots coincide", curve.shift, 1e300)
    dated = ss.CubicSpline(np.arange("2024-01-01", "2024-01-06", dtype="M8[D]"), curve.points, "r:2")
    raises("the knots are dates, so dt must be a timedelta64 or a text such as '3h', not 3", dated.shift, 3)


def test_parts_of_piecewise_geodesics_are_piecewise_geodesics():
    """Their velocities jump at the knots, so that they are not Hermite splines."""
    rng = np.random.default_rng(9)
    t = np.array([0.0, 0.7, 1.0, 2.5, 3.0])
    curve = ss.PiecewiseGeodesic(t, ss.Sphere(2).random_point(rng, 5), "sphere:2")
    x = np.linspace(0.7, 2.5, 41)
    part, back, later = curve.restrict(0.7, 2.5), curve.reverse(), curve.shift(2)
    for own in (part, back, later):
        assert isinstance(own, ss.PiecewiseGeodesic)
    for nu in (0, 1):
        inside = ~np.isin(x, t)
        assert np.abs(part(x, nu) - curve(x, nu))[inside].max() < 1e-12
        assert np.abs(later(x + 2, nu) - curve(x, nu))[inside].max() < 1e-12
        assert np.abs(back(3 - x, nu) - (-1) ** nu * curve(x, nu))[inside].max() < 1e-12
