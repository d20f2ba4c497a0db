"""Fits and curves on a GPU: `symspline.jax` and `symspline.torch` beside the compiled core on all cores.

python -m benchmarks.accelerators

JAX computes on its default device, PyTorch with CUDA where there is a GPU. Libraries that are not installed are
omitted.
"""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Callable
from functools import partial
from importlib.util import find_spec
from time import perf_counter
from typing import Any, NamedTuple

import numpy as np

import symspline as ss

from .data import Array
from .machine import description
from .tables import table
from .timing import Effort, in_unit, measure, ready
from .walks import walks

SPACES = ("sphere:3", "so:3", "se:3", "spd:3")
CURVES, KNOTS, TIMES = 10_000, 20, 200
CORES = os.cpu_count() or 1
EFFORT = Effort(runs=5, shortest=0.02, longest=5.0)
PRECISIONS = {"double": np.float64, "single": np.float32}


class Library(NamedTuple):
    """Functions of points that return when the result is there.

    Attributes:
        device: where it computes.
        array: puts an array on the device.
        values: the curves at all times.
        gradient: that of the sum of the cubes of these values.
    """

    device: str
    array: Callable[[Array], Any]
    values: Callable[[Any], Any]
    gradient: Callable[[Any], Any]


def core(space: ss.Space, t: Array, x: Array) -> Library:
    def gradient(points: Array) -> Array:
        spline = ss.CubicSpline(t, points, space)
        return spline.vjp(x, 3 * spline(x) ** 2).points

    return Library("CPU", lambda a: a, lambda points: ss.CubicSpline(t, points, space)(x), gradient)


def in_jax(space: ss.Space, t: Array, x: Array) -> Library:
    import jax
    import jax.numpy as jnp

    from symspline.jax import evaluate, fit

    def values(points: Any) -> Any:
        return evaluate(t, points, fit(t, points, space)[0], space, x)

    def waiting(function: Any) -> Callable[[Any], Any]:
        compiled = jax.jit(function)
        return lambda points: jax.block_until_ready(compiled(points))

    device = jax.devices()[0].device_kind
    return Library(device, jnp.asarray, waiting(values), waiting(jax.grad(lambda p: jnp.sum(values(p) ** 3))))


def in_torch(space: ss.Space, t: Array, x: Array) -> Library:
    import torch

    from symspline.torch import evaluate, fit

    on_gpu = torch.cuda.is_available()
    device = torch.device("cuda" if on_gpu else "cpu")
    knots, times = torch.tensor(t, device=device), torch.tensor(x, device=device)

    def curves(points: Any) -> Any:
        return evaluate(knots, points, fit(knots, points, space), space, times)

    def finished(found: Any) -> Any:
        if on_gpu:
            torch.cuda.synchronize()
        return found

    def values(points: Any) -> Any:
        with torch.no_grad():
            return finished(curves(points))

    def gradient(points: Any) -> Any:
        free = points.clone().requires_grad_()
        return finished(torch.autograd.grad((curves(free) ** 3).sum(), free)[0])

    name = torch.cuda.get_device_name() if on_gpu else "CPU"
    return Library(name, lambda a: torch.tensor(a, device=device), values, gradient)


def text(curves: int = CURVES, effort: Effort = EFFORT) -> str:
    """Return a table of times of values and of gradients, and of how far values are from those of the core."""
    t, x = np.arange(float(KNOTS)), np.linspace(0, KNOTS - 1, TIMES)
    makers = {"core": core}
    if find_spec("jax"):
        import jax

        jax.config.update("jax_enable_x64", True)
        makers["JAX"] = in_jax
    if find_spec("torch"):
        makers["PyTorch"] = in_torch
    rows, devices = [], {}
    for name in SPACES:
        space = ss.space(name)
        points = walks(space, curves, KNOTS)
        exact = ss.CubicSpline(t, points, space)(x)
        for own, make in makers.items():
            library = make(space, t, x)
            devices[own] = library.device
            for precision, dtype in PRECISIONS.items():
                if own == "core" and precision == "single":
                    continue
                given = library.array(points.astype(dtype))
                rows.append([f"{name}, {precision}", own, *_measured(library, given, exact, effort)])
                print(*rows[-1], sep="\t", file=sys.stderr, flush=True)
    heading = f"{curves} curves of {KNOTS} knots, {TIMES} times"
    columns = ("values, ms", "gradient, ms", "first calls, s", "difference of values")
    return "\n\n".join(
        [
            "\n".join(f"{own}: {device}" for own, device in devices.items()),
            "\n".join(f"{key}: {value}" for key, value in _machine(makers).items()),
            table((heading, "library", *columns), rows),
        ]
    )


def _measured(library: Library, given: Any, exact: Array, effort: Effort) -> list[str]:
    """Return the times of values and of gradients, those of the first calls, and how far values are from the core's."""
    works = {"values": library.values, "gradient": library.gradient}
    first, difference = [], ""
    for which, work in works.items():
        start = perf_counter()
        try:
            found = work(given)
        except Exception as error:
            first.append(type(error).__name__)
            continue
        first.append(f"{perf_counter() - start:.1f}")
        if which == "values":
            difference = _difference(found, exact)
    results = measure({which: ready(partial(work, given), CORES) for which, work in works.items()}, effort)
    return [*(in_unit(results[which], 1e-3) for which in works), " and ".join(first), difference]


def _machine(makers: dict[str, Any]) -> dict[str, str]:
    packages = ["numpy", *(name for own, name in (("JAX", "jax"), ("PyTorch", "torch")) if own in makers)]
    return description(CORES, packages)


def _difference(value: Any, exact: Array) -> str:
    array = np.asarray(value.cpu() if hasattr(value, "cpu") else value, float)
    return f"{np.abs(array - exact).max():.1e}"


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--curves", type=int, default=CURVES)
    print(text(parser.parse_args().curves))
