"""What a gradient with respect to the data costs, beside the fit."""

from __future__ import annotations

from functools import partial

import numpy as np

import symspline as ss

from .tables import table, versus
from .timing import Effort, in_unit, measure, ready
from .walks import walks

SPACES = ("so:3", "sphere:2", "spd:3")
KEYS = 20
FIT, ONCE, EACH = "fit", "gradient at one time", "gradient at 20 times"


def text(effort: Effort) -> str:
    """One curve of 20 points on one core: times of whole calls, as multiples of the fit's."""
    lines = []
    rng = np.random.default_rng(0)
    for name in SPACES:
        space = ss.space(name)
        points = walks(space, 1, KEYS)[0]
        spline = ss.CubicSpline(None, points, space)
        x = np.linspace(0.5, KEYS - 1.5, KEYS)
        cotangent = rng.standard_normal(spline(x).shape)
        contestants = {
            FIT: ready(partial(ss.CubicSpline, None, points, space), 1),
            ONCE: ready(partial(spline.vjp, x[:1], cotangent[:1]), 1),
            EACH: ready(partial(spline.vjp, x, cotangent), 1),
        }
        found = measure(contestants, effort)
        ratios = [versus(found, which, FIT)[0] for which in (ONCE, EACH)]
        times = [in_unit(found[which], 1e-6) for which in (FIT, ONCE, EACH)]
        lines.append([f"{space!r}: {KEYS} knots", times[0], times[1], ratios[0], times[2], ratios[1]])
    return table(("µs, one core", FIT, ONCE, "ratio", EACH, "ratio"), lines)
