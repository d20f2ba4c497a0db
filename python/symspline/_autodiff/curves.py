"""Curves with given velocities, and the C² condition for velocities: arguments of users, and values for them.

Inside, nodes and times are along the first axis, and axes of the batch follow. Knots that all curves share have axes of
length 1 there.
"""

from __future__ import annotations

from collections.abc import Callable

from .. import _spaces
from .._base.arrays import short_repr
from .._base.typing import CubicBCType
from .._core import ValidationError
from .._curves.options import order_of
from .._spaces import AnySpace, Product, Space, parts_of, refuse_quotients, space_named
from .compiled import split
from .condition import Problem, chain_of
from .library import Library, Module, Tensor, adjoint
from .models import QUOTIENTS, Model, model_of


def named(lib: Library, space: AnySpace | str) -> AnySpace:
    """Return the space, or raise ValidationError for a quotient."""
    whole = space_named(space)
    refuse_quotients(whole, f"functions of {lib.name} are not made")
    return whole


def evaluate(
    lib: Library, t: Tensor, points: Tensor, velocities: Tensor, space: AnySpace | str, x: Tensor, nu: int
) -> Tensor:
    """Evaluate curves, see `symspline.jax.evaluate` and `symspline.torch.evaluate`."""
    nu, space = order_of(nu), named(lib, space)
    if isinstance(space, Product):
        parts = parts_of(points, space, "points"), parts_of(velocities, space, "velocities")
        return tuple(evaluate(lib, t, *part, x, nu) for part in zip(*parts, space.factors, strict=True))
    model = model_of(lib, space)
    if model is None:
        raise unsupported(lib, space, "evaluate")
    points, velocities = lib.promote(space, points, velocities)
    if velocities.shape != points.shape:
        raise ValidationError(f"velocities has shape {tuple(velocities.shape)}, but points {tuple(points.shape)}")
    knots, axis = _knots(lib, t, points, space), points.ndim - 1 - len(space.point_shape)
    x = lib.array(x, "x", points.real)
    p, v = (lib.xp.moveaxis(a, axis, 0) for a in (points, velocities))
    values = lib.xp.moveaxis(_values(model, space, knots, p, v, x.reshape(-1), nu), 0, axis)
    return values.reshape(*points.shape[:axis], *x.shape, *space.point_shape)


def problem_of(
    lib: Library, t: Tensor, points: Tensor, space: AnySpace, bc_type: CubicBCType
) -> tuple[Problem, Callable[[Tensor], Tensor]]:
    """Return the C² condition of curves, and a function that converts its solution to velocities for the user."""
    chain = chain_of(model_of(lib, space))
    if chain is None:
        raise unsupported(lib, space, "fit")
    (points,) = lib.promote(space, points)
    knots, axis = _knots(lib, t, points, space), points.ndim - 1 - len(space.point_shape)
    points = lib.xp.moveaxis(points, axis, 0)
    given, (first, last) = _ends(lib, bc_type, points)
    rows = lib.xp.concatenate([first[None], lib.xp.zeros_like(points[1:-1]), last[None]])
    p, u = chain.enter(points, rows)
    problem = Problem(chain, given, knots[1:] - knots[:-1], p, u[0], u[-1])
    return problem, lambda u: lib.xp.moveaxis(chain.leave(p, u), 0, axis)


def unsupported(lib: Library, space: AnySpace, function: str) -> ValidationError:
    """Return the error of a space without closed forms, or without a fit."""
    flat = ["r", "sphere"] if function == "fit" else ["r", "sphere", "hyperbolic"]
    lines = ["rp", "cp", "gr", "cgr"] if lib.general and function != "fit" else []
    names = [*flat, *lines, "spd", *(["hpd"] if lib.general else []), "so:2", "so:3", "se:2"]
    return ValidationError(
        f"symspline.{lib.module}.{function} does not support {space}, but only {', '.join(names)} and se:3; use "
        f"symspline.{lib.module}.curve, which supports every space"
    )


def _knots(lib: Library, t: Tensor, points: Tensor, space: AnySpace) -> Tensor:
    """Return knots of shape (n, *batch), or (n, 1, ..., 1) if all curves have the same ones."""
    lead = points.ndim - len(space.point_shape)
    if lead < 1 or tuple(points.shape[lead:]) != space.point_shape or points.shape[lead - 1] < 2:
        raise ValidationError(
            f"points has shape {tuple(points.shape)}; a curve in {space} needs (..., n, *{space.point_shape}), n >= 2"
        )
    t, shape = lib.array(t, "t", points.real), tuple(points.shape[:lead])
    if tuple(t.shape) not in (shape[-1:], shape):
        raise ValidationError(
            f"t has shape {tuple(t.shape)}; points of shape {tuple(points.shape)} need {shape[-1:]}, or one row per "
            f"curve, {shape}"
        )
    return lib.xp.moveaxis(t.reshape(*(1,) * (lead - t.ndim), *t.shape), -1, 0)


def _ends(lib: Library, bc_type: CubicBCType, points: Tensor) -> tuple[tuple[bool, bool], list[Tensor]]:
    """Return which ends have a given velocity, and its value or zero."""
    kinds, vectors = split(bc_type)
    pair = (kinds, kinds) if isinstance(kinds, str) else kinds
    if any(kind not in ("natural", "clamped", 1) for kind in pair):
        raise ValidationError(
            "bc_type must be 'natural', 'clamped', or a pair with one of these or (1, velocity) for either end; got "
            f"{short_repr(bc_type)}"
        )
    ends = []
    for vector, name in zip(vectors, ("start", "end"), strict=True):
        velocity = lib.xp.zeros_like(points[0]) if vector is None else lib.array(vector, f"the {name} velocity", points)
        try:
            ends.append(lib.xp.broadcast_to(velocity, points.shape[1:]))
        except (ValueError, RuntimeError):
            raise ValidationError(
                f"the {name} velocity has shape {tuple(velocity.shape)}, which does not broadcast to "
                f"{tuple(points.shape[1:])}"
            ) from None
    return (pair[0] != "natural", pair[1] != "natural"), ends


def _values(model: Model, space: AnySpace, t: Tensor, points: Tensor, velocities: Tensor, x: Tensor, nu: int) -> Tensor:
    """Return values of shape (times, *batch, *point_shape)."""
    lib, xp = model.lib, model.lib.xp
    h = t[1:] - t[:-1]
    polygons = _control(model, h, *model.to_internal(points, velocities))
    x = xp.broadcast_to(x[(..., *(None,) * (t.ndim - 1))], (len(x), *t.shape[1:]))
    at = xp.moveaxis(lib.search(xp.moveaxis(t, 0, -1), xp.moveaxis(x, 0, -1)), -1, 0)
    segment = xp.clip(at - 1, 0, len(h) - 1)
    begin, length = (lib.take_along(a, segment, 0) for a in (t, h))
    starts, handles = (_rows(lib, a, segment) for a in polygons)

    def curve(x: Tensor) -> Tensor:
        return model.from_internal(_bezier(model, starts, handles, (x - begin) / length))

    def velocity(x: Tensor) -> Tensor:
        return lib.along(curve, x)

    if nu == 0:
        values = curve(x)
    elif nu == 1:
        values = _velocity(space, *velocity(x))
    else:
        (point, first), (_, second) = lib.along(velocity, x)
        values = _acceleration(lib, space, point, first, second)
    # As in `symspline._base.time.onto_ends`, a few units in the last place beyond the ends are rounding.
    reach = 4 * xp.finfo(x.dtype).eps * xp.maximum(abs(t[0]), abs(t[-1]))
    inside = (x >= t[0] - reach) & (x <= t[-1] + reach)
    return xp.where(inside[(..., *(None,) * len(space.point_shape))], values, float("nan"))


def _rows(lib: Library, polygons: Tensor, segment: Tensor) -> Tensor:
    """Take segments, shape (times, *batch), of polygons of shape (3, n - 1, *batch, *point shape)."""
    if all(size == 1 for size in segment.shape[1:]):
        # All curves have the same knots.
        return polygons[:, segment.reshape(-1)]
    return lib.take_along(polygons, segment[(None, ..., *(None,) * (polygons.ndim - 1 - segment.ndim))], 1)


# ---- de Casteljau's algorithm for cubic Bézier curves of geodesics, (8) of the paper, and covariant derivatives ----

_COLUMN = (_spaces.Sphere, _spaces.RealProjective, _spaces.ComplexProjective)
_COLUMNS = (_spaces.Grassmannian, _spaces.ComplexGrassmannian, _spaces.QuaternionicProjective)
_LORENTZ = (_spaces.Hyperbolic, _spaces.ComplexHyperbolic)


def _control(model: Model, h: Tensor, points: Tensor, velocities: Tensor) -> tuple[Tensor, Tensor]:
    """Return the starts of the three geodesics of every control polygon, and their velocities.

    The first geodesic leads from the first point to the first handle, the second joins the handles, and the third leads
    from the last point to the second handle. The geodesics of one stage are one computation, because JAX compiles each
    computation.
    """
    stack = model.lib.xp.stack
    p, q = points[:-1], points[1:]
    handles = stack([model.times(h / 3, velocities[:-1]), model.times(-h / 3, velocities[1:])])
    inner = model.exp(stack([p, q]), handles)
    return stack([p, inner[0], q]), stack([handles[0], model.log(inner[0], inner[1]), handles[1]])


def _bezier(model: Model, starts: Tensor, handles: Tensor, s: Tensor) -> Tensor:
    """Evaluate curves at s between 0 and 1, with control polygons as `_control` returns them."""
    stack = model.lib.xp.stack
    a, b, c = model.exp(starts, model.times(stack([s, s, 1 - s]), handles))
    left, right = model.between(stack([a, b]), stack([b, c]), s)
    return model.between(left, right, s)


def _velocity(space: Space, point: Tensor, first: Tensor) -> Tensor:
    """Return the velocity of a curve from the derivative of its arrays."""
    return _horizontal(space, point, first) if isinstance(space, QUOTIENTS) else first


def _acceleration(lib: Library, space: Space, point: Tensor, first: Tensor, second: Tensor) -> Tensor:
    """Return the covariant acceleration of a curve from the derivatives of its arrays."""
    if isinstance(space, QUOTIENTS):
        return _horizontal(space, point, first, second)
    return second - second_fundamental_form(lib.xp, space, point, first, first)


def _horizontal(space: Space, y: Tensor, first: Tensor, second: Tensor = None) -> Tensor:
    """Return (I − YY*)Y', or the acceleration (I − YY*)(Y'' − 2Y'(Y*Y')), for any representatives Y of a curve."""
    if len(space.point_shape) == 1:
        columns = (None if a is None else a[..., None] for a in (y, first, second))
        return _horizontal_columns(*columns)[..., 0]
    return _horizontal_columns(y, first, second)


def _horizontal_columns(y: Tensor, first: Tensor, second: Tensor) -> Tensor:
    change = first if second is None else second - 2 * first @ (adjoint(y) @ first)
    return change - y @ (adjoint(y) @ change)


def second_fundamental_form(xp: Module, space: Space, point: Tensor, vector: Tensor, motion: Tensor) -> Tensor:
    """Return the derivative of a field of tangent vectors as arrays, minus its covariant derivative.

    Of unit vectors, and of k orthonormal columns X, it is −X Ẋ*V, which keeps X*V = 0 (minus the second fundamental
    form). A field gΩ on a group has the covariant derivative g(Ω' + ½[ω, Ω]) where g moves by gω, and the array
    g(Ω' + ωΩ) as derivative: that is ½g(ωΩ + Ωω) more, or ½(ġ g⁻¹V + V g⁻¹ġ); the same holds for positive definite
    matrices, whose covariant acceleration is γ'' − γ'γ⁻¹γ'.

    Parameters
    ----------
    point : array, shape (..., *point_shape)
        The point γ.
    vector : array
        The field at γ.
    motion : array
        The velocity of γ. The result is linear in it.
    """
    if isinstance(space, _spaces.Euclidean):
        return xp.zeros_like(motion)
    if isinstance(space, _COLUMN):
        return -point * (motion.conj() * vector).sum(axis=-1, keepdims=True)
    if isinstance(space, _LORENTZ):
        products = motion.conj() * vector
        return point * (products[..., 1:].sum(axis=-1, keepdims=True) - products[..., :1])
    if isinstance(space, _COLUMNS):
        return -point @ (adjoint(motion) @ vector)
    inverse = xp.linalg.inv(point)
    return 0.5 * (motion @ inverse @ vector + vector @ inverse @ motion)
