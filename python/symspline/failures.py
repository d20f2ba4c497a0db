"""What is done about curves that failed, or that may go the wrong way round."""

from __future__ import annotations

import os
import sys
import warnings
from typing import Any

from ._core import ConvergenceError, CutLocusError
from .curves.solve import ALMOST_CUT, Fault, failures
from .report import ConvergenceWarning

_PACKAGE = os.path.dirname(__file__)
_FAULTS: dict[str, type[Exception]] = {"cut-locus": CutLocusError, "unconverged": ConvergenceError}


def fail(faults: list[Fault], on_failure: str, spline: Any) -> None:
    """Raise or warn, with the good curves attached."""
    failed = failures(faults)
    if failed and on_failure == "raise":
        _, kind, message = failed[0]
        error: Any = _FAULTS[kind](message + _more(failed, "curves failed"))
        error.spline = spline
        raise error
    if failed and on_failure == "warn":
        message = failed[0][2] + _more(failed, "curves failed")
        warnings.warn(message, ConvergenceWarning, stacklevel=callers_level())
    if len(failed) < len(faults):
        almost = [fault for fault in faults if fault[1] == ALMOST_CUT]
        warnings.warn(almost[0][2] + _more(almost, "curves"), UserWarning, stacklevel=callers_level())


def _more(faults: list[Fault], what: str) -> str:
    return f" (and {len(faults) - 1} more {what})" if len(faults) > 1 else ""


def callers_level() -> int:
    """How many frames up the code is that called this package."""
    frame, level = sys._getframe(1), 1
    while frame.f_back is not None and frame.f_code.co_filename.startswith(_PACKAGE):
        frame, level = frame.f_back, level + 1
    return level
