"""The propagator of a curve's Hamiltonian."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np

from .._arrays import refuse
from .._core import ValidationError
from .._cubic import CubicSpline
from .._curves.curve import CurveArrays
from .._curves.reduced import span_of
from .._spaces import ComplexGrassmannian, ComplexProjective, Doubles
from .._time import onto_ends
from .._typing import TimesLike
from ..convert._reading import Array, adjoint
from ._generators import generator, quantum_space

STAGES = 8
# For steps of this length, the error of eight stages is a rounding error.
_LONGEST_STEP = 0.4
# Bytes of the linear systems that are solved at once.
_BLOCK = 2**26


def propagator(spline: CubicSpline[Any, Any], x: TimesLike) -> Array:
    """Compute the unitary U(x) that propagates states from the first knot to time x.

    U satisfies iU' = HU, with U = 1 at the first knot. It moves the first point along the curve, and transports the
    orthogonal complement in parallel.

    Parameters
    ----------
    spline : CubicSpline
        Curve, as for `hamiltonian`.
    x : array_like
        Times between the first and the last knot, any shape.

    Returns
    -------
    ndarray, shape ``(*batch axes, *x.shape, n, n)``
        Unitary matrices.

    Raises
    ------
    ValidationError
        If the curve is on another space, or a time is outside the knots.

    Notes
    -----
    The result is accurate up to rounding errors and does not depend on the other times in `x`. It is computed by Gauss
    collocation of order 16 inside every segment, where the curve is analytic; Gauss methods preserve U*U [1]_. For
    states or subspaces in high dimensions, computations are in the span of the data.

    References
    ----------
    .. [1] Hairer, Lubich & Wanner, "Geometric Numerical Integration", 2006, sections II.1.3 and IV.2.1.

    Examples
    --------
    >>> import symspline as ss
    >>> from_up_to_down = ss.CubicSpline([0, 1, 2], [[1, 0], [2**-0.5, 2**-0.5], [0, 1]], "cp:1")
    >>> propagator(from_up_to_down, 2).round(8).real + 0.0
    array([[ 0., -1.],
           [ 1.,  0.]])
    """
    space = quantum_space(spline)
    times, curves = _times(spline, x), int(np.prod(spline._batch))
    if not isinstance(space, (ComplexProjective, ComplexGrassmannian)):
        first = spline.points.reshape(curves, -1, *space.point_shape)[:, :1]
        gates = spline._curve.evaluate(times.ravel(), "point", "raise", False)
        moved: Array = gates.reshape(curves, times.size, *space.point_shape) @ adjoint(first)
        return moved.reshape(*spline._batch, *times.shape, *space.point_shape)
    curve, basis = _in_span(spline)
    edges = _edges(curve).reshape(curves, -1)
    at_edges = _products(_steps(curve, edges[:, :-1], np.diff(edges)))
    flat = np.broadcast_to(times.ravel(), (curves, times.size))
    place = np.stack([np.searchsorted(own, times.ravel(), "right") for own in edges[:, :-1]]) - 1
    start = np.take_along_axis(edges, place, axis=1)
    result = _steps(curve, start, flat - start) @ np.take_along_axis(at_edges, place[..., None, None], axis=1)
    result = _unitary(result)
    if basis is not None:
        # What is orthogonal to all points stays.
        q = basis.reshape(curves, 1, *basis.shape[-2:])
        result = np.eye(q.shape[-2]) + q @ (result - np.eye(q.shape[-1])) @ adjoint(q)
    return np.asarray(result.reshape(*spline._batch, *times.shape, *result.shape[-2:]))


def _in_span(spline: CubicSpline[Any, Any]) -> tuple[CurveArrays, Array | None]:
    """Express a curve in an orthonormal basis of the span of its points and end vectors, on which the Hamiltonian acts.

    Return the curve and the basis; if they span the whole space, return the curve unchanged and None.
    """
    curve: CurveArrays = spline._curve
    width = 1 if isinstance(curve.space, ComplexProjective) else curve.space.point_shape[1]
    if (curve.times.shape[-1] + 2) * width >= curve.space.point_shape[0]:
        return curve, None
    span = span_of(curve.space, curve.points, np.take(curve.velocities, [0, -1], axis=len(curve.batch)))
    return span.inside(curve), span.basis


def _times(spline: CubicSpline[Any, Any], x: TimesLike) -> Doubles:
    """Return the times in the units of the core, the same for all curves."""
    times, per_curve = spline._time_axis.at(x, spline._batch, False)
    if per_curve:
        raise ValidationError(
            "the curves have different first knots; compute the propagator of one curve at a time: "
            "propagator(spline[i], x)"
        )
    first, last = spline._times[..., 0].max(), spline._times[..., -1].min()
    times, _ = onto_ends(times, np.array([first, last]), (), False)
    bad = ~((times >= first) & (times <= last))
    refuse(bad, "x", lambda i: f"is {times[i]}, but must be between the first and last knots, {first} and {last}")
    return times


def _edges(curve: CurveArrays) -> Doubles:
    """Return the knots with enough intermediate times that every step is short, shape batch axes + (m,)."""
    knots = np.broadcast_to(curve.times, (*curve.batch, curve.times.shape[-1]))
    lengths = np.diff(knots)
    inner = knots[..., :-1, None] + lengths[..., None] * np.linspace(0, 1, 9)
    # By rounding the last of them may lie behind the last knot.
    inner = np.minimum(inner, knots[..., 1:, None])
    speed = curve.evaluate(inner.reshape(*knots.shape[:-1], -1), "speed", "raise", True)
    arcs = speed.reshape(inner.shape).max(axis=-1) * lengths
    # The same number in all curves, so that they are one array.
    number = np.maximum(1, np.ceil(arcs.reshape(-1, arcs.shape[-1]).max(axis=0) / _LONGEST_STEP)).astype(int)
    share = np.concatenate([np.arange(n) / n for n in number])
    starts = np.repeat(knots[..., :-1], number, axis=-1) + np.repeat(lengths, number, axis=-1) * share
    return np.concatenate([starts, knots[..., -1:]], axis=-1)


def _products(steps: Array) -> Array:
    """Return the products of the first 0, 1, 2, … of m steps, shape (curves, m + 1, n, n)."""
    products = [np.broadcast_to(np.eye(steps.shape[-1], dtype=complex), steps[:, 0].shape)]
    for i in range(steps.shape[1]):
        products.append(_unitary(steps[:, i] @ products[-1]))
    return np.stack(products, axis=1)


def _steps(curve: CurveArrays, start: Doubles, length: Doubles) -> Array:
    """Return the propagators over short intervals inside a segment, shape (curves, m, n, n)."""
    n = curve.space.point_shape[0]
    block = max(1, _BLOCK // (start.shape[0] * (STAGES * n) ** 2 * 16))
    steps = [_step(curve, start[:, i : i + block], length[:, i : i + block]) for i in range(0, start.shape[1], block)]
    return np.concatenate(steps, axis=1) if steps else np.zeros((*start.shape, n, n), complex)


def _step(curve: CurveArrays, start: Doubles, length: Doubles) -> Array:
    nodes, weights, matrix = gauss()
    times = start[..., None] + length[..., None] * nodes
    point, velocity = (
        curve.evaluate(times.reshape(*curve.batch, -1), quantity, "raise", True) for quantity in ("point", "velocity")
    )
    h = generator(curve.space, point, velocity)
    n = h.shape[-1]
    rates = -1j * length[..., None, None, None] * h.reshape(*times.shape, n, n)
    # Kᵢ = rateᵢ (1 + Σ aᵢⱼ Kⱼ), for all stages at once.
    system = np.eye(STAGES * n) - np.einsum("ij,cmiab->cmiajb", matrix, rates).reshape(
        *start.shape, STAGES * n, STAGES * n
    )
    stages = np.linalg.solve(system, rates.reshape(*start.shape, STAGES * n, n))
    step = np.eye(n) + np.einsum("i,cmiab->cmab", weights, stages.reshape(rates.shape))
    return _unitary(step)


def _unitary(u: Array) -> Array:
    """Return the nearest unitary matrices of nearly unitary ones, by one step of Newton and Schulz."""
    return np.asarray(u @ (3 * np.eye(u.shape[-1]) - adjoint(u) @ u) / 2)


@cache
def gauss() -> tuple[Doubles, Doubles, Doubles]:
    """Return nodes c, weights b and the matrix a of Gauss collocation on [0, 1].

    aᵢⱼ is the integral of the j-th Lagrange polynomial from 0 to cᵢ.
    """
    y, w = np.polynomial.legendre.leggauss(STAGES)
    # In Legendre's polynomials nothing cancels; the integral of Pₖ is (Pₖ₊₁ − Pₖ₋₁) / (2k + 1), of P₀ it is P₁ + P₀.
    p = np.polynomial.legendre.legvander(y, STAGES)
    odd = 2 * np.arange(STAGES) + 1
    integrals = (p[:, 1:] - np.c_[-p[:, 0], p[:, : STAGES - 1]]) / odd
    return (1 + y) / 2, w / 2, integrals @ (p[:, :STAGES] * odd * w[:, None] / 4).T
