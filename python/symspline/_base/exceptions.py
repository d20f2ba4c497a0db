"""The exceptions that users can catch."""

from __future__ import annotations

from typing import Any, Self


class SymsplineError(Exception):
    """Base class of the errors that symspline raises.

    Attributes
    ----------
    curve : tuple of int or None
        Index of the curve in the batch; () for a single curve, None if the error is not about one curve.
    node : int or None
        Index of the node, or of the first of the two nodes, that the error is about.
    value, limit : float or None
        The number that was found, such as an angle or a residual, and its largest allowed value.
    spline : object
        Curves that were fitted before the error was raised: the valid ones, and the best iterates of the others. None
        if nothing was fitted.
    """

    curve: tuple[int, ...] | None = None
    node: int | None = None
    value: float | None = None
    limit: float | None = None
    spline: Any = None

    def _with_message(self, message: str) -> Self:
        """Return an error with the same fields and another message."""
        error = type(self)(message)
        vars(error).update(vars(self))
        return error

    def _of_curve(self, number: int) -> Self:
        """Return the error of one of several curves, which the message names."""
        error = self._with_message(f"curve {number}: {self}")
        error.curve = (number,)
        return error


class ValidationError(SymsplineError, ValueError):
    """The input does not meet the requirements. The message names the argument, the index, the value and the remedy."""


class CutLocusError(SymsplineError, ValueError):
    """Two points are not joined by a unique shortest geodesic: they lie at or past each other's cut locus."""


class ConvergenceError(SymsplineError, RuntimeError):
    """The solver did not reach the tolerance. The attribute ``spline`` holds the best iterate."""


for _error in (SymsplineError, ValidationError, CutLocusError, ConvergenceError):
    # Users know them by these names, in messages and in pickles.
    _error.__module__ = "symspline"
