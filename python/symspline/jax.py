"""Splines as differentiable functions in JAX, on the CPU.

>>> import jax
>>> import jax.numpy as jnp
>>> from symspline.jax import curve
>>> points = jnp.array([[1.0, 0, 0], [0, 1, 0], [0, 0, 1]])
>>> curve(0.5, jnp.arange(3.0), points, "sphere:2").shape
(3,)
>>> jax.grad(lambda t: curve(0.5, t, points, "sphere:2")[0])(jnp.arange(3.0)).shape
(3,)
"""

from __future__ import annotations

from functools import partial
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax.core import ShapedArray
from jax.extend.core import Primitive
from jax.interpreters import ad, batching, mlir

from .adapters import Kinds, Movable, fitted, joined, split
from .curves.ends import ends_in_factors
from .curves.fit import curve_of
from .manifolds import refuse_functions
from .spaces import Product, Space, parts_of
from .spaces import space as space_named

Array = jax.Array


def curve(
    x: Any, t: Any, points: Any, space: Space | str, *, bc_type: Any = "natural", **options: Any
) -> Any:
    """The spline through points at times x: ``CubicSpline(t, points, space, ...)(x)``.

    It has derivatives of first order, forward and backward, with respect to x, t, points and the vectors in
    ``bc_type``; `jax.jit` and `jax.vmap` work. Numbers are computed in double precision, and come back in that of
    the points: most uses want ``jax.config.update("jax_enable_x64", True)``.

    Points and vectors are first moved to the nearest of the space, so that points which an optimiser moved are
    welcome. Where many arrays are one point (projective spaces, Grassmannians), differentiate what does not
    depend on the choice.

    With ``on_failure="ignore"`` or ``"warn"`` a curve that did not converge has values, of the best iterate, but its
    derivatives are NaN: they follow from the C² condition, which it does not fulfil.

    Args:
        x: times, any shape.
        t: knots, shape (N+1,), or (..., N+1).
        points: shape (..., N+1, *point_shape); for a `Product` a tuple.
        space: the space or its name.
        bc_type: as for `CubicSpline`; vectors may be arrays of JAX.
        options: further options of `CubicSpline`.

    Returns:
        Shape batch axes + x.shape + point_shape; for a `Product` a tuple.
    """
    space = space_named(space)
    refuse_functions(space, "derivatives with respect to the data are not made")
    if isinstance(space, Product):
        pieces = zip(
            parts_of(points, space, "points"), space.factors, ends_in_factors(bc_type, space), strict=True
        )
        return tuple(curve(x, t, p, factor, bc_type=bc, **options) for p, factor, bc in pieces)
    kinds, given = split(bc_type)
    points = jnp.asarray(points)
    points = points.astype(jnp.result_type(points, jnp.complex64 if space.dtype.kind == "c" else jnp.float32))
    real = points.real.dtype
    x, t = jnp.asarray(x, real), jnp.asarray(t, real)
    vectors = tuple(None if v is None else jnp.asarray(v, points.dtype) for v in given)
    return _curve(_Fixed(space, kinds, tuple(sorted(options.items()))), x, t, points, vectors)


class _Fixed:
    """What is not differentiated, hashable for JAX."""

    def __init__(self, space: Space, kinds: Kinds, options: tuple[tuple[str, Any], ...]) -> None:
        self.space, self.kinds, self.options = space, kinds, options

    def _key(self) -> Any:
        return self.space, self.kinds, self.options

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Fixed) and self._key() == other._key()

    def __hash__(self) -> int:
        return hash(self._key())

    def fit(self, x: Any, t: Any, points: Any, vectors: Any) -> tuple[Any, Any]:
        """The curve at x, and the velocities at the knots from which its derivatives are made."""
        spline = fitted(t, points, vectors, self.space, self.kinds, dict(self.options))
        return spline(x), spline._solved().velocities

    def movable(self, t: Any, points: Any, velocities: Any, vectors: Any) -> Movable:
        """The curve with velocities that a fit found."""
        points = self.space.project(points)
        wide = velocities.astype(points.dtype)
        return Movable(curve_of(self.space, _doubles(t), [(points, wide)]), joined(self.kinds, vectors))


def _results(fixed: _Fixed, x: Array, points: Array) -> Any:
    space = fixed.space
    batch = points.shape[: points.ndim - len(space.point_shape) - 1]
    return jax.ShapeDtypeStruct((*batch, *x.shape, *space.point_shape), points.dtype)


def _fit(fixed: _Fixed, x: Array, t: Array, points: Array, vectors: Any) -> Any:
    wide = jax.ShapeDtypeStruct(points.shape, points.dtype)

    def call(*inputs: Any) -> Any:
        return tuple(a.astype(points.dtype) for a in fixed.fit(*jax.tree.map(np.asarray, inputs)))

    results = (_results(fixed, x, points), wide)
    return jax.pure_callback(call, results, x, t, points, vectors, vmap_method="sequential")


@partial(jax.custom_jvp, nondiff_argnums=(0,))
def _curve(fixed: _Fixed, x: Array, t: Array, points: Array, vectors: Any) -> Any:
    return _fit(fixed, x, t, points, vectors)[0]


@_curve.defjvp
def _curve_jvp(fixed: _Fixed, primals: Any, tangents: Any) -> Any:
    value, velocities = _fit(fixed, *primals)
    # One vector: its transpose is asked for as a whole, also where some of the inputs are constant.
    change = jnp.concatenate([jnp.ravel(a).astype(value.dtype) for a in jax.tree.leaves(tangents)])
    leaves, tree = jax.tree.flatten((*primals, velocities))
    return value, _push_p.bind(change, *leaves, fixed=fixed, tree=tree)


def _push(change: Any, *leaves: Any, fixed: _Fixed, tree: Any) -> Any:
    """How the curve moves."""
    data = jax.tree.unflatten(tree, leaves)

    def call(change: Any, data: Any) -> Any:
        *inputs, velocities = jax.tree.map(np.asarray, data)
        x, t, points, vectors = inputs
        dx, dt, moved, ends = _apart(np.asarray(change), inputs)
        found = fixed.movable(t, points, velocities, vectors).push(_doubles(x), dx, moved, dt, ends)
        return found.astype(points.dtype)

    return jax.pure_callback(call, _results(fixed, data[0], data[2]), change, data)


def _pull(cotangent: Any, *leaves: Any, fixed: _Fixed, tree: Any) -> Any:
    """The transpose. JAX pairs complex numbers without conjugation."""
    data = jax.tree.unflatten(tree, leaves)

    def call(cotangent: Any, data: Any) -> Any:
        x, t, points, vectors, velocities = jax.tree.map(np.asarray, data)
        made = fixed.movable(t, points, velocities, vectors)
        parts = jax.tree.leaves(made.pull(_doubles(x), np.conj(np.asarray(cotangent))))
        return np.concatenate([np.conj(part).ravel() for part in parts]).astype(points.dtype)

    size = sum(leaf.size for leaf in jax.tree.leaves(data[:-1]))
    return jax.pure_callback(call, jax.ShapeDtypeStruct((size,), data[2].dtype), cotangent, data)


def _doubles(x: Any) -> Any:
    return np.array(x, np.float64)


def _linear(name: str, call: Any) -> Any:
    """A primitive of JAX that is linear in its first argument."""
    primitive = Primitive(name)

    def many(arguments: Any, axes: Any, **fixed: Any) -> Any:
        size = next(a.shape[axis] for a, axis in zip(arguments, axes, strict=True) if axis is not None)
        moved = [
            jnp.broadcast_to(a, (size, *a.shape)) if axis is None else jnp.moveaxis(a, axis, 0)
            for a, axis in zip(arguments, axes, strict=True)
        ]
        return jax.lax.map(lambda one: primitive.bind(*one, **fixed), tuple(moved)), 0

    def shape(*arguments: Any, **fixed: Any) -> Any:
        result = jax.eval_shape(partial(call, **fixed), *arguments)
        return ShapedArray(result.shape, result.dtype)

    primitive.def_impl(call)
    primitive.def_abstract_eval(shape)
    batching.primitive_batchers[primitive] = many
    mlir.register_lowering(primitive, mlir.lower_fun(call, multiple_results=False))
    return primitive


_push_p = _linear("symspline_push", _push)
_pull_p = _linear("symspline_pull", _pull)


def _transpose(cotangent: Any, _: Any, *leaves: Any, fixed: _Fixed, tree: Any) -> Any:
    return [_pull_p.bind(cotangent, *leaves, fixed=fixed, tree=tree), *(None for _ in leaves)]


ad.primitive_transposes[_push_p] = _transpose


def _apart(change: Any, inputs: Any) -> Any:
    """One vector as changes of all inputs."""
    leaves, tree = jax.tree.flatten(inputs)
    ends = np.cumsum([leaf.size for leaf in leaves])
    pieces = np.split(change, ends[:-1])
    made = [
        (piece if np.iscomplexobj(leaf) else piece.real).reshape(leaf.shape)
        for piece, leaf in zip(pieces, leaves, strict=True)
    ]
    return jax.tree.unflatten(tree, made)
