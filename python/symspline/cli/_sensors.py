"""Curves from points, angular velocities and velocities in the columns of one table."""

from __future__ import annotations

import math
import warnings
from argparse import Namespace
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from .. import measure
from .._base.exceptions import SymsplineError
from .._base.lonlat import compass
from .._estimation import estimate
from .._estimation.measurements import Measurement
from .._smoothing import SmoothingSpline, SmoothingWarning
from .._spaces import Array, Doubles, Euclidean, Product, Space, factors_of, space_named
from ._columns import PointColumns, split_names
from ._messages import Problem, Progress, for_command_line, listed, refuse, say
from ._points import POSES, ROTATIONS, described
from ._recordings import group
from ._tables import Rows, Table
from ._times import option_numbers

_QUATERNIONS = space_named("sphere:3")
# Vectors in tables are rounded, so that they are tangent only up to this fraction of their size.
_TANGENT = 1e-4
_FOR_PYTHON = "Raise max_iter, pass lam, or a better `start`."
_FOR_COMMAND_LINE = "Give λ with --lam, or another --penalty, and check the standard deviations."


@dataclass(frozen=True)
class Sensors:
    """The columns of rates and velocities, and their standard deviations.

    Attributes
    ----------
    rates, velocities : list of str
        Columns; empty without rates or velocities.
    sigma : float or tuple
        Standard deviation of the points.
    rate_sigma, velocity_sigma : float
        Standard deviations of rates and velocities.
    bias : bool
        Whether the rates have an unknown bias.
    rotation, moving : int or None
        Factors of a product to which rates and velocities belong.
    """

    rates: list[str]
    velocities: list[str]
    sigma: Any
    rate_sigma: float
    velocity_sigma: float
    bias: bool
    rotation: int | None
    moving: int | None

    @property
    def names(self) -> list[str]:
        """All columns."""
        return [*self.rates, *self.velocities]


def sensors_of(table: Table, options: Namespace, space: Space, sigma: Any) -> Sensors | None:
    """Return the columns of rates and velocities; None if the table has only points.

    Parameters
    ----------
    table : Table
        Table to read.
    options : Namespace
        Options of the command line.
    space : Space
        Space of the curve.
    sigma : float, tuple or None
        Standard deviation of the points.

    Raises
    ------
    Problem
        If columns or standard deviations are missing, or their number does not match the space.
    """
    if options.rates is None and options.velocities is None:
        return None
    refuse(
        "--rates " if options.rates is not None else "--velocities ",
        (sigma is None, "needs the standard deviation of the points; give it with --sigma, such as --sigma 0.05"),
        (options.dedup, "cannot be combined with --dedup: all measurements of one time count"),
        (options.max_gap, "cannot be combined with --max-gap; select the curves with --curve"),
    )
    rates, velocities = _columns(table, options.rates), _columns(table, options.velocities)
    rotation = moving = None
    if rates:
        kinds = (ROTATIONS, _QUATERNIONS, POSES)
        rotation = _only([factor in kinds for factor in factors_of(space)])
        refuse(
            "--rates needs a space with one rotation, such as so:3, sphere:3, se:3, ",
            (rotation is None, f"not {space}"),
        )
        _check_count("--rates", rates, 3, "an angular velocity has 3 numbers")
    if velocities:
        moving = None if options.lonlat else _moving(space)
        _check_count("--velocities", velocities, *_velocity(factors_of(space)[moving or 0], options.lonlat))
    rate_sigma = _sigma("rates", "--rate-sigma", options.rate_sigma) if rates else 1.0
    velocity_sigma = _sigma("velocities", "--velocity-sigma", options.velocity_sigma) if velocities else 1.0
    velocity_sigma = math.radians(velocity_sigma) if options.lonlat else velocity_sigma
    several = isinstance(space, Product)
    factors = (rotation if several else None, moving if several else None)
    return Sensors(rates, velocities, sigma, rate_sigma, velocity_sigma, options.rate_bias, *factors)


def _columns(table: Table, text: str | None) -> list[str]:
    return [] if text is None else [column for name in split_names(text) for column in table.expand(name)]


def _check_count(option: str, columns: list[str], count: int, words: str) -> None:
    there = f"there are {len(columns)} columns" if len(columns) > 1 else "there is 1 column"
    refuse(f"{option} {','.join(columns)}: ", (len(columns) != count, f"{words}, and {there}"))


def _sigma(kind: str, option: str, text: str | None) -> float:
    needed = f"needs the standard deviation of one number of the {kind}; give it with {option}"
    refuse(f"--{kind} ", (text is None, needed))
    value = option_numbers(text or "", option, positive=True)
    refuse(f"{option} {text}: ", (isinstance(value, tuple), "the standard deviation must be one number"))
    return float(value)


def _only(found: list[bool]) -> int | None:
    """Return the index of the only factor that was found."""
    return found.index(True) if sum(found) == 1 else None


def _moving(space: Space) -> int:
    """Return the factor of positions in a product."""
    factors = factors_of(space)
    if len(factors) == 1:
        return 0
    found = _only([isinstance(own, Euclidean) for own in factors])
    found = _only([own == POSES for own in factors]) if found is None else found
    if found is None:
        raise Problem(f"--velocities needs a space with one position, such as r:3, se:3 or so:3 x r:3, not {space}")
    return found


def _velocity(space: Space, lonlat: bool) -> tuple[int, str]:
    """Return the number of columns of a velocity, and words for them."""
    if lonlat:
        return 2, "a velocity to the east and to the north has 2 numbers"
    if space == POSES:
        return 3, "the velocity of a position has 3 numbers"
    refuse(
        "--velocities ",
        (space == ROTATIONS, "is not for rotations; give angular velocities with --rates"),
        (space._complex, f"is not available for complex numbers, the points of {space}"),
    )
    return math.prod(space.point_shape), f"a velocity on {space} has {described(space)}"


# ---- measurements ----


class Fusion:
    """Curves from the rows of a table.

    Attributes
    ----------
    counts : list of int
        Numbers of points, rates and velocities.
    omitted : int
        Number of rows without any measurement.
    """

    def __init__(self, table: Table, rows: Rows, columns: PointColumns, sensors: Sensors) -> None:
        if not rows.times.size:
            option = "--rates" if sensors.rates else "--velocities"
            raise Problem(f"{option} needs times, and there is no column of times; say which with --time")
        self._path, self._rows, self._columns, self._sensors = table.path, rows, columns, sensors
        used = len(columns.used)
        self._numbers = np.split(rows.numbers, [used, used + len(sensors.rates)], axis=1)
        names = (columns.used, sensors.rates, sensors.velocities)
        kinds = ("a point", "an angular velocity", "a velocity")
        self._has = [self._complete(*each) for each in zip(self._numbers, names, kinds, strict=True)]
        self.counts = [int(own.sum()) for own in self._has]
        self.omitted = int((~np.any(self._has, axis=0)).sum())

    def _complete(self, numbers: Doubles, names: Sequence[str], what: str) -> Any:
        """Return which rows have all numbers of a measurement; the others have none."""
        missing = np.isnan(numbers)
        if not names:
            return np.zeros(len(numbers), bool)
        partly = missing.any(axis=1) & ~missing.all(axis=1)
        if partly.any():
            row = int(partly.argmax())
            name, there = names[int(missing[row].argmax())], names[int((~missing[row]).argmax())]
            raise Problem(
                f"{self._path}, {self._rows.place(row)}: column {name!r} is empty, but {there!r} is not; {what} needs "
                "all of its columns in a row, or none"
            )
        return ~missing.any(axis=1)

    def fitted(self, options: dict[str, Any]) -> dict[str, SmoothingSpline[Any, Any]]:
        """Fit all curves."""
        return {name: self._one(name, own, options) for name, own in group(self._rows).items()}

    def _one(self, name: str, own: Any, options: dict[str, Any]) -> SmoothingSpline[Any, Any]:
        of = "" if self._rows.labels is None else f" of curve {name!r}"
        given = self._measurements(own, of)
        try:
            with warnings.catch_warnings(record=True) as noted, Progress("fitting") as progress:
                warnings.simplefilter("always")
                # The summary describes λ at a bound and residuals that are too large.
                warnings.simplefilter("ignore", SmoothingWarning)
                curve = estimate(list(given.values()), "auto", self._columns.space, progress=progress, **options)
        except SymsplineError as error:
            raise error._with_message(self._located(error, list(given), of)) from None
        for note in noted:
            say(self._located(note.message, list(given), of))
        return curve

    def _located(self, note: Any, words: list[str], of: str) -> str:
        text = for_command_line(note).replace(_FOR_PYTHON, _FOR_COMMAND_LINE)
        for i, word in enumerate(words):
            text = text.replace(f"measurements[{i}]", word).replace("the measurements", f"the measurements{of}")
        return f"{self._path}: {text}"

    def _measurements(self, own: Any, of: str) -> dict[str, Measurement]:
        sensors, times = self._sensors, self._rows.times
        points, rates, velocities = (own[has[own]] for has in self._has)
        if not len(points):
            raise Problem(
                f"{self._path}, {self._rows.place(int(own[0]))}: there are no points{of}, and rates and velocities "
                "alone do not determine a curve; give at least one point"
            )
        given: dict[str, Measurement] = {}
        given["the points"] = measure.Points(times[points], self._points(points), sigma=sensors.sigma)
        if len(rates):
            bias = measure.Constant(3) if sensors.bias else None
            omega, factor = self._numbers[1][rates], sensors.rotation
            known: dict[str, Any] = {"sigma": sensors.rate_sigma, "bias": bias, "factor": factor}
            given["the rates"] = measure.BodyRates(times[rates], omega, **known)
        if len(velocities):
            given["the velocities"] = self._velocities(velocities)
        return given

    def _points(self, own: Any) -> Any:
        return self._columns.read(self._numbers[0][own], lambda row: self._rows.place(int(own[row])))

    def _velocities(self, own: Any) -> Measurement:
        sensors, times = self._sensors, self._rows.times[own]
        v, sigma, factor = self._numbers[2][own], sensors.velocity_sigma, sensors.moving
        space = factors_of(self._columns.space)[factor or 0]
        if space == POSES:
            return measure.Function(times, lambda _, rate: rate[:, :3, 3] - v, sigma=sigma, nu=1, factor=factor)
        if isinstance(space, Euclidean):
            # Vectors are the same at all points.
            return measure.Velocities(times, np.zeros_like(v), v, sigma=sigma, factor=factor)
        alone = np.flatnonzero(~self._has[0][own])
        if len(alone):
            raise Problem(
                f"{self._path}, {self._rows.place(int(own[alone[0]]))}: this velocity has no point in its row, but on "
                f"{space} a velocity belongs to a point; fill in the columns of the point"
            )
        y = self._points(own)
        if self._columns.lonlat:
            east, north = compass(y)
            vectors = np.radians(v[:, :1] * east + v[:, 1:] * north)
        else:
            vectors = self._tangent(space, y, v, own)
        return measure.Velocities(times, y, vectors, sigma=sigma)

    def _tangent(self, space: Space, y: Array, v: Doubles, own: Any) -> Array:
        vectors = v.reshape(y.shape)
        tangent = np.asarray(space.project_tangent(y, vectors))
        axes = tuple(range(1, y.ndim))
        off = np.abs(vectors - tangent).max(axis=axes) > _TANGENT * (1 + np.abs(vectors).max(axis=axes))
        if off.any():
            raise Problem(
                f"{self._path}, {self._rows.place(int(own[off.argmax()]))}: the vector in columns "
                f"{listed(self._sensors.velocities)} is not tangent to {space} at the point in its row"
            )
        return tangent
