"""Invalid numbers and arrays, and objects that are neither, as users pass them by accident."""

import numpy as np
from hypothesis import strategies as st

NASTY = [
    np.nan, np.inf, -np.inf, -0.0, 0.0, 5e-324, -2e-308, 1e-200, 1e-17, 1e-8, 0.5, 1.0, -1.0, 1 + 2**-52,
    1e8, 2.0**53, 1e16, -1e150, 1e154, 1e300, -1.7e308,
]  # fmt: skip

GOOD, BAD, ODD = "good", "bad", "odd"
moods = st.sampled_from([GOOD, GOOD, BAD, BAD, ODD])
"""How well a user means: all as it should be, sometimes bad numbers or shapes, or even things of wrong types."""


class Strange:
    """Of no use to anybody."""

    def __repr__(self):
        return "Strange()"


class WithArray:
    """Not an array, but NumPy makes one of it."""

    def __init__(self, array):
        self.array = array

    def __array__(self, dtype=None, copy=None):
        return np.array(self.array, dtype=dtype)

    def __repr__(self):
        return f"WithArray({self.array!r})"


NONSENSE = [
    None, "", "points", "nan", b"\x00", True, 5, -1.5, 1j, 10**400, float("nan"), (), [], [[]], {}, {"a": 1}, [None],
    [[1, 2], [3]], [1, "a"], [[1, 0, 0], None], set(), range(3), Strange(), Strange, len, slice(1), Ellipsis,
    np.str_("x"), np.float32(1), np.datetime64("NaT"), np.timedelta64(1, "s"), np.zeros(0), np.zeros((0, 3)),
    np.zeros((3, 0)), np.zeros(3, "V4"), np.zeros(3, [("a", "f8")]), np.array(None), np.array(["a"]),
    np.array([Strange()]), np.zeros((2,) * 20), np.array("2020-01-01", "M8"),
]  # fmt: skip
"""Things of wrong types; a TypeError is an answer to all of them."""

nonsense = st.sampled_from(NONSENSE)
seeds = st.integers(0, 2**32 - 1)
exponents = st.integers(-320, 308)

DTYPES = [
    "f8", ">f8", "f4", "f2", "g", "c16", "c8", "G", "i8", "i1", "u8", "?", "O", "U", "S", "M8[s]", "m8[ns]",
]  # fmt: skip


def rarely(draw, chance=8):
    """True once in a while."""
    return draw(st.integers(0, chance - 1)) == chance - 1


@st.composite
def spoiled(draw, array):
    """The array with nasty numbers in some places, or of another size."""
    array = np.array(array)
    if array.size == 0:
        return array
    with np.errstate(all="ignore"):
        if array.dtype.kind not in "fc":
            array.reshape(-1)[draw(st.integers(0, array.size - 1))] = array.flat[0]
            return array
        how = draw(st.sampled_from(["one", "many", "scale", "shift", "zero"]))
        if how == "one":
            array.reshape(-1)[draw(st.integers(0, array.size - 1))] = draw(st.sampled_from(NASTY))
        elif how == "many":
            rng = np.random.default_rng(draw(seeds))
            array[rng.random(array.shape) < 0.3] = draw(st.sampled_from(NASTY))
        elif how == "scale":
            array *= 10.0 ** draw(exponents)
        elif how == "shift":
            rng = np.random.default_rng(draw(seeds))
            array = array + 10.0 ** draw(st.integers(-17, 1)) * rng.standard_normal(array.shape)
        else:
            array[...] = 0
    return array


@st.composite
def disguised(draw, array):
    """The same numbers in memory of another kind."""
    array = np.asarray(array)
    how = draw(st.sampled_from(["plain", "fortran", "steps", "back", "locked", "list", "swapped", "object", "wide"]))
    if how == "fortran":
        return np.array(array, order="F")
    if how == "steps":
        return np.stack([array] * 3, axis=-1)[..., 1]
    if how == "back" and array.ndim:
        return array[::-1].copy()[::-1]
    if how == "locked":
        array = array.copy()
        array.flags.writeable = False
    if how == "list":
        return array.tolist()
    if how == "swapped":
        return array.astype(array.dtype.newbyteorder())
    if how == "object":
        return WithArray(array)
    if how == "wide" and array.ndim and len(array):
        # All rows are the first one.
        return np.broadcast_to(array[:1], array.shape)
    return array


@st.composite
def cast(draw, array):
    """The array with numbers of another type, which may not hold them."""
    with np.errstate(all="ignore"):
        try:
            return np.asarray(array).real.astype(draw(st.sampled_from(DTYPES)))
        except (ValueError, TypeError, OverflowError):
            return array


@st.composite
def misshapen(draw, array):
    """The array with other axes."""
    array = np.asarray(array)
    how = draw(st.sampled_from(["new", "last", "drop", "cut", "empty", "turned", "flat", "none", "repeat"]))
    if how == "new":
        return array[None]
    if how == "last":
        return array[..., None]
    if how == "drop" and array.ndim:
        return array[draw(st.integers(-1, 0))] if len(array) else array.reshape(-1)
    if how == "cut" and array.ndim:
        return array[..., :-1]
    if how == "empty" and array.ndim:
        return array[:0]
    if how == "turned":
        return array.T
    if how == "flat":
        return array.ravel()
    if how == "repeat":
        return np.stack([array] * 3)
    return np.zeros(())


@st.composite
def array_like(draw, array, mood):
    """An array as a user gives it: well in a good mood, in others sometimes spoiled or something else."""
    if mood == ODD and rarely(draw, 4):
        return draw(nonsense)
    if mood != GOOD and rarely(draw, 4):
        array = draw(st.one_of(spoiled(array), cast(array), misshapen(array)))
    return draw(disguised(array))
