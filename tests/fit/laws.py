"""Data for the laws of curves."""

import numpy as np
from cases import end_conditions


def sharpness(space):
    """K where it is above 1: steps on such a space are as long as K times that on a sphere."""
    return max(1.0, np.nan_to_num(space.curvature))


def ends_along(kind, space, p):
    """End conditions with vectors along the chords at the ends."""
    return end_conditions(kind, 0.8 * space.log(p[0], p[1]), 0.3 * space.log(p[-1], p[-2]))


def knots(kind, n, rng):
    return np.concatenate([[0.0], np.cumsum(np.ones(n - 1) if kind == "uniform" else rng.uniform(0.7, 1.3, n - 1))])
