"""The compiled core as primitives of JAX: fits, the sensitivity of curves to their data, and its transpose.

Each is one call of the core, also under `jax.vmap`, however often. Every array has the axes of `jax.vmap` in front, of
size one where it does not depend on them, so data shared by all curves are passed once.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax.core import ShapedArray
from jax.extend.core import Primitive
from jax.interpreters import ad, batching, mlir

from .._autodiff.compiled import Kinds, fitted, joined
from .._autodiff.library import Tensor
from .._base.typing import AnyFunction
from .._curves.curve import CurveArrays
from .._curves.derivatives import sample_times
from .._curves.fit import curve_of
from .._spaces import Space

Shape = tuple[int, ...]


class Layout(NamedTuple):
    """Where arrays of the core have the axes of `jax.vmap`.

    Those along which curves differ stand before the batch axes of the points. Along the others all times belong to
    the same curves, so that they are axes of the times.

    Attributes:
        curves: sizes of the axes along which curves differ, 1 along the others.
        times: sizes of the axes along which times differ, 1 along the others.
        batch: batch axes of the points passed to `symspline.jax.curve`.
    """

    curves: Shape
    times: Shape
    batch: Shape

    @property
    def full(self) -> Shape:
        """Sizes of all axes of `jax.vmap`."""
        return np.broadcast_shapes(self.curves, self.times)

    @property
    def _of_curves(self) -> list[int]:
        return [i for i, size in enumerate(self.curves) if size != 1]

    @property
    def _shared(self) -> list[int]:
        return [i for i, size in enumerate(self.curves) if size == 1]

    def data(self, array: Tensor, core: int) -> Tensor:
        """Points, vectors or knots, one for every curve.

        Args:
            core: the number of axes behind the batch axes, of which there may be none.
        """
        lead = len(self.curves)
        missing = len(self.batch) - (array.ndim - lead - core)
        padded = array.reshape(*array.shape[:lead], *(1,) * missing, *array.shape[lead:])
        full = np.broadcast_to(padded, (*self.curves, *self.batch, *padded.shape[lead + len(self.batch) :]))
        return np.squeeze(full, axis=tuple(self._shared))

    def knots(self, t: Tensor) -> Tensor:
        """Knots, one row that all curves share where they do."""
        lead = len(self.curves)
        if t.ndim == lead + 1 and all(size == 1 for size in t.shape[:lead]):
            return t.reshape(-1)
        return self.data(t, 1)

    def sample_times(self, x: Tensor) -> tuple[Tensor, bool]:
        """Times, and whether every curve has its own."""
        of_curves, shared, lead = self._of_curves, self._shared, len(self.curves)
        x = np.transpose(x, (*of_curves, *shared, *range(lead, x.ndim)))
        if all(self.times[i] == 1 for i in of_curves):
            return x.reshape(x.shape[len(of_curves) :]), False
        x = x.reshape(*x.shape[: len(of_curves)], *(1,) * len(self.batch), *x.shape[len(of_curves) :])
        curves = [self.curves[i] for i in of_curves]
        return np.broadcast_to(x, (*curves, *self.batch, *x.shape[len(curves) + len(self.batch) :])), True

    def outward(self, values: Tensor) -> Tensor:
        """Values of the core with the axes of `jax.vmap` in front."""
        return np.transpose(values, np.argsort(self._order(values.ndim)))

    def inward(self, cotangent: Tensor) -> Tensor:
        """The inverse of `outward`."""
        return np.transpose(cotangent, self._order(cotangent.ndim))

    def _order(self, axes: int) -> list[int]:
        lead = len(self.curves)
        behind = lead + len(self.batch)
        return [*self._of_curves, *range(lead, behind), *self._shared, *range(behind, axes)]

    def gradient(self, array: Tensor, core: int, kept: Shape, shape: Shape) -> Tensor:
        """The transpose of `data`: an array per curve, summed along the axes that curves share.

        Args:
            kept: sizes of the axes of `jax.vmap` that the sum keeps.
            shape: of the array without those axes.
        """
        array = np.expand_dims(array, tuple(self._shared))
        missing = len(self.batch) + core - len(shape)
        wanted = (*kept, *(1,) * missing, *shape)
        axes = tuple(i for i, (n, m) in enumerate(zip(array.shape, wanted, strict=True)) if n != m)
        return array.sum(axis=axes, keepdims=True).reshape(*kept, *shape)


@dataclass(frozen=True)
class Fixed:
    """Arguments that are not differentiated, hashable for JAX."""

    space: Space
    kinds: Kinds
    options: tuple[tuple[str, object], ...]


# ---- the spline ----


def _fit_shapes(x: Tensor, *data: Tensor, fixed: Fixed, lead: int, orders: Shape) -> Tensor:
    layout, points = _layout(fixed, lead, x, data), data[1]
    values = _values(fixed, lead, layout, x, points)
    return (*(values for _ in orders), ShapedArray((*layout.curves, *points.shape[lead:]), points.dtype))


def _fit(x: Tensor, t: Tensor, points: Tensor, *vectors: Tensor, fixed: Fixed, lead: int, orders: Shape) -> Tensor:
    """The curves at x, γ and its derivatives of the given orders, and the velocities at the knots from which
    derivatives in the data are made."""
    layout, core = _layout(fixed, lead, x, (t, points, *vectors)), len(fixed.space.point_shape)
    ends = _ends(fixed.kinds, [layout.data(v, core) for v in vectors])
    data = layout.knots(t), layout.data(points, core + 1)
    spline = fitted(*data, ends, fixed.space, fixed.kinds, dict(fixed.options))
    at, per_curve = layout.sample_times(x)
    values = [layout.outward(spline(at, nu, per_curve=per_curve)) for nu in orders]
    solved = spline._solved().velocities.reshape(*layout.curves, *points.shape[lead:])
    return tuple(np.asarray(a, points.dtype) for a in (*values, solved))


def _layout(fixed: Fixed, lead: int, x: Tensor, data: Tensor, *changes: Shape) -> Layout:
    """The axes of times and data: of t, points, vectors and, where derivatives are made, velocities."""
    points = data[1]
    curves = np.broadcast_shapes(*(a.shape[:lead] for a in data), *changes)
    batch = points.shape[lead : points.ndim - len(fixed.space.point_shape) - 1]
    return Layout(curves, x.shape[:lead], batch)


def _values(fixed: Fixed, lead: int, layout: Layout, x: Tensor, points: Tensor) -> ShapedArray:
    shape = (*layout.full, *layout.batch, *x.shape[lead:], *fixed.space.point_shape)
    return ShapedArray(shape, points.dtype)


def _ends(kinds: Kinds, vectors: Tensor) -> tuple[Tensor, Tensor]:
    """Vectors for both ends, None where none is given."""
    left = iter(vectors)
    first, last = (
        None if isinstance(kind, str) else next(left) for kind in ((kinds, kinds) if isinstance(kinds, str) else kinds)
    )
    return first, last


# ---- its sensitivity to its data ----


def _jvp_shape(change: Tensor, x: Tensor, *data: Tensor, fixed: Fixed, lead: int, orders: Shape, **_: object) -> Tensor:
    values = _values(fixed, lead, _layout(fixed, lead, x, data, change.shape[:lead]), x, data[1])
    return ShapedArray((*values.shape, len(orders)), values.dtype)


def _jvp(
    change: Tensor, x: Tensor, *data: Tensor, fixed: Fixed, lead: int, orders: Shape, moving: tuple[bool, ...]
) -> Tensor:
    """The change of γ, or of a derivative of it seen from the moving point, with the data, orders on the last axis.

    Args:
        change: of those of t, points and vectors that move, all in one vector.
        data: t, points, vectors, and the velocities that a fit found.
    """
    layout = _layout(fixed, lead, x, data, change.shape[:lead])
    curve, at, bc_type = _moved(fixed, layout, orders, x, data)
    sizes = [math.prod(a.shape[lead:]) * moves for a, moves in zip(data, moving, strict=False)]
    rows = zip(np.split(change, np.cumsum(sizes)[:-1], axis=-1), data, _cores(fixed, data), moving, strict=False)
    knots, steps, *ends = (
        layout.data(_like(part, array).reshape(*change.shape[:lead], *array.shape[lead:]), core) if moves else None
        for part, array, core, moves in rows
    )
    moved = curve.jvp(at, bc_type, steps, knots, _ends(fixed.kinds, ends))
    return np.asarray(layout.outward(np.moveaxis(moved, len(curve.batch), -1)), data[1].dtype)


def _vjp_shape(
    _: object, x: Tensor, *data: Tensor, lead: int, moving: tuple[bool, ...], kept: Shape, **__: object
) -> Tensor:
    sizes = (math.prod(a.shape[lead:]) for a, moves in zip(data, moving, strict=False) if moves)
    return ShapedArray((*kept, sum(sizes)), data[1].dtype)


def _vjp(
    cotangent: Tensor,
    x: Tensor,
    *data: Tensor,
    fixed: Fixed,
    lead: int,
    orders: Shape,
    moving: tuple[bool, ...],
    kept: Shape,
) -> Tensor:
    """The transpose. JAX pairs complex numbers without conjugation.

    Args:
        kept: sizes of the axes of `jax.vmap` along which gradients are kept separate; 1 along those that are summed.
    """
    layout = _layout(fixed, lead, x, data, kept)
    curve, at, bc_type = _moved(fixed, layout, orders, x, data)
    wide = np.broadcast_to(cotangent, (*layout.full, *cotangent.shape[lead:]))
    gradient = curve.vjp(at, bc_type, np.conj(np.moveaxis(layout.inward(wide), -1, len(curve.batch))))
    parts = (gradient.t, gradient.points, *(end for end in gradient.ends if end is not None))
    rows = [
        layout.gradient(np.conj(part), core, kept, array.shape[lead:]).reshape(*kept, -1)
        for part, core, array, moves in zip(parts, _cores(fixed, data), data, moving, strict=False)
        if moves
    ]
    return np.concatenate(rows, axis=-1).astype(data[1].dtype)


def _cores(fixed: Fixed, data: Tensor) -> list[int]:
    """How many axes knots, points and vectors have behind those of a batch."""
    core = len(fixed.space.point_shape)
    return [1, core + 1, *(core for _ in data[2:])]


def _moved(fixed: Fixed, layout: Layout, orders: Shape, x: Tensor, data: Tensor) -> tuple[CurveArrays, Tensor, Tensor]:
    """Return curves with fitted velocities, sampling times, and their end conditions."""
    space, core = fixed.space, len(fixed.space.point_shape)
    t, points, *vectors, velocities = data
    points = space.project(np.ascontiguousarray(layout.data(points, core + 1)))
    rates = np.array(layout.data(velocities, core + 1), points.dtype)
    knots = np.array(layout.data(t, 1), np.float64)
    at, per_curve = layout.sample_times(np.asarray(x))
    curve = curve_of(space, knots, [(points, rates)])
    batch = points.shape[: points.ndim - core - 1]
    bc_type = joined(fixed.kinds, _ends(fixed.kinds, [layout.data(v, core) for v in vectors]))
    return curve, sample_times(knots, batch, at, per_curve, orders), bc_type


def _like(change: Tensor, array: Tensor) -> Tensor:
    """Changes of real arrays are real."""
    return change if np.iscomplexobj(array) else change.real


# ---- rules of JAX for these primitives ----


def _primitive(name: str, call: AnyFunction, shapes: AnyFunction, multiple: bool = False) -> Primitive:
    """A primitive that is one call of the core."""
    primitive = Primitive(name)
    primitive.multiple_results = multiple

    def now(*arguments: Tensor, **fixed: object) -> Tensor:
        return jax.tree.map(jnp.asarray, call(*map(np.asarray, arguments), **fixed))

    def later(*arguments: Tensor, **fixed: object) -> Tensor:
        def back(*arrays: Tensor) -> Tensor:
            return call(*map(np.asarray, arrays), **fixed)

        made = jax.tree.map(lambda a: jax.ShapeDtypeStruct(a.shape, a.dtype), shapes(*arguments, **fixed))
        return jax.pure_callback(back, made, *arguments)

    primitive.def_impl(now)
    primitive.def_abstract_eval(shapes)
    mlir.register_lowering(primitive, mlir.lower_fun(later, multiple_results=multiple))
    return primitive


fit_p = _primitive("symspline_fit", _fit, _fit_shapes, multiple=True)
jvp_p = _primitive("symspline_jvp", _jvp, _jvp_shape)
vjp_p = _primitive("symspline_vjp", _vjp, _vjp_shape)


def _mapped(primitive: Primitive, arguments: Tensor, axes: Sequence[int | None], *, lead: int, **fixed: Any) -> Tensor:
    """The rule of `jax.vmap`: one more axis in front of every argument, of size one where there is none."""
    pairs = list(zip(arguments, axes, strict=True))
    moved = [jnp.expand_dims(a, 0) if i is None else jnp.moveaxis(a, i, 0) for a, i in pairs]
    if primitive is vjp_p:
        fixed["kept"] = (next(a.shape[i] for a, i in pairs if i is not None), *fixed["kept"])
    results = primitive.bind(*moved, lead=lead + 1, **fixed)
    if primitive is not fit_p:
        return results, 0
    if any(axis is not None for axis in axes[1:]):
        return results, (0,) * len(results)
    # Only times differ: there is one curve.
    *values, velocities = results
    return (*values, jnp.squeeze(velocities, 0)), (*(0 for _ in values), None)


def _second(*_: object, **__: object) -> Tensor:
    raise NotImplementedError(
        "symspline.jax.curve has derivatives of first order; symspline.jax.fit and symspline.jax.evaluate have those "
        "of any order"
    )


for primitive in (fit_p, jvp_p, vjp_p):
    batching.primitive_batchers[primitive] = partial(_mapped, primitive)
    ad.primitive_jvps[primitive] = _second


def _transpose(cotangent: Tensor, change: Tensor, *data: Tensor, lead: int, **fixed: object) -> Tensor:
    kept = change.aval.shape[:lead]
    return [vjp_p.bind(cotangent, *data, lead=lead, kept=kept, **fixed), *(None for _ in data)]


ad.primitive_transposes[jvp_p] = _transpose
