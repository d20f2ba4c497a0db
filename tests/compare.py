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


def close(found, expected, tol=1e-12):
    """Whether values agree in shape, type, NaN and numbers, those to a part of the largest number of the factor."""
    for x, y in zip(parts(found), parts(expected), strict=True):
        x, y = np.asarray(x), np.asarray(y)
        if x.shape != y.shape or x.dtype != y.dtype:
            return False
        allowed = tol and tol * max(1.0, np.abs(y).max(initial=0.0, where=np.isfinite(y)))
        if not np.allclose(x, y, rtol=0, atol=allowed, equal_nan=True):
            return False
    return True


def same(a, b):
    """Whether two values agree in shape, type and to the last bit, NaN included."""
    return all(
        np.shape(x) == np.shape(y) and np.result_type(x) == np.result_type(y) and np.array_equal(x, y, equal_nan=True)
        for x, y in zip(parts(a), parts(b), strict=True)
    )


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
