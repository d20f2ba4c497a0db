"""All public functions and methods, and a pool of valid and invalid arguments for them."""

import datetime
import importlib
import inspect
import io

import numpy as np

import symspline as ss

MODULES = [
    "symspline", "symspline.convert", "symspline.geo", "symspline.manifolds", "symspline.measure", "symspline.poses",
    "symspline.quantum", "symspline.rotations", "symspline.shapes", "symspline.subspaces", "symspline.tensors",
    "symspline.testing", "symspline.xarray",
]  # fmt: skip
NEEDS = {"symspline.xarray": "xarray"}
# They change how the process runs, or take functions that the user vouches for.
LEFT_OUT = {"set_num_threads", "show_config", "from_geomstats", "from_pymanopt", "map"}
# Animations warn if they are not drawn.
LEFT_OUT |= {"animate"}
# Made by `make_smoothing_spline` only.
LEFT_OUT |= {"RetimedCurve", "SmoothingGrid", "SmoothingSpline"}
# An abstract class.
LEFT_OUT |= {"Curve"}

P = np.eye(3)
T = np.array([0.0, 1.0, 3.0])
DAYS = np.array(["2024-01-01", "2024-01-02", "2024-01-04"], "M8[s]")
QUBIT = np.array([[1, 0], [0.8, 0.6j], [0.6, 0.8]])
TURNS = ss.rotations.from_rotation_vectors([[0, 0, 0], [0, 0, 1.0], [0.2, 0, 1.5]])
POSES = ss.poses.join(TURNS, [[0, 0, 0], [1, 0, 0], [2, 1, 0]])
SPD = np.array([np.diag([1.0, 2, 3]), np.eye(3), np.diag([3.0, 1, 1])])
SQUARE = np.array([[0.0, 0], [1, 0], [1, 1], [0, 1]])
NAMES = ("sphere:2", "r:2", "so:3", "cp:1", "se:3", "spd:3", "gr:1,3", "h:2", "r:2 x so:3")
SPACES = [ss.space(name) for name in NAMES]


MEASURED = [
    [ss.measure.Points(T, TURNS, sigma=0.1), ss.measure.BodyRates(T, P, sigma=0.1, bias=ss.measure.Constant(3))],
    [ss.measure.Points(T, P, sigma=0.1)],
    [ss.measure.Points(DAYS, TURNS, sigma=0.1)],
]


def objects():
    """Objects whose methods are called, by a name for messages."""
    sphere = ss.CubicSpline(T, P, "sphere:2")
    found = {
        "CubicSpline": sphere,
        "CubicSpline of dates": ss.CubicSpline(DAYS, P, "sphere:2", extrapolate=True),
        "CubicSpline, closed": ss.CubicSpline(None, [*P, P[0]], "sphere:2", bc_type="periodic"),
        "CubicSpline, batch": ss.CubicSpline(None, [P, P], "sphere:2"),
        "CubicSpline, no curves": ss.CubicSpline(None, np.zeros((0, 3, 3)), "sphere:2"),
        "CubicSpline, qubit": ss.CubicSpline(None, QUBIT, "cp:1"),
        "CubicSpline, turns": ss.CubicSpline(None, TURNS, "so:3"),
        "CubicSpline, poses": ss.CubicSpline(None, POSES, "se:3"),
        "CubicSpline, product": ss.CubicSpline(None, (P, T[:, None]), "sphere:2 x r:1"),
        "HermiteSpline": ss.HermiteSpline(T, P, np.zeros((3, 3)), "sphere:2"),
        "SmoothingSpline": ss.make_smoothing_spline(T, P, "sphere:2", 0.1),
        "SmoothingSpline, estimated": ss.estimate(MEASURED[0], 4, "so:3", lam=0.1),
        "BSpline": ss.BSpline([0, 0, 0, 1, 1, 1], P, 2, "sphere:2"),
        "CumulativeBSpline": ss.CumulativeBSpline([0, 0, 0, 1, 1, 1], TURNS, "so:3", degree=2),
        "BezierCurve": ss.BezierCurve(P, "sphere:2"),
        "RetimedCurve": sphere.restrict(0.25, 0.75),
        "RetimedCurve of dates": ss.CubicSpline(DAYS, P, "sphere:2").restrict(
            DAYS[0], DAYS[0] + (DAYS[1] - DAYS[0]) // 2
        ),
        "SegmentedCurve": ss.SegmentedCurve([sphere, sphere.shift(10)]),
        "Derivative": sphere.derivative(),
        "GridSpline": ss.GridSpline(
            (T, None), P[[0, 1]].repeat(2, axis=0)[[0, 1, 2]][:, None] * np.ones((3, 2, 1)), "sphere:2"
        ),
        "GridSpline, volume": ss.GridSpline((None, T, DAYS), np.full((2, 3, 3, 1), 0.5), "r:1", symmetric=True),
        "SmoothingGrid": ss.make_smoothing_grid((None, T), np.eye(3)[..., None], "r:1", lam=0.1),
        "Report": sphere.report,
        "Stiefel": ss.Stiefel(2, 3),
    }
    return found | {f"space {space}": space for space in SPACES}


def methods(thing):
    """Names of the public methods of an object."""
    kind = type(thing)
    names = [name for name in dir(thing) if not name.startswith("_") and name not in LEFT_OUT]
    names += [name for name in ("__call__", "__getitem__") if any(name in vars(base) for base in kind.__mro__)]
    return [name for name in names if callable(inspect.getattr_static(kind, name, None))]


def functions():
    """Public functions and classes by their full names."""
    found = {}
    for name in MODULES:
        try:
            module = importlib.import_module(name)
        except ImportError:
            assert name in NEEDS
            continue
        public = getattr(module, "__all__", None) or [
            key
            for key, value in vars(module).items()
            if not key.startswith("_") and getattr(value, "__module__", None) == name
        ]
        for key in public:
            value = getattr(module, key)
            error = isinstance(value, type) and issubclass(value, (Warning, Exception))
            if callable(value) and key not in LEFT_OUT and not error:
                found.setdefault(f"{name.removeprefix('symspline.')}.{key}" if name != "symspline" else key, value)
    return found


def table():
    """A table of pandas, if that is installed."""
    try:
        import pandas as pd
    except ImportError:
        return None
    return pd.DataFrame({"time": pd.to_datetime(DAYS), "lon": [1.0, 2, 3], "lat": [4.0, 5, 6], "name": ["a"] * 3})


def labelled():
    """An array of xarray, if that is installed."""
    try:
        import xarray as xr
    except ImportError:
        return None
    return xr.DataArray(P, dims=("time", "q"), coords={"time": T})


def fits_of_xarray():
    if labelled() is None:
        return None
    import symspline.xarray

    return symspline.xarray.fit(labelled(), "sphere:2")


class Odd:
    """An object that nothing knows."""


def pools(things):
    """Good values by the names of parameters, and values that may be anything."""
    curves = [value for key, value in things.items() if "Spline" in key]
    good = {
        "t": [T, DAYS, None, [0, 1, 3]],
        "x": [0.5, [0.5, 1.0], T, DAYS, DAYS[1], np.zeros((2, 2))],
        "points": [P, QUBIT, TURNS, SPD, [P, P]],
        "space": [*SPACES, "sphere:2", "so:3"],
        "spline": curves,
        "curves": [[(T, P), (None, P)], {"a": curves[0]}],
        "nu": [0, 1, 2],
        "bc_type": [
            *("natural", "not-a-knot", "periodic", "clamped", ((1, [0, 1, 0]), "natural")),
            ([(1, [0, 1, 0]), (2, [0, 0, 0])], "natural"),
        ],
        "p": [P[0], QUBIT[0], TURNS[0], POSES[0], SPD[0]],
        "q": [P[1], QUBIT[1], TURNS[1], POSES[1], SPD[1]],
        "v": [np.zeros(3), [0, 1.0, 0], np.zeros((3, 3))],
        "rng": [np.random.default_rng(0), 0],
        "shape": [(), 2, (2, 3)],
        "file": ["a.npz", io.BytesIO(), "missing/a", io.StringIO("0 0 0 0 0 0 0 1")],
        "name": ["sphere:2"],
        "method": ["auto", "newton"],
        "extrapolate": [None, True, "geodesic"],
        "on_failure": ["ignore", "warn"],
        "per_curve": [False, True],
        "max_gap": [1.5, np.timedelta64(1, "D")],
        "duplicates": ["mean", "raise"],
        "frame": [table(), "body", "world"],
        "da": [labelled()],
        "ds": [fits_of_xarray()],
        "dim": ["time"],
        "point_dims": [["q"]],
        "lon": [1.0, [1.0, 2.0]],
        "lat": [1.0, [1.0, 2.0]],
        "rotations": [TURNS],
        "poses": [POSES, (TURNS, P)],
        "positions": [P],
        "rates": [P],
        "scalar_first": [True, False],
        "quaternions": [[1.0, 0, 0, 0]],
        "knots": [[0, 0, 0, 1, 1, 1], 4],
        "measurements": MEASURED,
        "omega": [P],
        "y": [P, TURNS],
        "sigma": [0.1, None],
        "level": [0.9],
        "skipna": [True, False],
        "control_points": [P],
        "degree": [2],
        "landmarks": [[SQUARE, 2 * SQUARE]],
        "tensors": [SPD],
        "order": ["dipy", "fsl"],
        "edges": [T],
        "operators": [np.eye(2)[None]],
        "lam": [0.1, None],
        "criterion": ["gcv", "reml"],
        "weights": [None, [1, 1, 1]],
        "seed": [0],
        "dims": [(2,)],
        "n": [2, 3],
        "k": [1],
        "velocities": [np.zeros((3, 3)), {1: np.zeros(3)}],
        "twists": [np.zeros(6), np.zeros((3, 6))],
        "u": [np.zeros((3, 3))],
        "cotangent": [np.zeros(3)],
        "every": ["1h"],
        "columns": [("lon", "lat")],
        "by": ["name", None],
        "time": ["time", None],
        "progress": [None],
        "dtype": ["float32"],
        "gap": [np.timedelta64(3, "h")],
        "index": [0, slice(1)],
        "function": [lambda x: x],
    }
    bad = [
        None, True, 0, 1, -1, 7, 10**30, 0.5, -2.5, np.nan, np.inf, 1j, "", "natural", "x", "sphere:2",
        "\x1b[31mred\x00\n", "9" * 12_000, b"bytes", (), [], {}, set(), [1, 2], (5, 2), [[1, 0], [0]], ["a", None],
        [None], {"a": 1}, Odd(), object, len, range(3), slice(2), np.zeros(0), np.zeros((0, 3)), np.zeros((3, 0)),
        np.array(5.0), np.array([1, 0, 2]), np.ones(3), P, np.ones((2, 3, 4)), np.full((3, 3), np.nan),
        np.array(["a", "b"]), np.array([None, Odd()], object), np.ma.masked_invalid([1, np.nan]),
        np.array([True, False]), np.float32(2), np.int8(1), np.zeros(3, "V4"), np.zeros(2, [("a", float)]), DAYS,
        np.array(["NaT"], "M8[s]"), np.timedelta64(5, "s"), datetime.datetime(2024, 1, 1), datetime.timedelta(1),
        [datetime.date(2024, 1, 1), "x"], io.BytesIO(b"not a curve"), io.StringIO("1 2 3"), np.arange(3000.0),
        ss.Sphere(2), np.random.default_rng(0), (P, P), [(T, P)], [(1, 2, 3)], lambda: 1,
    ]  # fmt: skip
    return good, bad
