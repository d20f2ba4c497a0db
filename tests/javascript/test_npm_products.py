"""Products of spaces in the npm package: the curves of their factors, and those of the Python package."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import symspline as ss
from javascript.npm_tools import PACKAGE, require, run_cases
from javascript.test_npm_package import SQUARE, T, X, close, flat, walk

require(PACKAGE / "symspline_bg.wasm")

NAMES = ("so:3 x r:3", "sphere:2 x spd:2 x h:2", "r:1 x r:1", "se:3 x so:3")
Parts = tuple[np.ndarray, ...]


def points_on(name: str, n: int, seed: int) -> Parts:
    """Return points of a random walk in each factor."""
    return tuple(walk(ss.space(factor), n, seed + i) for i, factor in enumerate(name.split(" x ")))


def listed(parts: Any) -> list[Any]:
    return [np.asarray(part).tolist() for part in parts]


def ends_on(name: str, points: Parts) -> list[tuple[Any, Any]]:
    """Return pairs of end conditions for Python and for JavaScript."""
    space = ss.space(name)
    first, second, last = (tuple(part[i] for part in points) for i in (0, 1, -1))
    v, a = space.log(first, second), space.log(last, tuple(part[-2] for part in points))
    return [
        ("natural", "natural"),
        ("not-a-knot", "not-a-knot"),
        ("clamped", "clamped"),
        (((1, v), "not-a-knot"), [[1, listed(v)], "not-a-knot"]),
        (("clamped", (2, a)), ["clamped", [2, listed(a)]]),
    ]


def test_splines_equal_those_of_python_and_of_the_factors(tmp_path: Path) -> None:
    cases: list[dict[str, Any]] = []
    curves: list[Any] = []
    for seed, name in enumerate(NAMES):
        points = points_on(name, len(T), 10 * seed)
        shared = {"kind": "spline", "t": T.tolist(), "x": X.tolist()}
        closed = tuple(np.concatenate([part[:-1], part[:1]]) for part in points)
        for own, python, javascript in [
            *((points, *ends) for ends in ends_on(name, points)),
            (closed, "periodic", "periodic"),
        ]:
            curves.append(ss.CubicSpline(T, own, name, bc_type=python))
            options = {"bcType": javascript}
            cases.append(shared | {"space": name, "points": listed(own), "options": options})
            for i, factor in enumerate(name.split(" x ")):
                ends = [end if isinstance(end, str) else [end[0], end[1][i]] for end in javascript]
                in_factor = {"bcType": javascript if isinstance(javascript, str) else ends}
                cases.append(shared | {"space": factor, "points": own[i].tolist(), "options": in_factor})
    results = iter(run_cases(cases, tmp_path))
    for spline in curves:
        product = next(results)
        assert "error" not in product, product
        factors = [next(results) for _ in spline.space.factors]
        for i, factor in enumerate(factors):
            assert [values[i] for values in product["values"]] == factor["values"]
            for name in ("into", "one", "points", "velocities", "controlPoints"):
                assert product[name][i] == factor[name]
        for nu, values in enumerate(product["values"]):
            for found, wanted in zip(values, spline(X, nu=nu), strict=True):
                close(found, flat(wanted), (1e-12, 1e-12, 1e-11)[nu])
        reports = [factor["report"] for factor in factors]
        assert product["report"]["residual"] == max(report["residual"] for report in reports)
        assert product["report"]["iterations"] == max(report["iterations"] for report in reports)
        close(product["report"]["maxStep"], spline.report.max_step)


def test_smoothing_splines_equal_those_of_python(tmp_path: Path) -> None:
    rng = np.random.default_rng(5)
    t = np.sort(rng.uniform(0, 10, 60))
    x, name = np.linspace(t[0], t[-1], 37), "so:3 x r:3"
    space = ss.space(name)
    truth: Any = ss.CubicSpline(np.linspace(t[0], t[-1], 5), points_on(name, 5, 3), space)
    turns, shifts = truth(t)
    noise = np.stack([space.factors[0].random_tangent(rng, p) for p in turns])
    points = (space.factors[0].exp(turns, 0.05 * noise), shifts + rng.normal(0, 0.3, shifts.shape))
    weights = rng.uniform(0.5, 2, len(t))
    shared = {"kind": "smooth", "t": t.tolist(), "points": listed(points), "space": name, "x": x.tolist()}
    options: list[tuple[dict[str, Any], dict[str, Any]]] = [
        ({}, {}),
        ({"lam": 0.3}, {"lam": 0.3}),
        ({"lam": (0.3, 2.0), "weights": weights}, {"lam": [0.3, 2.0], "weights": weights.tolist()}),
        ({"lam": (None, 2.0)}, {"lam": [None, 2.0]}),
        ({"loss": "huber", "sigma": (0.05, 0.3)}, {"loss": "huber", "sigma": [0.05, 0.3]}),
    ]
    results = run_cases([shared | {"options": javascript} for _, javascript in options], tmp_path)
    for (python, _), found in zip(options, results, strict=True):
        assert "error" not in found, found
        smooth: Any = ss.make_smoothing_spline(t, points, name, **python)
        close(found["lam"], smooth.lam, 1e-9)
        close(found["df"], smooth.df, 1e-9)
        close(found["sigma"], smooth.sigma, 1e-9)
        for i, values in enumerate(smooth(x)):
            close(found["values"][i], flat(values), 1e-10)
            close(found["std"][i], smooth.std(x)[i], 1e-9)
            close(found["band"][i], smooth.band(x, 0.9)[i], 1e-9)
            assert found["one"][i] == found["std"][i][1]


def test_operations_equal_those_of_python(tmp_path: Path) -> None:
    cases, t = [], [0.0, 0.3, 1.0, 1.2]
    rng = np.random.default_rng(1)
    for seed, name in enumerate(NAMES):
        space: Any = ss.space(name)
        points = points_on(name, 2, 30 + 10 * seed)
        p, q = (tuple(part[i] for part in points) for i in (0, 1))
        v = tuple(0.3 * part for part in space.random_tangent(rng, p))
        cases.append({"kind": "space", "space": name, "p": listed(p), "q": listed(q), "v": listed(v), "t": t})
    for entry, found in zip(cases, run_cases(cases, tmp_path), strict=True):
        assert "error" not in found, found
        space = ss.space(entry["space"])
        p, q, v = (tuple(map(np.asarray, entry[name])) for name in "pqv")
        for i, factor in enumerate(space.factors):
            close(found["exp"][i], np.ravel(space.exp(p, v)[i]))
            close(found["log"][i], np.ravel(space.log(p, q)[i]))
            close(found["project"][i], np.ravel(p[i]))
            close(found["geodesic"][i], flat(factor.geodesic(p[i], q[i], np.asarray(t))))
            close(found["middle"][i], np.ravel(factor.geodesic(p[i], q[i], 0.5)))
        lengths = [found["distance"], found["inner"], found["norm"]]
        close(lengths, [space.distance(p, q), space.inner(p, v, v), space.norm(p, v)])
        assert (found["dim"], found["factors"]) == (space.dim, entry["space"].split(" x "))
        assert tuple(map(tuple, found["shape"])) == space.point_shape
        assert float(found["radius"].replace("Infinity", "inf")) == pytest.approx(space.injectivity_radius, rel=1e-15)


FLAT = [[0, 0], [1, 2], [2, 1]]


@pytest.mark.parametrize(
    ("change", "error", "argument", "index", "factor"),
    [
        ({"points": SQUARE}, "ValidationError", "points", None, None),
        ({"points": [SQUARE, FLAT, FLAT]}, "ValidationError", "points", None, None),
        ({"points": [SQUARE, FLAT[:2]]}, "ValidationError", "points", None, None),
        ({"points": [SQUARE, [[0], [1], [2]]]}, "ValidationError", "points", 0, 1),
        ({"points": [SQUARE, [[0, 0], [1, "NaN"], [2, 1]]]}, "ValidationError", "points", 1, 1),
        ({"points": [SQUARE, [[0, 0], [1, "x"], [2, 1]]]}, "ValidationError", "points", 1, 1),
        ({"points": [[[1, 0, 0], [0, 2, 0], [0, 0, 1]], FLAT]}, "ValidationError", "points", 1, 0),
        ({"points": [[[1, 0, 0], [-1, 0, 0], [0, 0, 1]], FLAT]}, "CutLocusError", "points", 0, 0),
        ({"t": [0, 1, 1]}, "ValidationError", "t", 2, None),
        ({"t": [0, 1]}, "ValidationError", "t", None, None),
        ({"space": "sphere:2 x r:2 x"}, "ValidationError", "space", None, None),
        ({"space": "sphere:2 x xx:2"}, "ValidationError", "space", None, None),
        ({"space": "sphere:2 r:2"}, "ValidationError", "space", None, None),
        ({"options": {"bcType": "periodic"}}, "ValidationError", "points", None, 0),
        ({"options": {"bcType": ["natural", [1, [0, 0]]]}}, "ValidationError", "bcType", 1, 0),
        ({"options": {"bcType": ["natural", [1, [[0, 0, 0]]]]}}, "ValidationError", "bcType", None, None),
        ({"options": {"bcType": [[1, [[1, 0, 0], [0, 0]]], "natural"]}}, "ValidationError", "bcType", None, 0),
        ({"kind": "smooth", "options": {"lam": [1, 2, 3]}}, "ValidationError", "lam", None, None),
        ({"kind": "smooth", "options": {"sigma": [1, -1]}}, "ValidationError", "sigma", None, None),
        ({"kind": "smooth", "t": [0, 0, 0]}, "ConvergenceError", None, None, None),
    ],
)
def test_invalid_input_raises(tmp_path: Path, change: Any, error: str, argument: Any, index: Any, factor: Any) -> None:
    case = {"kind": "spline", "t": [0, 1, 2], "points": [SQUARE, FLAT], "space": "sphere:2 x r:2", "x": [0.5, 1]}
    (found,) = run_cases([case | change], tmp_path)
    seen = tuple(found.get(name) for name in ("error", "argument", "index", "factor"))
    assert seen == (error, argument, index, factor), found
    assert len(found["message"]) > 20 and "undefined" not in found["message"]
    assert found["message"].startswith(f"factor {factor}, ") == (factor is not None)
