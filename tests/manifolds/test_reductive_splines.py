"""The C² condition on reductive spaces, (e*) of docs/theorem.md, on splines: groups with left translations only, and
Stiefel manifolds, whose acceleration is computed with 40 digits from the segments."""

import numpy as np
import pytest
from cases import loop_over
from made import walk
from mpmath import mp
from scipy.linalg import logm

import symspline as ss

GROUPS = [ss.space("se:2"), ss.space("se:3"), ss.Affine(2), ss.SpecialOrthogonal(3)]
TIMES = np.array([0.0, 0.7, 2.0, 2.6, 4.0, 4.9])


def ad(xi):
    """The matrix of η ↦ [ξ, η]."""
    one = np.eye(len(xi))
    return np.kron(xi, one) - np.kron(one, xi.T)


def dexp(xi):
    """(eˣ − 1)/x of ad_ξ, by its series."""
    x = ad(xi)
    total = term = np.eye(len(x))
    for j in range(2, 40):
        term = term @ x / j
        total = total + term
    return total


def sides(spline, solve):
    """Both sides of (e*) at the inner knots, with left translations, where solve(ξ, ω − ξ) is D(ξ)⁻¹(ω − ξ)."""
    t, p, controls = spline.t, spline.points, spline.control_points
    both = []
    for i in range(1, len(t) - 1):
        inverse = np.linalg.inv(p[i])
        for h, handle, other in ((t[i + 1] - t[i], *controls[i, 1:3]), (t[i] - t[i - 1], *controls[i - 1, 2:0:-1])):
            xi = np.real(logm(handle @ inverse))
            # exp(−ξ) = p q⁻¹
            omega = np.real(logm(p[i] @ np.linalg.inv(handle) @ other @ inverse))
            both.append(solve(xi, omega - xi) / h**2)
    right, left = np.array(both[::2]), np.array(both[1::2])
    return np.abs(right - left).max() / np.abs(right).max()


@loop_over("space", GROUPS)
@loop_over("ends", ["natural", "clamped"])
@loop_over("equal", [False, True])
def test_left_translations_suffice(space, ends, equal):
    """The splines of the compiled groups, computed with both translations, satisfy (e*). (13) fails for them."""
    rng = np.random.default_rng(6)
    t = np.arange(len(TIMES)) * 1.0 if equal else TIMES
    p = [space.random_point(rng)]
    for _ in t[1:]:
        # Without a metric, vectors have no length but that of their generator.
        v = space.random_tangent(rng, p[-1])
        p.append(space.exp(p[-1], 0.8 * v / np.linalg.norm(np.linalg.solve(p[-1], v))))
    spline = ss.CubicSpline(t, np.array(p), space, bc_type=ends)
    error = sides(spline, lambda xi, x: np.linalg.solve(dexp(-xi), x.ravel()))
    assert error < 1e-10, (space, ends, error)
    # The identity in place of D, which is (13) on equal knots, and D(−ξ).
    assert sides(spline, lambda _, x: x) > 0.1
    assert sides(spline, lambda xi, x: np.linalg.solve(dexp(xi), x.ravel())) > 0.1


# ---- accelerations of Stiefel manifolds with 40 digits ----

DIGITS = 40
STEP = "1e-12"


def exact_exp(p, v):
    """exp_p(v) = exp(Ω)p with Ω = (1 − ppᵀ/2)vpᵀ − pvᵀ(1 − ppᵀ/2)"""
    half = v - p * (p.T * v) / 2
    return mp.expm(half * p.T - p * half.T, method="taylor") * p


def exact_log(space, p, q):
    """Newton's method with derivatives in double precision, each step of which gives some ten digits."""
    near, there = (np.array(x.tolist(), dtype=float) for x in (p, q))
    # The nearest frames in double precision.
    near, there = space.project(near), space.project(there)
    v = mp.matrix(space.log(near, there))
    for _ in range(8):
        rest = q - exact_exp(p, v)
        size = mp.norm(rest, mp.inf)
        if size < mp.mpf(10) ** (5 - DIGITS):
            return v
        away = np.array((rest / size).tolist(), dtype=float)
        v = v + size * mp.matrix(space.dlog(near, there, space.project_tangent(there, away)))
        # Tangent vectors at p have a skew-symmetric pᵀv.
        inside = p.T * v
        v = v - p * (inside + inside.T) / 2
    raise AssertionError(f"no logarithm: {size}")


def exact_acceleration(space, p, v, q, w):
    """The covariant acceleration at t = 0 of the segment with handles v at p and w at q."""
    p, v, q, w = (mp.matrix(x) for x in (p, v, q, w))
    inner, other = exact_exp(p, v), exact_exp(q, w)
    between = exact_log(space, inner, other)

    def point(t):
        a, b, c = exact_exp(p, t * v), exact_exp(inner, t * between), exact_exp(q, (1 - t) * w)
        d, e = (exact_exp(x, t * exact_log(space, x, y)) for x, y in ((a, b), (b, c)))
        return exact_exp(d, t * exact_log(space, d, e))

    h = mp.mpf(STEP)
    after, before = point(h), point(-h)
    y, d, dd = p, (after - before) / (2 * h), (after + before - 2 * p) / h**2
    # Edelman, Arias & Smith (1998), equation 2.41.
    inside = y.T * d
    result = dd + d * (d.T * y) + y * (inside * inside + d.T * d)
    return np.array(result.tolist(), dtype=float)


def frames(x):
    """The nearest frame, orthonormal to all digits, by steps of Newton and Schulz."""
    x = mp.matrix(x)
    for _ in range(2):
        x = 1.5 * x - 0.5 * x * (x.T * x)
    return x


@pytest.mark.slow
@pytest.mark.parametrize(("k", "n"), [(2, 4), (3, 6)])
def test_the_acceleration_of_stiefel_splines_is_continuous(k, n):
    space = ss.Stiefel(k, n)
    spline = ss.CubicSpline(TIMES, walk(space, 0.9, len(TIMES), 4), space, bc_type="clamped")
    with mp.workdps(DIGITS + 5):
        p = [frames(x) for x in spline.points]
        u = []
        for x, v in zip(p, spline.velocities, strict=True):
            inside = x.T * mp.matrix(v)
            u.append(mp.matrix(v) - x * (inside + inside.T) / 2)
        for i in (1, 3):
            right, left = (
                exact_acceleration(space, p[i], h * u[i] / 3, p[j], -h * u[j] / 3) / h**2
                for h, j in ((TIMES[i + 1] - TIMES[i], i + 1), (TIMES[i - 1] - TIMES[i], i - 1))
            )
            size = np.abs(right).max()
            assert size > 0.1
            assert np.abs(right - left).max() < 1e-10 * size
            # The library's own derivatives, where it has exact ones.
            if space.operations.differentiates:
                assert np.abs(spline(TIMES[i], 2) - right).max() < 1e-10 * size
