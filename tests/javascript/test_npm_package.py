"""The npm package against the Python package: the same numbers, and errors with the same meaning."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import symspline as ss
from javascript.npm_tools import NODE, PACKAGE, ROOT, TOOLS, node, require, run_cases

require(PACKAGE / "symspline_bg.wasm")

SPACES = ("sphere:2", "sphere:3", "h:2", "h:5", "so:3", "se:3", "spd:2", "spd:4", "r:3")
T = np.array([0.0, 0.7, 1.0, 2.4, 2.9, 4.0, 5.3])
X = np.sort(np.concatenate([T, np.linspace(0, 5.3, 40)]))


def walk(space: ss.Space[Any], n: int, seed: int, step: float = 0.6) -> np.ndarray:
    """Return points of a random walk, like those of a recorded motion."""
    rng = np.random.default_rng(seed)
    points = [np.asarray(space.random_point(rng))]
    for _ in range(n - 1):
        v = np.asarray(space.random_tangent(rng, points[-1]))
        norm = np.sqrt(max(np.vdot(v, v).real, 1e-12))
        points.append(np.asarray(space.exp(points[-1], step * v / norm)))
    return np.asarray(points)


def flat(x: Any) -> np.ndarray:
    x = np.asarray(x)
    return x.reshape(len(x), -1)


def close(found: Any, wanted: Any, tol: float = 1e-12) -> None:
    """Compare relative to the largest number."""
    found, wanted = np.asarray(found, float).reshape(np.shape(wanted)), np.asarray(wanted, float)
    assert np.abs(found - wanted).max() <= tol * max(1.0, np.abs(wanted).max())


def end_conditions(space: ss.Space[Any], points: np.ndarray) -> list[tuple[Any, Any]]:
    """Return pairs of end conditions for Python and for JavaScript."""
    v = np.asarray(space.log(points[0], points[1])) * 0.5
    a = np.asarray(space.log(points[-1], points[-2])) * 0.3
    return [
        ("natural", "natural"),
        ("not-a-knot", "not-a-knot"),
        ("clamped", "clamped"),
        (((1, v), "not-a-knot"), [[1, v.tolist()], "not-a-knot"]),
        (("clamped", (2, a)), ["clamped", [2, a.tolist()]]),
    ]


@pytest.fixture(scope="module")
def splines(tmp_path_factory: pytest.TempPathFactory) -> list[tuple[Any, dict[str, Any]]]:
    """Curves of Python, and the same of JavaScript."""
    curves, cases = [], []
    for seed, name in enumerate(SPACES):
        space = ss.space(name)
        points = walk(space, len(T), seed)
        shared = {"kind": "spline", "t": T.tolist(), "points": points.tolist(), "space": name, "x": X.tolist()}
        for python, javascript in end_conditions(space, points):
            curves.append(ss.CubicSpline(T, points, space, bc_type=python))
            cases.append(shared | {"options": {"bcType": javascript}})
        closed = np.concatenate([points[:-1], points[:1]])
        curves.append(ss.CubicSpline(T, closed, space, bc_type="periodic"))
        cases.append(shared | {"points": closed.tolist(), "options": {"bcType": "periodic"}})
    return list(zip(curves, run_cases(cases, tmp_path_factory.mktemp("splines")), strict=True))


def test_splines_equal_those_of_python(splines: list[tuple[Any, dict[str, Any]]]) -> None:
    for spline, found in splines:
        assert "error" not in found, found
        for nu, values in enumerate(found["values"]):
            # An acceleration is a difference of distances divided by the square of a short interval.
            close(values, flat(spline(X, nu=nu)), (1e-12, 1e-12, 1e-11)[nu])
        close(found["velocities"], flat(spline.velocities))
        close(found["controlPoints"], np.asarray(spline.control_points))
        assert found["into"] == [x for row in found["values"][1] for x in row]
        assert found["report"]["residual"] < 1e-12
        close(found["report"]["maxStep"], spline.report.max_step)


def test_smoothing_splines_equal_those_of_python(tmp_path: Path) -> None:
    rng = np.random.default_rng(7)
    t = np.sort(rng.uniform(0, 10, 60))
    x, knots = np.linspace(t[0], t[-1], 37), np.linspace(t[0], t[-1], 9)
    cases, wanted = [], []
    for name in ("sphere:2", "so:3", "spd:2", "h:2", "r:3"):
        space = ss.space(name)
        truth = ss.CubicSpline(np.linspace(t[0], t[-1], 5), walk(space, 5, 3, 0.9), space)(t)
        noise = np.asarray([space.random_tangent(rng, p) for p in truth])
        points = np.asarray(space.exp(truth, 0.05 * noise))
        shared = {"kind": "smooth", "t": t.tolist(), "points": points.tolist(), "space": name, "x": x.tolist()}
        weights = rng.uniform(0.5, 2, len(t))
        for python, javascript in [
            ({"lam": 0.3}, {"lam": 0.3}),
            ({}, {}),
            ({"gamma": 1, "weights": weights}, {"gamma": 1, "weights": weights.tolist()}),
            ({"loss": "huber", "sigma": 0.05}, {"loss": "huber", "sigma": 0.05}),
            ({"lam": 0.01, "knots": knots}, {"lam": 0.01, "knots": knots.tolist()}),
        ]:
            wanted.append(ss.make_smoothing_spline(t, points, name, **python))
            cases.append(shared | {"options": javascript})
    for smooth, found in zip(wanted, run_cases(cases, tmp_path), strict=True):
        assert "error" not in found, found
        # Iterations end at a step of 1e-3 standard errors, and magnify rounding errors a little.
        close(found["lam"], smooth.lam, 1e-9)
        close(found["df"], smooth.df, 1e-9)
        close(found["sigma"], smooth.sigma, 1e-9)
        close(found["values"], flat(smooth(x)), 1e-10)
        close(found["std"], smooth.std(x), 1e-9)
        close(found["band"], smooth.band(x, 0.9), 1e-9)


def test_operations_of_spaces_equal_those_of_python(tmp_path: Path) -> None:
    cases, t = [], [0.0, 0.3, 1.0, 1.2]
    for seed, name in enumerate(SPACES):
        space = ss.space(name)
        p, q = walk(space, 2, seed + 20)
        v = np.asarray(space.random_tangent(np.random.default_rng(seed), p))
        own = {"p": p.tolist(), "q": q.tolist(), "v": (0.3 * v).tolist(), "t": t}
        cases.append({"kind": "space", "space": name} | own)
    for entry, found in zip(cases, run_cases(cases, tmp_path), strict=True):
        assert "error" not in found, found
        space: Any = ss.space(entry["space"])
        p, q, v = (np.asarray(entry[name]) for name in "pqv")
        close(found["exp"], np.ravel(space.exp(p, v)))
        close(found["log"], np.ravel(space.log(p, q)))
        close(found["geodesic"], flat(space.geodesic(p, q, np.asarray(t))))
        close(found["project"], np.ravel(space.project(p)))
        close([found["distance"], found["inner"]], [space.distance(p, q), space.inner(p, v, v)])
        assert (found["dim"], tuple(found["shape"])) == (space.dim, space.point_shape)
        assert float(found["radius"].replace("Infinity", "inf")) == pytest.approx(space.injectivity_radius, rel=1e-15)


def test_times_outside_the_knots(tmp_path: Path) -> None:
    policies = [True, "geodesic", "periodic"]
    cases = [{"kind": "evaluate", "x": [-0.5, 2.6], "nu": 0, "options": {"extrapolate": p}} for p in policies]
    for policy, found in zip(policies, run_cases(cases, tmp_path), strict=True):
        spline: Any = ss.CubicSpline(None, np.eye(3), "sphere:2", extrapolate=policy)
        close(found["values"], spline(np.array([-0.5, 2.6])))


SQUARE = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]


@pytest.mark.parametrize(
    ("change", "error", "argument", "index", "value", "limit"),
    [
        ({"t": [0, 1, 1]}, "ValidationError", "t", 2, 1, 1),
        ({"t": [0, "NaN", 2]}, "ValidationError", "t", 1, None, None),
        ({"t": [0, "one", 2]}, "ValidationError", "t", 1, None, None),
        ({"t": [0, 1]}, "ValidationError", "t", None, 2, 3),
        ({"points": [[1, 0, 0], [0, 1.2, 0], [0, 0, 1]]}, "ValidationError", "points", 1, 0.2, None),
        ({"points": [[1, 0, 0], [0, 1], [0, 0, 1]]}, "ValidationError", "points", 1, 2, 3),
        ({"points": [[1, 0, 0], [0, "1", 0], [0, 0, 1]]}, "ValidationError", "points", 1, None, None),
        ({"t": [0], "points": [[1, 0, 0]]}, "ValidationError", "points", None, 1, 2),
        ({"points": [[1, 0, 0], [-1, 0, 0], [0, 0, 1]]}, "CutLocusError", "points", 0, np.pi, np.pi),
        ({"space": "spere:2"}, "ValidationError", "space", None, None, None),
        ({"space": "sphere:x"}, "ValidationError", "space", None, None, None),
        ({"options": {"bcType": "free"}}, "ValidationError", "bcType", 0, None, None),
        ({"options": {"bcType": ["natural", [1, [1, 0]]]}}, "ValidationError", "bcType", 1, 2, 3),
        ({"options": {"bcType": [[1, [1, 0, 0]], "natural"]}}, "ValidationError", "bcType", None, None, None),
        ({"options": {"bctype": "natural"}}, "ValidationError", "bctype", None, None, None),
        ({"options": {"tol": -1}}, "ValidationError", "tol", None, -1, None),
        ({"kind": "smooth", "t": [0, 0, 0]}, "ConvergenceError", None, None, None, None),
        ({"options": {"method": "bogus"}}, "ValidationError", "method", None, None, None),
        ({"options": {"bcType": "periodic"}}, "ValidationError", "points", None, None, None),
        ({"kind": "smooth", "options": {"lam": -1}}, "ValidationError", "lam", None, -1, None),
        ({"kind": "smooth", "options": {"gamma": 0.5}}, "ValidationError", "gamma", None, 0.5, None),
        ({"kind": "smooth", "options": {"weights": [1, -1, 1]}}, "ValidationError", "weights", 1, -1, None),
        ({"kind": "smooth", "options": {"loss": "l1"}}, "ValidationError", "loss", None, None, None),
        ({"kind": "evaluate", "x": [5], "nu": 0}, "ValidationError", "x", None, 5, 2),
        ({"kind": "evaluate", "x": ["NaN"], "nu": 0}, "ValidationError", "x", None, None, None),
        ({"kind": "evaluate", "x": [1], "nu": 3}, "ValidationError", "nu", None, None, None),
    ],
)
def test_invalid_input_raises(
    tmp_path: Path, change: Any, error: str, argument: Any, index: Any, value: Any, limit: Any
) -> None:
    case = {"kind": "spline", "t": [0, 1, 2], "points": SQUARE, "space": "sphere:2", "x": [0.5]}
    (found,) = run_cases([case | change], tmp_path)
    assert (found.get("error"), found["argument"], found["index"]) == (error, argument, index), found
    if value is not None:
        assert found["value"] == pytest.approx(value)
    if limit is not None:
        assert found["limit"] == pytest.approx(limit)
    assert len(found["message"]) > 20 and "undefined" not in found["message"]


def test_types_fit_a_program(tmp_path: Path) -> None:
    if not (TOOLS / "typescript").exists():
        pytest.skip("TypeScript is not installed: run `make wasm`")
    compiler = [str(NODE), str(TOOLS / "typescript/bin/tsc"), "--noEmit", "--strict", "--target", "es2022"]
    modules = ["--module", "nodenext", "--moduleResolution", "nodenext", "--lib", "es2022,dom"]
    program = tmp_path / "program.mts"
    program.write_text(Path(__file__).with_name("program.mts").read_text())
    (tmp_path / "node_modules").mkdir()
    (tmp_path / "node_modules/symspline").symlink_to(PACKAGE)
    done = subprocess.run([*compiler, *modules, str(program)], capture_output=True, text=True, cwd=tmp_path)
    assert done.returncode == 0, done.stdout


def test_licences_are_in_the_package_and_paths_of_this_machine_are_not() -> None:
    crates = (PACKAGE / "THIRD-PARTY-LICENSES.txt").read_text("utf-8")
    assert "wasm-bindgen 0." in crates and "the Rust standard library" in crates
    assert "THIRD-PARTY-LICENSES.txt" in json.loads((PACKAGE / "package.json").read_text("utf-8"))["files"]
    module = (PACKAGE / "symspline_bg.wasm").read_bytes()
    assert str(Path.home()).encode() + b"/" not in module and b"/registry/src/" not in module


def test_example_of_the_readme_runs() -> None:
    text = (ROOT / "packaging/npm/README.md").read_text()
    blocks = [block.split("```")[0] for block in text.split("```js\n")[1:]]
    program = "\n".join(block if "import" in block else f"{{\n{block}\n}}" for block in blocks)
    program = program.replace('"symspline"', f'"{PACKAGE.as_posix()}/index.js"')
    done = subprocess.run([str(NODE), "--input-type=module"], input=program, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


def test_use_before_loading_raises() -> None:
    program = f"""
        import {{ CubicSpline, init, Space, SymsplineError }} from "{PACKAGE.as_posix()}/index.js";
        for (const use of [() => Space.names, () => new CubicSpline(null, [[1], [2]], "r:1")]) {{
          try {{ use(); process.exit(2); }}
          catch (error) {{
            if (!(error instanceof SymsplineError && error.message.includes("await init()"))) throw error;
          }}
        }}
        await Promise.all([init(), init()]);
        if (new CubicSpline(null, [[1], [2]], "r:1").evaluate(0.5)[0] !== 1.5) process.exit(3);
    """
    done = subprocess.run([str(NODE), "--input-type=module"], input=program, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


def test_types_name_what_the_module_exports() -> None:
    exported = set(node("exports.mjs", PACKAGE).split())
    declared = {
        line.split()[2].split("(")[0].split("<")[0]
        for line in (PACKAGE / "index.d.ts").read_text().splitlines()
        if line.startswith(("export class", "export function"))
    }
    assert exported == declared
