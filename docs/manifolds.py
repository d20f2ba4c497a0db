"""What holds on manifolds that are not symmetric spaces: the tables of ``manifolds.md``.

python docs/manifolds.py [--write]

A minute or two.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from comparisons.page import insert, parser, table, versions
from manifolds_surface import surface
from numpy.typing import NDArray
from pymanopt.manifolds import Oblique

import symspline as ss

Array = NDArray[np.float64]

PAGE = Path(__file__).parent / "manifolds.md"
PARTS = ("surface", "condition", "spaces", "sphere")
STEPS = (1.2, 0.8, 0.4, 0.2, 0.1)
POINTS = 10
S2 = ss.Sphere(2)


# ---- manifolds ----


def ellipsoid(axes: Sequence[float] = (1.0, 1.2, 0.8)) -> ss.Manifold:
    squares = np.square(axes)
    return surface(
        lambda x: np.sum(x * x / squares, axis=1) - 1,
        lambda x: 2 * x / squares,
        lambda x: np.broadcast_to(np.diag(2 / squares), (len(x), 3, 3)),
        3,
    )


def torus(big: float = 2.0, small: float = 0.8) -> ss.Manifold:
    def around(x: Array) -> Array:
        """The nearest points of the circle in the middle."""
        return big * x * [1, 1, 0] / np.hypot(x[:, 0], x[:, 1])[:, None]

    def hessian(x: Array) -> Array:
        circle = around(x) / big
        tangents = np.diag([1.0, 1.0, 0.0]) - circle[:, :, None] * circle[:, None, :]
        return 2 * (np.eye(3) - big * tangents / np.hypot(x[:, 0], x[:, 1])[:, None, None])

    return surface(
        lambda x: np.sum((x - around(x)) ** 2, axis=1) - small**2,
        lambda x: 2 * (x - around(x)),
        hessian,
        3,
    )


def with_dlog(space: ss.Space, dlog: Callable[..., Array] | None) -> ss.Manifold:
    """A manifold with the functions of a space, and something in place of the derivative of the logarithm."""
    return ss.Manifold(
        exp=space.exp,
        log=space.log,
        project_tangent=space.project_tangent,
        inner=space.inner,
        project=space.project,
        dlog=dlog,
        injectivity_radius=space.injectivity_radius,
        point_shape=space.point_shape,
    )


def equation_13(space: ss.Stiefel) -> ss.Manifold:
    """With E_p(−v) in place of D log_p, the condition of equal accelerations is (13) of the paper."""
    n = space.point_shape[0]
    rotations = ss.SpecialOrthogonal(n)

    def pulled_back(p: Array, q: Array, w: Array) -> Array:
        v = space.log(p, q)
        half = v - p @ (_transposed(p) @ v) / 2
        generator = half @ _transposed(p) - p @ _transposed(half)
        turned: Array = rotations.exp(np.eye(n), -generator) @ w
        return turned

    return with_dlog(space, pulled_back)


def transported(p: Array, q: Array, w: Array) -> Array:
    """E_p(−v) on the sphere, which carries tangent vectors in parallel."""
    moved: Array = S2.transport(q, p, w)
    return moved


def _transposed(x: Array) -> Array:
    return np.swapaxes(x, -1, -2)


# ---- data ----


def walk(space: ss.Space, step: float, n: int = POINTS, seed: int = 1) -> Array:
    """Points with equal steps, each in a direction that turns by about half a radian."""
    rng = np.random.default_rng(seed)
    p = [space.random_point(rng)]

    def unit(at: Array) -> Array:
        v = space.random_tangent(rng, at)
        return np.asarray(v / space.norm(at, v))

    direction = unit(p[0])
    for _ in range(n - 1):
        q = space.exp(p[-1], step * direction)
        direction = -space.log(q, p[-1]) / step + 0.5 * unit(q)
        direction = direction / space.norm(q, direction)
        p.append(q)
    return np.array(p)


def knots(equal: bool, n: int = POINTS) -> Array:
    gaps = np.ones(n - 1) if equal else np.random.default_rng(2).uniform(0.5, 1.5, n - 1)
    return np.concatenate([[0.0], np.cumsum(gaps)])


# ---- what is measured ----


def acceleration(spline: ss.CubicSpline) -> tuple[float, float]:
    """The largest jump of the acceleration at a knot, each segment evaluated by itself; and the largest
    acceleration at a knot."""
    h = np.diff(spline.t)
    ends = np.stack([0 * h, h], axis=1)
    p, u = (np.stack([x[:-1], x[1:]], axis=1) for x in (spline.points, spline.velocities))
    values = ss.evaluate(ends, p, u, spline.space, ends, nu=2, per_curve=True)
    left, right = values[:-1, 1], values[1:, 0]
    at = spline.points[1:-1]
    largest = max(spline.space.norm(at, side).max() for side in (left, right))
    return float(spline.space.norm(at, left - right).max()), float(largest)


def order(space: ss.Space, counts: tuple[int, int] = (20, 40)) -> float:
    """By what power of the spacing the error of curves with not-a-knot ends falls, on unequal knots."""
    rng = np.random.default_rng(3)
    base = walk(space, 0.1, 1)[0]
    axes = [0.5 * v / space.norm(base, v) for v in (space.random_tangent(rng, base) for _ in range(2))]

    def curve(t: Array) -> Array:
        waves = t + 0.3 * np.sin(3 * t), np.cos(2 * t)
        return space.exp(base, sum(np.multiply.outer(w, a) for w, a in zip(waves, axes, strict=True)))

    errors = []
    for n in counts:
        s = np.linspace(0, 1, n + 1)
        t = s + 0.2 * s * (1 - s)
        x = (t[:-1, None] + np.diff(t)[:, None] * [0.2, 0.5, 0.8]).ravel()
        spline = ss.CubicSpline(t, curve(t), space, bc_type="not-a-knot")
        errors.append(np.abs(spline(x) - curve(x)).max())
    return float(np.log2(errors[0] / errors[1]) / np.log2(counts[1] / counts[0]))


def seconds(work: Callable[[], Any], repeats: int = 3) -> float:
    """The median of the processor time."""
    work()
    times = []
    for _ in range(repeats):
        begin = time.process_time()
        work()
        times.append(time.process_time() - begin)
    return float(np.median(times))


# ---- tables ----


def condition_table(steps: Sequence[float] = STEPS) -> str:
    """Jumps of acceleration with D log, and with what is not D log."""
    stiefel = ss.Stiefel(2, 5)
    cases = [
        ("St(2, 5), D log", stiefel, stiefel),
        ("St(2, 5), (13)", stiefel, equation_13(stiefel)),
        ("S², D log", S2, with_dlog(S2, None)),
        ("S², (13)", S2, with_dlog(S2, transported)),
    ]
    rows = []
    for name, space, solved in cases:
        for step in steps:
            spline = ss.CubicSpline(knots(True), walk(space, step), solved)
            jump, size = acceleration(spline)
            found = f"{jump:.1e}", f"{size:.2g}", f"{jump / size:.1e}", spline.report.iterations
            rows.append([name, f"{step:g}", *found])
    return table(["condition", "step", "jump", "acceleration", "jump / acceleration", "iterations"], rows)


def spaces_table(step: float = 0.5, repeats: int = 3) -> str:
    """Jumps, order and time on manifolds that are not symmetric, and on one of pymanopt."""
    spaces = {
        "St(2, 5)": ss.Stiefel(2, 5),
        "St(2, 5), differences": with_dlog(ss.Stiefel(2, 5), None),
        "St(3, 4)": ss.Stiefel(3, 4),
        "St(3, 6)": ss.Stiefel(3, 6),
        "ellipsoid 1, 1.2, 0.8": ellipsoid(),
        "torus 2, 0.8": torus(),
        "pymanopt, Oblique(3, 3)": ss.manifolds.from_pymanopt(Oblique(3, 3)),
    }
    rows = []
    for name, space in spaces.items():
        matrices = name.startswith("pymanopt")
        p = _oblique(step) if matrices else walk(space, step)
        splines = [ss.CubicSpline(knots(equal), p, space) for equal in (True, False)]
        jumps = [jump / size for jump, size in map(acceleration, splines)]
        iterations = ", ".join(str(spline.report.iterations) for spline in splines)
        fit = 1e3 * seconds(lambda p=p, space=space: ss.CubicSpline(knots(True), p, space), repeats)
        x = np.linspace(0, POINTS - 1, 50)
        cells = [
            1e3 * seconds(lambda s=splines[0], nu=nu, x=x: s(x, nu=nu), repeats) / len(x) for nu in (0, 2)
        ]
        rows.append(
            [
                name,
                *(f"{j:.1e}" for j in jumps),
                iterations,
                None if matrices else f"{order(space):.1f}",
                f"{fit:.0f}",
                *(f"{c:.2g}" for c in cells),
            ]
        )
    head = [
        "space",
        "jump, equal",
        "unequal",
        "iterations",
        "order",
        "fit, ms",
        "sample, ms",
        "acceleration, ms",
    ]
    return table(head, rows)


def _oblique(step: float) -> Array:
    """Matrices whose columns walk on the sphere."""
    return np.stack([walk(S2, step, seed=seed) for seed in (1, 2, 3)], axis=-1)


def sphere_table(steps: Sequence[float] = STEPS) -> str:
    """The sphere as a manifold that is made of functions, beside the compiled core."""
    rows = []
    for step in steps:
        p, t = walk(S2, step), knots(False)
        x = np.linspace(t[0], t[-1], 400)
        core, ours = (ss.CubicSpline(t, p, space) for space in (S2, with_dlog(S2, None)))
        off = [np.abs(core(x, nu) - ours(x, nu)).max() / np.abs(core(x, nu)).max() for nu in (0, 1, 2)]
        rows.append(
            [f"{step:g}", *(f"{value:.1e}" for value in off), core.report.iterations, ours.report.iterations]
        )
    return table(
        ["step", "points", "velocity", "acceleration", "iterations, core", "iterations, functions"], rows
    )


def main() -> None:
    write = parser(__doc__).parse_args().write
    code = Path(__file__).with_name("manifolds_surface.py").read_text("utf-8")
    parts = {
        "surface": f"```python\n{code}```",
        "condition": condition_table(),
        "spaces": f"{spaces_table()}\n\n{versions('symspline', 'pymanopt', 'numpy')}",
        "sphere": sphere_table(),
    }
    print("\n\n".join(parts.values()))
    if write:
        for part, text in parts.items():
            insert(part, text, PAGE)


if __name__ == "__main__":
    main()
