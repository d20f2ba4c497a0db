"""Arguments of a fit and of an evaluation: times, end conditions, options."""

import numpy as np
from hypothesis import strategies as st

from fuzz.places import joined, parts, points, vectors
from fuzz.values import BAD, GOOD, NASTY, ODD, array_like, exponents, nonsense, rarely, seeds

WORDS = ["natural", "clamped", "not-a-knot", "periodic"]
POLICIES = [None, True, "geodesic", "periodic"]
UNITS = ["D", "h", "m", "s", "ms", "us", "ns", "as", "W", "M", "Y", "10m"]


def ignored(*_):
    """Takes progress and does nothing."""


_good_options = st.fixed_dictionaries(
    {},
    optional={
        "method": st.sampled_from(["auto", "quasi-newton", "newton", "fixed-point"]),
        "tol": st.sampled_from([0, 1e-15, 1e-9, np.float32(1e-3), 10.0, 1e300, 5e-324]),
        "max_iter": st.sampled_from([1, 2, 9, np.int64(50), 1000]),
        "extrapolate": st.sampled_from(POLICIES),
        "on_failure": st.sampled_from(["raise", "warn", "ignore"]),
        "progress": st.sampled_from([None, ignored]),
    },
)
_bad_options = st.fixed_dictionaries(
    {},
    optional={
        "method": st.sampled_from(["Auto", "", "new"]),
        "tol": st.sampled_from(NASTY),
        "max_iter": st.sampled_from([0, -1, 1, 10**30]),
        "extrapolate": st.sampled_from(["", "wrap", False]),
        "on_failure": st.sampled_from(["", "Raise", "ignore"]),
        "check": st.booleans(),
    },
)
_odd_options = st.dictionaries(
    st.sampled_from(["method", "tol", "max_iter", "extrapolate", "on_failure", "check", "progress", "surprise"]),
    nonsense,
    max_size=2,
)


@st.composite
def options(draw, mood):
    """Keyword arguments of a fit."""
    found = draw(_good_options)
    if mood == BAD and rarely(draw, 4):
        found |= draw(_bad_options)
    if mood == ODD:
        found |= draw(_odd_options)
    return found


@st.composite
def nodes(draw, space, batch, n):
    """Points of curves, a list with one array a factor."""
    return [draw(points(factor, (*batch, n))) for factor in parts(space)]


def come_back(space, arrays):
    """The same curves, whose last points are now their first ones."""
    closed = []
    for factor, p in zip(parts(space), arrays, strict=True):
        axis = p.ndim - len(factor.point_shape) - 1
        p = p.copy()
        np.moveaxis(p, axis, 0)[-1] = np.moveaxis(p, axis, 0)[0]
        closed.append(p)
    return closed


@st.composite
def knots(draw, batch, n, mood):
    """Times of curves: numbers, dates, or None for 0, 1, ..."""
    if mood == ODD and rarely(draw, 4):
        return draw(nonsense)
    kind = draw(st.sampled_from(["none", "gaps", "steep", "dates", "large"]))
    rng = np.random.default_rng(draw(seeds))
    shape = (*batch, n) if rarely(draw, 3) else (n,)
    with np.errstate(all="ignore"):
        if kind == "none":
            return None
        if kind == "dates":
            start = draw(st.sampled_from([0, -(10**6), 10**9]))
            t = start + np.arange(1, n + 1) * draw(st.sampled_from([1, 60, 2**33]))
            if mood != GOOD and rarely(draw):
                t += draw(st.sampled_from([-(2**63) + 1, 2**63 - 2**40, 2**62]))
            return t.astype(f"M8[{draw(st.sampled_from(UNITS))}]")
        if kind == "large":
            whole = draw(st.sampled_from([2**53, 2**62, 2**64 - 100, -(2**63)]))
            return np.array([whole + i for i in range(n)], np.uint64 if whole > 2**63 else np.int64)
        gaps = rng.uniform(0.5, 2, shape)
        if kind == "steep":
            gaps = 10.0 ** (rng.uniform(-1, 1, shape) * draw(st.sampled_from([2, 6, 12, 100])))
        t = np.cumsum(gaps, axis=-1) * 10.0 ** draw(st.sampled_from([0, 0, -3, 5, 12, -150, 150, 300]))
        return draw(array_like(t, mood))


@st.composite
def _end(draw, space, arrays, at, mood):
    if draw(st.booleans()):
        return draw(st.sampled_from(WORDS[:3]))
    if mood == ODD and draw(st.booleans()):
        return draw(st.one_of(nonsense, st.tuples(st.sampled_from([0, 1, 2, 3, 1.0, True, "1"]), nonsense)))
    found = []
    for factor, p in zip(parts(space), arrays, strict=True):
        here = np.take(p, at, axis=p.ndim - len(factor.point_shape) - 1)
        found.append(draw(array_like(draw(vectors(factor, here)), mood)))
    return (draw(st.sampled_from([1, 2])), joined(space, found))


@st.composite
def ends(draw, space, arrays, mood):
    """End conditions of curves with these points."""
    if mood == ODD and rarely(draw):
        return draw(nonsense)
    if draw(st.booleans()):
        return draw(st.sampled_from(WORDS))
    return (draw(_end(space, arrays, 0, mood)), draw(_end(space, arrays, -1, mood)))


@st.composite
def times(draw, spline_t, mood, shape=()):
    """Times at which to evaluate: at knots, between them, beside them, far away, and none at all."""
    if mood == ODD and rarely(draw, 4):
        return draw(nonsense)
    try:
        t = np.asarray(spline_t)
    except ValueError:
        t = np.zeros(1)
    t = t if t.size else np.zeros(1)
    rng = np.random.default_rng(draw(seeds))
    size = (*shape, draw(st.sampled_from([1, 2, 9, 40, 0])))
    kind = draw(st.sampled_from(["inside", "knots", "outside", "far"]))
    if kind == "knots" or t.dtype.kind != "f" or not np.isfinite(t).all():
        return draw(array_like(rng.choice(t.ravel(), size), mood))
    low, high = t.min(), t.max()
    with np.errstate(all="ignore"):
        if kind == "far":
            return draw(array_like(rng.standard_normal(size) * 10.0 ** draw(exponents), mood))
        share = rng.random(size) if kind == "inside" else rng.uniform(-2, 3, size)
        return draw(
            array_like(np.clip(low + (high - low) * share, *((low, high) if kind == "inside" else (None, None))), mood)
        )
