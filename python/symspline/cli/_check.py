"""Measure how well curves interpolate and how smooth they are

Every segment is evaluated on its own, so that the values on both sides of a knot are independent. The table has

  distance      the largest distance of the curve from its points
  position      the largest jump of the curve at a knot, relative to the largest length of its array; for positive
                definite matrices the jump itself, as distances are relative there
  velocity      the largest jump of the velocity, relative to the largest velocity
  acceleration  the largest jump of the covariant acceleration, relative to the largest one

Where values are rounding errors themselves, as the acceleration of a geodesic is, a jump of the k-th derivative is
multiplied by h^k instead, where h is the shorter of the two segments.

Lengths are those of the space and do not depend on the array that represents a line or subspace. For poses they are
those of the rates in the body, angle and position together. A jump of the k-th derivative may be 1.2e-11 of the largest
value, as much as the tolerance of the fit, plus 100 eps / h^k for rounding; |p| times as much where points p have large
numbers, |p|^2 times as much in
hyperbolic spaces, cond(p) for positive definite matrices; on Stiefel manifolds, whose logarithms are iterative, 1e-7
of the largest value. The check fails at larger jumps, and the exit code is 1.

example:
  symspline check storms.npz
"""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path

import numpy as np

from .._base.arrays import brief
from .._curves.ends import is_closed
from .._spaces import HermitianPositiveDefinite, SymmetricPositiveDefinite
from .._splines.cubic import CubicSpline
from .._splines.functional import segments_of
from ..manifolds import Manifold
from ._curves import read_curves
from ._messages import Failure, listed

_MEASURES = ("distance", "position", "velocity", "acceleration")
# The tolerance of the fit is a residual of 1e-12, and the jump of an acceleration is twelve times as large.
_RELATIVE = 1.2e-11
_OF_FUNCTIONS = 1e-7
_ROUNDING = 100 * float(np.finfo(np.float64).eps)
# Their metric is relative: it does not depend on the unit of the matrices.
_POSITIVE = (SymmetricPositiveDefinite, HermitianPositiveDefinite)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of ``symspline check``."""
    parser.add_argument("curves", type=Path, metavar="CURVE", help="file of curves to read: .npz, or -")
    parser.add_argument("--curve", action="append", metavar="NAME", help="which curve; may be repeated (default: all)")


def run(options: argparse.Namespace) -> int:
    """Measure all curves, print the table, and compare with what is allowed."""
    curves = read_curves(options.curves).chosen(options.curve)
    width = max(len("curve"), *(len(brief(name)) for name in curves.splines)) + 2 if curves.named else 0

    def line(name: str, count: object, *cells: str) -> None:
        print(f"{name:{width}}"[:width] + f"{count:>8}" + "".join(f"{cell:>14}" for cell in cells))

    line("curve", "points", *_MEASURES)
    failed = []
    for name, spline in curves.splines.items():
        # The largest values of all factors of a product count.
        measured = [_measure(part) for part in spline._parts]
        values = np.max([values for values, _ in measured], axis=0)
        line(brief(name), len(spline.t), *(f"{value:.1e}" for value in values))
        if not np.max([excess for _, excess in measured]) <= 1:
            failed.append(name)
    if failed:
        many = f"{len(failed)} of {len(curves.splines)} curves: {listed(failed)}"
        raise Failure(f"{curves.file}: more than rounding allows in {many if curves.named else 'the curve'}")
    print("All is within what rounding allows.")
    return 0


def _measure(spline: CubicSpline) -> tuple[list[float], float]:
    """Return the numbers of the table, and the largest of them divided by what is allowed."""
    if not np.isfinite(spline.velocities).all():
        return [np.nan] * len(_MEASURES), np.inf
    segments = segments_of(spline)
    closed = is_closed(spline.bc_type)
    steps = np.diff(spline._times)
    shorter = np.minimum(steps, np.roll(steps, -1))[: None if closed else -1]
    relative = _OF_FUNCTIONS if isinstance(spline.space, Manifold) else _RELATIVE
    floor = _ROUNDING * float(spline.space._rounding(spline.points).max())
    distance = float(spline.space.distance(segments.at(segments.t), segments.points).max())
    values, excess = [distance], [distance / (relative + floor)]
    for nu in range(3):
        jumps = segments.jumps(nu, closed)
        if nu == 2 and spline._c1_nodes:
            # The acceleration may jump where a velocity is prescribed.
            size = jumps.size.copy()
            size[..., [node - 1 for node in spline._c1_nodes]] = 0
            jumps = replace(jumps, size=size)
        if nu == 0 and isinstance(spline.space, _POSITIVE):
            jumps = replace(jumps, largest=1.0)
        rounding = floor / shorter**nu
        # A value that is zero up to rounding cannot measure a jump.
        is_rounding = jumps.largest <= rounding.max(initial=0.0)
        values.append(float((jumps.size * shorter**nu).max(initial=0.0)) if is_rounding else jumps.relative)
        excess.append(float((jumps.size / (relative * jumps.largest + rounding)).max(initial=0.0)))
    return values, max(excess)
