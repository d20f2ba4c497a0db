"""Hamiltonians for solvers of differential equations."""

from __future__ import annotations

from typing import Any

from .._core import ValidationError
from ..spline import CubicSpline
from .generators import hamiltonian, quantum_space


def qobjevo(spline: CubicSpline) -> Any:
    """The Hamiltonian of a curve as a ``QobjEvo`` for QuTiP's solvers.

    Solvers try times past the last one; where the curve raises an error outside its knots, the Hamiltonian goes on
    as it was at the end. For SciPy's, do the same with ``hamiltonian(spline, t, extrapolate="geodesic")``.

    Args:
        spline: one curve, as for `hamiltonian`, whose times are numbers.

    Returns:
        A ``qutip.QobjEvo``.

    Raises:
        ImportError: QuTiP is not installed.
        ValidationError: the curve is in another space, one of a batch, or its times are dates.
    """
    quantum_space(spline)
    if spline._batch:
        raise ValidationError(f"{spline!r} is a batch; a QobjEvo is for one curve: qobjevo(spline[0])")
    if spline._clock.dates:
        raise ValidationError(
            "times of a QobjEvo are numbers, and those of this curve are dates; fit it in seconds"
        )
    try:
        import qutip
    except ImportError:
        raise ImportError("a QobjEvo needs QuTiP; install it with: pip install qutip") from None
    beyond = "geodesic" if spline._outside == "raise" else None
    return qutip.QobjEvo(lambda t: qutip.Qobj(hamiltonian(spline, float(t), extrapolate=beyond)))
