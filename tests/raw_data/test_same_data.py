"""The same data are accepted, or refused in the same words, by every function that takes times and points."""

import re
import warnings

import numpy as np
import pytest
from cases import loop_over

import symspline as ss
from symspline.cli import main

xr = pytest.importorskip("xarray")
sx = pytest.importorskip("symspline.xarray")

S, N = "sphere:2", 12
T = np.cumsum(0.5 + np.random.default_rng(1).random(N))
P = ss.geo.from_lonlat(np.linspace(0, 60, N), 20 * np.sin(np.arange(N) / 3))
# Sampling times; the curve ends at the last of them.
X = np.linspace(T[0], T[-1], 9)[1:-1]


def array(t, points):
    return xr.DataArray(points, dims=("time", "q"), coords=None if t is None else {"time": t})


def by_fit(t, points, **how):
    v, _ = ss.fit(t, points, S, **how)
    return lambda x: ss.evaluate(t, points, v, S, x)


def by_command_line(t, points):
    np.savez("a.npz", points=points, **({} if t is None else {"t": t}))
    if main(["fit", "a.npz", "--space", S, "-o", "b.npz"]):
        raise ss.ValidationError("")
    return ss.load("b.npz")


def on_grid(make, t, points):
    grid = make((t,), points, S)
    return lambda x: grid(np.asarray(x)[:, None])


# With `skipna`: functions that take recordings.
RECORDINGS = {
    "CubicSpline": lambda t, p, **how: ss.CubicSpline(t, p, S, **how),
    "fit_many": lambda t, p, **how: ss.fit_many([(t, p)], S, **how)[0],
    "fit_segments": lambda t, p, **how: ss.fit_segments(t, p, S, max_gap=9, **how),
    "HermiteSpline": lambda t, p, **how: ss.HermiteSpline(t, p, np.zeros((len(p), 3)), S, **how),
    "HermiteSpline.from_points": lambda t, p, **how: ss.HermiteSpline.from_points(t, p, S, **how),
    "PiecewiseGeodesic": lambda t, p, **how: ss.PiecewiseGeodesic(t, p, S, **how),
    "make_smoothing_spline": lambda t, p, **how: ss.make_smoothing_spline(t, p, S, 1e-9, **how),
    "fit_segments smooth": lambda t, p, **how: ss.fit_segments(t, p, S, max_gap=9, smooth=True, lam=1e-9, **how),
    "make_lsq_spline": lambda t, p, **how: ss.make_lsq_spline(t, p, 5, S, **how),
    "estimate": lambda t, p, **how: ss.estimate([ss.measure.Points(t, p, sigma=1.0)], 9, S, lam=1e-9, **how),
}
OTHERS = {
    "fit": by_fit,
    "append": lambda t, p: ss.CubicSpline(t[:2], p[:2], S).append(t[2:], p[2:], lag=None),
    "evaluate": lambda t, p: lambda x: ss.evaluate(t, p, np.zeros((len(p), 3)), S, x),
    "xarray.resample": lambda t, p: lambda x: sx.resample(array(t, p), S, x, on_failure="raise").values,
    "xarray.smooth": lambda t, p: lambda x: sx.smooth(array(t, p), S, lam=1e-9, on_failure="raise", to=x).points.values,
    "command line": by_command_line,
}
# NaN marks missing nodes, without an option.
GRIDS = {
    "GridSpline": lambda t, p: on_grid(ss.GridSpline, t, p),
    "make_smoothing_grid": lambda t, p: on_grid(lambda *own: ss.make_smoothing_grid(*own, lam=1e-9), t, p),
}
DOORS = RECORDINGS | OTHERS | GRIDS
TAKE_ANY_ORDER = ("estimate",)
TAKE_REPEATED = ("estimate", "make_smoothing_spline", "fit_segments smooth", "make_lsq_spline")
# Their points are arrays of xarray or in a file, or the call itself slices them.
NOT_PLAIN = ("xarray.resample", "xarray.smooth", "command line", "append")


def with_row(i, value, array=P):
    found = np.array(array)
    found[i] = value
    return found


def masked(array):
    found = np.ma.masked_array(array, np.zeros(array.shape, bool))
    found[4] = np.ma.masked
    return found


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


DATES = np.datetime64("2024-05-01") + (1e9 * T).astype("m8[ns]")
X_DATES = np.datetime64("2024-05-01") + (1e9 * X).astype("m8[ns]")
GOOD = {
    "single precision": (T, P.astype(np.float32), X, 1e-6),
    "from single precision": (T, P.astype(np.float32).astype(float), X, 1e-6),
    "six decimals": (T, P.round(6), X, 1e-5),
    "three decimals": (T, P.round(3), X, 1e-2),
    "dates": (DATES, P, X_DATES, 1e-8),
    "durations": ((1e9 * T).astype("m8[ns]"), P, (1e9 * X).astype("m8[ns]"), 1e-8),
    "big-endian": (T.astype(">f8"), P.astype(">f8"), X, 1e-12),
    "not contiguous": (np.repeat(T, 2)[::2], np.asfortranarray(P), X, 1e-12),
    "lists": (T.tolist(), P.tolist(), X, 1e-12),
}


@pytest.mark.parametrize("name", DOORS)
@loop_over("kind", GOOD)
def test_accepted(name, kind):
    t, points, x, tolerance = GOOD[kind]
    if kind == "durations" and name == "command line":
        pytest.skip("files hold numbers or dates")
    found = DOORS[name](t, points)(x)
    np.testing.assert_allclose(found, DOORS[name](T, P)(X), atol=tolerance)


POINTS, TIMES = r"(points|da|measurements\[0\]\.y)", r"(t|axes\[0\]|measurements\[0\]\.t)(\[0\])?"
BAD = {
    "unsorted": (with_row(4, T[6] + 0.1, T), P, TIMES + r"\[(5|3)\]"),
    "repeated": (with_row(4, T[3], T), P, TIMES + r"\[(3|4|2)\]"),
    "infinite time": (with_row(4, np.inf, T), P, TIMES + r"\[(4|2)\] is inf"),
    "missing time": (with_row(4, np.nan, T), P, TIMES + r"\[(4|2)\] is nan"),
    "complex times": (T + 0j, P, TIMES + " must be numbers or datetime64, not complex128"),
    "no dates": (T.astype(str), P, TIMES + r"\[0\] is '1.01"),
    "too few times": (T[:-1], P, r"\(?11|conflicting sizes|\(9, 3\) is needed"),
    "missing point": (T, with_row(4, np.nan), r"\[4\].*skipna=True|finite"),
    "infinite point": (T, with_row(4, np.inf), POINTS + r"\[4\]"),
    "off the space": (
        T,
        with_row(4, 1.3 * P[4]),
        r"(\[| )4\]? (of curve 0 )?is off the space by 3.000e-1: its norm is 1.3",
    ),
    "wrong size": (T, np.c_[P, P[:, 0]], r"\(12, 4\)|\(10, 4\)|\(4,\)|\(2, 4\)"),
    "complex": (T, P + 0j, POINTS + " must be an array of real numbers, not of complex128"),
    "objects": (T, P.astype(object), POINTS + " must be an array of numbers, not of object; pass .*astype"),
    "texts": (T, P.astype(str), POINTS + " must be an array of real numbers, not of <U32"),
    "masked": (T, masked(P), POINTS + r"\[4, 0\] is masked.*skipna=True"),
    "empty": (T[:0], P[:0], "no points given|shape|0 nodes|two"),
    "one point": (T[:1], P[:1], "two"),
}
# Functions that accept such data.
ACCEPT = {
    "unsorted": TAKE_ANY_ORDER,
    "repeated": TAKE_REPEATED,
    "missing point": ("xarray.smooth", *GRIDS),
    "missing time": ("xarray.smooth",),
    "masked": (*GRIDS, *NOT_PLAIN),
    # The command reads texts as numbers. Complex numbers are two columns, neither of which holds times, as it says.
    "complex times": ("command line",),
    "no dates": ("command line",),
    "texts": ("command line",),
}


@pytest.mark.parametrize("name", DOORS)
@loop_over("kind", BAD)
def test_refused_with_the_place(name, kind, capsys):
    t, points, match = BAD[kind]
    if name in ACCEPT.get(kind, ()):
        return
    with warnings.catch_warnings(), pytest.raises(ValueError) as caught:
        warnings.simplefilter("error")
        DOORS[name](t, points)(X)
    message = f"{caught.value}{capsys.readouterr().err}"
    # A table has rows.
    in_file = r"row (3|4|5) \(counted from 0\)|must be|point|11 and 12|columns|no rows"
    assert re.search(in_file if name == "command line" else match, message, re.IGNORECASE), message
    assert len(message) < 420


@pytest.mark.parametrize("name", RECORDINGS)
@loop_over("kind", ["missing point", "missing time", "masked", "masked times"])
def test_skipped(name, kind):
    t, points = (masked(T), P) if kind == "masked times" else BAD[kind][:2]
    kept = np.delete(np.arange(N), 4)
    expected = RECORDINGS[name](T[kept], P[kept])(X)
    np.testing.assert_allclose(RECORDINGS[name](t, points, skipna=True)(X), expected, atol=1e-12)
