"""Hamiltonians for solvers of differential equations."""

from __future__ import annotations

from collections.abc import Sequence
from math import prod
from typing import Any

import numpy as np

from .._core import ValidationError
from ..arrays import shown
from ..spline import CubicSpline
from .generators import hamiltonian, quantum_space


def qobjevo(spline: CubicSpline, dims: Sequence[int] | None = None) -> Any:
    """The Hamiltonian of a curve as a ``QobjEvo`` for QuTiP's solvers, with ħ = 1: of times in ns in rad/ns.

    Solvers try times past the last one; where the curve raises an error outside its knots, the Hamiltonian goes on
    as it was at the end, and there is none before the first one. For SciPy's, do the same with
    ``hamiltonian(spline, t, extrapolate="geodesic")``. States come to the given ones up to a phase.

    Args:
        spline: one curve, as for `hamiltonian`, whose times are numbers.
        dims: the levels of each part of a composite system, such as ``[2, 2]`` of two qubits; None for a single one.

    Returns:
        A ``qutip.QobjEvo``.

    Raises:
        ImportError: QuTiP is not installed.
        ValidationError: the curve is in another space, one of a batch, its times are dates, or ``dims`` are of another
            number of levels; and, of the result, a time before the first one.
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
    first, levels = float(spline.t[0]), spline.space.point_shape[0]
    if dims is not None and not (
        isinstance(dims, (list, tuple)) and all(isinstance(n, (int, np.integer)) for n in dims)
    ):
        raise ValidationError(f"dims must be a list of whole numbers, such as [2, 2], not {shown(dims)}")
    if dims is not None and prod(dims) != levels:
        raise ValidationError(f"dims {shown(dims)} are {prod(dims)} levels, but the curve has {levels}")
    both = None if dims is None else [list(dims), list(dims)]

    def at(t: float) -> Any:
        # QuTiP asks for 0 to learn what it gets.
        if beyond and t < first and t != 0:
            raise ValidationError(f"the curve begins at {first}, and the solver asks for {t}: begin there")
        return qutip.Qobj(hamiltonian(spline, float(t), extrapolate=beyond), dims=both)

    return qutip.QobjEvo(at)
