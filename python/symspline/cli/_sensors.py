"""Curves from points, angular velocities and velocities in the columns of one table."""

from __future__ import annotations

import warnings
from argparse import Namespace
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from .. import measure
from .._estimation import estimate
from .._estimation.measurements import Measurement
from .._exceptions import SymsplineError
from .._lonlat import compass
from .._smoothing import SmoothingSpline, SmoothingWarning
from .._smoothing.factors import is_several, smoothed_spaces
from .._spaces import Array, Doubles, Euclidean, Product, Space, factors_of, space_named
from ._columns import completed, split_names
from ._messages import Problem, Progress, for_command_line, listed, refuse, say
from ._points import POSES, ROTATIONS, Columns, described, points_of
from ._recordings import Groups, group
from ._tables import Rows, Table

_QUATERNIONS = space_named("sphere:3")
_POSITION = 3
# Vectors in tables are rounded, so that they are tangent only up to this fraction of their size.
_TANGENT = 1e-4
_FOR_PYTHON = "Raise max_iter, pass lam, or a better `start`."
_FOR_COMMAND_LINE = "Give λ with --lam, or another --penalty, and check the standard deviations."
# Residuals may exceed the given standard deviations by this factor without a note.
_FACTOR = 2.0


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


def sensors_of(table: Table, options: Namespace, space: Space, sigma: Any, number: Any) -> Sensors | None:
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
    number : callable
        Function that reads the number of an option.

    Raises
    ------
    Problem
        If columns or standard deviations are missing, or their number does not match the space.
    """
    if options.rates is None and options.velocities is None:
        return None
    option = "--rates" if options.rates is not None else "--velocities"
    refuse(
        f"{option} ",
        (sigma is None, "needs the standard deviation of the points; give it with --sigma, such as --sigma 0.05"),
        (options.dedup, "cannot be combined with --dedup: all measurements of one time count"),
        (options.max_gap, "cannot be combined with --max-gap; select the curves with --curve"),
    )
    table.allow_missing()
    rates = _columns(table, options.rates)
    velocities = _columns(table, options.velocities)
    rotation = moving = None
    if rates:
        rotation = _factor(space, (ROTATIONS, _QUATERNIONS, POSES), "--rates", "one rotation")
        _check_count("--rates", rates, 3, "an angular velocity has 3 numbers")
    if velocities:
        lonlat, several = options.lonlat, isinstance(space, Product)
        moving = None if lonlat or not several else _moving(space)
        own = factors_of(space)[moving or 0]
        if lonlat:
            _check_count("--velocities", velocities, 2, "a velocity to the east and to the north has 2 numbers")
        elif own == POSES:
            _check_count("--velocities", velocities, _POSITION, "the velocity of a position has 3 numbers")
        else:
            refuse(
                "--velocities ",
                (own == ROTATIONS, "is not for rotations; give angular velocities with --rates"),
                (own._complex, f"is not available for complex numbers, the points of {own}"),
            )
            words = f"a velocity on {own} has {described(own)}"
            _check_count("--velocities", velocities, int(np.prod(own.point_shape)), words)
    sigmas = [
        _sigma(columns, f"--{what}-sigma", getattr(options, f"{what}_sigma"), number)
        for columns, what in ((rates, "rate"), (velocities, "velocity"))
    ]
    velocity_sigma = np.radians(sigmas[1]) if options.lonlat else sigmas[1]
    return Sensors(rates, velocities, sigma, sigmas[0], velocity_sigma, options.rate_bias, rotation, moving)


def _columns(table: Table, text: str | None) -> list[str]:
    return [] if text is None else [column for name in split_names(text) for column in table.expand(name)]


def _check_count(option: str, columns: list[str], count: int, words: str) -> None:
    found = f"{len(columns)} column{'s' if len(columns) > 1 else ''}"
    if len(columns) != count:
        raise Problem(f"{option} {','.join(columns)}: {words}, and there {'are' if len(columns) > 1 else 'is'} {found}")


def _sigma(columns: list[str], option: str, text: str | None, number: Any) -> float:
    if not columns:
        return 1.0
    kind = "rates" if option == "--rate-sigma" else "velocities"
    if text is None:
        raise Problem(f"--{kind} needs the standard deviation of one number of the {kind}; give it with {option}")
    value = number(text, option)
    wrong = isinstance(value, tuple) or not value > 0
    refuse(f"{option} {text}: ", (wrong, "the standard deviation must be one number greater than 0"))
    return float(value)


def _factor(space: Space, known: Sequence[Space], option: str, what: str) -> int | None:
    factors = factors_of(space)
    found = [i for i, factor in enumerate(factors) if factor in known]
    if len(found) != 1:
        names = ", ".join(map(str, known))
        raise Problem(f"{option} needs a space with {what}, such as {names}, not {space}")
    return found[0] if isinstance(space, Product) else None


def _moving(space: Space) -> int:
    """Return the factor of positions in a product."""
    factors = factors_of(space)
    for kind in (lambda own: isinstance(own, Euclidean), lambda own: own == POSES):
        found = [i for i, factor in enumerate(factors) if kind(factor)]
        if len(found) == 1:
            return found[0]
    raise Problem(f"--velocities needs a space with one position, such as r:3, se:3 or so:3 x r:3, not {space}")


# ---- measurements ----


class Fusion:
    """Curves from the rows of a table.

    Attributes
    ----------
    groups : dict
        Name and rows of each curve.
    counts : list of int
        Numbers of points, rates and velocities.
    omitted : int
        Number of rows without any measurement.
    """

    def __init__(
        self,
        table: Table,
        rows: Rows,
        entries: Sequence[Any],
        columns: Columns,
        space: Space,
        sensors: Sensors,
    ) -> None:
        if not rows.times.size:
            option = "--rates" if sensors.rates else "--velocities"
            raise Problem(f"{option} needs times, and there is no column of times; say which with --time")
        self._path, self._rows, self._space, self._sensors = table.path, rows, space, sensors
        self._columns = columns
        used = [column for entry in entries for column in entry.columns]
        widths = np.cumsum([len(used), len(sensors.rates)])
        blocks = np.split(rows.numbers, widths, axis=1)
        kinds = [(used, "a point"), (sensors.rates, "an angular velocity"), (sensors.velocities, "a velocity")]
        self._has = [self._complete(*own) for own in zip(blocks, *zip(*kinds, strict=True), strict=True)]
        self._numbers = blocks
        if columns.lonlat or columns.quaternion:
            self._point_numbers = blocks[0]
        else:
            self._point_numbers = completed(blocks[0], entries, space)
        self.groups: Groups = group(rows)
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
            name = names[int(missing[row].argmax())]
            there = names[int((~missing[row]).argmax())]
            raise Problem(
                f"{self._path}, {self._rows.place(row)}: column {name!r} is empty, but {there!r} is not; {what} needs "
                "all of its columns in a row, or none"
            )
        return ~missing.any(axis=1)

    def fitted(self, named: bool, options: dict[str, Any]) -> list[SmoothingSpline[Any, Any]]:
        """Fit all curves."""
        found = []
        for name, own in self.groups.items():
            of = f" of curve {name!r}" if named else ""
            found.append(self._one(own, of, options))
        return found

    def _one(self, own: Any, of: str, options: dict[str, Any]) -> SmoothingSpline[Any, Any]:
        given, words = self._measurements(own, of)
        try:
            with warnings.catch_warnings(record=True) as noted, Progress("fitting") as progress:
                warnings.simplefilter("always")
                # The summary describes λ at a bound and residuals that are too large.
                warnings.simplefilter("ignore", SmoothingWarning)
                curve = estimate(given, "auto", self._space, progress=progress, **options)
        except SymsplineError as error:
            raise error._with_message(self._located(error, words, of)) from None
        for note in noted:
            say(self._located(note.message, words, of))
        return curve

    def _located(self, note: Any, words: list[str], of: str) -> str:
        text = for_command_line(note).replace(_FOR_PYTHON, _FOR_COMMAND_LINE)
        for i, word in enumerate(words):
            text = text.replace(f"measurements[{i}]", word).replace("the measurements", f"the measurements{of}")
        return f"{self._path}: {text}"

    def _measurements(self, own: Any, of: str) -> tuple[list[Measurement], list[str]]:
        sensors, times = self._sensors, self._rows.times
        given: list[Measurement] = []
        words: list[str] = []
        at = [own[has[own]] for has in self._has]
        points = None
        if len(at[0]):
            points = self._points(at[0])
            given.append(measure.Points(times[at[0]], points, sigma=sensors.sigma))
            words.append("the points")
        if len(at[1]):
            bias = measure.Constant(3) if sensors.bias else None
            omega, sigma = self._numbers[1][at[1]], sensors.rate_sigma
            rates = measure.BodyRates(times[at[1]], omega, sigma=sigma, bias=bias, factor=sensors.rotation)
            given.append(rates)
            words.append("the rates")
        if len(at[2]):
            given.append(self._velocities(at[2]))
            words.append("the velocities")
        if points is None:
            place = self._rows.place(int(own[0]))
            raise Problem(
                f"{self._path}, {place}: there are no points{of}, and rates and velocities alone do not determine a "
                "curve; give at least one point"
            )
        return given, words

    def _points(self, own: Any) -> Any:
        place = self._rows.place
        numbers = self._point_numbers[own]
        return points_of(self._space, numbers, self._columns, self._path, lambda row: place(int(own[row])))

    def _velocities(self, own: Any) -> Measurement:
        sensors, times = self._sensors, self._rows.times[own]
        v, sigma = self._numbers[2][own], sensors.velocity_sigma
        space = factors_of(self._space)[sensors.moving or 0]
        if space == POSES:
            return measure.Function(times, lambda _, rate: rate[:, :3, 3] - v, sigma=sigma, nu=1, factor=sensors.moving)
        if isinstance(space, Euclidean):
            # Vectors are the same at all points.
            return measure.Velocities(times, np.zeros_like(v), v, sigma=sigma, factor=sensors.moving)
        alone = np.flatnonzero(~self._has[0][own])
        if len(alone):
            raise Problem(
                f"{self._path}, {self._rows.place(int(own[alone[0]]))}: this velocity has no point in its row, but on "
                f"{space} a velocity belongs to a point; fill in the columns of the point"
            )
        y = self._points(own)
        if self._columns.lonlat:
            east, north = compass(y)
            v = np.radians(v[:, :1] * east + v[:, 1:] * north)
            return measure.Velocities(times, y, v, sigma=sigma)
        return measure.Velocities(times, y, self._tangent(space, y, v, own), sigma=sigma)

    def _tangent(self, space: Space, y: Array, v: Doubles, own: Any) -> Array:
        vectors = v.reshape(y.shape)
        tangent = np.asarray(space.project_tangent(y, vectors))
        axes = tuple(range(1, y.ndim))
        off = np.abs(vectors - tangent).max(axis=axes) > _TANGENT * (1 + np.abs(vectors).max(axis=axes))
        if off.any():
            names = listed(self._sensors.velocities)
            raise Problem(
                f"{self._path}, {self._rows.place(int(own[off.argmax()]))}: the vector in columns {names} is not "
                f"tangent to {space} at the point in its row"
            )
        return tangent


# ---- report ----


def summary(path: str, curves: Sequence[SmoothingSpline[Any, Any]], fusion: Fusion, named: bool) -> list[str]:
    """Describe the curves in one line for all and one per bias."""
    space = curves[0].space
    kinds = zip(fusion.counts, ("points", "rates", "velocities"), strict=True)
    counts = [f"{count} {kind}" for count, kind in kinds if count]
    count = len(curves)
    parts = []
    reports = [curve.report if is_several(space) else (curve.report,) for curve in curves]
    for part, own in zip(smoothed_spaces(space), zip(*reports, strict=True), strict=True):
        bound = sum(bool(report.at_bound) for report in own)
        at_bound = "" if not bound else " (at its bound)" if len(own) == 1 else f" ({bound} at a bound)"
        parts.append(
            f"{f'{part}: ' if is_several(space) else ''}λ {spread([report.lam for report in own])}{at_bound}, "
            f"{spread([report.df for report in own])} degrees of freedom"
        )
    sizes = [own[0].sigma for own in reports]
    advice = " (check --sigma, --rate-sigma and --velocity-sigma)" if max(sizes) > _FACTOR else ""
    omitted = fusion.omitted
    rows = f"; {omitted} row{'s' if omitted > 1 else ''} without measurements omitted" if omitted else ""
    lines = [
        f"{path}: {count} curve{'s' if count > 1 else ''} near {_joined(counts)} on {space}, converged: "
        f"{'; '.join(parts)}; residuals {spread(sizes)} times the given standard deviations{advice}{rows}"
    ]
    for name, curve in zip(fusion.groups, curves, strict=True):
        of = f" of curve {name!r}" if named else ""
        for key, found in curve.parameters.items():
            each = zip(found.value, found.std, strict=True)
            lines.append(f"{key}{of}: {', '.join(f'{value:.3g} ± {std:.2g}' for value, std in each)}")
    return lines


def _joined(words: Sequence[str]) -> str:
    return " and ".join([*filter(None, [", ".join(words[:-1])]), *words[-1:]])


def spread(values: Sequence[Any]) -> str:
    """Return the range of some numbers."""
    least, most = f"{min(values):.3g}", f"{max(values):.3g}"
    return least if least == most else f"{least} to {most}"
