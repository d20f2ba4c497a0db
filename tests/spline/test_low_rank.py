"""Curves of high ambient dimension, which are computed in the span of their points."""

import numpy as np
import pytest
from cases import ENDS, QUOTIENTS, apart, closed_walk, end_conditions, loop_over, unit_tangent, walk

import symspline as ss

SEED = 1000000

# Spaces of high dimension, and small ones in them that hold the data.
SMALL = {
    "sphere:299": "sphere:9",
    "hyperbolic:300": "hyperbolic:9",
    "rp:299": "rp:9",
    "cp:299": "cp:9",
    "gr:3,300": "gr:3,27",
    "cgr:2,300": "cgr:2,18",
}
every_space = pytest.mark.parametrize("name", SMALL)
N = 7


class Embedded:
    """A space, a small one in it that is totally geodesic, and the map between them."""

    def __init__(self, name, rng):
        self.space, self.small = ss.space(name), ss.space(SMALL[name])
        n, m = self.space.point_shape[0], self.small.point_shape[0]
        first = isinstance(self.space, ss.Hyperbolic)
        noise = rng.standard_normal((n - first, m - first))
        if self.space.dtype == complex:
            noise = noise + 1j * rng.standard_normal(noise.shape)
        self.basis = np.zeros((n, m), noise.dtype)
        self.basis[:first, :first] = 1.0
        self.basis[first:, first:] = np.linalg.qr(noise).Q

    def __call__(self, x):
        columns = len(self.small.point_shape) == 2
        return self.basis @ x if columns else x @ self.basis.T

    def ends(self, bc_type):
        if isinstance(bc_type, str):
            return bc_type
        return tuple(end if isinstance(end, str) else (end[0], self(end[1])) for end in bc_type)

    def check(self, here, there, x=None, factor=1.0):
        """Two splines are the same curve up to rounding: their data, or values and derivatives at x."""
        if x is None:
            ours, theirs = (here.points, here.velocities), (there.points, there.velocities)
        else:
            ours, theirs = ([curve(x, nu) for nu in range(3)] for curve in (here, there))
        self.agree(ours, theirs, factor)

    def agree(self, ours, theirs, factor=1.0):
        (point, *vectors), (other, *images) = ours, map(self, theirs)
        assert apart(self.space, point, other) <= 2e-13 * factor
        for v, w in zip(vectors, images, strict=True):
            if isinstance(self.space, QUOTIENTS):
                v = self.space.transport(point, other, v)
            assert np.abs(v - w).max() <= 1e-10 * factor * max(1.0, np.abs(w).max())


def data(space, rng, kind="natural", n=N):
    """Times, points, and end conditions."""
    p = (closed_walk if kind == "periodic" else walk)(space, 0.5, n, rng)
    t = np.cumsum(rng.uniform(0.7, 1.3, len(p)))
    return t, p, end_conditions(kind, *(0.6 * unit_tangent(space, p[i], rng) for i in (0, -1)))


@every_space
@loop_over("kind", ENDS)
def test_curves(name, kind, rng):
    embed = Embedded(name, rng)
    t, p, bc_type = data(embed.small, rng, kind)
    there = ss.CubicSpline(t, p, embed.small, bc_type=bc_type)
    here = ss.CubicSpline(t, embed(p), embed.space, bc_type=embed.ends(bc_type))
    assert here.report.converged and there.report.converged
    x = np.linspace(t[0], t[-1], 40)
    embed.check(here, there)
    embed.check(here, there, x, 10)
    assert np.allclose(here.speed(x), there.speed(x), rtol=1e-10)
    assert here.length() == pytest.approx(there.length(), rel=1e-10)
    assert here.bending_energy() == pytest.approx(there.bending_energy(), rel=1e-10)
    embed.space.check_tangent(here(x), here(x, 1))
    outside = [t[0] - 0.4, t[-1] + 0.3]
    for policy in (True, "geodesic", "periodic"):
        values = [[c(outside, nu, extrapolate=policy) for nu in range(3)] for c in (here, there)]
        embed.agree(*values, 30)


@every_space
def test_velocities_outside_the_span_of_the_points(name, rng):
    embed = Embedded(name, rng)
    t, p, _ = data(embed.small, rng)
    u = embed.small.random_tangent(rng, p)
    u *= 0.3 / embed.small.norm(p, u).reshape(-1, *[1] * len(embed.small.point_shape))
    x = np.linspace(t[0], t[-1], 20)
    ours = [ss.evaluate(t, embed(p), embed(u), embed.space, x, nu=nu) for nu in range(3)]
    embed.agree(ours, [ss.evaluate(t, p, u, embed.small, x, nu=nu) for nu in range(3)], 10)


@every_space
def test_curves_with_control_points(name, rng):
    embed = Embedded(name, rng)
    points = np.stack([walk(embed.small, 0.4, 6, rng) for _ in range(2)])
    knots, x = [0, 0, 0, 0, 0.5, 1, 2, 2, 2, 2], np.linspace(0, 2, 21).reshape(3, 7)
    there, here = (
        ss.BSpline(knots, *given, 3, space)
        for given, space in (((points,), embed.small), ((embed(points),), embed.space))
    )
    embed.check(here, there, x, 10)
    assert np.allclose(here.speed(x), there.speed(x), rtol=1e-11)


every_large = pytest.mark.parametrize("space", [ss.space(name) for name in SMALL], ids=str)


@every_large
def test_batches_and_lists_are_bit_identical_to_single_curves(space, rng):
    p = np.stack([walk(space, 0.4, 6, rng) for _ in range(3)])
    v = 0.3 * space.random_tangent(rng, p[:, 0]) / np.sqrt(space.dim)
    batch = ss.CubicSpline(None, p, space, bc_type=((1, v), "natural"))
    many = ss.fit_many([(None, q) for q in p], space, bc_type=((1, v), "natural"))
    x = np.linspace(0, 5, 11)
    for i in range(3):
        one = ss.CubicSpline(None, p[i], space, bc_type=((1, v[i]), "natural"))
        assert batch[i] == many[i] == one and batch[i].report == many[i].report == one.report
        for nu in range(3):
            assert np.array_equal(batch(x, nu)[i], one(x, nu)) and np.array_equal(many[i](x, nu), one(x, nu))
    # Curves of other lengths.
    curves, calls = [(None, p[0]), ([0.0, 2.0], p[1, :2]), (None, walk(space, 0.4, 9, rng))], []
    fitted = ss.fit_many(curves, space, bc_type="not-a-knot", progress=lambda *call: calls.append(call))
    for spline, (t, q) in zip(fitted, curves, strict=True):
        alone = ss.CubicSpline(t, q, space, bc_type="not-a-knot")
        assert spline == alone and spline.report == alone.report
    assert all(0 <= done <= total == 17 for done, total in calls) and sorted(calls) == calls


def test_error_names_the_invalid_curve(rng):
    space = ss.Sphere(299)
    good = walk(space, 0.4, 5, rng)
    far = good.copy()
    far[3] = -far[2]
    with pytest.raises(ss.CutLocusError, match=r"points\[2\] and points\[3\] of curve 1 lie") as caught:
        ss.fit_many([(None, good), (None, far), (None, good[:3])], space)
    splines = caught.value.spline
    assert [s.report.converged for s in splines] == [True, False, True]
    assert splines[2] == ss.CubicSpline(None, good[:3], space)
    assert np.isnan(splines[1](0.5)).all()
    with pytest.raises(ss.CutLocusError, match=r"points\[2\] and points\[3\] of curve 1 lie"):
        ss.CubicSpline(None, np.stack([good, far]), space)
    with pytest.raises(ss.ValidationError, match=r"points\[1\] of curve 1 is off the space"):
        ss.fit_many([(None, good), (None, good * [[1.0], [2], [1], [1], [1]])], space)
