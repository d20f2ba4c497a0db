"""Derivatives, smoothing, estimation, lengths and jerks, beside a fit, an evaluation or SciPy in the same run."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

import numpy as np
from scipy.interpolate import make_smoothing_spline as scipy_smoothing

import symspline as ss

from . import data
from .data import SPHERE, Array
from .tables import count, table, times
from .timing import Effort, Work, measure, ratio, ready, shared
from .walks import walks


@dataclass(frozen=True)
class Sizes:
    """How much of everything: curves in a batch, knots of short curves and of a long one, noisy data, seconds."""

    batch: int
    short: tuple[int, ...]
    long: int
    noisy: int
    duration: int


FULL = Sizes(256, (100, 150, 300, 513, 1000), 100_000, 10_000, 2000)
QUICK = Sizes(3, (10, 40), 60, 40, 4)
KEYS = 20
"""The number of knots and of samples of each curve in a batch."""


class Pair(NamedTuple):
    """Work, what it is compared with, and by how many equal parts both times are divided."""

    label: str
    work: Work
    beside: str
    other: Work
    parts: float = 1
    other_parts: float = 1


def text(sizes: Sizes, effort: Effort) -> str:
    """Return the table: times of whole calls on one core, and their ratios."""
    rows = []
    with warnings.catch_warnings():
        # Small sizes are not smooth motions.
        warnings.simplefilter("ignore", ss.SmoothingWarning)
        for pair in _pairs(sizes):
            found = measure({"work": ready(pair.work), "other": ready(pair.other)}, effort)
            own, other = shared(found["work"], pair.parts), shared(found["other"], pair.other_parts)
            rows.append([pair.label, own, pair.beside, other, times(ratio(own, other))])
    return table(("work, one core", "time", "beside", "time", "ratio"), rows)


def _pairs(sizes: Sizes) -> Iterator[Pair]:
    yield from _derivatives(sizes)
    yield from _grids()
    yield from _lengths(sizes)
    yield from _single_curves(sizes)
    yield from _smoothing(sizes)
    yield from _estimates(sizes)


def _derivatives(sizes: Sizes) -> Iterator[Pair]:
    """Products with the derivatives of curves with respect to their points, beside fit and evaluation."""
    for name in ("so:3", "sphere:2", "spd:3"):
        space = ss.space(name)
        for curves in (1, sizes.batch):
            points = walks(space, curves, KEYS)
            x = np.linspace(0.5, KEYS - 1.5, KEYS)
            spline = ss.CubicSpline(None, points, space)
            change = space.random_tangent(np.random.default_rng(0), points)
            for nu in range(3):
                cotangent = spline(x, nu)
                label = f"{{}}, ν = {nu}, {space!r}, {count(curves)} × {KEYS} knots"
                beside, both = "fit and evaluation", partial(_evaluated, points, space, x, nu)
                forward = partial(spline.jvp, x, points=change, nu=nu)
                backward = partial(spline.vjp, x, cotangent, nu=nu)
                yield Pair(label.format("jvp"), forward, beside, both)
                yield Pair(label.format("vjp"), backward, beside, both)


def _evaluated(points: Array, space: ss.Space, x: Array, nu: int) -> Array:
    return ss.CubicSpline(None, points, space)(x, nu)


def _grids() -> Iterator[Pair]:
    """Derivatives of a surface along both axes, beside its values."""
    rng = np.random.default_rng(0)
    for name in ("so:3", "sphere:2"):
        space = ss.space(name)
        rows = walks(space, KEYS, KEYS)
        start = np.broadcast_to(rows[:1, :1], rows.shape)
        surface = ss.GridSpline((None, None), space.exp(start, 0.3 * space.log(start, rows)), space)
        x = tuple(rng.uniform(0, KEYS - 1, (2, 1000)))
        for nu in ((1, 0), (0, 1)):
            label = f"derivative {nu} of a surface, {space!r}, {KEYS} × {KEYS} nodes, 1 000 samples"
            yield Pair(label, partial(surface, x, nu=nu), "values", partial(surface, x))


def _lengths(sizes: Sizes) -> Iterator[Pair]:
    """Lengths beside fits, and jerks beside accelerations."""
    for name in ("so:3", "sphere:2", "cp:2"):
        space, knots = ss.space(name), sizes.short[-1]
        points = walks(space, 1, knots)[0]
        curve = ss.CubicSpline(None, points, space)
        x = data.times(knots, 10 * knots)
        label = f"{space!r}, {count(knots)} knots"
        yield Pair(f"length, {label}", curve.length, "fit", partial(ss.CubicSpline, None, points, space))
        label = f"jerk (nu=3), {label}, {count(10 * knots)} samples"
        yield Pair(label, partial(curve, x, 3), "accelerations", partial(curve, x, 2))


def _single_curves(sizes: Sizes) -> Iterator[Pair]:
    """The time of a fit per knot, beside that of a long curve."""
    walk = data.rotations(sizes.long)
    long = partial(ss.CubicSpline, None, walk, SPHERE)
    for knots in sizes.short:
        fit = partial(ss.CubicSpline, None, walk[:knots], SPHERE)
        beside = f"{count(sizes.long)} knots, per knot"
        yield Pair(f"fit of {count(knots)} knots, S³, per knot", fit, beside, long, knots, sizes.long)


def _smoothing(sizes: Sizes) -> Iterator[Pair]:
    """Smoothing with λ by cross-validation beside SciPy, and iterations on curved spaces beside fits."""
    rng, n = np.random.default_rng(0), sizes.noisy
    t = 0.01 * np.arange(n)
    for dim in (1, 3):
        y = np.sin(np.outer(t, 1 + 0.3 * np.arange(dim))) + 0.1 * rng.standard_normal((n, dim))
        own = partial(ss.make_smoothing_spline, t, y, f"r:{dim}")

        def theirs(y: Array = y) -> list[object]:
            return [scipy_smoothing(t, column) for column in y.T]

        # The time of SciPy is in front, so that the ratio says how many times as long it takes.
        label = f"SciPy's make_smoothing_spline with GCV, {count(n)} data on R{'¹ ³'[dim - 1]}"
        yield Pair(label, theirs, "make_smoothing_spline", own)
    knots = sizes.short[-1]
    for name in ("so:3", "sphere:2"):
        space = ss.space(name)
        points = walks(space, 1, knots)[0]
        noisy = space.exp(points, 0.02 * space.random_tangent(rng, points))
        fit, parts = partial(ss.CubicSpline, None, points, space), knots
        for method, words in (("newton", "full Gauss–Newton"), ("linearized", "linearised")):
            smooth = partial(ss.make_smoothing_spline, None, noisy, space, 1.0, method=method)
            steps = knots * smooth().report.iterations
            label = f"smoothing, {words}, {space!r}, {count(knots)} knots, per knot and iteration"
            yield Pair(label, smooth, "fit, per knot", fit, steps, parts)


def _estimates(sizes: Sizes) -> Iterator[Pair]:
    """Attitudes and rates with automatic knots, beside a fit of as many knots."""
    rng, end = np.random.default_rng(0), float(sizes.duration)
    fine = np.linspace(0, end, 40 * sizes.duration + 1)
    phases = rng.uniform(0, 2 * np.pi, (3, 3))
    angles = sum(
        np.array([0.8, 0.6, 0.4]) / k * np.sin(0.28 * k * fine[:, None] + phases[k - 1]) for k in (1, 2, 3)
    )
    truth = ss.CubicSpline(fine, ss.rotations.from_rotation_vectors(angles), "so:3", bc_type="not-a-knot")
    t, s = np.linspace(0, end, 5 * sizes.duration), np.linspace(0, end, 50 * sizes.duration)
    seen = truth(t) @ ss.rotations.from_rotation_vectors(0.05 * rng.standard_normal((len(t), 3)))
    omega = ss.rotations.angular_velocity(truth, s) + 0.02 * rng.standard_normal((len(s), 3))
    given: list[ss.measure.Measurement] = [
        ss.measure.Points(t, seen, sigma=0.05),
        ss.measure.BodyRates(s, omega, sigma=0.02, bias=ss.measure.Constant(3)),
    ]
    curve = ss.estimate(given, "auto", "so:3")
    knots = len(curve.t)
    label = (
        f"estimate, {count(len(t))} attitudes and {count(len(s))} rates in {count(end)} s, automatic knots"
    )
    fit = partial(ss.CubicSpline, curve.t, curve(curve.t), "so:3")
    yield Pair(label, partial(ss.estimate, given, "auto", "so:3"), f"fit of its {count(knots)} knots", fit)
