"""Data for the laws of curves."""

import numpy as np

ENDS = ["natural", "clamped", "not-a-knot", "periodic", "velocity", "acceleration", "mixed"]


def sharpness(space):
    """K where it is above 1: steps on such a space are as long as K times that on a sphere."""
    return max(1.0, np.nan_to_num(space.curvature))


def end_conditions(kind, space, p):
    velocity = 0.8 * space.log(p[0], p[1]), 0.3 * space.log(p[-1], p[-2])
    return {
        "velocity": ((1, velocity[0]), (1, velocity[1])),
        "acceleration": ((2, velocity[0]), (2, velocity[1])),
        "mixed": ("not-a-knot", (1, velocity[1])),
    }.get(kind, kind)


def knots(kind, n, rng):
    return np.concatenate(
        [[0.0], np.cumsum(np.ones(n - 1) if kind == "uniform" else rng.uniform(0.7, 1.3, n - 1))]
    )
