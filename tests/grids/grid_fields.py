"""Smooth fields of points over two or three parameters, on any space."""

import cases
import numpy as np
from cases import base_point, unit_tangent


def knots(rng, n, uneven=0.4):
    """Unequal knots from 0 to 1."""
    steps = 1 + uneven * rng.uniform(-1, 1, n - 1)
    return np.concatenate([[0], np.cumsum(steps)]) / steps.sum()


class Field:
    """A smooth field: the exponential of a smooth combination of three tangent vectors at one point."""

    def __init__(self, space, seed=0, size=0.4):
        rng = np.random.default_rng(seed)
        self.space, self.size = space, size
        self.waves = rng.uniform(0.8, 2.2, (3, 3))
        self.parts = []
        for factor in factors_of(space):
            base = base_point(factor, rng)
            self.parts.append((factor, base, [unit_tangent(factor, base, rng) for _ in range(3)]))

    def __call__(self, *x):
        x = np.broadcast_arrays(*x)
        phases = [sum(w * own for w, own in zip(wave, x, strict=False)) + k for k, wave in enumerate(self.waves)]
        heights = [self.size * np.sin(phase) for phase in phases]

        def one(factor, base, vectors):
            tail = (1,) * len(factor.point_shape)
            v = sum(h.reshape(h.shape + tail) * own for h, own in zip(heights, vectors, strict=True))
            return factor.exp(np.broadcast_to(base, v.shape), v)

        found = tuple(one(*part) for part in self.parts)
        return found if len(found) > 1 else found[0]

    def on(self, *axes):
        """The points on the outer product of axes."""
        return self(*np.meshgrid(*axes, indexing="ij"))


def factors_of(space):
    return getattr(space, "factors", (space,))


def apart(space, p, q):
    """How far points are from each other, the most in any factor."""
    if not hasattr(space, "factors"):
        return cases.apart(space, p, q)
    return max(cases.apart(*each) for each in zip(space.factors, p, q, strict=True))


def inside(rng, axes, count):
    """Random coordinates between the ends of each axis."""
    return tuple(rng.uniform(t[0], t[-1], count) for t in axes)
