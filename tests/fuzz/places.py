"""Spaces, and points on them: close together, far apart, at the cut locus and past it."""

import numpy as np
from cases import CASES, HYPERBOLIC, POSITIVE, base_point, steep_tangent, unit_tangent
from hypothesis import strategies as st

import symspline as ss
from fuzz.values import exponents, rarely, seeds

# Small ones; of what is special about large matrices nothing depends on their size.
FACTORS = [case.space for case in CASES if np.prod(case.space.point_shape) <= 10 or case.name in ("so:5", "cgr:3,8")]
PRODUCTS = [
    ss.space(name) for name in ("sphere:3 x r:3", "so:3 x r:3", "h:2 x s:1", "cp:1 x spd:2 x u:2", "se:2 x gr:2,5")
]

factors = st.sampled_from(FACTORS)
spaces = st.sampled_from(FACTORS + PRODUCTS)


def parts(value):
    """The factors of a product, or the arrays of its points; anything else is its own."""
    if isinstance(value, ss.Product):
        return value.factors
    return value if isinstance(value, tuple) else (value,)


def bent(space):
    """Whether rounding grows with the exponential of distances."""
    return isinstance(space, (*HYPERBOLIC, *POSITIVE))


def joined(space, arrays):
    """A point or vector of a product is a tuple of those of its factors."""
    return tuple(arrays) if isinstance(space, ss.Product) else arrays[0]


@st.composite
def points(draw, space, shape):
    """Points of a space that is no product, shape ``shape + point_shape``."""
    rng = np.random.default_rng(draw(seeds))
    kind = draw(st.sampled_from(["near", "tiny", "random", "still", "far", "cut", "paused"]))
    with np.errstate(all="ignore"):
        if kind == "random":
            return space.random_point(rng, shape)
        centre = base_point(space, rng)
        if kind == "still":
            return np.broadcast_to(centre, (*shape, *space.point_shape)).copy()
        size = {"near": 0.5, "paused": 0.5, "cut": 0.5, "far": draw(st.floats(1, 2 if bent(space) else 20))}.get(kind)
        size = 10.0 ** draw(st.integers(-18, -1)) if size is None else size
        there = np.broadcast_to(centre, (*shape, *space.point_shape))
        v = rng.standard_normal(shape)[..., *[None] * len(space.point_shape)] * unit_tangent(space, centre, rng)
        v = v + space.random_tangent(rng, there) / np.sqrt(space.dim)
        p = np.asarray(space.exp(there, size * v))
        if kind == "paused" and shape and shape[-1] > 2:
            at = len(shape) - 1
            p = np.repeat(np.take(p, range(0, shape[-1], 2), axis=at), 2, axis=at)
            p = np.take(p, range(shape[-1]), axis=at)
        if kind == "cut" and shape and shape[-1] > 1:
            radius = space.injectivity_radius if np.isfinite(space.injectivity_radius) else 3.0
            rows = p.reshape(-1, *space.point_shape)
            off = draw(st.sampled_from([0, -1e-15, 1e-15, -1e-8, 1e-8, -1e-3, 1e-3, 0.5]))
            rows[1] = space.exp(rows[0], radius * (1 + off) * steep_tangent(space, rows[0], rng))
        return p


@st.composite
def vectors(draw, space, p):
    """Tangent vectors at points, of any size; not always quite tangent."""
    rng = np.random.default_rng(draw(seeds))
    with np.errstate(all="ignore"):
        try:
            v = space.random_tangent(rng, p)
        except ss.ValidationError:
            v = rng.standard_normal(np.shape(p))
        if rarely(draw, 6):
            return v * 10.0 ** draw(exponents)
        if rarely(draw):
            return v + rng.standard_normal(v.shape)
        return v * draw(st.sampled_from([0.0, 1e-12, 0.1, 1.0, 3.0]))
