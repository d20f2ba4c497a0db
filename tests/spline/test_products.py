"""Products take and return tuples, and every factor is a curve of its own."""

import numpy as np
import pytest
from cases import zigzag
from compare import found, same, shaped
from curves import KNOTS, S2, points_on
from refused import TWO, P, changed, fit_error, raises

import symspline as ss


def test_a_product_speaks_in_tuples():
    space = ss.Product(ss.Sphere(3), ss.Euclidean(2))
    p = points_on(space, 5)
    spline = ss.CubicSpline(None, p, space)
    x = [0.5, 2.0]
    for value in (spline.points, spline.velocities, spline.control_points, spline(0.5), spline(x, nu=1)):
        assert isinstance(value, tuple) and len(value) == 2
    assert found(spline(x)) == shaped(space, (2,))
    for i, factor in enumerate(space.factors):
        alone = ss.CubicSpline(None, p[i], factor)
        assert all(same(spline(x, nu=nu)[i], alone(x, nu=nu)) for nu in range(3))
    assert spline == ss.CubicSpline(None, list(p), space)


def test_lengths_add_as_in_pythagoras_in_a_product():
    p = points_on(S2, 6)
    one, both = ss.CubicSpline(KNOTS, p, S2), ss.CubicSpline(KNOTS, (p, p), ss.Product(S2, S2))
    x = np.linspace(0, 4.5, 11)
    assert np.allclose(both.speed(x), np.sqrt(2) * one.speed(x), rtol=1e-14)
    assert both.length() == pytest.approx(np.sqrt(2) * one.length(), rel=1e-13)
    assert both.bending_energy() == pytest.approx(2 * one.bending_energy(), rel=1e-13)


def test_max_step_of_a_product():
    space = ss.Product("r:1", "r:1")
    p = np.array([[0.0], [3], [3]]), np.array([[0.0], [0], [4]])
    # The steps are 3 and 4; no two neighbours are 5 apart.
    assert ss.CubicSpline(None, p, space).report.max_step == pytest.approx(4)


@pytest.mark.parametrize("batch", [False, True])
def test_another_curve_of_a_product_is_another_curve_of_a_factor(batch):
    far, near = zigzag(2.5), points_on(S2, len(zigzag(2.5)))
    p = np.array([far, near]) if batch else far
    factors = [ss.CubicSpline(None, x, S2) for x in (p, p[..., ::-1, :], np.broadcast_to([0, 0, 1.0], p.shape))]
    report = ss.CubicSpline(None, tuple(f.points for f in factors), "s:2 x s:2 x s:2").report
    total = sum(f.bending_energy() for f in factors)
    other = total + np.minimum(*(f.report.alternative_energy - f.bending_energy() for f in factors[:2]))
    assert factors[0].report.alternative_energy is not None and factors[2].report.alternative_energy is None
    np.testing.assert_allclose(report.alternative_energy, other, rtol=1e-12)
    assert np.isnan(other[1]) if batch else other > total


PRODUCT = "sphere:2 x r:1"
FLAT, OFF = np.zeros((3, 1)), changed(2, [0, 0, 2])


def test_invalid_products_raise():
    for points, options, match in [
        (P, {}, r"points must be a tuple of 2 arrays, one per factor of Product\(Sphere\(2\), Euclidean\(1\)\)"),
        ((P,), {}, r"points must be a tuple of 2 arrays"),
        ((P, FLAT, FLAT), {}, r"points must be a tuple of 2 arrays"),
        ((FLAT, P), {}, r"points has shape \(3, 1\), but Sphere\(2\) needs"),
        ((P, np.zeros((4, 1))), {}, r"points"),
        (np.zeros((3, 4)), {}, r"If x is your array, pass \(x\[..., 0:3\], x\[..., 3:4\]\)"),
        ((TWO, np.zeros((3, 3, 1))), {}, r"batch axes differ"),
        ((OFF, FLAT), {}, r"factor 0, Sphere\(2\): points\[2\] is off the space"),
        ((P, FLAT), {"bc_type": ((1, [0, 0, 0]), "natural")}, r"an end vector must be a tuple of 2 arrays"),
        ((P, FLAT), {"bc_type": "foo"}, r"the start is 'foo'"),
        ((P, FLAT), {"bc_type": ("natural",)}, r"bc_type must be 'natural', .* or a pair .*; got \('natural',\)"),
        ((P, FLAT), {"bc_type": ("natural", (1,))}, r"bc_type must be 'natural', .*; the end is \(1,\)"),
    ]:
        fit_error(match, None, points, PRODUCT, **options)
    raises("at least two factors", ss.Product, "sphere:2")
    raises(r"needs tuples of 2 arrays, one per factor", ss.space(PRODUCT).exp, (P, FLAT), (P,))
