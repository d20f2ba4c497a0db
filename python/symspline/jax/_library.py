"""What the formulas of `symspline._autodiff` need of JAX."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial, wraps
from typing import Any, ParamSpec, TypeVar

import jax
import jax.numpy as jnp
from jax.scipy.linalg import expm, solve_triangular

from .._autodiff import divided
from .._autodiff.library import Library, hermitian
from .._spaces import Space

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


def promoted(space: Space, *arrays: Any) -> tuple[jax.Array, ...]:
    """Convert points, and arrays of their shape, to one precision."""
    found = [jnp.asarray(array) for array in arrays]
    kind = jnp.result_type(*found, jnp.complex64 if space.dtype.kind == "c" else jnp.float32)
    return tuple(array.astype(kind) for array in found)


def _constant(array: Any, like: Any) -> Any:
    return jnp.asarray(array, like.dtype)


# ---- functions of Hermitian matrices, with derivatives of any order ----


def _of_matrix(function: Callable[..., Any], a: Any) -> Any:
    """Return the function, given by its divided differences, of Hermitian matrices."""
    a = hermitian(a)
    values, vectors = jnp.linalg.eigh(jax.lax.stop_gradient(a))
    return _derivative(function, a, values, vectors, ())


@partial(jax.custom_jvp, nondiff_argnums=(0,))
def _derivative(function: Callable[..., Any], a: Any, values: Any, vectors: Any, directions: Any) -> Any:
    """The derivative of order k in k directions, at a matrix with these eigenvalues and eigenvectors."""
    return divided.derivative(jnp, function, values, vectors, directions)


@_derivative.defjvp
@full_precision
def _next(function: Callable[..., Any], primals: Any, tangents: Any) -> Any:
    a, values, vectors, directions = primals
    da, _, _, changes = tangents
    call = partial(_derivative, function, a, values, vectors)
    moved = call((*directions, da))
    for i, change in enumerate(changes):
        moved += call((*directions[:i], change, *directions[i + 1 :]))
    return call(directions), moved


# ---- the library ----


def _fold(step: Any, start: Any, numbers: Any) -> Any:
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
    logarithm=partial(_of_matrix, partial(divided.logarithm, jnp, _constant)),
    exponential=expm,
    arcs=partial(_of_matrix, lambda *y: divided.arc(jnp, _constant, LIBRARY.arc, *y)),
    solve_lower=partial(solve_triangular, lower=True),
    fold=_fold,
    along=lambda function, x: jax.jvp(function, (x,), (jnp.ones_like(x),)),
    search=jnp.vectorize(partial(jnp.searchsorted, side="right"), signature="(n),(m)->(m)"),
    take_along=jnp.take_along_axis,
)
