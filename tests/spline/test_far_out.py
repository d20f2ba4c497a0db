"""Numbers that are huge or tiny, and points that are very far."""

import itertools

import numpy as np
import pytest
from cases import EPS, unit_tangent
from curves import points_on
from scipy.interpolate import CubicSpline as FlatSpline

import symspline as ss


def mirrored(d):
    """Two points of H² at distance d whose middle is (1, 0, 0)."""
    x = np.sinh(d / 2)
    return np.array([[np.sqrt(1 + x * x), -x, 0], [np.sqrt(1 + x * x), x, 0]])


# Velocities are ambient arrays, whose rounding de Casteljau's algorithm multiplies by the legs' cosh.
lossy = pytest.mark.xfail(strict=True, reason="rounding grows faster than |p|² for steps this long")


@pytest.mark.parametrize(
    ("how", "d"),
    [
        *(("geodesic", d) for d in (2, 5, 15, 20)),
        *(("spline", d) for d in (2, 5)),
        *(pytest.param("spline", d, marks=lossy) for d in (15, 20)),
    ],
)
def test_the_hyperboloid_costs_no_more_than_the_square_of_its_points(how, d):
    space, p = ss.Hyperbolic(2), mirrored(d)
    middle = space.geodesic(*p, 0.5) if how == "geodesic" else ss.CubicSpline(None, p, space)(0.5)
    # In all but rounding this is (p + q)/|p + q|.
    assert np.abs(middle - [1, 0, 0]).max() < 100 * EPS * p[0, 0] ** 2


def test_what_is_mostly_rounding_has_not_converged():
    report = ss.CubicSpline(None, mirrored(30), "h:2", on_failure="ignore").report
    assert not report.converged or report.residual < 1e-3


def test_strange_but_lawful_input():
    rng = np.random.default_rng(0)
    spaces = [ss.Euclidean(1), ss.Sphere(1), ss.Sphere(9), ss.Hyperbolic(1), ss.Hyperbolic(9)]
    for space, n, bc_type in itertools.product(spaces, (2, 3, 4, 9), ("natural", "clamped", "not-a-knot")):
        p = points_on(space, n, step=0.5, seed=n)
        t = np.cumsum(10.0 ** rng.uniform(-3, 3, n))
        spline = ss.CubicSpline(t, p, space, bc_type=bc_type, on_failure="ignore")
        x = rng.uniform(t[0] - 1, t[-1] + 1, 20)
        for nu, policy in itertools.product(range(3), (True, "geodesic", "periodic")):
            assert spline(x, nu=nu, extrapolate=policy).shape == (20, *space.point_shape)
        assert "\n" not in str(spline.report)


@pytest.mark.parametrize("size", [1e-200, 1e-150, 1e-30, 1e30, 1e150, 1e200])
def test_huge_and_tiny_flat_data(size):
    t, p = np.arange(5.0), size * points_on(ss.Euclidean(2), 5)
    spline, flat = ss.CubicSpline(t, p, "r:2"), FlatSpline(t, p, bc_type="natural")
    assert np.abs(spline.velocities - flat(t, 1)).max() < 1e-13 * size


@pytest.mark.parametrize(("name", "step"), [("hyperbolic:2", 11.0), ("spd:3", 14.0)])
def test_very_far_points_converge_to_their_rounding(name, step):
    """What rounding does to a residual grows with the length of chords, and is no failure until the curve shows it,
    see test_report_is_true."""
    space = ss.space(name)
    origin = np.eye(*(3,) * 2) if name == "spd:3" else np.array([1.0, 0, 0])
    for seed in range(20):
        rng = np.random.default_rng(seed)
        p = [space.exp(origin, step / 2 * unit_tangent(space, origin, rng)) for _ in range(5)]
        assert ss.CubicSpline(None, np.array(p), space).report.converged
