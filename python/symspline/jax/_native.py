"""Fits and curves written in JAX: many curves of equal length, a fixed number of quasi-Newton steps.

`LIBRARY` has what the formulas of `symspline._autodiff` need of JAX.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial, wraps
from typing import ParamSpec, TypeVar, overload

import jax
import jax.numpy as jnp
from jax.scipy.linalg import expm, solve_triangular
from numpy.typing import ArrayLike

from .._autodiff import curves
from .._autodiff.condition import Chain, PoseChain, PositiveChain, Problem, SphereChain, cyclic_reduction
from .._autodiff.library import Library, Tensor, adjoint, divided_arc, divided_logarithm, hermitian, matrix_derivative
from .._autodiff.models import turned
from .._base.arrays import short_repr
from .._base.typing import AnyFunction, CubicBCType, PointsLike
from .._core import ValidationError
from .._spaces import AnySpace, Product, Space

_P = ParamSpec("_P")
_T = TypeVar("_T")


def full_precision(function: Callable[_P, _T]) -> Callable[_P, _T]:
    """Decorate a function that multiplies matrices.

    On a GPU, JAX rounds single-precision factors to 10 bits (TF32) by default, which leaves errors of 1e-3 in a curve.
    """

    @wraps(function)
    def wrapped(*args: _P.args, **kwargs: _P.kwargs) -> _T:
        with jax.default_matmul_precision("highest"):
            return function(*args, **kwargs)

    return wrapped


def promoted(space: Space, *arrays: Tensor) -> tuple[jax.Array, ...]:
    """Convert points, and arrays of their shape, to one precision."""
    converted = [jnp.asarray(array) for array in arrays]
    kind = jnp.result_type(*converted, jnp.complex64 if space.dtype.kind == "c" else jnp.float32)
    return tuple(array.astype(kind) for array in converted)


def _constant(array: Tensor, like: Tensor) -> Tensor:
    return jnp.asarray(array, like.dtype)


# ---- functions of Hermitian matrices, with derivatives of any order ----


def _of_matrix(function: Callable[..., Tensor], a: Tensor) -> Tensor:
    """Return the function, given by its divided differences, of Hermitian matrices."""
    a = hermitian(a)
    values, vectors = jnp.linalg.eigh(jax.lax.stop_gradient(a))
    return _derivative(function, a, values, vectors, ())


@partial(jax.custom_jvp, nondiff_argnums=(0,))
def _derivative(
    function: Callable[..., Tensor], a: Tensor, values: Tensor, vectors: Tensor, directions: Tensor
) -> Tensor:
    """The derivative of order k in k directions, at a matrix with these eigenvalues and eigenvectors."""
    return matrix_derivative(jnp, function, values, vectors, directions)


@_derivative.defjvp
@full_precision
def _next(function: Callable[..., Tensor], primals: Tensor, tangents: Tensor) -> Tensor:
    a, values, vectors, directions = primals
    da, _, _, changes = tangents
    call = partial(_derivative, function, a, values, vectors)
    moved = call((*directions, da))
    for i, change in enumerate(changes):
        moved += call((*directions[:i], change, *directions[i + 1 :]))
    return call(directions), moved


# ---- the library ----


def _fold(step: AnyFunction, start: Tensor, numbers: Tensor) -> Tensor:
    # One compiled step, where a loop of Python would compile as many as there are numbers.
    return jax.lax.scan(
        lambda value, number: (step(value, number), None), start, jnp.asarray(numbers, start.real.dtype)
    )[0]


LIBRARY: Library = Library(
    name="JAX",
    module="jax",
    general=True,
    xp=jnp,
    array=lambda value, name, like: jnp.asarray(value, like.dtype),
    promote=promoted,
    constant=_constant,
    logarithm=partial(_of_matrix, partial(divided_logarithm, jnp, _constant)),
    exponential=expm,
    arcs=partial(_of_matrix, lambda *y: divided_arc(jnp, _constant, LIBRARY.arc, *y)),
    solve_lower=partial(solve_triangular, lower=True),
    fold=_fold,
    along=lambda function, x: jax.jvp(function, (x,), (jnp.ones_like(x),)),
    search=jnp.vectorize(partial(jnp.searchsorted, side="right"), signature="(n),(m)->(m)"),
    take_along=jnp.take_along_axis,
)


# ---- fits and curves ----


@overload
def evaluate(
    t: ArrayLike, points: PointsLike, velocities: PointsLike, space: Space | str, x: ArrayLike, *, nu: int = 0
) -> jax.Array: ...


@overload
def evaluate(
    t: ArrayLike, points: PointsLike, velocities: PointsLike, space: Product, x: ArrayLike, *, nu: int = 0
) -> tuple[jax.Array, ...]: ...


@full_precision
def evaluate(t: Tensor, points: Tensor, velocities: Tensor, space: AnySpace | str, x: Tensor, *, nu: int = 0) -> Tensor:
    """Evaluate curves with given knots, points and velocities, in JAX alone.

    This is `symspline.evaluate` written in JAX. It runs on the device of JAX and has derivatives of any order, in
    forward and reverse mode, with respect to all arrays.

    Parameters
    ----------
    t : array, shape (n,) or (..., n)
        Knots.
    points : array, shape (..., n, *space.point_shape)
        Points; for a `Product` a tuple.
    velocities : array, shape of points
        Velocities, such as those of `symspline.jax.fit` or `symspline.fit`.
    space : Space or str
        Space or its name: ``r``, ``sphere``, ``hyperbolic``, ``rp``, ``cp``, ``gr``, ``cgr``, ``spd``, ``hpd``,
        ``so:2``, ``so:3``, ``se:2``, ``se:3`` or products of them.
    x : array
        Times, any shape.
    nu : {0, 1, 2}, default 0
        0 for points, 1 for the velocity γ', 2 for the covariant acceleration ∇γ'.

    Returns
    -------
    array, shape ``(*batch axes, *x.shape, *space.point_shape)``
        Values; for a `Product` a tuple. On projective spaces and Grassmannians the representatives may differ from
        those of the compiled core.

    Raises
    ------
    ValidationError
        If the space is not supported in JAX, or shapes do not match.

    Notes
    -----
    Between two knots the curve is the cubic Bézier curve of geodesics, (8) of the paper. Derivatives are finite also
    where points coincide, velocities are zero or eigenvalues repeat.

    Points are first projected onto the manifold and velocities onto the tangent spaces, so derivatives are tangent as
    well. Values are not validated: at times outside the knots, and for matrices far off the space, results are NaN.

    Examples
    --------
    >>> import jax
    >>> import jax.numpy as jnp
    >>> from symspline.jax import evaluate
    >>> p = jnp.array([[1.0, 0, 0], [0, 1, 0]])
    >>> curve = lambda x: evaluate(jnp.arange(2.0), p, jnp.zeros((2, 3)), "sphere:2", x)
    >>> jax.jit(jax.jacfwd(jax.jacfwd(curve)))(0.5).shape
    (3,)
    """
    return curves.evaluate(LIBRARY, t, points, velocities, space, x, nu)


@full_precision
def fit(
    t: ArrayLike, points: ArrayLike, space: Space | str, *, bc_type: CubicBCType = "natural", steps: int = 40
) -> tuple[jax.Array, jax.Array]:
    """Compute the velocities of C² splines through points, in JAX alone.

    This is `symspline.fit` written in JAX. It runs on the device of JAX and has derivatives of any order, in forward
    and reverse mode.

    Parameters
    ----------
    t : array, shape (n,) or (..., n)
        Knots.
    points : array, shape (..., n, *space.point_shape)
        Points, which are first projected onto the manifold.
    space : Space or str
        ``r:n``, ``sphere:n``, ``spd:n``, ``hpd:n``, ``so:2``, ``so:3``, ``se:2`` or ``se:3``.
    bc_type : {"natural", "clamped"} or pair, default "natural"
        End conditions. A pair has one of these words or ``(1, velocity)`` for either end.
    steps : int, default 40
        Number of quasi-Newton steps, the same for all curves.

    Returns
    -------
    velocities : array, shape of points
        Velocities at the knots.
    residual : array, shape batch axes
        Relative residual of every curve: the change of a velocity by one more sweep of (17) of the paper, divided by
        the largest velocity.

    Raises
    ------
    ValidationError
        If the space or the end conditions are not supported, or shapes do not match.

    Notes
    -----
    Each step solves a tridiagonal system in frames that are transported in parallel along the points. In flat space one
    step gives the spline. A step divides the error by about 30 for points .3 apart (half an angle, for rotations), by 6
    for .8, and by 3 for 1.2. Check the residual. For points farther apart than about 1.5 use `symspline.fit`, which has
    other solvers.

    Derivatives use the implicit function theorem: the same steps are applied to the linearised equation, without
    storing the steps of the fit.

    Examples
    --------
    >>> import jax.numpy as jnp
    >>> from symspline.jax import fit
    >>> u, residual = fit(jnp.arange(3.0), jnp.eye(3), "sphere:2")
    >>> u.shape, residual.shape
    ((3, 3), ())
    """
    if isinstance(steps, bool) or not isinstance(steps, int) or steps < 1:
        raise ValidationError(f"steps must be a whole number from 1 on, not {short_repr(steps)}")
    problem, leave = curves.problem_of(LIBRARY, t, points, curves.named(LIBRARY, space), bc_type)
    u = _velocities(problem.chain, problem.given, steps, problem[2:])
    change = problem.sizes(jax.lax.stop_gradient(problem.residual(u))) / problem.weights()[1]
    largest = jnp.max(problem.sizes(jax.lax.stop_gradient(u)), axis=0)
    return leave(u), jax.lax.stop_gradient(jnp.max(change, axis=0) / jnp.where(largest > 0, largest, 1.0))


@partial(jax.custom_jvp, nondiff_argnums=(0, 1, 2))
def _velocities(chain: Chain, given: tuple[bool, bool], steps: int, data: Tensor) -> Tensor:
    problem = Problem(chain, given, *data)
    step = _step_of(problem)

    def further(u: Tensor, _: Tensor) -> Tensor:
        return u + step(problem.residual(u)), None

    start = jnp.zeros((len(problem.p), *problem.first.shape), problem.first.dtype)
    return jax.lax.scan(further, start, None, length=steps)[0]


@_velocities.defjvp
@full_precision
def _velocities_jvp(chain: Chain, given: tuple[bool, bool], steps: int, primals: Tensor, tangents: Tensor) -> Tensor:
    """Differentiate F(u, data) = 0: du = −F_u⁻¹ F_data, by the same steps."""
    (data,), (change,) = primals, tangents
    u = _velocities(chain, given, steps, data)
    problem = Problem(chain, given, *data)
    # A tangent vector leaves the tangent space when its point moves.
    normal = chain.normal_change(problem.p, u, Problem(chain, given, *change).p)
    ahead = jax.jvp(lambda u, data: Problem(chain, given, *data).residual(u), (u, data), (normal, change))[1]
    _, linear = jax.linearize(problem.residual, u)
    step = _step_of(problem)

    def further(du: Tensor, _: Tensor) -> Tensor:
        return du + step(linear(du) + ahead), None

    du = jax.lax.scan(further, jnp.zeros_like(u), None, length=steps)[0]
    return u, du + normal


def _step_of(problem: Problem) -> Callable[[Tensor], Tensor]:
    """Return the quasi-Newton step from residuals to velocities.

    The step solves a tridiagonal system in frames that are transported in parallel from node to node. The choice of
    frames does not affect the solution, so the step is not differentiated.
    """
    still = problem._replace(h=jax.lax.stop_gradient(problem.h))
    diagonals = still.weights()
    to_first, from_first = _transport(problem.chain, jax.lax.stop_gradient(problem.p))

    def step(rows: Tensor) -> Tensor:
        moved = to_first(rows)
        flat = moved.reshape(*moved.shape[: moved.ndim - problem.chain.model.axes], -1)
        return from_first(_solved(diagonals, flat).reshape(moved.shape))

    return step


def _solved(diagonals: tuple[Tensor, Tensor, Tensor], rows: Tensor) -> Tensor:
    """Solve tridiagonal systems for rows of shape (n, *batch, k)."""

    def lapack(diagonals: Tensor, rows: Tensor) -> Tensor:
        if diagonals[1].size == len(rows):
            # The knots of all curves are the same.
            columns = rows.reshape(len(rows), -1)
            lower, main, upper = (a.reshape(-1).astype(rows.dtype) for a in diagonals)
            return jax.lax.linalg.tridiagonal_solve(lower, main, upper, columns).reshape(rows.shape)
        lower, main, upper = (jnp.moveaxis(a, 0, -1).astype(rows.dtype) for a in diagonals)
        solved = jax.lax.linalg.tridiagonal_solve(lower, main, upper, jnp.moveaxis(rows, 0, -2))
        return jnp.moveaxis(solved, -2, 0)

    def reduction(diagonals: Tensor, rows: Tensor) -> Tensor:
        lower, main, upper = (a[..., None, None] for a in diagonals)
        return cyclic_reduction(jnp, _solve_scalars, lower, main, upper, rows[..., None, :])[..., 0, :]

    # On a GPU `tridiagonal_solve` takes one column of all curves after another: 10 000 curves take seconds.
    return jax.lax.platform_dependent(diagonals, rows, cpu=lapack, default=reduction)


def _solve_scalars(diagonal: Tensor, *columns: Tensor) -> Tensor:
    return [a / diagonal for a in columns]


def _transport(chain: Chain, p: Tensor) -> tuple[Callable[[Tensor], Tensor], Callable[[Tensor], Tensor]]:
    """Return the parallel transport of vectors along the nodes to the first one, and its inverse."""
    if isinstance(chain, SphereChain):
        frames = _rotations(p)
        return lambda v: _times(jnp.swapaxes(frames, -1, -2), v), lambda v: _times(frames, v)
    if isinstance(chain, PositiveChain):
        # In frames L the transport is the unitary factor of L_p⁻¹ L_q.
        left, _, right = jnp.linalg.svd(LIBRARY.solve_lower(p[:-1], p[1:]))
        frames = _products(adjoint(left @ right))
        return lambda v: adjoint(frames) @ v @ frames, lambda v: frames @ v @ adjoint(frames)
    if isinstance(chain, PoseChain):
        # A geodesic exp(sd) transports by Ad(exp(−sd/2)) in the frame of the body.
        columns = _adjoint_columns(chain, chain.model.exp(_at_rest(p[1:]), -0.5 * chain.model.log(p[:-1], p[1:])))
        frames = _products(columns)
        inverse = jnp.linalg.inv(frames)
        return lambda v: _times(inverse, v), lambda v: _times(frames, v)
    return lambda v: v, lambda v: v


def _times(matrices: Tensor, vectors: Tensor) -> Tensor:
    return (matrices @ vectors[..., None])[..., 0]


def _products(steps: Tensor) -> Tensor:
    """Return the products of matrices from the first node to each node."""
    one = jnp.broadcast_to(jnp.eye(steps.shape[-1], dtype=steps.dtype), steps[:1].shape)
    return jax.lax.associative_scan(lambda x, y: y @ x, jnp.concatenate([one, steps]))


def _rotations(p: Tensor) -> Tensor:
    """Return the rotations that transport tangent vectors at the first point along the polygon to each point."""
    a, b = p[:-1], p[1:]
    s = a + b
    scale = 1 + jnp.sum(a * b, axis=-1)
    outer = s[..., :, None] * s[..., None, :] / scale[..., None, None]
    return _products(jnp.eye(p.shape[-1], dtype=p.dtype) - outer + 2 * b[..., :, None] * a[..., None, :])


def _at_rest(p: Tensor) -> Tensor:
    """Return poses without rotation and translation."""
    return jnp.zeros_like(p).at[..., 0].set(1.0)


def _adjoint_columns(chain: Chain, poses: Tensor) -> Tensor:
    """Return the matrices of Ad, which maps the twist (ω, v) to (Rω, Rv + x × Rω)."""
    quaternion, place = poses[..., None, :4], poses[..., None, 4:]
    twists = jnp.eye(6, dtype=poses.dtype)
    turn = turned(chain.lib, quaternion, twists[:, :3])
    ahead = turned(chain.lib, quaternion, twists[:, 3:]) + jnp.cross(place, turn)
    return jnp.swapaxes(jnp.concatenate([turn, ahead], axis=-1), -1, -2)
