"""The bounds behind `report.certificate`, against numerical derivatives (docs/theory/certificate.md).

Every bound is compared with the derivatives of the middle side w of random control polygons on several spaces.
"""

import numpy as np
import pytest

import symspline as ss

SPACES = ["sphere:2", "hyperbolic:2", "so:3", "cp:2", "gr:2,4", "spd:3", "rp:2", "su:3"]
# How much numerical derivatives may exceed the bounds, relative to them.
NUMERICAL = 1e-5


class Polygons:
    """Random control polygons p, exp_p(a), exp_q(-b), q, whose frames are transported along the chord."""

    def __init__(self, name, count=200, seed=0):
        rng = np.random.default_rng(seed)
        self.space = s = ss.space(name)
        self.curvature, self.dim = s.curvature, s.dim
        origin = ss.space(name).random_point(np.random.default_rng(1))
        if not np.isfinite(s.injectivity_radius):
            origin = np.eye(s.point_shape[0]) if len(s.point_shape) == 2 else np.eye(s.point_shape[0])[0]
        self.p = np.broadcast_to(origin, (count, *s.point_shape)).copy()
        self.frame = np.asarray(s.frame(self.p))
        reach = min(s.injectivity_radius, np.pi / s.curvature)
        lengths = rng.uniform(0.05, [[1.2], [0.7], [0.7]], (3, count)) / s.curvature
        lengths = np.minimum(lengths, 0.9 * reach)
        x = rng.normal(size=(3, count, s.dim))
        x[1:, : count // 4] = x[0, : count // 4] * rng.choice([-1, 1], (2, count // 4, 1))  # along one geodesic
        x[:, count // 4 : count // 2, 2:] = 0  # in one plane
        x *= (lengths / np.linalg.norm(x, axis=-1))[..., None]
        self.chord, self.a, self.b = x
        self.q = np.asarray(s.exp(self.p, self.vectors(self.chord)))
        moved = [np.asarray(s.transport(self.p, self.q, self.frame[:, k])) for k in range(s.dim)]
        self.next_frame = np.stack(moved, axis=1)
        # Some polygons go round a closed geodesic. The logarithm of the middle side must be smooth.
        self.valid = self.lengths()[2] < 0.95 * reach * s.curvature

    def vectors(self, x, frame=None):
        frame = self.frame if frame is None else frame
        return np.einsum("...k,...kn->...n", x, frame.reshape(*frame.shape[:2], -1)).reshape(self.p.shape)

    def coordinates(self, v):
        return np.asarray(self.space.inner(self.p[:, None], self.frame, np.asarray(v)[:, None]))

    def middle(self, a, b):
        """Return w, the middle side seen from p."""
        s = self.space
        start, end = s.exp(self.p, self.vectors(a)), s.exp(self.q, -self.vectors(b, self.next_frame))
        return self.coordinates(s.transport(start, self.p, s.log(start, end)))

    def turn(self):
        """Return Ad_k: along the chord from p to q, and back along the control polygon."""
        s, columns = self.space, []
        start, end = s.exp(self.p, self.vectors(self.a)), s.exp(self.q, -self.vectors(self.b, self.next_frame))
        for k in range(self.dim):
            v = s.transport(self.q, end, self.next_frame[:, k])
            columns.append(self.coordinates(s.transport(start, self.p, s.transport(end, start, v))))
        return np.stack(columns, axis=-1)

    def lengths(self):
        w = self.middle(self.a, self.b)
        return [self.curvature * np.linalg.norm(x, axis=-1) for x in (self.a, self.b, w)]


def sinhc(x):
    return np.sinh(x) / x


def dsinhc(x):
    return (np.cosh(x) - sinhc(x)) / x


def coshc(x):
    return (np.cosh(x) - 1) / x


def bounds(a, b, w):
    """Return A and B of (cd), and the bounds (cf) of w_aa, w_ab and w_bb, for lengths times K."""
    t, cot = w / np.sin(w), w / np.tan(w)
    dt, de = (1 - cot) / np.sin(w), (t - np.cos(w)) / np.sin(w)
    big_a, big_b = (2 - cot) * sinhc(a) + w * coshc(a), t * sinhc(b)
    turn_a, turn_b = (coshc(x) + np.tan(w / 2) * sinhc(x) for x in (a, b))
    dcoshc = (np.sinh(a) - coshc(a)) / a
    aa = de * big_a * sinhc(a) + (2 - cot) * dsinhc(a) + coshc(a) * big_a + w * dcoshc
    ab = sinhc(b) * (dt * big_a + t * turn_a)
    bb = sinhc(b) * (dt * big_b + t * turn_b) + t * dsinhc(b)
    return big_a, big_b, aa, ab, bb


def jacobian(f, dim, h=1e-4):
    unit = np.eye(dim) * h
    return np.stack([(f(unit[k]) - f(-unit[k])) / (2 * h) for k in range(dim)], axis=-1)


def norms(matrices):
    return np.linalg.norm(matrices, ord=2, axis=(1, 2))


@pytest.mark.parametrize("name", SPACES)
def test_first_derivatives(name):
    # The derivative by b differs by at most B - 1 from the isometry -Ad_k, transport along the control polygon.
    case = Polygons(name)
    big_a, big_b, *_ = bounds(*case.lengths())
    by_a = jacobian(lambda x: case.middle(case.a + x, case.b), case.dim)
    by_b = jacobian(lambda x: case.middle(case.a, case.b + x), case.dim)
    turn = case.turn()
    np.testing.assert_allclose(turn @ turn.transpose(0, 2, 1) - np.eye(case.dim), 0, atol=1e-9)
    for norm, bound in ((norms(by_a + np.eye(case.dim)), big_a - 1), (norms(by_b + turn), big_b - 1)):
        norm, bound = norm[case.valid], bound[case.valid]
        assert np.all(norm <= bound * (1 + NUMERICAL) + 1e-7)
        assert np.max(norm / bound) > 0.7


@pytest.mark.parametrize("name", SPACES)
def test_second_derivatives(name):
    case = Polygons(name)
    limits = [case.curvature * x for x in bounds(*case.lengths())[2:]]
    rng, h, most = np.random.default_rng(2), 2e-3, np.zeros((3, len(case.p)))
    for trial in range(16):
        u, v = rng.normal(size=(2, *case.a.shape))
        v = [v, u, case.a, case.middle(case.a, case.b)][trial % 4]
        u, v = (h * x / np.linalg.norm(x, axis=-1, keepdims=True) for x in (u, v))
        none = 0 * u
        pairs = [((u, none), (v, none)), ((u, none), (none, v)), ((none, u), (none, v))]
        for row, (one, other) in zip(most, pairs, strict=True):
            total = none
            for i, j in ((1, 1), (1, -1), (-1, 1), (-1, -1)):
                by_a, by_b = (i * x + j * y for x, y in zip(one, other, strict=True))
                total = total + i * j * case.middle(case.a + by_a, case.b + by_b)
            np.maximum(row, np.linalg.norm(total, axis=-1) / (4 * h * h), out=row)
    for row, limit in zip(most, limits, strict=True):
        assert np.all((row <= limit * (1 + 1e-3))[case.valid])
    assert max(np.max((row / limit)[case.valid]) for row, limit in zip(most, limits, strict=True)) > 0.4
