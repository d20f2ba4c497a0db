"""The compiled core as primitives of JAX: fits, how curves move with their data, and the transpose of that.

Each is one call of the core, also under `jax.vmap`, however often. Every array has the axes of `jax.vmap` in front, of
size one where it does not depend on them, so that what all curves share is handed over once.
"""

from __future__ import annotations

import math
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax.core import ShapedArray
from jax.extend.core import Primitive
from jax.interpreters import ad, batching, mlir

from ..adapters import Kinds, fitted, joined
from ..curves.curve import Curve
from ..curves.derivatives import places
from ..curves.fit import curve_of
from ..spaces import Space
from .layout import Layout, Shape, together


class Fixed:
    """What is not differentiated, hashable for JAX."""

    def __init__(self, space: Space, kinds: Kinds, options: tuple[tuple[str, Any], ...]) -> None:
        self.space, self.kinds, self.options = space, kinds, options

    def _key(self) -> Any:
        return self.space, self.kinds, self.options

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Fixed) and self._key() == other._key()

    def __hash__(self) -> int:
        return hash(self._key())


# ---- the spline ----


def _fit_shapes(x: Any, t: Any, points: Any, *vectors: Any, fixed: Fixed, lead: int, orders: Shape) -> Any:
    layout = _layout(fixed, lead, x, t, points, vectors)
    values = _values(fixed, lead, layout, x, points)
    return (*(values for _ in orders), ShapedArray((*layout.curves, *points.shape[lead:]), points.dtype))


def _fit(x: Any, t: Any, points: Any, *vectors: Any, fixed: Fixed, lead: int, orders: Shape) -> Any:
    """The curves at x, γ and its derivatives of the given orders, and the velocities at the knots from which
    derivatives in the data are made."""
    layout, core = _layout(fixed, lead, x, t, points, vectors), len(fixed.space.point_shape)
    ends = _ends(fixed.kinds, [layout.data(v, core) for v in vectors])
    data = layout.knots(t), layout.data(points, core + 1)
    spline = fitted(*data, ends, fixed.space, fixed.kinds, dict(fixed.options))
    at, per_curve = layout.places(x)
    found = [layout.outward(spline(at, nu, per_curve=per_curve)) for nu in orders]
    solved = spline._solved().velocities.reshape(*layout.curves, *points.shape[lead:])
    return tuple(np.asarray(a, points.dtype) for a in (*found, solved))


def _layout(fixed: Fixed, lead: int, x: Any, t: Any, points: Any, vectors: Any, *more: Shape) -> Layout:
    curves = together(*(a.shape[:lead] for a in (t, points, *vectors)), *more)
    batch = points.shape[lead : points.ndim - len(fixed.space.point_shape) - 1]
    return Layout(curves, x.shape[:lead], batch)


def _values(fixed: Fixed, lead: int, layout: Layout, x: Any, points: Any) -> ShapedArray:
    full = together(layout.curves, layout.times)
    shape = (*full, *layout.batch, *x.shape[lead:], *fixed.space.point_shape)
    return ShapedArray(shape, points.dtype)


def _ends(kinds: Kinds, vectors: Any) -> tuple[Any, Any]:
    """Vectors for both ends, None where none is given."""
    left = iter(vectors)
    first, last = (
        None if isinstance(kind, str) else next(left)
        for kind in ((kinds, kinds) if isinstance(kinds, str) else kinds)
    )
    return first, last


# ---- how it moves with its data ----


def _push_shape(
    change: Any, x: Any, *data: Any, fixed: Fixed, lead: int, nu: int, moving: tuple[bool, ...]
) -> Any:
    layout = _layout_of_changes(fixed, lead, x, data, change.shape[:lead])
    return _values(fixed, lead, layout, x, data[1])


def _push(change: Any, x: Any, *data: Any, fixed: Fixed, lead: int, nu: int, moving: tuple[bool, ...]) -> Any:
    """How γ, or a derivative of it seen from the moving point, moves with the data.

    Args:
        change: of those of t, points and vectors that move, all in one vector.
        data: t, points, vectors, and the velocities that a fit found.
    """
    layout = _layout_of_changes(fixed, lead, x, data, change.shape[:lead])
    curve, at, bc_type = _moved(fixed, layout, nu, x, data)
    shapes = [a.shape[lead:] for a, moves in zip(data, moving, strict=False) if moves]
    pieces = iter(_apart(change, lead, shapes))
    knots, steps, *ends = (
        layout.data(_like(next(pieces), array), core) if moves else None
        for array, core, moves in zip(data, _cores(fixed, data), moving, strict=False)
    )
    found = curve.push(at, bc_type, steps, knots, _ends(fixed.kinds, ends))
    return np.asarray(layout.outward(found), data[1].dtype)


def _pull_shape(
    cotangent: Any,
    x: Any,
    *data: Any,
    fixed: Fixed,
    lead: int,
    nu: int,
    moving: tuple[bool, ...],
    kept: Shape,
) -> Any:
    sizes = (math.prod(a.shape[lead:]) for a, moves in zip(data, moving, strict=False) if moves)
    return ShapedArray((*kept, sum(sizes)), data[1].dtype)


def _pull(
    cotangent: Any,
    x: Any,
    *data: Any,
    fixed: Fixed,
    lead: int,
    nu: int,
    moving: tuple[bool, ...],
    kept: Shape,
) -> Any:
    """The transpose. JAX pairs complex numbers without conjugation.

    Args:
        kept: sizes of the axes of `jax.vmap` along which gradients are wanted one by one; 1 for their sum.
    """
    layout = _layout_of_changes(fixed, lead, x, data, kept)
    curve, at, bc_type = _moved(fixed, layout, nu, x, data)
    full = together(layout.curves, layout.times)
    wide = np.broadcast_to(cotangent, (*full, *cotangent.shape[lead:]))
    found = curve.pull(at, bc_type, np.conj(layout.inward(wide)))
    parts = (found.t, found.points, *(end for end in found.ends if end is not None))
    each = zip(parts, _cores(fixed, data), data, moving, strict=False)
    rows = [
        layout.gradient(np.conj(part), core, kept, array.shape[lead:]).reshape(*kept, -1)
        for part, core, array, moves in each
        if moves
    ]
    return np.concatenate(rows, axis=-1).astype(data[1].dtype)


def _layout_of_changes(fixed: Fixed, lead: int, x: Any, data: Any, changes: Shape) -> Layout:
    t, points, *rest = data
    return _layout(fixed, lead, x, t, points, rest, changes)


def _cores(fixed: Fixed, data: Any) -> list[int]:
    """How many axes knots, points and vectors have behind those of a batch."""
    core = len(fixed.space.point_shape)
    return [1, core + 1, *(core for _ in data[2:])]


def _moved(fixed: Fixed, layout: Layout, nu: int, x: Any, data: Any) -> tuple[Curve, Any, Any]:
    """Curves with velocities that a fit found, places on them, and their end conditions."""
    space, core = fixed.space, len(fixed.space.point_shape)
    t, points, *vectors, velocities = data
    points = space.project(np.ascontiguousarray(layout.data(points, core + 1)))
    found = np.array(layout.data(velocities, core + 1), points.dtype)
    knots = np.array(layout.data(t, 1), np.float64)
    at, per_curve = layout.places(np.asarray(x))
    curve = curve_of(space, knots, [(points, found)])
    batch = points.shape[: points.ndim - core - 1]
    bc_type = joined(fixed.kinds, _ends(fixed.kinds, [layout.data(v, core) for v in vectors]))
    return curve, places(knots, batch, at, per_curve, nu), bc_type


def _apart(change: Any, lead: int, shapes: Any) -> Any:
    """One vector as several arrays."""
    ends = np.cumsum([math.prod(shape) for shape in shapes])
    pieces = np.split(change, ends[:-1], axis=-1)
    return [piece.reshape(*change.shape[:lead], *s) for piece, s in zip(pieces, shapes, strict=True)]


def _like(change: Any, array: Any) -> Any:
    """Changes of real arrays are real."""
    return change if np.iscomplexobj(array) else change.real


# ---- what JAX must know of them ----


def _primitive(name: str, call: Any, shapes: Any, multiple: bool = False) -> Any:
    """A primitive that is one call of the core."""
    primitive = Primitive(name)
    primitive.multiple_results = multiple

    def now(*arguments: Any, **fixed: Any) -> Any:
        return jax.tree.map(jnp.asarray, call(*map(np.asarray, arguments), **fixed))

    def later(*arguments: Any, **fixed: Any) -> Any:
        def back(*arrays: Any) -> Any:
            return call(*map(np.asarray, arrays), **fixed)

        made = jax.tree.map(lambda a: jax.ShapeDtypeStruct(a.shape, a.dtype), shapes(*arguments, **fixed))
        return jax.pure_callback(back, made, *arguments)

    primitive.def_impl(now)
    primitive.def_abstract_eval(shapes)
    mlir.register_lowering(primitive, mlir.lower_fun(later, multiple_results=multiple))
    return primitive


def _in_front(arguments: Any, axes: Any) -> tuple[list[Any], int]:
    """Arguments with one more axis in front, and its size."""
    size = next(a.shape[i] for a, i in zip(arguments, axes, strict=True) if i is not None)
    return [
        jnp.expand_dims(a, 0) if i is None else jnp.moveaxis(a, i, 0)
        for a, i in zip(arguments, axes, strict=True)
    ], size


fit_p = _primitive("symspline_fit", _fit, _fit_shapes, multiple=True)
push_p = _primitive("symspline_push", _push, _push_shape)
pull_p = _primitive("symspline_pull", _pull, _pull_shape)


def _fit_many(arguments: Any, axes: Any, *, lead: int, **fixed: Any) -> Any:
    moved, _ = _in_front(arguments, axes)
    *values, velocities = fit_p.bind(*moved, lead=lead + 1, **fixed)
    if any(axis is not None for axis in axes[1:]):
        return (*values, velocities), (0,) * (len(values) + 1)
    # Only times differ: there is one curve.
    return (*values, jnp.squeeze(velocities, 0)), (*(0 for _ in values), None)


def _push_many(arguments: Any, axes: Any, *, lead: int, **fixed: Any) -> Any:
    moved, _ = _in_front(arguments, axes)
    return push_p.bind(*moved, lead=lead + 1, **fixed), 0


def _pull_many(arguments: Any, axes: Any, *, lead: int, kept: Shape, **fixed: Any) -> Any:
    moved, size = _in_front(arguments, axes)
    return pull_p.bind(*moved, lead=lead + 1, kept=(size, *kept), **fixed), 0


batching.primitive_batchers[fit_p] = _fit_many
batching.primitive_batchers[push_p] = _push_many
batching.primitive_batchers[pull_p] = _pull_many


def _transpose(cotangent: Any, change: Any, *data: Any, lead: int, **fixed: Any) -> Any:
    kept = change.aval.shape[:lead]
    return [pull_p.bind(cotangent, *data, lead=lead, kept=kept, **fixed), *(None for _ in data)]


ad.primitive_transposes[push_p] = _transpose


def _second(*_: Any, **__: Any) -> Any:
    raise NotImplementedError(
        "symspline.jax.curve has derivatives of first order; symspline.jax.fit and symspline.jax.evaluate have those "
        "of any order"
    )


ad.primitive_jvps[fit_p] = ad.primitive_jvps[push_p] = ad.primitive_jvps[pull_p] = _second
