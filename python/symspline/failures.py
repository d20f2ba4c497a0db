"""What is done about curves that failed."""

from __future__ import annotations

import os
import sys
import warnings
from typing import Any

from ._core import ConvergenceError, CutLocusError
from .curves.solve import Fault
from .report import ConvergenceWarning

_PACKAGE = os.path.dirname(__file__)
_FAULTS: dict[str, type[Exception]] = {"cut-locus": CutLocusError, "unconverged": ConvergenceError}


def fail(faults: list[Fault], on_failure: str, spline: Any) -> None:
    """Raise or warn, with the good curves attached."""
    if on_failure == "ignore":
        return
    _, kind, message = faults[0]
    if len(faults) > 1:
        message += f" (and {len(faults) - 1} more curves failed)"
    if on_failure == "warn":
        warnings.warn(message, ConvergenceWarning, stacklevel=callers_level())
        return
    error: Any = _FAULTS[kind](message)
    error.spline = spline
    raise error


def callers_level() -> int:
    """How many frames up the code is that called this package."""
    frame, level = sys._getframe(1), 1
    while frame.f_back is not None and frame.f_code.co_filename.startswith(_PACKAGE):
        frame, level = frame.f_back, level + 1
    return level
