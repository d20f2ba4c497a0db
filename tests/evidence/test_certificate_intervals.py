"""`report.certificate` against proofs by interval arithmetic: the radius r, and zigzags on both sides of the threshold.

`exact_splines` proves for each curve that a C² spline exists. Its velocities are compared with the computed ones. All
bounds are rigorous. More curves, and the distribution of the errors:

    python tests/evidence/test_certificate_intervals.py 50
"""

import itertools
import sys
from contextlib import contextmanager

import numpy as np
import pytest
from exact_splines import DIGITS, MODELS, WIDTH, Undecided, iv, midpoints, mp, sizes
from spaces.exact import PositiveDefinite, Sphere, Subspaces

import symspline as ss

SEED = 1948


@contextmanager
def many_digits():
    before = iv.dps
    iv.dps = DIGITS
    with mp.workdps(DIGITS):
        yield
    iv.dps = before


@pytest.fixture(autouse=True)
def digits():
    with many_digits():
        yield


# Which ends have given velocities: the others are natural. With a coarse tolerance, rounding errors do not matter.
CASES = list(
    itertools.product(
        ((), (0, -1), (-1,)),
        ({}, {"tol": 1e-3, "method": "fixed-point"}),
        ("equal knots", "unequal knots"),
        ("equal steps", "unequal steps"),
    )
)


def random_curve(space, rng, case, nodes=5):
    """A spline with steps up to KD = 0.9, and the given velocities at its ends."""
    clamped, options, knots, steps = case
    step = rng.uniform(0.2, 0.9) / space.curvature
    points = [space.random_point(rng)]
    for part in np.ones(nodes - 1) if steps == "equal steps" else rng.uniform(0.3, 1.0, nodes - 1):
        v = space.random_tangent(rng, points[-1])
        points.append(space.exp(points[-1], v * (part * step / space.norm(points[-1], v))))
    t = np.arange(nodes) * 1.0 if knots == "equal knots" else np.cumsum(rng.uniform(0.7, 1.3, nodes))
    given = [None, None]
    for end in clamped:
        v = space.random_tangent(rng, points[end])
        given[end] = v * (rng.uniform(0, 1.2) * step / space.norm(points[end], v))
    ends = tuple("natural" if v is None else (1, v) for v in given)
    return ss.CubicSpline(t, np.array(points), space, bc_type=ends, **options), tuple(given)


def certified_curves(name, rng, count):
    """Splines of all cases in turn that have a certificate, with their given velocities."""
    space = ss.space(name)
    # 7 and the number of cases have no common divisor: neighbours differ in all respects.
    cases = (CASES[7 * i % len(CASES)] for i in itertools.count())
    curves = (random_curve(space, rng, case) for case in cases)
    return itertools.islice((x for x in curves if x[0].report.certificate), count)


def errors(name, spline, given=(None, None), added=0.0):
    """Upper bounds of the distances of velocities, and of what is added, to those of a C² spline, at each knot."""
    return MODELS[name].errors(spline.t, spline.points, spline.velocities + added, given)


@pytest.mark.parametrize("name", MODELS)
def test_a_spline_exists_within_r(name, rng):
    for spline, given in certified_curves(name, rng, 3):
        assert errors(name, spline, given).max() <= spline.report.certificate.r


@pytest.mark.parametrize("name", MODELS)
def test_errors_are_lengths_in_the_metric(name, rng):
    (spline, given), *_ = certified_curves(name, rng, 1)
    space, p = spline.space, spline.points
    added = space.random_tangent(rng, p)
    added *= 1e-6 / space.norm(p, added)[(..., *[None] * len(space.point_shape))]
    np.testing.assert_allclose(errors(name, spline, given, added), 1e-6, atol=2 * spline.report.certificate.r)


@pytest.mark.parametrize("name", ["hyperbolic:2", "cp:2", "spd:3"])
def test_bounds_contain_values_and_derivatives(name, rng):
    ((spline, given),) = certified_curves(name, rng, 1)
    curve = next(iter(MODELS[name].curves(spline.t, spline.points, spline.velocities, given)))
    z = curve.solution()

    def residual(at):
        return np.concatenate(curve.residual(curve.columns(at), midpoints))[:, 0]

    for width in (WIDTH, 1e-3):
        jet = curve.derivative(z, width)
        inside = z + rng.uniform(-width, width, len(z))
        direction, small = rng.normal(size=len(z)), mp.mpf(10) ** -18
        value = residual(inside)
        slope = (residual(inside + small * direction) - value) / small
        assert (abs(value - jet.mid[0]) <= jet.rad[0]).all()
        assert (abs(slope - direction @ jet.mid[1:]) <= abs(direction) @ jet.rad[1:] + 1e-15).all()


def test_boxes_without_a_solution_are_not_proved(rng):
    ((spline, given),) = certified_curves("sphere:2", rng, 1)
    (curve,) = MODELS["sphere:2"].curves(spline.t, spline.points, spline.velocities, given)
    with pytest.raises(Undecided):
        curve.prove(curve.solution() + 2 * WIDTH)


class Hyperboloid:
    """Points with x₁² + ⋯ − x₀² = −1."""

    def dot(self, x, y):
        return (x.T * y)[0] - 2 * x[0] * y[0]

    def exp(self, p, v):
        angle = mp.sqrt(self.dot(v, v))
        return p * mp.cosh(angle) + v * mp.sinh(angle) / angle

    def log(self, p, q):
        away = q + p * self.dot(p, q)
        size = mp.sqrt(self.dot(away, away))
        return away * (mp.asinh(size) / size)


@pytest.mark.parametrize(
    ("name", "geometry"),
    [
        ("sphere:2", Sphere()),
        ("hyperbolic:2", Hyperboloid()),
        ("so:3", Sphere()),
        ("cp:2", Subspaces()),
        ("spd:3", PositiveDefinite()),
    ],
)
def test_solutions_are_twice_differentiable(name, geometry, rng):
    """Accelerations on both sides of knots by differences of points, from the algorithm of de Casteljau."""
    spline, _ = random_curve(ss.space(name), rng, ((), {}, "unequal knots", "unequal steps"), nodes=4)
    (curve,) = MODELS[name].curves(spline.t, spline.points, spline.velocities)
    space, z = curve.space, curve.solution()

    def ambient(x):
        x = mp.matrix(midpoints(x).tolist())
        return x[: space.size] + 1j * x[space.size :] if name == "cp:2" else x

    # Cholesky factors of matrices, or columns of unit vectors.
    p = [ambient(frame[0] @ frame[0].T if name == "spd:3" else frame[0][:, 0]) for frame in curve.frames]
    u = [ambient(space.tangent(*x)) for x in zip(curve.frames, curve.exact(z), strict=True)]
    h = [mp.mpf(float(x)) for x in np.diff(spline.t)]

    def at(i, tau):
        b = [p[i], geometry.exp(p[i], u[i] * h[i] / 3), geometry.exp(p[i + 1], u[i + 1] * (-h[i] / 3)), p[i + 1]]
        while len(b) > 1:
            b = [geometry.exp(x, geometry.log(x, y) * tau) for x, y in itertools.pairwise(b)]
        return b[0]

    small = mp.mpf(10) ** -12

    def acceleration(i, segment):
        """From log(γ(t ± δ)) = ±δ u + δ² a/2 + O(δ³)."""
        delta, tau = (small, small) if segment == i else (-small, 1 - small)
        delta = delta * h[segment]
        return (geometry.log(p[i], at(segment, tau)) / delta - u[i]) * 2 / delta

    assert mp.norm(acceleration(1, 1)) > 0.01
    jumps = [acceleration(i, i) - acceleration(i, i - 1) for i in (1, 2)]
    for zero in (acceleration(0, 0), *jumps, acceleration(3, 2)):
        assert mp.norm(zero) < 1e-9


THRESHOLD = 1.306542374
"""KD at which the equations of zigzags on the sphere become singular: `docs/theory/thresholds.md`."""


def zigzag(step, segments, ends):
    angle = step * (np.arange(segments + 1) % 2 - 0.5)
    points = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=-1)
    return ss.CubicSpline(None, points, "sphere:2", bc_type=ends, on_failure="ignore")


def curve_of(spline, ends, velocities=None):
    u = spline.velocities if velocities is None else velocities
    given = (np.zeros(3),) * 2 if ends == "clamped" else (None, None)
    (curve,) = MODELS["sphere:2"].curves(spline.t, spline.points, u, given, ends == "periodic")
    return curve


@pytest.mark.parametrize("ends", ["natural", "clamped", "periodic"])
def test_certified_zigzags_are_on_their_geodesic(ends):
    """The box is its own mirror image up to rounding, and so is the only solution in it.

    No other solution is within R/4, by intervals. Bounds that are sharper than those of intervals prove R.
    """
    for step in (0.8, 1.0) if ends == "natural" else (0.8, 1.2, 1.3):
        spline = zigzag(step, 4, ends)
        curve, (r, R) = curve_of(spline, ends), spline.report.certificate
        z = curve.solution()
        velocities = [curve.space.tangent(*x) for x in zip(curve.frames, curve.exact(z), strict=True)]
        assert all(sizes(v)[2] < 1e-24 for v in velocities)
        assert curve.errors().max() <= r
        assert curve.only_one_within(z, R / 4)


def test_no_zigzag_above_the_threshold_is_certified():
    for ends, segments in itertools.product(["natural", "clamped", "periodic"], [4, 40]):
        for step in THRESHOLD + np.geomspace(1e-6, 0.2, 12):
            assert zigzag(step, segments, ends).report.certificate is None
    assert zigzag(THRESHOLD - 1e-4, 40, "periodic").report.certificate


def test_two_splines_above_the_threshold():
    """Loops, and the curve that turns back at every point, for the same points."""
    spline = zigzag(1.4, 4, "periodic")
    # Of `test_thresholds`, where Algorithm 1 finds them.
    height = 3 * 0.388
    loops = height * np.array([[0, 0, (-1) ** i] for i in range(5)])
    solutions = []
    for velocities in (0 * loops, loops):
        curve = curve_of(spline, "periodic", velocities)
        assert curve.errors().max() < 2e-3
        solutions.append(curve.solution())
    assert max(abs(solutions[0] - solutions[1])) > 1.16


def main(count):
    """The errors of many curves, as fractions of r."""
    with many_digits():
        for name in MODELS:
            found = {True: [], False: []}
            for spline, given in certified_curves(name, np.random.default_rng(SEED), count):
                r = spline.report.certificate.r
                found[r > 1e-8].append(errors(name, spline, given).max() / r)
            for coarse, ratios in found.items():
                assert max(ratios) <= 1
                kind = "coarse" if coarse else "fine"
                print(
                    f"{name} {kind}: {len(ratios)}, median {np.median(ratios):.3f}, max {max(ratios):.3f}", flush=True
                )


if __name__ == "__main__":
    main(int(sys.argv[1]))
