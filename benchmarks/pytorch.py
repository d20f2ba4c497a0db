"""Curves of rotations and poses in PyTorch: `symspline.torch` beside the B-spline of pypose and the slerp of roma.

python -m benchmarks.pytorch

This needs PyTorch, and takes pypose and roma where they are installed. The libraries compute different curves: pypose a
cumulative B-spline, which does not pass through its control points, and roma geodesics between neighbours.
"""

from __future__ import annotations

import statistics
from collections.abc import Callable
from importlib.util import find_spec
from time import perf_counter
from typing import Any

import symspline as ss

from .tables import table
from .walks import walks

CURVES, KNOTS, TIMES = 20, 20, 5
RUNS = 5


def contestants(curves: int, knots: int, times: int) -> dict[str, tuple[Callable[[Any], Any], Any]]:
    """Return functions of rotations, with their input, by what they compute at the same number of times per segment."""
    import torch

    from symspline.torch import curve, evaluate, fit

    t = torch.arange(float(knots), dtype=torch.float64)
    s = torch.arange(times, dtype=t.dtype) / times
    x = (t[:-1, None] + s).reshape(-1)
    found: dict[str, tuple[Callable[[Any], Any], Any]] = {}
    points = {name: torch.tensor(walks(ss.space(name), curves, knots)) for name in ("so:3", "se:3")}
    for name, own in points.items():
        u = fit(t, own, name)
        found |= {
            f"{name}: symspline.torch.curve": (lambda p, name=name: curve(x, t, p, name), own),
            f"{name}: symspline.torch.fit and evaluate": (
                lambda p, name=name: evaluate(t, p, fit(t, p, name), name, x),
                own,
            ),
            f"{name}: symspline.torch.evaluate": (lambda p, name=name, u=u: evaluate(t, p, u, name, x), own),
        }
    if find_spec("roma"):
        import roma

        quaternions = roma.rotmat_to_unitquat(points["so:3"])
        found["so:3: roma.unitquat_slerp, segment by segment"] = (
            lambda q: roma.unitquat_slerp(q[:, :-1], q[:, 1:], s),
            quaternions,
        )
    if find_spec("pypose"):
        import pypose

        poses = pypose.mat2SE3(points["se:3"]).tensor()
        # With further control points before the first segment and after the last.
        found["se:3: pypose.bspline"] = (
            lambda q: pypose.bspline(pypose.SE3(q), 1 / times, extrapolate=True).tensor(),
            poses,
        )
    return found


def text(curves: int = CURVES, knots: int = KNOTS, times: int = TIMES, runs: int = RUNS) -> str:
    """Return medians of values, and of values with the gradient of their sum of squares, after one call of each."""
    import torch

    before = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        lines = []
        for name, (function, data) in contestants(curves, knots, times).items():

            def gradient(function: Callable[[Any], Any] = function, data: Any = data) -> Any:
                free = data.clone().requires_grad_()
                return torch.autograd.grad((function(free) ** 3).sum(), free)

            def value(function: Callable[[Any], Any] = function, data: Any = data) -> Any:
                with torch.no_grad():
                    return function(data)

            lines.append([name, *(f"{1e3 * _median(work, runs):.3g}" for work in (value, gradient))])
        heading = f"ms, {curves} curves of {knots} knots, {times} times per segment, one core"
        return table((heading, "values", "values and gradient"), lines)
    finally:
        torch.set_num_threads(before)


def _median(work: Callable[[], Any], runs: int) -> float:
    work()
    seconds = []
    for _ in range(runs):
        start = perf_counter()
        work()
        seconds.append(perf_counter() - start)
    return statistics.median(seconds)


if __name__ == "__main__":
    print(text())
