"""Hamiltonians for solvers of differential equations."""

from __future__ import annotations

from collections.abc import Sequence
from math import prod
from typing import TYPE_CHECKING, Any

import numpy as np

from .._arrays import short_repr
from .._core import ValidationError
from .._cubic import CubicSpline
from .._typing import Extrapolate
from ._generators import hamiltonian, quantum_space

if TYPE_CHECKING:
    from qutip import QobjEvo


def qobjevo(spline: CubicSpline[Any, Any], *, dims: Sequence[int] | None = None) -> QobjEvo:
    """Convert the Hamiltonian of a curve to a ``QobjEvo`` for QuTiP's solvers.

    With ħ = 1, times in ns give a Hamiltonian in rad/ns. The solver's states agree with the points of the curve up to a
    phase.

    Parameters
    ----------
    spline : CubicSpline
        One curve, as for `hamiltonian`, whose times are numbers.
    dims : sequence of int, optional
        Levels of each part of a composite system, such as ``[2, 2]`` for two qubits. None means a single system.

    Returns
    -------
    qutip.QobjEvo
        Time-dependent Hamiltonian.

    Raises
    ------
    ImportError
        If QuTiP is not installed.
    ValidationError
        If the curve is on another space, is a batch, has dates as times, or `dims` has another number of levels. The
        result raises this error for times before the first knot.

    Notes
    -----
    Solvers evaluate the Hamiltonian beyond the last knot. If the curve raises an error there, the final Hamiltonian is
    used instead. For SciPy's solvers, do the same with ``hamiltonian(spline, t, extrapolate="geodesic")``.

    Examples
    --------
    >>> import symspline as ss
    >>> from symspline import quantum
    >>> flip = ss.CubicSpline([0, 10], [[1, 0], [0.6, 0.8]], "cp:1")
    >>> quantum.qobjevo(flip)(5.0).shape
    (2, 2)
    """
    quantum_space(spline)
    if spline._batch:
        raise ValidationError(f"{spline!r} is a batch, but a QobjEvo needs one curve; use qobjevo(spline[0])")
    if spline._time_axis.dates:
        raise ValidationError(
            "the times of this curve are dates, but a QobjEvo needs numbers; fit the curve with times in seconds"
        )
    try:
        import qutip
    except ImportError:
        raise ImportError("a QobjEvo needs QuTiP; install it with: pip install qutip") from None
    beyond: Extrapolate = "geodesic" if spline._extrapolation_mode in ("raise", "nan") else None
    first, levels = float(spline.t[0]), spline.space.point_shape[0]
    if dims is not None and not (
        isinstance(dims, (list, tuple)) and all(isinstance(n, (int, np.integer)) for n in dims)
    ):
        raise ValidationError(f"dims must be a list of whole numbers, such as [2, 2], not {short_repr(dims)}")
    if dims is not None and prod(dims) != levels:
        raise ValidationError(f"dims {short_repr(dims)} have {prod(dims)} levels, but the curve has {levels}")
    both = None if dims is None else [list(dims), list(dims)]

    def at(t: float) -> Any:
        # QuTiP evaluates at 0 to determine the type of the result.
        if beyond and t < first and t != 0:
            raise ValidationError(f"the time {t} is before the first knot, {first}; start the solver at {first}")
        return qutip.Qobj(hamiltonian(spline, float(t), extrapolate=beyond), dims=both)

    return qutip.QobjEvo(at)
