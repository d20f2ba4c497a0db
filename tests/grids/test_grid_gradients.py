"""Gradients of functions of grids with respect to the nodes: against matrices, finite differences and each other."""

import numpy as np
import pytest
from cases import REPRESENTATIVE, loop_over, unit_tangent
from grids.grid_fields import Field, factors_of, inside, knots
from refused import raises
from scipy.interpolate import CubicSpline

import symspline as ss
from symspline._grid import evaluation

H = 3e-3
# Central differences of order six.
WEIGHTS = {1: 3 / 4, 2: -3 / 20, 3: 1 / 60}
SO3 = ss.space("so:3")


def as_tuple(parts):
    return parts if isinstance(parts, tuple) else (parts,)


def joined(parts):
    return tuple(parts) if len(parts) > 1 else parts[0]


def of_factors(space, work, *arrays):
    """Apply a function to each factor and its part of each array."""
    return joined([work(*each) for each in zip(factors_of(space), *map(as_tuple, arrays), strict=True)])


def total(space, first, second):
    """The sum of the products of all numbers that are not missing."""
    return sum(
        np.nansum(a.real * b.real) + (np.nansum(a.imag * b.imag) if np.iscomplexobj(a) else 0.0)
        for a, b in zip(as_tuple(first), as_tuple(second), strict=True)
    )


def is_quotient(space):
    return space._handle.fibre() > 0


def seen(space, points):
    """Numbers that do not depend on the representative of a point: projectors on quotient spaces."""

    def one(factor, p):
        if not is_quotient(factor):
            return p
        columns = p[..., None] if len(factor.point_shape) == 1 else p
        return columns @ np.swapaxes(columns.conj(), -1, -2)

    return of_factors(space, one, points)


def weights_of(space, values, rng):
    """Random weights of what is seen, and the cotangent of the values."""

    def one(factor, value, own):
        weights = rng.normal(size=own.shape)
        if factor.dtype.kind == "c":
            weights = weights + 1j * rng.normal(size=own.shape)
        if not is_quotient(factor):
            return weights, weights
        weights = weights + np.swapaxes(weights.conj(), -1, -2)
        return weights, 2 * (weights @ value.reshape(*own.shape[:-1], -1)).reshape(value.shape)

    pairs = [one(*each) for each in zip(factors_of(space), *map(as_tuple, (values, seen(space, values))), strict=True)]
    return tuple(joined([pair[i] for pair in pairs]) for i in range(2))


def motion(grid, rng):
    """Random tangent vectors at the nodes, zero at missing ones, the same at both ends of periodic axes."""

    def one(factor, points):
        vectors = np.zeros_like(points)
        for node in np.argwhere(factor._where_finite(points)):
            vectors[tuple(node)] = unit_tangent(factor, points[tuple(node)], rng)
        for k, bc in enumerate(grid.bc_type):
            if bc == "periodic":
                np.moveaxis(vectors, k, 0)[-1] = np.take(vectors, 0, axis=k)
        return vectors

    return of_factors(grid.space, one, grid.points)


def moved(grid, vectors, size):
    """The grid with nodes that moved along geodesics."""

    def one(factor, points, own):
        new, valid = points.copy(), factor._where_finite(points)
        new[valid] = factor.exp(points[valid], size * own[valid])
        return new

    points = of_factors(grid.space, one, grid.points, vectors)
    return ss.GridSpline(grid.axes, points, grid.space, bc_type=grid.bc_type, symmetric=grid.symmetric)


def assert_gradient(grid, x, rng, outer=False):
    """`vjp` is the derivative of a sum of weighted values, and consists of tangent vectors."""

    def values(of):
        return of.grid(*x) if outer else of(x)

    space, here = grid.space, values(grid)
    weights, cotangent = weights_of(space, here, rng)
    vectors = motion(grid, rng)
    expected = sum(
        weight * sign * total(space, weights, seen(space, values(moved(grid, vectors, sign * k * H)))) / H
        for k, weight in WEIGHTS.items()
        for sign in (1, -1)
    )
    gradient = grid.vjp(x, cotangent, grid=outer)
    found = total(space, gradient, vectors)
    assert abs(found - expected) < 1e-9 * max(1.0, *(np.linalg.norm(g) for g in as_tuple(gradient)))
    for factor, p, g in zip(factors_of(space), *map(as_tuple, (grid.points, gradient)), strict=True):
        valid = factor._where_finite(p)
        assert g.shape == p.shape and not g[~valid].any()
        factor.check_tangent(p[valid], g[valid])


def matrix(t, x, bc):
    """The values of cardinal splines, as SciPy computes them."""
    unit = np.eye(len(t))
    if bc == "periodic":
        # The last node has no value of its own.
        unit[-1], unit[:, -1] = unit[0], 0
    return CubicSpline(t, unit, bc_type=bc)(x)


@pytest.mark.parametrize("symmetric", [False, True])
@pytest.mark.parametrize("bc", [("not-a-knot", "natural", "clamped"), ("periodic", "clamped", "periodic")])
def test_flat_gradients_are_those_of_the_tensor_product(bc, symmetric):
    rng = np.random.default_rng(40)
    axes = 5 + 3 * knots(rng, 7), 0.1 * knots(rng, 5) - 2, knots(rng, 6)
    points = rng.normal(size=(7, 5, 6, 2))
    for k in range(3):
        if bc[k] == "periodic":
            np.moveaxis(points, k, 0)[-1] = np.take(points, 0, axis=k)
    grid = ss.GridSpline(axes, points, "r:2", bc_type=bc, symmetric=symmetric)
    x = [np.concatenate([own, t[[0, 2, -1]]]) for own, t in zip(inside(rng, axes, 9), axes, strict=True)]
    a, b, c = (matrix(*each) for each in zip(axes, x, bc, strict=True))
    weights = rng.normal(size=(12, 2))
    expected = np.einsum("si,sj,sk,sd->ijkd", a, b, c, weights)
    np.testing.assert_allclose(grid.vjp(np.stack(x, axis=-1), weights), expected, atol=1e-12)
    weights = rng.normal(size=(12, 12, 12, 2))
    expected = np.einsum("pi,qj,rk,pqrd->ijkd", a, b, c, weights)
    np.testing.assert_allclose(grid.vjp(x, weights, grid=True), expected, atol=1e-11)


@pytest.mark.parametrize("space", REPRESENTATIVE, ids=str)
@loop_over("symmetric", [False, True])
def test_gradients_match_finite_differences(space, symmetric):
    rng = np.random.default_rng(41)
    axes = 2 + knots(rng, 5), 3 * knots(rng, 4)
    grid = ss.GridSpline(axes, Field(space, size=0.3).on(*axes), space, symmetric=symmetric)
    assert_gradient(grid, inside(rng, axes, 5), rng)
    assert_gradient(
        grid, tuple(np.append(own[:2], t[1]) for own, t in zip(inside(rng, axes, 5), axes, strict=True)), rng, True
    )


@pytest.mark.parametrize("symmetric", [False, True])
@loop_over("bc", [("periodic", "natural", "clamped"), (("natural", "clamped"), "not-a-knot", "periodic")])
def test_gradients_of_three_axes_with_end_conditions(bc, symmetric):
    rng = np.random.default_rng(42)
    axes = knots(rng, 5) - 3, knots(rng, 4), 2 * knots(rng, 5)
    points = Field(SO3, size=0.3).on(*axes)
    for k in range(3):
        if bc[k] == "periodic":
            np.moveaxis(points, k, 0)[-1] = np.take(points, 0, axis=k)
    grid = ss.GridSpline(axes, points, SO3, bc_type=bc, symmetric=symmetric)
    assert_gradient(grid, inside(rng, axes, 6), rng)
    assert_gradient(grid, tuple(own[:k] for k, own in enumerate(inside(rng, axes, 3), 1)), rng, True)


@pytest.mark.parametrize("bc", ["natural", "periodic", ("clamped", "periodic")])
@loop_over("symmetric", [False, True])
def test_gradients_beside_missing_nodes(bc, symmetric):
    rng = np.random.default_rng(43)
    axes = 0.7 + knots(rng, 8), knots(rng, 7)
    points = Field(SO3, size=0.3).on(*axes)
    for k, word in enumerate([bc] * 2 if isinstance(bc, str) else bc):
        if word == "periodic":
            np.moveaxis(points, k, 0)[-1] = np.take(points, 0, axis=k)
    # The last of these columns has an isolated node; at coordinates of nodes its point is the value.
    for node in [(3, 2), (4, 2), (1, 5), (3, 5), (5, 4)]:
        points[node] = np.nan
    grid = ss.GridSpline(axes, points, SO3, bc_type=bc, symmetric=symmetric)
    x = [np.concatenate([own, t]) for own, t in zip(inside(rng, axes, 6), axes, strict=True)]
    values = grid.grid(*x)
    assert 0.02 < np.isnan(values).mean() < 0.8
    assert_gradient(grid, x, rng, True)
    sites = tuple(own.ravel()[::3] for own in np.meshgrid(*x, indexing="ij"))
    assert_gradient(grid, sites, rng)
    cotangent = rng.normal(size=values.shape)
    ignored = np.where(np.isnan(values), np.nan, cotangent)
    assert np.array_equal(grid.vjp(x, ignored, grid=True), grid.vjp(x, cotangent, grid=True))


@pytest.mark.parametrize("gap", [1, -2])
def test_both_ends_of_a_periodic_axis_belong_to_the_run_beside_a_gap(gap):
    rng = np.random.default_rng(51)
    # The first knot plus the period is not the last knot, because the period is rounded.
    t = np.append(np.sort(rng.uniform(-1, 0, 8)), 1e-3)
    assert t[0] + (t[-1] - t[0]) != t[-1]
    points = rng.normal(size=(9, 1))
    points[-1] = points[0]
    points[gap] = np.nan
    grid = ss.GridSpline((t,), points, "r:1", bc_type="periodic")
    for end in t[[0, -1]]:
        np.testing.assert_allclose(grid.vjp(end, [1.0])[:, 0], np.eye(9)[0], atol=1e-13)


@pytest.mark.parametrize("symmetric", [False, True])
def test_gradients_of_no_values_are_zero(symmetric):
    points = np.arange(20.0).reshape(5, 4, 1)
    points[2] = np.nan
    grid = ss.GridSpline((None, None), points, "r:1", symmetric=symmetric)
    none = np.empty(0)
    assert not grid.vjp((1.5, [0.5, 2.5]), np.ones((2, 1))).any()
    assert not grid.vjp((none, none), np.empty((0, 1))).any()
    assert not grid.vjp((none, [0.5]), np.empty((0, 1, 1)), grid=True).any()
    assert not grid.vjp(([0.5], none), np.empty((1, 0, 1)), grid=True).any()


def test_gradients_of_points_at_nodes_need_no_spline():
    points = np.radians([[[0.0], [170]], [[0.0], [190]]])
    grid = ss.GridSpline(([0, 1], [0, 1]), points, "torus:1")
    # The row along the second axis is at its cut locus.
    np.testing.assert_allclose(grid.vjp((0.5, 1.0), [1.0])[..., 0], [[0, 0.5], [0, 0.5]], atol=1e-14)
    raises(r"points\[0\] and points\[1\] of a row along axis 1", grid.vjp, (0.5, 0.5), [1.0], error=ss.CutLocusError)
    loose = ss.GridSpline(([0, 1], [0, 1]), points, "torus:1", on_failure="ignore")
    gradient = loose.vjp((0.5, [0.5, 1.0]), np.ones((2, 1)))
    np.testing.assert_allclose(gradient[..., 0], [[0, 0.5], [0, 0.5]], atol=1e-14)


def test_outer_products_have_the_gradients_of_scattered_coordinates(monkeypatch):
    rng = np.random.default_rng(44)
    space = ss.space("so:3 x r:2")
    axes = 0.3 + knots(rng, 8), knots(rng, 7)
    points = Field(space).on(*axes)
    for part in points:
        part[-1] = part[0]
    grid = ss.GridSpline(axes, points, space, bc_type=("periodic", "not-a-knot"))
    x = np.concatenate([rng.uniform(-3, 3, 14), axes[0]]), np.concatenate([rng.uniform(0, 1, 12), axes[1][:3]])
    cotangent = tuple(rng.normal(size=value.shape) for value in grid.grid(*x))
    outer = grid.vjp(x, cotangent, grid=True)
    mesh = tuple(own.ravel() for own in np.meshgrid(*x, indexing="ij"))
    pairs = mesh, tuple(own.reshape(-1, *own.shape[2:]) for own in cotangent)
    # 330 coordinates, at once and in blocks.
    for most in (evaluation._MOST, 1 << 11):
        monkeypatch.setattr(evaluation, "_MOST", most)
        blocks = grid.vjp(x, cotangent, grid=True), grid.vjp(*pairs), grid.vjp((x[0][:, None], x[1]), cotangent)
        for found in blocks:
            for a, b in zip(found, outer, strict=True):
                assert np.abs(a - b).max() < 1e-12 * np.abs(b).max()


def test_products_have_the_gradients_of_their_factors():
    rng, space = np.random.default_rng(48), ss.space("so:3 x r:2")
    axes = knots(rng, 6), knots(rng, 5)
    x, cotangent = inside(rng, axes, 4), (rng.normal(size=(4, 3, 3)), rng.normal(size=(4, 2)))
    for symmetric in (False, True):
        grid = ss.GridSpline(axes, Field(space).on(*axes), space, symmetric=symmetric)
        for factor, *arrays in zip(space.factors, grid.points, cotangent, grid.vjp(x, cotangent), strict=True):
            alone = ss.GridSpline(axes, arrays[0], factor, symmetric=symmetric)
            assert np.array_equal(alone.vjp(x, arrays[1]), arrays[2])


def test_gradients_of_one_axis_are_those_of_curves():
    rng = np.random.default_rng(45)
    t = knots(rng, 9)
    points, x = Field(ss.Sphere(2)).on(t), rng.uniform(0, 1, (3, 4))
    dates = np.datetime64("2024-01-01") + (1e6 * t).astype("m8[s]")
    grid, curve = (
        make(points)
        for make in (
            lambda p: ss.GridSpline((dates,), p, "sphere:2"),
            lambda p: ss.CubicSpline(dates, p, "sphere:2", bc_type="not-a-knot"),
        )
    )
    at, cotangent = dates[0] + (9e5 * x).astype("m8[s]"), rng.normal(size=(3, 4, 3))
    np.testing.assert_allclose(grid.vjp(at, cotangent), curve.vjp(at, cotangent).points, atol=1e-13)
    assert not grid.vjp(at[:0], cotangent[:0]).any()


def test_gradients_on_a_space_of_crystals_are_those_of_rotations():
    rng = np.random.default_rng(46)
    axes = knots(rng, 7), knots(rng, 6)
    cubic = ss.Quotient("so:3", "432")
    grid = ss.GridSpline(axes, Field(SO3).on(*axes), cubic)
    plain = ss.GridSpline(axes, grid.points, SO3)
    x, cotangent = inside(rng, axes, 3), rng.normal(size=(3, 3, 3))
    assert np.array_equal(grid.vjp(x, cotangent), plain.vjp(x, cotangent))


GRID = ss.GridSpline((np.arange(5.0), np.arange(4.0)), Field(SO3).on(np.linspace(0, 1, 5), np.linspace(0, 1, 4)), SO3)
ONES = np.ones((3, 3))


@pytest.mark.parametrize(
    ("x", "cotangent", "options", "message"),
    [
        ((0.5, 3.5), ONES, {}, r"the coordinate 3.5 is outside axis 1, which extends from 0.0 to 3.0; .* Remove"),
        ((0.5, np.nan), ONES, {}, r"x\[1\] is not finite"),
        ((0.5,), ONES, {}, "1 coordinates, but the grid has 2 axes"),
        ((0.5, 0.5), np.ones((2, 3, 3)), {}, r"cotangent has shape \(2, 3, 3\), but \(3, 3\) is needed"),
        ((0.5, 0.5), np.ones(3), {}, r"cotangent has shape \(3,\), but .* needs shape \(..., 3, 3\)"),
        ((0.5, 0.5), 1j * ONES, {}, "cotangent must be an array of real numbers"),
        ((0.5, 0.5), ONES, {"grid": 1}, "grid must be True or False"),
        (0.5, ONES, {"grid": True}, r"x must be a tuple with the coordinates along each axis, .* not 0.5"),
        ((0.5, [[0.5]]), ONES, {"grid": True}, "along axis 1 have shape"),
    ],
)
def test_invalid_arguments_of_gradients_raise(x, cotangent, options, message):
    raises(message, GRID.vjp, x, cotangent, **options)


def test_spaces_without_gradients_raise():
    stiefel, rng = ss.Stiefel(2, 4), np.random.default_rng(47)
    base = np.broadcast_to(stiefel.random_point(rng), (4, 4, 4, 2))
    points = stiefel.exp(base, 0.1 * stiefel.random_tangent(rng, base))
    for symmetric in (False, True):
        grid = ss.GridSpline((None, None), points, stiefel, symmetric=symmetric)
        raises("the gradient with respect to the nodes needs the sensitivity", grid.vjp, (0.5, 0.5), points[0, 0])
    large = ss.Sphere(299)
    grid = ss.GridSpline((None, None), large.project(1 + rng.uniform(size=(3, 3, 300))), large)
    raises("not available, because the dimension of", grid.vjp, (0.5, 0.5), np.ones(300))
    product = ss.GridSpline((None, None), (np.zeros((3, 3, 1)), np.zeros((3, 3, 1))), "r:1 x r:1")
    raises("cotangent must be a tuple of 2 arrays", product.vjp, (0.5, 0.5), np.ones(1))
