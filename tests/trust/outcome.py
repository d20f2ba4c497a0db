"""Outcomes of fits of random recordings, and rows of the table that summarises them."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterable
from typing import NamedTuple

import symspline as ss

# From this number of standard errors on, a result is wrong.
WRONG = 5.0


class Outcome(NamedTuple):
    """Result of one recording.

    Attributes
    ----------
    error : float
        Largest error of the result, in standard errors of a fit that is right; NaN if there is no result.
    warned : bool
        Whether a warning was issued.
    refused : bool
        Whether an exception was raised.
    sound : bool
        Whether the recording has no fault that a warning should report.
    """

    error: float
    warned: bool
    refused: bool
    sound: bool = True


class Row(NamedTuple):
    """Shares of the outcomes of one kind of data."""

    kind: str
    recordings: int
    wrong: float
    silently_wrong: float
    refused: float
    false_alarms: float


def outcome_of(fit: Callable[[], float], sound: bool = True) -> Outcome:
    """Run a fit that returns its error in standard errors, and record warnings and exceptions of symspline."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        try:
            error = float(fit())
        except ss.SymsplineError:
            return Outcome(float("nan"), bool(caught), True, sound)
    return Outcome(error, bool(caught), False, sound)


def row_of(kind: str, outcomes: Iterable[Outcome]) -> Row:
    """Summarise the outcomes of one kind of data."""
    every = list(outcomes)
    results = [one for one in every if not one.refused]
    # NaN counts as wrong.
    wrong = [one for one in results if not one.error <= WRONG]
    false = [one for one in results if one.sound and one.warned and one.error <= WRONG]
    share = 1 / max(len(every), 1)
    return Row(
        kind,
        len(every),
        len(wrong) * share,
        sum(not one.warned for one in wrong) * share,
        (len(every) - len(results)) * share,
        len(false) * share,
    )
