"""What splines cost in JAX, beside the core alone: a table for ``jax.md``.

python docs/jax_times.py

A minute or two, on one core of a machine that does nothing else.
"""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from comparisons.page import table, versions

import symspline as ss
from symspline.jax import curve, evaluate, fit

KNOTS, SAMPLES = 20, 200


def milliseconds(call: Callable[[], Any], runs: int = 3) -> float:
    """Median of some runs, after one to compile and warm up."""
    jax.block_until_ready(call())
    found = []
    for _ in range(runs):
        start = time.perf_counter()
        jax.block_until_ready(call())
        found.append(1e3 * (time.perf_counter() - start))
    return statistics.median(found)


def walks(space: ss.Space, curves: int) -> Any:
    """Points near a point each."""
    rng = np.random.default_rng(0)
    first = space.random_point(rng, curves)[:, None]
    first = np.broadcast_to(first, (curves, KNOTS, *space.point_shape))
    return jnp.asarray(space.exp(first, 0.1 * space.random_tangent(rng, first)))


def times_table(curves: int = 1000, runs: int = 3) -> str:
    """Curves on S³: in one call, one by one under vmap, and in JAX itself; values and gradients."""
    space, t, x = ss.Sphere(3), jnp.arange(float(KNOTS)), jnp.linspace(0, KNOTS - 1, SAMPLES)
    points = walks(space, curves)

    def compiled(points: Any) -> Any:
        return curve(x, t, points, space)

    def in_jax(points: Any) -> Any:
        return evaluate(t, points, fit(t, points, space)[0], space, x)

    def loss(function: Any) -> Any:
        return lambda points: jnp.sum(function(points) ** 3)

    spline = ss.CubicSpline(np.asarray(t), np.asarray(points), space)
    cotangent = 3 * spline(np.asarray(x)) ** 2
    rows = [
        (
            "`CubicSpline`, `vjp`",
            lambda: spline_values(points, t, x),
            lambda: spline.vjp(np.asarray(x), cotangent),
        ),
        ("`curve`, points with a batch axis", jax.jit(compiled), jax.jit(jax.grad(loss(compiled)))),
        ("`jax.vmap` of `curve`", jax.jit(jax.vmap(compiled)), jax.jit(jax.vmap(jax.grad(loss(compiled))))),
        ("`fit` and `evaluate`", jax.jit(in_jax), jax.jit(jax.grad(loss(in_jax)))),
    ]
    cells = []
    for name, value, gradient in rows:
        calls = (
            (value, gradient)
            if name.startswith("`Cubic")
            else (lambda v=value: v(points), lambda g=gradient: g(points))
        )
        cells.append((name, *(f"{milliseconds(call, runs):.0f}" for call in calls)))
    return table((f"{curves} curves, {KNOTS} knots, {SAMPLES} times: ms", "values", "gradient"), cells)


def spline_values(points: Any, t: Any, x: Any) -> Any:
    """Without JAX."""
    return ss.CubicSpline(np.asarray(t), np.asarray(points), "sphere:3")(np.asarray(x))


def main() -> None:
    jax.config.update("jax_enable_x64", True)
    ss.set_num_threads(1)
    print(f"{times_table()}\n\n{versions('symspline', 'jax')}")


if __name__ == "__main__":
    main()
