"""``symspline check``: whether curves are what they should be."""

from __future__ import annotations

import argparse
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ..arrays import brief
from ..curves.ends import is_closed
from ..manifolds import Manifold
from ..pieces import spline_pieces
from ..spaces import HermitianPositiveDefinite, SymmetricPositiveDefinite
from ..spline import CubicSpline
from .curves import read_curves
from .errors import Failure, listed

SUMMARY = "measure how well curves interpolate and how smooth they are"
DESCRIPTION = """\
Measure how well curves interpolate, and how smooth they are. Every segment is evaluated on its own, so that
the values from both sides of a knot know nothing of each other. The table has

  distance      the largest distance of the curve from its points
  position      the largest jump of the curve at a knot, relative to the largest length of its array; of
                positive definite matrices the jump itself, as distances are relative there
  velocity      the largest jump of the velocity, relative to the largest velocity
  acceleration  the largest jump of the covariant acceleration, relative to the largest one

Of values that are rounding themselves, as the acceleration of a geodesic is, a jump of the k-th derivative is
multiplied by h^k instead, where h is the shorter of the two segments.

Lengths are those of the space, so that it does not matter which array of a line or subspace stands for it; of
poses those of the rates in the body, the angle and the way together. A jump of the k-th derivative may be
1e-12 of the largest value, and 100 eps / h^k for rounding; |p| as much where points p have large numbers, in
hyperbolic spaces |p|^2 as much, for positive definite matrices cond(p); on Stiefel manifolds, whose logarithms
are found by iterations, 1e-7 of the largest value. With a larger one the check fails, and the exit code is 1."""
EPILOG = """\
example:
  symspline check storms.npz"""

MEASURES = ("distance", "position", "velocity", "acceleration")
_RELATIVE = 1e-12
_OF_FUNCTIONS = 1e-7
_ROUNDING = 100 * float(np.finfo(np.float64).eps)
# Lengths of their metric are relative to the matrices as they are: 1 m² or 10⁶ mm² is the same.
_POSITIVE = (SymmetricPositiveDefinite, HermitianPositiveDefinite)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The options of ``symspline check``."""
    parser.add_argument("curves", type=Path, metavar="CURVE", help="file of curves to read: .npz")


def run(options: argparse.Namespace) -> int:
    """Measure, print and judge."""
    curves = read_curves(options.curves)
    width = max(len("curve"), *(len(brief(name)) for name in curves.splines)) if curves.named else 0
    print(_line(width, "curve", "points", *MEASURES))
    failed = []
    for name, spline in curves.splines.items():
        found = measure(spline)
        print(_line(width, brief(name), len(spline.t), *(f"{value:.1e}" for value in found.values)))
        if not found.excess <= 1:
            failed.append(name)
    if failed:
        which = (
            f"{len(failed)} of {len(curves.splines)} curves: {listed(failed)}"
            if curves.named
            else "the curve"
        )
        raise Failure(f"{options.curves}: more than rounding allows in {which}")
    print("All is within what rounding allows.")
    return 0


def _line(width: int, name: str, *cells: object) -> str:
    first = f"{name:{width}}  " if width else ""
    return first + f"{cells[0]:>8}" + "".join(f"{cell:>14}" for cell in cells[1:])


@dataclass(frozen=True)
class Found:
    """What was measured on a curve.

    Attributes:
        values: the numbers of the table.
        excess: the largest of them divided by what is allowed.
    """

    values: tuple[float, ...]
    excess: float


def measure(spline: CubicSpline) -> Found:
    """Distance from the points, and jumps at the knots; of a curve in a product, in its worst factor."""
    found = [_measure(part) for part in spline._parts]
    values = np.max([part.values for part in found], axis=0)
    return Found(tuple(values.tolist()), float(np.max([part.excess for part in found])))


def _measure(spline: CubicSpline) -> Found:
    if not np.isfinite(spline.velocities).all():
        return Found((np.nan,) * len(MEASURES), np.inf)
    pieces = spline_pieces(spline)
    closed = is_closed(spline.bc_type)
    steps = np.diff(spline._times)
    shorter = np.minimum(steps, np.roll(steps, -1))[: None if closed else -1]
    relative = _OF_FUNCTIONS if isinstance(spline.space, Manifold) else _RELATIVE
    floor = _ROUNDING * float(spline.space.rounding(spline.points).max())
    distance = float(spline.space.distance(pieces.at(pieces.t), pieces.points).max())
    values, excess = [distance], [distance / (relative + floor)]
    for nu in range(3):
        jumps = pieces.jumps(nu, closed)
        if nu == 0 and isinstance(spline.space, _POSITIVE):
            jumps = replace(jumps, largest=1.0)
        rounding = floor / shorter**nu
        allowed = relative * jumps.largest + rounding
        # Zero is no measure of zero.
        is_rounding = jumps.largest <= rounding.max(initial=0.0)
        values.append(float((jumps.size * shorter**nu).max(initial=0.0)) if is_rounding else jumps.relative)
        excess.append(float((jumps.size / allowed).max(initial=0.0)))
    return Found(tuple(values), max(excess))
