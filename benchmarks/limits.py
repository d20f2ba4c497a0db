"""What a second core brings, and how far evaluation is from what it cannot do without."""

from __future__ import annotations

import os
from functools import partial

import numpy as np

import symspline as ss

from . import data
from .data import SPHERE, Array, Sizes
from .side_by_side import QUANTITIES
from .tables import count, table, verdict, versus
from .timing import Effort, Result, Timing, Work, measure, ready, shared

ANGLES, TURNS = 3, 6
"""Of de Casteljau's six geodesics the first three join control points: their angles belong to the
segment. For a sample remain three angles, an arctan2 each, and six steps, a sine and a cosine each."""

_BLOCK = 4096
"""Numbers in a block of trigonometry: all stay in the cache."""


def cores_text(walk: Array, sizes: Sizes, effort: Effort) -> str:
    """One core against two."""
    if (os.cpu_count() or 1) < 2:
        return "There is only one core."
    rows = []
    for label, work in _long_works(walk, sizes).items():
        contestants = {str(n): ready(work, n) for n in (1, 2)}
        results = measure(contestants, effort)
        rows.append(
            [label, results["1"], results["2"], *versus(results, "1", "2", 1.8 if sizes.goals else None)]
        )
    return table(("work", "one core", "two cores", "ratio", "goal"), rows)


def limits_text(walk: Array, sizes: Sizes, effort: Effort) -> str:
    """Time per sample on one core of evaluation, of writing the output, and of trigonometry."""
    t, points = data.knots(sizes.knots_to_evaluate), walk[: sizes.knots_to_evaluate]
    curve = ss.CubicSpline(t, points, SPHERE)
    counts = (sizes.samples, sizes.most_samples)
    columns = [_per_sample(curve, len(t), n, effort) for n in counts]
    rows = [[name, *(column[name] for column in columns)] for name in columns[0]]
    head = ("time per sample, one core", *(f"{count(n)} samples" for n in counts))
    return table(head, rows) + (_goal(columns[0]["evaluate: value"]) if sizes.goals else "")


def _goal(value: object) -> str:
    found = verdict(25e-9 / value.median if isinstance(value, Timing) else None, 1)
    return f"\n\nGoal for a value: at most 25 ns, {found}."


def _long_works(walk: Array, sizes: Sizes) -> dict[str, Work]:
    (n, (curves, keys), samples) = sizes.long_curve, sizes.batch, sizes.most_samples
    long, own = data.knots(n), data.knots(keys)
    batch = walk[: curves * keys].reshape(curves, keys, 4)
    curve = ss.CubicSpline(None, walk[: sizes.knots_to_evaluate], SPHERE)
    x = data.times(sizes.knots_to_evaluate, samples)
    return {
        f"construct, {count(n)} knots": partial(ss.CubicSpline, long, walk[:n], SPHERE),
        f"construct, {count(curves)} curves × {keys} knots": partial(ss.CubicSpline, own, batch, SPHERE),
        **{
            f"evaluate, {count(samples)} {quantity}s": partial(curve, x, nu)
            for nu, quantity in enumerate(QUANTITIES)
        },
    }


def _per_sample(curve: ss.CubicSpline, n: int, samples: int, effort: Effort) -> dict[str, Result]:
    x = data.times(n, samples)
    reused = np.empty((samples, 4))
    works: dict[str, Work] = {
        **{f"evaluate: {quantity}": partial(curve, x, nu) for nu, quantity in enumerate(QUANTITIES)},
        "write as many bytes: a new array": lambda: np.empty((samples, 4)).fill(1.0),
        "write as many bytes: the same array again": lambda: reused.fill(1.0),
        f"{TURNS} sines, {TURNS} cosines, {ANGLES} arctan2 (NumPy)": _trigonometry(samples),
    }
    results = measure({name: ready(work) for name, work in works.items()}, effort)
    return {name: shared(result, samples) for name, result in results.items()}


def _trigonometry(samples: int) -> Work:
    angles = np.random.default_rng(3).uniform(0.01, 0.2, _BLOCK)
    out, other = np.empty(_BLOCK), np.sin(angles)

    def over(numbers: int, function: np.ufunc, *arguments: Array) -> None:
        for start in range(0, numbers, _BLOCK):
            size = min(_BLOCK, numbers - start)
            function(*(argument[:size] for argument in arguments), out=out[:size])

    def work() -> None:
        over(TURNS * samples, np.sin, angles)
        over(TURNS * samples, np.cos, angles)
        over(ANGLES * samples, np.arctan2, other, angles)

    return work
