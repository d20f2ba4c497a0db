"""Control points, length and bending energy."""

from itertools import pairwise

import numpy as np
import pytest
from cases import EPS
from compare import each, found, off, pick, same, shaped
from curves import KNOTS, at_node, bezier, every_batch, every_common, every_kind, points_on, run_python, tangents_at
from numpy.polynomial import Polynomial

import symspline as ss


@every_kind
@every_batch
def test_control_points(space, batch):
    spline = ss.CubicSpline(KNOTS, points_on(space, batch=batch, step=0.5), space)
    control = spline.control_points
    assert found(control) == shaped(space, (*batch, 5, 4))
    first = (0,) * len(batch)
    points, velocities = pick(spline.points, first), pick(spline.velocities, first)
    for k, h in enumerate(np.diff(KNOTS)):
        segment = pick(control, (*first, k))
        p, q, r, s = (pick(segment, j) for j in range(4))
        assert same(p, pick(points, k)) and same(s, pick(points, k + 1))
        u, w = pick(velocities, k), pick(velocities, k + 1)
        assert off(space, q, space.exp(p, each(lambda v, h=h: v * h / 3, u))) < 20 * EPS
        assert off(space, r, space.exp(s, each(lambda v, h=h: -v * h / 3, w))) < 20 * EPS
        middle = pick(spline(KNOTS[k] + 0.4 * h), first)
        assert off(space, middle, bezier(space, segment, 0.4)) < 20 * EPS


def on_a_geodesic(space, theta, t):
    """The curve with one segment that runs along a geodesic as the polynomial theta does."""
    p = at_node(space, points_on(space, 1), 0)
    e = tangents_at(space, p)
    e = each(lambda x: x / space.norm(p, e), e)
    ends = [space.exp(p, each(lambda x, s=s: theta(s) * x, e)) for s in t]
    start = [space.transport(p, q, e) for q in ends]
    bc = tuple((1, each(lambda x, s=s: theta.deriv()(s) * x, v)) for s, v in zip(t, start, strict=True))
    points = each(lambda a, b: np.stack([a, b]), *ends)
    return ss.CubicSpline(t, points, space, bc_type=bc)


@every_common
@pytest.mark.parametrize(
    "theta", [Polynomial([0, 0.5]), Polynomial([0.2, 0, 0.25]), Polynomial([0, 0.3, 0.1, 0.05])], ids=str
)
def test_length_speed_and_energy_in_closed_form(space, theta):
    t = np.array([0.0, 1.5])
    spline, x = on_a_geodesic(space, theta, t), np.linspace(0, 1.5, 13)
    rate, bend = theta.deriv(), theta.deriv(2)
    assert np.allclose(spline.speed(x), np.abs(rate(x)), rtol=1e-13, atol=1e-14)
    assert spline.length() == pytest.approx(theta(1.5) - theta(0), rel=1e-13)
    if bend != Polynomial([0]):
        assert spline.bending_energy() == pytest.approx((bend**2).integ()(1.5), rel=1e-12)


RESTS = """
import sys, numpy as np, symspline as ss
space = ss.space("sphere:2")
p = space.project([[1.5, 0.3, 0.2], [1.7, 0.5, 0.4], [0.2, 0.9, 0.5]])
t = [0, 1, 1.5, 3, 4, 4.5]
a = np.arange(4) * 1e-3
far = np.stack([np.cosh(10 + 0 * a), np.sinh(10) * np.cos(a), np.sinh(10) * np.sin(a)], axis=1)
"""


# In processes of their own: an integral that does not end takes all memory.
@pytest.mark.parametrize(
    "code",
    [
        "ss.CubicSpline(None, space.geodesic(p[0], p[1], np.linspace(0, 1, 8)), space).bending_energy() < 1e-24",
        "ss.CubicSpline(t, p[[0] * 6], space).length() < 1e-14",
        "ss.CubicSpline(t, np.stack([p[[0] * 6], p[[0, 1] * 3]]), space).length()[0] < 1e-14",
        "ss.CubicSpline(None, far, 'h:2').bending_energy() > 1",
    ],
    ids=["geodesic", "still", "one still in a batch", "far out"],
)
def test_integrals_come_to_rest_at_the_rounding_floor(code):
    run_python(f"{RESTS}\nassert {code}", timeout=60)


@every_kind
@every_batch
def test_length_and_energy_by_quadrature(space, batch):
    spline = ss.CubicSpline(KNOTS, points_on(space, batch=batch, step=0.5), space)
    nodes, weights = np.polynomial.legendre.leggauss(200)
    length = energy = 0.0
    for a, b in pairwise(KNOTS):
        x = (a + b) / 2 + (b - a) / 2 * nodes
        length = length + spline.speed(x) @ weights * (b - a) / 2
        energy = energy + space.norm(spline(x), spline(x, 2)) ** 2 @ weights * (b - a) / 2
    assert np.shape(spline.length()) == np.shape(spline.bending_energy()) == batch
    assert batch or (isinstance(spline.length(), float) and isinstance(spline.bending_energy(), float))
    # A curve in one dimension may turn back, where its speed has a kink.
    assert space.dim == 1 or np.allclose(spline.length(), length, rtol=1e-12)
    assert np.allclose(spline.bending_energy(), energy, rtol=1e-12)
