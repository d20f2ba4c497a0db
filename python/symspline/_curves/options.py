"""Validation of the options of splines."""

from __future__ import annotations

from importlib.util import find_spec
from typing import Any, TypedDict

import numpy as np

from .._base.arrays import checked_atol, checked_flag, short_repr, whole_number
from .._base.typing import Extrapolate, Progress
from .._core import ValidationError
from .fit import Points
from .solve import Options

_QUANTITIES = ("point", "velocity", "acceleration", "jerk")
_RAISE = "raise"
_EXTRAPOLATION_MODES = {
    None: "raise",
    "raise": "raise",
    True: "continue",
    False: "nan",
    "geodesic": "geodesic",
    "periodic": "periodic",
}


class EvaluationOptions(TypedDict, total=False):
    """The keywords of an evaluation that do not affect the type of its result."""

    extrapolate: Extrapolate
    per_curve: bool
    progress: Progress | None


def quantity_of(nu: object, most: int = 2) -> str:
    """The name of the derivative of order `nu`. Those up to the second order are known to the core."""
    if type(nu) is int and 0 <= nu <= most:
        return _QUANTITIES[nu]
    return _QUANTITIES[order_of(nu, most)]


def order_of(nu: object, most: int = 2) -> int:
    """Validate the order of a derivative, an integer from 0 to `most`.

    Raises
    ------
    ValidationError
        If `nu` is not an integer, such as True or 1.0, or is out of range.
    """
    if isinstance(nu, bool) or not isinstance(nu, (int, np.integer)) or not 0 <= nu <= most:
        words = f"{', '.join(map(str, range(most)))} or {most}"
        raise ValidationError(f"nu must be {words}, not {short_repr(nu)}")
    return int(nu)


def with_atol(data: list[Points], atol: float | None) -> list[Points]:
    """Return points with the tolerance `atol`; None keeps the tolerance of their type."""
    if atol is None:
        return data
    tol = checked_atol(atol)
    return [part._replace(tol=tol) for part in data]


def checked_extrapolate(extrapolate: object) -> Any:
    """Return the extrapolation policy, or raise ValidationError if it is invalid."""
    known = isinstance(extrapolate, str) and extrapolate in _EXTRAPOLATION_MODES
    if extrapolate is not None and not isinstance(extrapolate, bool) and not known:
        raise ValidationError(
            f"extrapolate must be None, 'raise', True, False, 'geodesic' or 'periodic', not {short_repr(extrapolate)}. "
            "To hold the first and the last point, evaluate at np.clip(x, *curve.domain)."
        )
    return extrapolate


def extrapolation_mode(policy: Any, bc_type: object) -> str:
    """Return the core's name of an extrapolation policy. Closed curves repeat unless another policy is given."""
    closed = isinstance(bc_type, str) and bc_type == "periodic"
    return "periodic" if policy is None and closed else _EXTRAPOLATION_MODES[policy]


def check_progress(progress: Progress | None) -> None:
    """Raise ValidationError unless the argument is callable or None."""
    if progress is not None and not callable(progress):
        raise ValidationError(f"progress must be a function of two numbers, not {short_repr(progress)}")


def fit_options(
    method: str,
    tol: float,
    max_iter: int | None,
    extrapolate: Extrapolate,
    on_failure: object,
    check: object,
    progress: Progress | None,
) -> Options:
    """Return the options of the solver, after validation of all options of a fit.

    The compiled core validates ``method`` and ``tol``. The usual defaults take no further function call.
    """
    if extrapolate is not None or on_failure is not _RAISE or progress is not None:
        check_policies(extrapolate, on_failure, progress)
    if check is not True:
        checked_flag(check, "check")
    return Options(method, tol, None if max_iter is None else whole_number(max_iter, "max_iter", 1))


def check_policies(extrapolate: object, on_failure: object, progress: Progress | None) -> None:
    """Validate the options that fits of all kinds have."""
    if extrapolate is not None:
        checked_extrapolate(extrapolate)
    # == would compare every element of an array.
    if on_failure is not _RAISE:
        check_on_failure(on_failure)
    if progress is not None:
        check_progress(progress)


def check_on_failure(on_failure: object) -> None:
    """Raise ValidationError unless the argument is one of the three policies."""
    if not isinstance(on_failure, str) or on_failure not in ("raise", "warn", "ignore"):
        raise ValidationError(f"on_failure must be 'raise', 'warn' or 'ignore', not {short_repr(on_failure)}")


def require_matplotlib() -> None:
    """Raise ImportError if Matplotlib is not installed."""
    if find_spec("matplotlib") is None:
        raise ImportError("plots need matplotlib; install it with: pip install 'symspline[plot]'")
