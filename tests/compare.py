"""Comparisons of curves and of values, which are tuples of arrays in a product."""

import numpy as np
from cases import QUOTIENTS, apart

import symspline as ss


def parts(value):
    """The arrays of a value, of which there are several in a product."""
    return value if isinstance(value, tuple) else (value,)


def factors(space):
    return space.factors if isinstance(space, ss.Product) else (space,)


def each(function, *values):
    """A function applied to the arrays of values."""
    made = tuple(map(function, *map(parts, values)))
    return made if any(isinstance(value, tuple) for value in values) else made[0]


def same(a, b):
    """Whether two values agree to the last bit, NaN included."""
    pairs = list(zip(parts(a), parts(b), strict=True))
    return all(np.shape(x) == np.shape(y) and np.array_equal(x, y, equal_nan=True) for x, y in pairs)


def largest_difference(a, b):
    return max(np.abs(np.subtract(x, y)).max() for x, y in zip(parts(a), parts(b), strict=True))


def same_curve(a, b):
    """Whether two splines and their reports agree to the last bit."""
    return a == b and same(a.velocities, b.velocities) and a.report == b.report


def pick(value, index):
    return each(lambda array: array[index], value)


def shaped(space, lead):
    """Shapes and types of points or vectors with some leading axes."""
    return [((*lead, *f.point_shape), f.dtype) for f in factors(space)]


def found(value):
    return [(np.shape(part), part.dtype) for part in parts(value)]


def off(space, x, y):
    """How far points are apart, whatever their arrays."""
    return max(float(np.max(apart(f, a, b))) for f, a, b in zip(factors(space), parts(x), parts(y), strict=True))


def vectors_off(space, x, u, y, v):
    """How far vectors are apart at points that may have other arrays."""
    return max(
        float(np.abs((f.transport(a, b, p) if isinstance(f, QUOTIENTS) else p) - q).max())
        for f, a, p, b, q in zip(factors(space), *map(parts, (x, u, y, v)), strict=True)
    )
