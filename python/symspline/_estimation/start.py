"""The initial curve of an estimate: smoothed points, integrated rates, or the attitudes of seen directions."""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._arrays import short_repr
from .._core import ValidationError
from .._curve import Curve
from .._smoothing import make_smoothing_spline
from .._smoothing.factors import split
from .._spaces import Array, Doubles, Euclidean, Product, Space, SpecialOrthogonal, factors_of
from ..convert import matrix_to_quaternion
from .rates import attitudes_at
from .solve import Setup
from .terms import Body, DirectionTerm, ForceTerm, PointTerm, RateTerm

_SO3 = SpecialOrthogonal(3)


def initial_points(setup: Setup, space: Space[Any], shown: Array, start: Any) -> list[Array]:
    """Return initial points at the knots in every part."""
    if start is not None:
        if not isinstance(start, Curve) or start.space != space:
            raise ValidationError(f"start must be a curve on {space!r}, not {short_repr(start)}")
        extended: Any = start
        points = extended(shown, extrapolate="geodesic")
        each = points if isinstance(space, Product) else (points,)
        return [part for factor, own in zip(factors_of(space), each, strict=True) for part in split(factor, own)]
    return [_initial(setup, part, own) for part, own in enumerate(setup.spaces)]


def _initial(setup: Setup, part: int, space: Space[Any]) -> Array:
    """Return initial points of one part: smoothed points, integrated rates, or the attitudes of seen directions."""
    knots = setup.knots
    points = [term for term in setup.terms if isinstance(term, PointTerm) and term.parts == [part]]
    times = np.concatenate([term.times for term in points]) if points else np.empty(0)
    rates = [term for term in setup.terms if isinstance(term, RateTerm) and term.parts == [part]]
    seen = [term for term in setup.terms if isinstance(term, DirectionTerm) and term.parts == [part]]
    spread = len(np.unique(times)) > 1 and (not rates or np.ptp(times) > 0.8 * (knots[-1] - knots[0]))
    if spread:
        order = np.argsort(times, kind="stable")
        y = np.concatenate([term.y for term in points])[order]
        weights = np.concatenate([term.noise[:, 0] ** -2.0 for term in points])[order]
        count = min(len(np.unique(times)), len(knots), 200)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            curve = make_smoothing_spline(
                times[order],
                y,
                space,
                weights=weights / weights.max(),
                knots=count,
                on_failure="ignore",
                loss="linear" if all(loss == "linear" for loss in setup.losses) else "cauchy",
            )
        smooth = curve(knots, extrapolate="geodesic")
        if np.isfinite(smooth).all():
            return np.asarray(smooth)
    if rates and rates[0].body.is_rotation:
        forces = [term for term in setup.terms if isinstance(term, ForceTerm) and term.parts[0] == part]
        vectors = [_force_vectors(setup, term) for term in forces]
        vectors += [(np.repeat(own.times, own.seen.shape[1]), *_rows(own.reference, own.seen)) for own in seen]
        # The rows of a rotation matrix are the fixed axes in the frame of the body.
        vectors += [(np.repeat(own.times, 3), *_rows(np.eye(3), Body(space).matrices(own.y))) for own in points]
        return _integrated(setup, space, rates[0], vectors)
    if seen:
        return _seen(setup, space, seen)
    if len(times):
        return np.asarray(np.repeat(points[0].y[:1], len(knots), axis=0))
    if isinstance(space, Euclidean):
        return np.zeros((len(knots), *space.point_shape))
    raise ValidationError(
        f"there is no initial curve on {space!r}: no measurement has points of it, rates or directions. Pass `start`."
    )


# Vectors in the fixed frame and the same vectors in the frame of the body, at times.
_Vectors = tuple[Doubles, Doubles, Doubles]
# The number of windows with which an initial attitude is aligned in turn, and the ratio of singular values from which
# vectors determine a rotation.
_WINDOWS, _RANK = 7, 1e-3


def _rows(reference: Doubles, seen: Doubles) -> tuple[Doubles, Doubles]:
    return np.broadcast_to(reference, seen.shape).reshape(-1, 3), seen.reshape(-1, 3)


def _force_vectors(setup: Setup, term: ForceTerm) -> _Vectors:
    """Return the accelerations without gravity that follow from measured positions, and the specific forces."""
    points = [own for own in setup.terms if isinstance(own, PointTerm) and own.parts == [term.parts[1]]]
    times = np.concatenate([own.times for own in points]) if points else np.empty(0)
    expected = np.tile(-term.gravity, (len(term.times), 1))
    count = len(np.unique(times))
    if count > 5:
        order = np.argsort(times, kind="stable")
        y = np.concatenate([own.y for own in points])[order]
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            path = make_smoothing_spline(
                times[order], y, "r:3", knots=min(count, 200), penalty="jerk", on_failure="ignore"
            )
        accelerations = path(np.clip(term.times, times.min(), times.max()), 2)
        if np.isfinite(accelerations).all():
            expected = expected + accelerations
    return term.times, expected, term.f


def _integrated(setup: Setup, space: Space[Any], rate: RateTerm, vectors: list[_Vectors]) -> Array:
    """Return the attitudes that follow from the rates and from vectors known in both frames.

    The integral of the rates is aligned with the vectors in windows that become longer, and every alignment yields a
    better bias of the rates, with which they are integrated again.
    """
    knots = setup.knots
    order = np.argsort(rate.times, kind="stable")
    bias = np.zeros(3) if rate.bias is None else np.array(setup.constants[rate.bias].start)
    at = np.arange(len(knots))
    matrices = attitudes_at(rate.times[order], rate.omega[order] - bias, knots)
    for level in range(_WINDOWS - 1 if rate.bias is not None else 0, -1, -1):
        profile = np.zeros((len(knots), 3, 3))
        for times, fixed, body in vectors:
            index = _closest(knots, times)
            near = np.einsum("nij,nj->ni", matrices[index], body)
            np.add.at(profile, index, fixed[:, :, None] * near[:, None, :])
        if not level:
            break
        half = max(1, len(knots) >> (level + 1))
        total = np.concatenate([np.zeros((1, 3, 3)), np.cumsum(profile, axis=0)])
        windows = total[np.minimum(at + half + 1, len(knots))] - total[np.maximum(at - half, 0)]
        sizes = np.linalg.svd(windows, compute_uv=False)
        if not np.all(sizes[:, 1] > _RANK * sizes[:, 0]):
            continue
        # The aligned attitudes turn more slowly than the integrated ones by the remaining bias.
        aligned = np.stack([_nearest(own) for own in windows]) @ matrices
        steps = [np.swapaxes(own[:-1], -1, -2) @ own[1:] for own in (aligned, matrices)]
        spin = np.swapaxes(steps[0], -1, -2) @ _SO3.log(steps[0], steps[1])
        vector = np.stack([spin[:, 2, 1], spin[:, 0, 2], spin[:, 1, 0]], axis=-1)
        bias = bias + np.median(vector / np.diff(knots)[:, None], axis=0)
        matrices = attitudes_at(rate.times[order], rate.omega[order] - bias, knots)
    return _rotations(space, _nearest(profile.sum(axis=0)) @ matrices)


def _closest(grid: Doubles, x: Doubles) -> NDArray[np.intp]:
    """Return the index of the closest number of an increasing grid."""
    return np.searchsorted(0.5 * (grid[1:] + grid[:-1]), x)


def _seen(setup: Setup, space: Space[Any], seen: list[DirectionTerm]) -> Array:
    """Return the attitudes at the knots from the directions seen near them (Wahba's problem)."""
    knots = setup.knots
    profile = np.zeros((len(knots), 3, 3))
    for term in seen:
        np.add.at(profile, _closest(knots, term.times), np.einsum("nki,nkl->nil", term.reference, term.seen))
    # Attitudes of knots without two directions are those of their neighbours.
    good = np.flatnonzero(np.linalg.svd(profile, compute_uv=False)[:, 1] > 1e-6)
    if not len(good):
        total = _nearest(profile.sum(axis=0))
        return _rotations(space, np.repeat(total[None], len(knots), axis=0))
    found = np.stack([_nearest(own) for own in profile[good]])
    return _rotations(space, found[_closest(good.astype(np.float64), np.arange(float(len(knots))))])


def _nearest(profile: Doubles) -> Doubles:
    """Return the rotation R with the largest trace of RᵀB."""
    u, _, v = np.linalg.svd(profile)
    u[:, -1] *= np.sign(np.linalg.det(u) * np.linalg.det(v)) or 1.0
    return np.asarray(u @ v)


def _rotations(space: Space[Any], matrices: Doubles) -> Array:
    if isinstance(space, SpecialOrthogonal):
        return np.asarray(space.project(matrices))
    quaternions = matrix_to_quaternion(matrices, scalar_first=True)
    signs = np.cumprod([1.0, *np.where(np.sum(quaternions[1:] * quaternions[:-1], axis=-1) < 0, -1.0, 1.0)])
    return np.asarray(signs[:, None] * quaternions)
