"""Faults of fitted curves, with the messages for every kind, and warnings at the line that called the package."""

from __future__ import annotations

import os
import re
import sys
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Any, NamedTuple, TypeVar

import numpy as np

from .exceptions import SymsplineError
from .report import Columns

_SUIT = "choose times that suit the distances"
# Rounding errors that are accepted whatever the tolerance, `MOST` in rounded.rs.
_ROUNDING = 1e-7
CUT_LOCUS, UNCONVERGED, INVALID, ALMOST_CUT = "cut-locus", "unconverged", "invalid", "almost-cut"


class Fault(NamedTuple):
    """A fault of one curve.

    Attributes
    ----------
    curve : int
        Number of the curve in the flattened batch.
    kind : str
        `CUT_LOCUS`, `UNCONVERGED`, `INVALID`, or `ALMOST_CUT` for a valid curve that would take the opposite
        direction after a small motion of its points.
    what, remedy : str
        The problem and its remedy. The name of the curve replaces ``{of}``.
    node : int or None
        The node at which the problem was found.
    value, limit : float
        The value at that node and its limit; NaN if there is none.
    about_times : bool
        Whether unsuitable times may be the cause.
    """

    curve: int
    kind: str
    what: str
    remedy: str = ""
    node: int | None = None
    value: float = float("nan")
    limit: float = float("nan")
    about_times: bool = False

    def batch_index(self, batch: Sequence[int]) -> tuple[int, ...]:
        """Return the index of the curve in the batch; () for a single curve."""
        return tuple(map(int, np.unravel_index(self.curve, batch))) if batch else ()

    def problem(self, batch: Sequence[int]) -> str:
        """Return the problem with the index of the curve in the batch."""
        return self.what.replace("{of}", of_curve(self.curve, batch))

    def message(self, batch: Sequence[int]) -> str:
        """Return the problem and the remedy."""
        return "; ".join(filter(None, (self.problem(batch), self.remedy)))

    @property
    def failed(self) -> bool:
        """Whether there is no valid curve."""
        return self.kind != ALMOST_CUT


CoreFault = tuple[int, str, int | None, float, float, str | None]
"""A fault from the compiled core: curve, kind, node, value, limit, and the message for an invalid point."""


def of_curve(number: int, batch: Sequence[int]) -> str:
    """Return " of curve ..." for a curve of a batch, or an empty text for a single curve."""
    return of_index(np.unravel_index(number, batch)) if batch else ""


def of_index(index: Sequence[int | np.intp]) -> str:
    """Return " of curve ..." for an index in a batch, or an empty text for the index ()."""
    return f" of curve {','.join(map(str, index))}" if index else ""


def unconverged(number: int, columns: Columns, tol: float, more_advice: str = "") -> Fault:
    """Return the fault of a curve whose residual exceeds the tolerance."""
    residual, iterations, longest = (columns.row(x)[number] for x in ("residual", "iterations", "max_step"))
    reached = f"residual {residual:.3e} after {iterations} iterations"
    what = f"no convergence{{of}}: {reached} (tol {tol:.1e}, longest step {_length(longest)})"
    remedy = (
        f"put more points where steps are long, choose times that suit the distances, or raise max_iter{more_advice}"
    )
    return Fault(number, UNCONVERGED, what, remedy, None, float(residual), tol, about_times=True)


def imprecise(of: str, error: float, tol: float) -> tuple[str, str]:
    """Return the problem of a curve with large rounding errors, and its remedy."""
    what = (
        f"rounding errors of the curve{of} are {error:.1e} of its largest speed (allowed: {max(tol, _ROUNDING):.1e}), "
        "although its velocities are accurate"
    )
    return what, "put points between those that are far apart"


def from_core(
    raw: CoreFault, columns: Columns, tol: float, quaternions: bool, names: Sequence[int] | None = None
) -> Fault:
    """Convert a fault from the compiled core, with its message.

    Parameters
    ----------
    columns : Columns
        Reports of all curves.
    tol : float
        Tolerance of the fit.
    quaternions : bool
        Whether points may be unit quaternions, whose inconsistent signs are the usual cause of antipodes.
    names : sequence of int, optional
        Indices of the nodes in messages, if they are not 0, 1, ...
    """
    number, kind, node, value, limit, why = raw
    if kind == "invalid":
        return Fault(number, INVALID, str(why), "", node, value, limit)
    category, about_times = CUT_LOCUS, False
    following = (node or 0) + 1
    if names is not None and node is not None:
        node, following = names[node], names[min(following, len(names) - 1)]
    handle, pair = f"the control handle at points[{node}]{{of}}", f"points[{node}] and points[{following}]{{of}}"
    past = f"lie at or past each other's cut locus: angle {value}, limit {limit}"
    if kind == "almost-cut":
        category, remedy = ALMOST_CUT, ""
        what = (
            f"neighbours almost at the cut locus: between {pair} the angle is {value}, limit {limit}; had it been a "
            "little more, the curve would go the other way round: put a point between them"
        )
    elif kind == "cut-locus" and limit == float("inf"):
        category = UNCONVERGED
        what = f"the geodesic between {pair} has no significant digits: they are too far apart for double precision"
        remedy = "put a point between them"
    elif kind == "cut-locus":
        what = f"{pair} {past}"
        remedy = "put a point between them" + (", or check their sign" if quaternions else "")
    elif kind == "inner-handles":
        about_times = True
        what = f"the control points between {pair} {past}"
        remedy = f"put a point between them, or {_SUIT}"
    elif kind == "outer-handle" and limit == float("inf"):
        category, about_times = UNCONVERGED, True
        what = f"{handle} has length {value:.1f}, too long for floating-point numbers"
        remedy = f"{_SUIT}: the segments next to it differ too much in length"
    elif kind == "outer-handle":
        about_times = True
        what = f"{handle} passes the cut locus: angle {value}, limit {limit}"
        remedy = f"put more points there, or {_SUIT}"
    elif kind == "imprecise":
        category = UNCONVERGED
        what, remedy = imprecise("{of}", value, tol)
    elif kind == "unattained":
        category = UNCONVERGED
        what = "no convergence{of}: no curve was found with the given velocity and acceleration at one end"
        remedy = "prescribe only one of them, or values that suit the points next to the end"
    elif kind in ("homotopy", "overflow"):
        category, about_times = UNCONVERGED, kind == "overflow"
        longest, iterations = columns.row("max_step")[number], columns.row("iterations")[number]
        why = "numbers exceeded the floating-point range" if about_times else "the homotopy did not reach these points"
        what = f"no convergence{{of}}: after {iterations} iterations {why} (longest step {_length(longest)})"
        remedy = f"{'' if about_times else 'try another method, '}put more points where steps are long, or {_SUIT}"
    else:
        return unconverged(number, columns, tol)
    return Fault(number, category, what, remedy, node, value, limit, about_times)


def _length(x: Any) -> str:
    return f"{x:.3f}" if x < 1e6 else f"{x:.3e}"


# ---- errors about samples, which may have other names in the user's data ----

_Error = TypeVar("_Error", bound=SymsplineError)
# Samples in messages: `points[3]`, `t[0][3]` of the first curve, `measurements[0].y: point 3`.
_SAMPLE = re.compile(r"\b(t|points|velocities|omega|measurements\[(\d+)\]\.\w+)(?:\[(\d+)\](?=\[))?(\[|: point )(\d+)")


class Sample(NamedTuple):
    """A sample that an error is about, with the numbers of its measurement and of its curve, if any."""

    argument: str
    measurement: int | None
    curve: int | None
    node: int


def renamed(error: _Error, name: Callable[[Sample], tuple[str, int | str]]) -> _Error:
    """Return an error about the same samples by other names: their argument, and their number or index."""

    def text(match: re.Match[str]) -> str:
        argument, measurement, curve, opening, node = match.groups()
        numbers = [None if number is None else int(number) for number in (measurement, curve)]
        argument, index = name(Sample(argument, numbers[0], numbers[1], int(node)))
        return f"{argument}{'' if curve is None else f'[{curve}]'}{opening}{index}"

    return error._with_message(_SAMPLE.sub(text, str(error)))


def between_neighbours(error: _Error, name: str, lead: Sequence[int]) -> _Error:
    """Return the error of an operation on rows of pairs as that of neighbouring points, whose array has a name."""
    row, _, problem = str(error).removeprefix("pair ").partition(": the points ")
    *curve, i = map(int, np.unravel_index(int(row), lead))
    return error._with_message(f"{name}[{i}] and {name}[{i + 1}]{of_index(curve)} {problem}")


# ---- warnings at the line that called the package ----

_PACKAGE = os.path.dirname(os.path.dirname(__file__))
# Categories of warnings that the current call suppresses because its result describes the same.
_SILENT: ContextVar[tuple[type[Warning], ...]] = ContextVar("silent", default=())


@contextmanager
def silenced(category: type[Warning]) -> Iterator[None]:
    """Suppress warnings of this package in the current thread; filters of `warnings` are shared by all threads."""
    token = _SILENT.set((*_SILENT.get(), category))
    try:
        yield
    finally:
        _SILENT.reset(token)


def is_silent(category: type[Warning]) -> bool:
    """Whether warnings of this category are not issued, so that their checks are not needed."""
    return issubclass(category, _SILENT.get())


def warn(message: str, category: type[Warning], curve: tuple[int, ...] | None = None, node: int | None = None) -> None:
    """Issue a warning at the line that called this package.

    The warning has the attributes ``curve`` and ``node`` of a `SymsplineError`.
    """
    if is_silent(category):
        return
    warning: Any = category(message)
    warning.curve, warning.node = curve, node
    warnings.warn(warning, stacklevel=callers_level())


def callers_level() -> int:
    """Return the number of frames between this function and the code that called the package."""
    frame, level = sys._getframe(1), 1
    while frame.f_back is not None and frame.f_code.co_filename.startswith(_PACKAGE):
        frame, level = frame.f_back, level + 1
    return level
