"""Quantum control: Hamiltonians that steer a system along a curve, pulses, propagators, geometric phases.

A curve on `ComplexProjective` is a path of pure states, a curve on `ComplexGrassmannian` a path of subspaces (such as
logical states), and a curve on `Unitary` or `SpecialUnitary` a path of gates. The module implements the second step of
§4.2 of the paper. All functions use iψ' = Hψ with ħ = 1; the paper uses the opposite sign.

Examples
--------
>>> import numpy as np, symspline as ss
>>> path = ss.CubicSpline([0, 1, 2], [[1, 0], [0.8, 0.6j], [0.6, 0.8]], "cp:1")
>>> H = ss.quantum.hamiltonian(path, np.linspace(0, 2, 5))
>>> U = ss.quantum.propagator(path, 1.0)
>>> ss.CubicSpline(None, [U @ path.points[0], path.points[1]], "cp:1").length().round(8)
np.float64(0.0)
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from math import prod
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from ._base.arrays import (
    adjoint,
    as_array,
    check_symmetric,
    largest,
    numbers,
    one_of,
    refuse,
    short_repr,
    square_matrices,
    unit_vectors,
)
from ._base.input import times_of
from ._base.time import onto_ends
from ._base.typing import Array, Extrapolate, Number, PointsLike, TimesLike
from ._core import ValidationError
from ._curves.curve import CurveArrays, in_span
from ._curves.options import order_of
from ._curves.reduced import span_of
from ._spaces import ComplexGrassmannian, ComplexProjective, Doubles, Space, SpecialUnitary, Unitary
from ._splines.cubic import AnyCubicSpline
from ._splines.piecewise import check_curve

if TYPE_CHECKING:
    from qutip import QobjEvo

__all__ = [
    "LeastChangeHamiltonian",
    "berry_phase",
    "from_kets",
    "hamiltonian",
    "propagator",
    "pulses",
    "qobjevo",
]


def __dir__() -> list[str]:
    return __all__


_STAGES = 8
# For steps of this length, the error of eight stages is a rounding error.
_LONGEST_STEP = 0.4
# Bytes of the linear systems that are solved at once.
_BLOCK = 2**26
# Degree of the polynomials of `LeastChangeHamiltonian`, and number of quadrature nodes, on every interval.
_DEGREE = 10
# Singular values below this share of the norm of the path belong to matrices that commute with the whole path.
_COMMUTING = 1e-8


# ---- Hamiltonians ----


def hamiltonian(spline: AnyCubicSpline, x: TimesLike, *, nu: int = 0, extrapolate: Extrapolate = None) -> Array:
    r"""Compute the Hamiltonian that drives states along a curve, or its derivative.

    Parameters
    ----------
    spline : CubicSpline
        Curve on `ComplexProjective`, `ComplexGrassmannian`, `Unitary` or `SpecialUnitary`.
    x : array_like
        Times, any shape.
    nu : {0, 1}, default 0
        0 for H, 1 for its derivative H'.
    extrapolate : bool or str, optional
        Extrapolation policy, as for `CubicSpline`. ODE solvers may evaluate H beyond the last knot, which raises an
        error by default. Pass ``"geodesic"`` to continue with the final Hamiltonian.

    Returns
    -------
    ndarray, shape ``(*batch axes, *x.shape, n, n)``
        Hermitian matrices H with iψ' = Hψ.

    Raises
    ------
    ValidationError
        If the curve is on another space, `nu` is not 0 or 1, or a time is outside the knots.

    See Also
    --------
    LeastChangeHamiltonian : The Hamiltonian of the same curve that varies least.

    Notes
    -----
    For states and subspaces, H has the least norm at every time: :math:`H = i[P', P]` for the projector P
    [1]_. Its Frobenius norm is :math:`\sqrt2` times the speed of the curve; for single states its spectral norm is the
    speed. H does not depend on phases or bases of the points. It is as smooth as the velocity, C¹, and
    :math:`\int \lVert H' \rVert^2 \, dt` is twice `CubicSpline.bending_energy`. For gates, :math:`H = iU'U^*` is
    unique. See also §4.2 of the paper.

    Least norm does not imply least change. Other Hamiltonians of the same states may vary less: a constant one drives a
    state along a circle of latitude of the Bloch sphere, while the one of least norm rotates with the state.
    `LeastChangeHamiltonian` computes the one that varies least.

    References
    ----------
    .. [1] Kato, "On the adiabatic theorem of quantum mechanics", 1950.

    Examples
    --------
    >>> import numpy as np, symspline as ss
    >>> from_up_to_down = ss.CubicSpline([0, 1, 2], [[1, 0], [2**-0.5, 2**-0.5], [0, 1]], "cp:1")
    >>> (hamiltonian(from_up_to_down, 0.5) / (np.pi / 4)).round(8) + 0.0
    array([[0.+0.j, 0.-1.j],
           [0.+1.j, 0.+0.j]])
    """
    space = _quantum_space(spline)
    nu = order_of(nu, 1)
    point, vector = (spline(x, nu=order, extrapolate=extrapolate) for order in (0, nu + 1))
    return _generator(space, point, vector)


class LeastChangeHamiltonian:
    r"""Compute the Hamiltonian that varies least among all that drive states along a curve.

    Many Hamiltonians drive the same path of states or subspaces. `hamiltonian` returns the one of least norm at every
    time. This class minimises :math:`\int \lVert H' \rVert^2 \, dt` from the first to the last knot. The result is an
    object that you can call: construction solves a linear boundary value problem, and calls evaluate its solution.

    Parameters
    ----------
    spline : CubicSpline
        Curve on `ComplexProjective`, `ComplexGrassmannian`, `Unitary` or `SpecialUnitary`.

    Raises
    ------
    ValidationError
        If the curve is on another space.

    See Also
    --------
    hamiltonian : The Hamiltonian of least norm.

    Notes
    -----
    The Hamiltonians of a path of projectors P are :math:`i[P', P] + D`, where D is Hermitian and commutes with P. Let U
    be the `propagator` of the first term. In the frame that moves with U, where P is constant, the two terms are
    :math:`m = U^* i[P', P] U`, which has only off-diagonal blocks, and :math:`c = U^* D U`, which has only diagonal
    blocks, and

    .. math:: H' = U (m' + c' - i[m, c]) U^*, \qquad
        \lVert H' \rVert^2 = \lVert m' - i[m, c] \rVert^2 + \lVert c' \rVert^2 .

    The integral is a convex quadratic function of c. Its minimiser satisfies
    :math:`c'' = [m, [m, c]] + i[m, m']` with :math:`c' = 0` at both ends. It is computed as a continuous function,
    polynomial of degree 10 on short intervals, by orthogonal elimination. A constant c that commutes with m at
    all times, such as a multiple of the identity, does not change the integral; these components are zero. For a
    geodesic the result is therefore the constant Hamiltonian of least norm.

    H drives the path up to rounding errors, and is continuously differentiable up to the error of the polynomials. The
    change of H is the cost of [1]_, where the path between given states is free as well. [2]_ characterises the
    Riemannian cubics whose horizontal lifts are cubics in the group.
    On `Unitary` and `SpecialUnitary` :math:`H = iU'U^*` is the only Hamiltonian, and is returned.

    The cost of construction grows with the sixth power of the dimension of the span of the points. On one core it takes
    0.3 s for 100 states in 4 dimensions, and 0.7 s for 12 states in 10 dimensions.

    References
    ----------
    .. [1] Brody, Holm & Meier, "Quantum splines", Phys. Rev. Lett. 109 (2012).
    .. [2] Gay-Balmaz, Holm, Meier, Ratiu & Vialard, "Invariant higher-order variational problems II", J. Nonlinear
       Sci. 22 (2012), arXiv:1112.6380.

    Examples
    --------
    A constant Hamiltonian drives a qubit along a circle of latitude, here at 60° from the pole:

    >>> import numpy as np, symspline as ss
    >>> angle = np.linspace(0, 2 * np.pi, 65)
    >>> circle = np.stack([np.full(65, np.sqrt(0.75)), np.exp(1j * angle) / 2], axis=-1)
    >>> path = ss.CubicSpline(angle, circle, "cp:1", bc_type="periodic")
    >>> H = LeastChangeHamiltonian(path)
    >>> H([0.3, 1.7]).round(4).real + 0.0
    array([[[ 0.5,  0. ],
            [ 0. , -0.5]],
    <BLANKLINE>
           [[ 0.5,  0. ],
            [ 0. , -0.5]]])
    """

    def __init__(self, spline: AnyCubicSpline) -> None:
        space = _quantum_space(spline)
        self._spline = spline
        self._path = None
        if isinstance(space, (ComplexProjective, ComplexGrassmannian)):
            self._path = _Path(spline)
            self._left, self._rates = _least_change(self._path)

    def __call__(self, x: TimesLike, *, nu: int = 0) -> Array:
        """Evaluate the Hamiltonian or its derivative.

        Parameters
        ----------
        x : array_like
            Times between the first and the last knot, any shape.
        nu : {0, 1}, default 0
            0 for H, 1 for its derivative H'.

        Returns
        -------
        ndarray, shape ``(*batch axes, *x.shape, n, n)``
            Hermitian matrices H with iψ' = Hψ.

        Raises
        ------
        ValidationError
            If a time is outside the knots, `nu` is not 0 or 1, or the times of a batch are dates with different first
            knots.
        """
        nu, spline, path = order_of(nu, 1), self._spline, self._path
        times = _times(spline, x)
        h = hamiltonian(spline, x, nu=nu)
        if path is None:
            return h
        frame, interval, share = path.frames(times)
        lengths = np.take_along_axis(np.diff(path.edges), interval, axis=1)
        index = interval[..., None]
        rates = np.take_along_axis(self._rates, index[..., None], axis=1)
        value, slope = _basis_functions(share, lengths)
        c = np.take_along_axis(self._left, index, axis=1) + np.einsum("cxj,cxjd->cxd", value, rates)
        added = path.at_points(frame, c)
        shape = (*spline._batch, *times.shape, *added.shape[-2:])
        added = added.reshape(shape)
        if nu == 1:
            least = hamiltonian(spline, x)
            turning = -1j * (least @ added - added @ least)
            changing = path.at_points(frame, np.einsum("cxj,cxjd->cxd", slope, rates)).reshape(shape)
            added = changing + (turning + adjoint(turning)) / 2
        return np.asarray(h + added)

    def __repr__(self) -> str:
        return f"LeastChangeHamiltonian({self._spline!r})"


class _Path:
    """Propagators of the Hamiltonian of least norm along curves of subspaces, and frames that move with them."""

    def __init__(self, spline: AnyCubicSpline) -> None:
        curve, self.basis = _in_span(spline)
        curves = int(np.prod(spline._batch))
        self.curve, self.edges = curve, _edges(curve).reshape(curves, -1)
        self.at_edges = _products(_steps(curve, self.edges[:, :-1], np.diff(self.edges)))
        n = curve.space.point_shape[0]
        first = curve.points.reshape(curves, curve.points.shape[len(curve.batch)], n, -1)[:, 0]
        self.width = first.shape[-1]
        # Its first columns span the first subspace, and the others the orthogonal complement.
        self.start = np.linalg.qr(first, mode="complete").Q[:, None].astype(complex)
        self.commuting = _block_diagonal(self.width, n)

    def propagators(self, times: Doubles) -> tuple[Array, Any, Doubles]:
        """Return U at times of shape (curves, m), the intervals that contain them, and their positions in these."""
        interval = np.stack([np.searchsorted(e, x, "right") for e, x in zip(self.edges[:, :-1], times, strict=True)])
        interval -= 1
        start = np.take_along_axis(self.edges, interval, axis=1)
        steps = _steps(self.curve, start, times - start)
        u = _unitary(steps @ np.take_along_axis(self.at_edges, interval[..., None, None], axis=1))
        return u, interval, (times - start) / np.take_along_axis(np.diff(self.edges), interval, axis=1)

    def frames(self, times: Doubles) -> tuple[Array, Any, Doubles]:
        """Return what `propagators` returns, for the same times of all curves and with moving frames in place of U."""
        u, interval, share = self.propagators(np.broadcast_to(times.ravel(), (len(self.edges), times.size)))
        return u @ self.start, interval, share

    def at_points(self, frame: Array, coefficients: Array) -> Array:
        """Return the Hermitian matrices with these coefficients in the moving frame, in the coordinates of points."""
        if self.basis is not None:
            frame = self.basis.reshape(len(frame), 1, *self.basis.shape[-2:]) @ frame
        matrix = frame @ np.einsum("cxd,dij->cxij", coefficients, self.commuting) @ adjoint(frame)
        return np.asarray((matrix + adjoint(matrix)) / 2)


def _block_diagonal(k: int, n: int) -> Array:
    """Return an orthonormal basis of the Hermitian matrices with blocks of k and n − k rows, in ⟨A, B⟩ = tr AB."""
    matrices = []
    for i in range(n):
        for j in range(i, n):
            if i < k <= j:
                continue
            for unit in (1,) if i == j else (1, 1j):
                e = np.zeros((n, n), complex)
                e[i, j] = unit
                matrices.append((e + adjoint(e)) / np.sqrt(4 if i == j else 2))
    return np.array(matrices)


def _basis_functions(share: Doubles, lengths: Doubles) -> tuple[Doubles, Doubles]:
    """Return polynomials that are zero at the start of intervals, and their derivatives, which are orthonormal.

    The integral of Legendre's polynomial Pⱼ from −1 is (Pⱼ₊₁ − Pⱼ₋₁) / (2j + 1), and of P₀ it is P₁ + P₀.
    """
    p = np.polynomial.legendre.legvander(2 * share - 1, _DEGREE)
    odd, root = 2 * np.arange(_DEGREE) + 1, np.sqrt(lengths)[..., None]
    before = np.concatenate([-p[..., :1], p[..., : _DEGREE - 1]], axis=-1)
    return root / 2 * (p[..., 1:] - before) / np.sqrt(odd), p[..., :_DEGREE] * np.sqrt(odd) / root


def _least_change(path: _Path) -> tuple[Doubles, Doubles]:
    """Return c at the start of every interval, and its coefficients a in the basis functions of the interval.

    The integral is a sum of |Fa + Gc − w|² + |a|² over the intervals, where c is the value at their ends. Intervals are
    eliminated from left to right. The minimum over a is |L⁻¹(Gc − w)|² with LL* = 1 + FF*, whose condition number is
    small for short intervals, and QR reduces its rows. So the condition number of the problem is not squared. Only the
    last block may be singular, by constants that commute with the whole path.
    """
    curves, d = len(path.edges), len(path.commuting)
    lengths = np.diff(path.edges)
    triangle, right = np.zeros((curves, d, d)), np.zeros((curves, d, 1))
    block, change = _off_diagonal(path)
    upper, lower = path.commuting[:, : path.width, : path.width], path.commuting[:, path.width :, path.width :]
    nodes = np.broadcast_to(_nodes()[0], (curves, _DEGREE))
    eliminated = []
    for j in range(lengths.shape[1]):
        root = np.sqrt(lengths[:, j])[:, None, None]
        value = _basis_functions(nodes, lengths[:, j, None])[0]
        # At the start of the interval, c is less by √h a₀ than at its end.
        value[..., :1] -= root
        # −i[m, c] for every c of the basis.
        turned = _rows(
            -1j * (np.einsum("cqab,dbe->cqaed", block[:, j], upper) - np.einsum("dab,cqbe->cqaed", lower, block[:, j]))
        )
        before = np.concatenate([-root * triangle, np.zeros((curves, d, (_DEGREE - 1) * d))], axis=-1)
        spread = np.einsum("cqj,cqrd->cqrjd", value, turned).reshape(curves, -1, _DEGREE * d)
        f = np.concatenate([before, spread], axis=1)
        outer = np.concatenate(
            [
                np.concatenate([triangle, turned.reshape(curves, -1, d)], axis=1),
                np.concatenate([right, -_rows(change[:, j, ..., None]).reshape(curves, -1, 1)], axis=1),
            ],
            axis=-1,
        )
        factor = np.linalg.cholesky(np.eye(f.shape[1]) + f @ adjoint(f))
        outer = np.linalg.solve(factor, outer)
        eliminated.append(adjoint(f) @ np.linalg.solve(adjoint(factor), outer))
        reduced: Array = np.asarray(np.linalg.qr(outer, mode="r"))
        triangle, right = reduced[:, :d, :d], reduced[:, :d, d:]
    u, s, vt = np.linalg.svd(triangle)
    size = np.sqrt(np.sum(np.abs(block) ** 2, axis=(1, 2, 3, 4)))
    floor = np.maximum(_COMMUTING * size, 1e-12 / np.sqrt(lengths.min(axis=1)))[:, None]
    inverse = np.where(s > floor, 1 / np.maximum(s, floor), 0)
    c = np.swapaxes(vt, -1, -2) @ (inverse[..., None] * (np.swapaxes(u, -1, -2) @ right))
    left, rates = [], []
    for j in reversed(range(lengths.shape[1])):
        rates.append((eliminated[j][..., d] - (eliminated[j][..., :d] @ c)[..., 0]).reshape(curves, _DEGREE, d))
        c = c - np.sqrt(lengths[:, j])[:, None, None] * rates[-1][:, 0, :, None]
        left.append(c[..., 0])
    return np.stack(left[::-1], axis=1), np.stack(rates[::-1], axis=1)


def _off_diagonal(path: _Path) -> tuple[Array, Array]:
    """Return lower left blocks of m and m' at the quadrature nodes, shape (curves, intervals, nodes, n − k, k).

    The sum of squares of m is its integral: nodes have their weights, and the upper right blocks count as well.
    """
    curves, intervals, k = len(path.edges), path.edges.shape[1] - 1, path.width
    nodes, weights = _nodes()
    lengths = np.diff(path.edges)[..., None]
    times = (path.edges[:, :-1, None] + lengths * nodes).reshape(curves, -1)
    frame = path.propagators(times)[0] @ path.start
    point, velocity, acceleration = (
        path.curve.evaluate(times.reshape(*path.curve.batch, -1), quantity, "raise", True)
        for quantity in ("point", "velocity", "acceleration")
    )
    scale = np.sqrt(2 * lengths * weights)[..., None, None]
    block, change = (
        (adjoint(frame) @ _generator(path.curve.space, point, vector).reshape(frame.shape) @ frame)[..., k:, :k]
        for vector in (velocity, acceleration)
    )
    shape = (curves, intervals, len(nodes), *block.shape[-2:])
    return scale * block.reshape(shape), scale * change.reshape(shape)


def _rows(matrices: Array) -> Doubles:
    """Return the real and imaginary parts of (curves, nodes, n − k, k, m) arrays as rows, (curves, nodes, rows, m)."""
    flat = matrices.reshape(*matrices.shape[:2], -1, matrices.shape[-1])
    return np.concatenate([flat.real, flat.imag], axis=-2)


@cache
def _nodes() -> tuple[Doubles, Doubles]:
    """Return nodes and weights of Gauss quadrature on [0, 1]."""
    nodes, weights = np.polynomial.legendre.leggauss(_DEGREE)
    return (1 + nodes) / 2, weights / 2


def qobjevo(spline: AnyCubicSpline, *, dims: Sequence[int] | None = None) -> QobjEvo:
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
    _quantum_space(spline)
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
    both = None
    if dims is not None:
        if not (isinstance(dims, (list, tuple)) and all(isinstance(n, (int, np.integer)) for n in dims)):
            raise ValidationError(f"dims must be a list of whole numbers, such as [2, 2], not {short_repr(dims)}")
        if prod(dims) != levels:
            raise ValidationError(f"dims {short_repr(dims)} have {prod(dims)} levels, but the curve has {levels}")
        both = [list(dims), list(dims)]

    def at(t: float) -> Any:
        # QuTiP evaluates at 0 to determine the type of the result.
        if beyond and t < first and t != 0:
            raise ValidationError(f"the time {t} is before the first knot, {first}; start the solver at {first}")
        return qutip.Qobj(hamiltonian(spline, float(t), extrapolate=beyond), dims=both)

    return qutip.QobjEvo(at)


def _quantum_space(spline: Any) -> Space:
    """Return the space of a curve that has a Hamiltonian, or raise ValidationError."""
    check_curve(spline)
    space: Space = spline.space
    if isinstance(space, (ComplexProjective, ComplexGrassmannian, Unitary, SpecialUnitary)):
        return space
    raise ValidationError(
        f"a curve on {space!r} does not define a Hamiltonian; use ComplexProjective(n) for states, "
        "ComplexGrassmannian(k, n) for subspaces, and Unitary(n) or SpecialUnitary(n) for gates"
    )


def _generator(space: Space, point: Array, vector: Array) -> Array:
    """Return the Hermitian matrix H of least norm with −iH·point = vector, for a horizontal tangent vector."""
    if isinstance(space, ComplexProjective):
        point, vector = point[..., None], vector[..., None]
    half = 1j * vector @ adjoint(point)
    # Hermitian to the last bit; of gates both halves are the same but for rounding.
    h: Array = half + adjoint(half)
    return h / 2 if isinstance(space, (Unitary, SpecialUnitary)) else h


# ---- pulses ----


def pulses(
    spline: AnyCubicSpline,
    edges: TimesLike,
    *,
    kind: Literal["exact", "midpoint"] = "exact",
    operators: ArrayLike | None = None,
) -> Array:
    """Compute piecewise constant Hamiltonians that steer along a curve.

    Parameters
    ----------
    spline : CubicSpline
        Curve, as for `hamiltonian`.
    edges : array_like, shape (m + 1,)
        Increasing times between the first and the last knot. There is one pulse between neighbouring edges.
    kind : {"exact", "midpoint"}, default "exact"
        ``"exact"`` for the generators of the geodesics between edges: the states agree with the curve at every edge, up
        to rounding errors. ``"midpoint"`` for H at the middle of each interval; its error is proportional to the square
        of the spacing.
    operators : array_like, shape (q, n, n), optional
        Hermitian matrices, such as Pauli matrices, in which to express the pulses. None means the matrices themselves.

    Returns
    -------
    ndarray, shape ``(*batch axes, m, n, n)`` or ``(*batch axes, m, q)``
        Hermitian matrices, or their real coefficients cⱼ with H = Σ cⱼ operators[j].

    Raises
    ------
    ValidationError
        If the input does not meet the requirements above, or the operators do not span a pulse. The message names the
        missing components.
    CutLocusError
        If ``kind="exact"``, and an edge is so far from the next that two shortest geodesics join them.

    Examples
    --------
    >>> import symspline as ss
    >>> from_up_to_down = ss.CubicSpline([0, 1, 2], [[1, 0], [2**-0.5, 2**-0.5], [0, 1]], "cp:1")
    >>> paulis = [[[0, 1], [1, 0]], [[0, -1j], [1j, 0]], [[1, 0], [0, -1]]]
    >>> pulses(from_up_to_down, [0, 1, 2], operators=paulis).round(8) + 0.0
    array([[0.        , 0.78539816, 0.        ],
           [0.        , 0.78539816, 0.        ]])
    """
    space = _quantum_space(spline)
    one_of(kind, "kind", "exact", "midpoint")
    n = space.point_shape[0]
    basis = None if operators is None else _operators(operators, n)
    times, spacing = _pulse_edges(spline, edges)
    if kind == "midpoint":
        h = hamiltonian(spline, times[:-1] + (times[1:] - times[:-1]) / 2)
    else:
        first, last = space._neighbours(spline(times))
        h = _generator(space, first, space.log(first, last)) / spacing[..., None, None]
    return h if basis is None else _coefficients(h, basis)


def _pulse_edges(spline: AnyCubicSpline, edges: TimesLike) -> tuple[Array, Array]:
    """Return the edges in their original type, and the intervals between them."""
    times = as_array(times_of(edges, "edges")[0], "edges")
    if times.ndim != 1 or len(times) < 2:
        raise ValidationError(
            f"edges must be a one-dimensional array of at least two times, not of shape {times.shape}"
        )
    spacing = np.diff(spline._time_axis.at(edges, spline._batch, False, spline._times)[0])
    advice = "edges must be strictly increasing"
    refuse(~(spacing > 0), "edges", lambda i: f"is {times[i[-1]]}, and the next is {times[i[-1] + 1]}, but {advice}")
    return times, spacing


def _operators(operators: Any, n: int) -> Array:
    """Return linearly independent Hermitian matrices."""
    basis, tol = square_matrices(operators, "operators")
    if basis.ndim != 3 or basis.shape[1] != n:
        raise ValidationError(f"operators must be of shape (q, {n}, {n}), not {basis.shape}")
    check_symmetric(basis, tol * largest(basis), "operators", "Hermitian", "; pass Hermitian operators")
    columns = _as_columns(basis)
    # The diagonal of R is the norm of the component of every operator outside the span of its predecessors.
    new = np.zeros(len(basis))
    triangle = np.abs(np.diagonal(np.linalg.qr(columns).R))
    new[: len(triangle)] = triangle
    why = "is zero or a linear combination of the previous operators; remove it, so that coefficients are unique"
    refuse(~(new > 1e-10 * np.linalg.norm(columns, axis=0)), "operators", lambda _: why)
    return basis


def _as_columns(matrices: Array) -> Array:
    """Return Hermitian matrices as columns of real numbers, with ⟨A, B⟩ = tr AB."""
    numbers = np.ascontiguousarray(matrices, complex).reshape(len(matrices), -1).view(float)
    return numbers.T


def _coefficients(h: Array, basis: Array) -> Array:
    flat = h.reshape(-1, *h.shape[-2:])
    columns = _as_columns(basis)
    wanted = _as_columns(flat)
    solution = np.linalg.lstsq(columns, wanted, rcond=None)[0]
    left = (wanted - columns @ solution).T.copy().view(complex).reshape(h.shape)
    size, most = np.sqrt(np.sum(np.abs(left) ** 2, axis=(-2, -1))), np.abs(left)
    # Spectral norms of pulses are speeds, so the remainder is compared with the largest norm of all pulses.
    allowed = 1e-9 * max(float(np.linalg.norm(flat, axis=(-2, -1)).max(initial=0)), np.finfo(float).tiny)

    def say(i: Any) -> str:
        j, k = np.unravel_index(most[i].argmax(), most[i].shape)
        return (
            f"cannot be expressed in the operators: {size[i]:.3e} of its norm {np.linalg.norm(h[i]):.3e} remains, "
            f"mostly in the entries [{j}, {k}] and [{k}, {j}] ({left[i][j, k]:.3g}); add operators with these entries"
        )

    refuse(~(size <= allowed), "pulse", say)
    return solution.T.reshape(*h.shape[:-2], len(basis))


# ---- propagators ----


def propagator(spline: AnyCubicSpline, x: TimesLike) -> Array:
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
    The result is accurate up to rounding errors and does not depend on the other times in `x`. It is
    computed by Gauss collocation of order 16 inside every segment, where the curve is analytic; Gauss methods preserve
    :math:`U^*U` [1]_. For states or subspaces in high dimensions, computations are in the span of the data.

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
    space = _quantum_space(spline)
    times, curves = _times(spline, x), int(np.prod(spline._batch))
    if not isinstance(space, (ComplexProjective, ComplexGrassmannian)):
        first = spline.points.reshape(curves, -1, *space.point_shape)[:, :1]
        gates = spline._curve.evaluate(times.ravel(), "point", "raise", False)
        moved: Array = gates.reshape(curves, times.size, *space.point_shape) @ adjoint(first)
        return moved.reshape(*spline._batch, *times.shape, *space.point_shape)
    path = _Path(spline)
    result = path.propagators(np.broadcast_to(times.ravel(), (curves, times.size)))[0]
    basis = path.basis
    if basis is not None:
        # What is orthogonal to all points stays.
        q = basis.reshape(curves, 1, *basis.shape[-2:])
        result = np.eye(q.shape[-2]) + q @ (result - np.eye(q.shape[-1])) @ adjoint(q)
    return np.asarray(result.reshape(*spline._batch, *times.shape, *result.shape[-2:]))


def _in_span(spline: AnyCubicSpline) -> tuple[CurveArrays, Array | None]:
    """Express a curve in an orthonormal basis of the span of its points and end vectors, on which the Hamiltonian acts.

    Return the curve and the basis; if they span the whole space, return the curve unchanged and None.
    """
    curve: CurveArrays = spline._curve
    width = 1 if isinstance(curve.space, ComplexProjective) else curve.space.point_shape[1]
    if (curve.times.shape[-1] + 2) * width >= curve.space.point_shape[0]:
        return curve, None
    span = span_of(curve.space, curve.points, np.take(curve.velocities, [0, -1], axis=len(curve.batch)))
    return in_span(curve, span), span.basis


def _times(spline: AnyCubicSpline, x: TimesLike) -> Doubles:
    """Return the times in the units of the core, the same for all curves."""
    times, per_curve = spline._time_axis.at(x, spline._batch, False)
    if per_curve:
        raise ValidationError(
            "the curves have different first knots, so that times are not shared; pass one curve at a time: spline[i]"
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
    block = max(1, _BLOCK // (start.shape[0] * (_STAGES * n) ** 2 * 16))
    steps = [_step(curve, start[:, i : i + block], length[:, i : i + block]) for i in range(0, start.shape[1], block)]
    return np.concatenate(steps, axis=1) if steps else np.zeros((*start.shape, n, n), complex)


def _step(curve: CurveArrays, start: Doubles, length: Doubles) -> Array:
    nodes, weights, matrix = _gauss()
    times = start[..., None] + length[..., None] * nodes
    point, velocity = (
        curve.evaluate(times.reshape(*curve.batch, -1), quantity, "raise", True) for quantity in ("point", "velocity")
    )
    h = _generator(curve.space, point, velocity)
    n = h.shape[-1]
    rates = -1j * length[..., None, None, None] * h.reshape(*times.shape, n, n)
    # Kᵢ = rateᵢ (1 + Σ aᵢⱼ Kⱼ), for all stages at once.
    system = np.eye(_STAGES * n) - np.einsum("ij,cmiab->cmiajb", matrix, rates).reshape(
        *start.shape, _STAGES * n, _STAGES * n
    )
    stages = np.linalg.solve(system, rates.reshape(*start.shape, _STAGES * n, n))
    step = np.eye(n) + np.einsum("i,cmiab->cmab", weights, stages.reshape(rates.shape))
    return _unitary(step)


def _unitary(u: Array) -> Array:
    """Return the nearest unitary matrices of nearly unitary ones, by one step of Newton and Schulz."""
    return np.asarray(u @ (3 * np.eye(u.shape[-1]) - adjoint(u) @ u) / 2)


@cache
def _gauss() -> tuple[Doubles, Doubles, Doubles]:
    """Return nodes c, weights b and the matrix a of Gauss collocation on [0, 1].

    aᵢⱼ is the integral of the j-th Lagrange polynomial from 0 to cᵢ.
    """
    y, w = np.polynomial.legendre.leggauss(_STAGES)
    # In Legendre's polynomials nothing cancels; the integral of Pₖ is (Pₖ₊₁ − Pₖ₋₁) / (2k + 1), of P₀ it is P₁ + P₀.
    p = np.polynomial.legendre.legvander(y, _STAGES)
    odd = 2 * np.arange(_STAGES) + 1
    integrals = (p[:, 1:] - np.c_[-p[:, 0], p[:, : _STAGES - 1]]) / odd
    return (1 + y) / 2, w / 2, integrals @ (p[:, :_STAGES] * odd * w[:, None] / 4).T


# ---- geometric phases ----


def berry_phase(spline: AnyCubicSpline) -> Number:
    r"""Compute the geometric phase that a state acquires along a closed curve.

    Parameters
    ----------
    spline : CubicSpline
        Closed curve on `ComplexProjective`: its first and last points are the same state up to a phase.

    Returns
    -------
    float or ndarray, shape (*batch axes)
        Phases in (−π, π].

    Raises
    ------
    ValidationError
        If the curve is on another space, or is not closed.

    See Also
    --------
    propagator : The unitary that moves the state and does not add another phase.
    CubicSpline.lift : Evaluate the states that are transported in parallel.

    Notes
    -----
    The phase is :math:`\varphi` in :math:`\psi(T) = e^{i\varphi} \psi(0)` for the horizontal lift ψ, which satisfies
    :math:`\langle\psi | \psi'\rangle = 0` [1]_. It is the limit of :math:`-\arg \prod_k \langle\psi_k |
    \psi_{k+1}\rangle` for states along the curve in any phases. For a qubit it is minus half the solid angle that the
    curve encloses counterclockwise on the Bloch sphere, up to multiples of 2π.

    References
    ----------
    .. [1] B. Simon, Holonomy, the quantum adiabatic theorem, and Berry's phase, Phys. Rev. Lett. 51 (1983).

    Examples
    --------
    A circle of latitude at 60° from the pole encloses the solid angle π:

    >>> import numpy as np, symspline as ss
    >>> angle = np.linspace(0, 2 * np.pi, 65)
    >>> circle = np.stack([np.full(65, np.sqrt(0.75)), np.exp(1j * angle) / 2], axis=-1)
    >>> loop = ss.CubicSpline(angle, circle, "cp:1", bc_type="periodic")
    >>> round(ss.quantum.berry_phase(loop) / np.pi, 4)
    np.float64(-0.5)
    """
    space = _quantum_space(spline)
    if not isinstance(space, ComplexProjective):
        raise ValidationError(f"a Berry phase is that of a curve on ComplexProjective, not on {space!r}.")
    first, last = spline.points[..., 0, :], spline.points[..., -1, :]
    gaps = np.asarray(space.distance(first, last))
    refuse(
        gaps > 1e-8,
        "spline",
        lambda i: f"is not closed: its last point is at distance {gaps[i]:.3g} from the first. Repeat the first point.",
    )
    lifted = spline.lift(spline.t[..., -1:], per_curve=spline.t.ndim > 1)[..., 0, :]
    overlap = np.sum(first.conj() * lifted, axis=-1)
    phase: Number = np.angle(overlap)[()]
    return phase


# ---- states ----


def from_kets(kets: PointsLike) -> Array:
    """Convert kets to points of `ComplexProjective`.

    Parameters
    ----------
    kets : qutip.Qobj, array_like of shape (n, 1), or nested lists of these
        Normalised kets.

    Returns
    -------
    ndarray, shape (..., n)
        Unit vectors.

    Raises
    ------
    ValidationError
        If a ket is not a column of length 1.

    Notes
    -----
    In the other direction, ``qutip.Qobj(point)`` is the ket of a point.

    Examples
    --------
    >>> from_kets([[[1], [0]], [[0.6], [0.8j]]])
    array([[1. +0.j , 0. +0.j ],
           [0.6+0.j , 0. +0.8j]])
    """
    columns, tol = numbers(_full(kets), "kets", 2)
    if columns.shape[-1] != 1:
        raise ValidationError(
            f"kets must be columns, of shape (..., n, 1), not {columns.shape}; for rows, such as bras, pass the adjoint"
        )
    return unit_vectors(columns[..., 0].astype(complex), tol, "kets", "a state")


def _full(kets: PointsLike) -> Any:
    """Return the arrays of objects such as ``Qobj``, which are recognised by their method ``full``."""
    if hasattr(kets, "full"):
        return kets.full()
    if isinstance(kets, (list, tuple)) or (isinstance(kets, np.ndarray) and kets.dtype == object):
        return [_full(ket) for ket in kets]
    return kets
