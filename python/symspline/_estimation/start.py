"""Initial curves of an estimate, from integrated rates, smoothed points, or attitudes computed from directions."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .._base.arrays import short_repr
from .._base.faults import silenced
from .._base.time import TimeAxis
from .._core import ValidationError
from .._smoothing import make_smoothing_spline
from .._smoothing.noise import split
from .._spaces import Array, Doubles, Euclidean, Product, Space, SpecialOrthogonal, factors_of, nearest_rotations
from .._splines.base import Curve
from ..convert._quaternions import matrix_to_quaternion
from .rates import Attitudes, Integral, Path, Rates, attitudes_at
from .solve import Setup
from .terms import Body, DirectionTerm, ForceTerm, InformationTerm, PointTerm, RateTerm, Values, VelocityTerm

_SO3 = SpecialOrthogonal(3)
# Function that returns points of a curve at times of the core.
PathOfPart = Callable[[Doubles], Array]
# Largest numbers of knots of smoothed points: in general, and with dense attitudes and rates, where the iteration adds
# the details.
_MOST, _MOST_WITH_RATES = 2000, 200
# Points at which velocities are given have this many times the standard deviation of other points.
_BESIDE = 2.0
# Attitudes alone determine a path that turns by less than this angle from one to the next.
_SMALL = 1.0
# With fewer attitudes, wrong ones cannot be recognised, and the bias of rates is not determined.
_FEW = 3


class Start(NamedTuple):
    """Initial curve and parameters of an iteration.

    Attributes
    ----------
    paths : list of callable
        Functions that return the points of every part at times.
    values : dict
        Initial values of some parameters, by name.
    """

    paths: list[PathOfPart]
    values: Values

    def points(self, knots: Doubles) -> list[Array]:
        """Return points at the knots in every part."""
        return [path(knots) for path in self.paths]


def starts(setup: Setup, space: Space[Any], axis: TimeAxis, start: Any) -> Iterator[Start]:
    """Yield initial curves in decreasing order of promise, computed on demand."""
    if start is not None:
        if not isinstance(start, Curve) or start.space != space:
            raise ValidationError(f"start must be a curve on {space!r}, not {short_repr(start)}")
        yield Start([_of_curve(start, axis, part) for part in range(len(setup.spaces))], {})
        return
    each = [_candidates(setup, part, own) for part, own in enumerate(setup.spaces)]
    chosen = [own[0]() for own in each]
    yield _joined(chosen)
    for part, candidates in enumerate(each):
        for candidate in candidates[1:]:
            yield _joined([*chosen[:part], candidate(), *chosen[part + 1 :]])


def _joined(parts: list[Start]) -> Start:
    values: Values = {}
    for own in parts:
        values |= own.values
    return Start([path for own in parts for path in own.paths], values)


def _of_curve(start: Any, axis: TimeAxis, part: int) -> PathOfPart:
    """Return the path of one part of a curve passed by the user."""

    def path(x: Doubles) -> Array:
        points = start(axis.shown(x, ()), extrapolate="geodesic")
        each = points if isinstance(start.space, Product) else (points,)
        return [own for factor, rows in zip(factors_of(start.space), each, strict=True) for own in split(factor, rows)][
            part
        ]

    return path


def _candidates(setup: Setup, part: int, space: Space[Any]) -> list[Callable[[], Start]]:
    """Return functions that compute initial curves of one part, the most promising first."""
    points = [term for term in setup.terms if isinstance(term, (PointTerm, InformationTerm)) and term.parts == [part]]
    rates = [term for term in setup.terms if isinstance(term, RateTerm) and term.parts == [part]]
    seen = [term for term in setup.terms if isinstance(term, DirectionTerm) and term.parts == [part]]
    found: list[Callable[[], Start]] = []
    times = np.concatenate([term.times for term in points]) if points else np.empty(0)
    spread = len(np.unique(times)) > 1
    if rates and rates[0].body.is_rotation:
        attitudes = _attitudes(space, points, seen)
        forces = [term for term in setup.terms if isinstance(term, ForceTerm) and term.parts[0] == part]

        def smoothed(x: Doubles) -> Doubles:
            return Body(space).matrices(_smoothed(setup, space, points, []).paths[0](x))

        def aligned() -> Start:
            found = _with_rates(setup, space, rates, attitudes, smoothed if spread else None)
            return found._replace(paths=[_signed(found.paths[0], points)]) if space != _SO3 else found

        def by_vectors() -> Start:
            vectors = [_force_vectors(setup, term) for term in forces]
            vectors += [(np.repeat(own.times, own.seen.shape[1]), *_rows(own.reference, own.seen)) for own in seen]
            # The rows of a rotation matrix are the fixed axes in the frame of the body.
            vectors += [(np.repeat(own.times, 3), *_rows(np.eye(3), Body(space).matrices(own.y))) for own in points]
            return _integrated(setup, space, rates[0], vectors)

        several = sum(len(own.attitudes.times) for own in attitudes)
        found = [aligned] if several else []
        if forces or (seen and several < _FEW) or not several:
            found.insert(0 if several < _FEW else 1, by_vectors)
        if spread and not setup.automatic and _are_dense(setup, points, rates):
            # The motion between attitudes is so small that attitudes alone suffice, which is faster.
            return [lambda: _smoothed(setup, space, points, [], _MOST_WITH_RATES), *found]
    beside = [term for term in setup.terms if isinstance(term, VelocityTerm) and term.parts == [part]]
    if beside and not isinstance(space, Euclidean):
        found.append(lambda: _smoothed(setup, space, points, beside))
    if spread:
        found.append(lambda: _smoothed(setup, space, points, []))
    if found:
        return found
    if seen:
        return [lambda: Start([lambda x: _seen(x, space, seen)], {})]
    if len(times):
        return [lambda: Start([lambda x: np.repeat(points[0].y[:1], len(x), axis=0)], {})]
    if isinstance(space, Euclidean):
        return [lambda: Start([lambda x: np.zeros((len(x), *space.point_shape))], {})]
    raise ValidationError(
        f"there is no initial curve on {space!r}: no measurement has points of it, rates or directions. Pass `start`."
    )


def _are_dense(setup: Setup, points: list[PointTerm | InformationTerm], rates: list[RateTerm]) -> bool:
    """Whether attitudes determine the path between them: the body turns by little from one to the next."""
    if not setup.least_squares or any(own.time_offset for own in (*points, *rates)):
        return False
    times = np.unique(np.concatenate([setup.knots[[0, -1]], *(own.times for own in points)]))
    sigma = max(float(scales_of(own).max()) for own in points)
    speed = max(float(np.linalg.norm(own.omega, axis=1).max()) for own in rates)
    return float(np.diff(times).max()) * speed + 3 * sigma < _SMALL


# ---- points ----


def scales_of(term: PointTerm | InformationTerm) -> Doubles:
    """Return the usual standard deviation of a coordinate of every point."""
    if isinstance(term, PointTerm):
        return term.noise[:, 0]
    information = np.mean(term.roots**2, axis=-1).sum(axis=-1)
    return np.asarray(term.noise[:, 0] / np.sqrt(np.maximum(information, np.finfo(float).tiny)))


def _smoothed(
    setup: Setup,
    space: Space[Any],
    points: list[PointTerm | InformationTerm],
    beside: list[VelocityTerm],
    most: int = _MOST,
) -> Start:
    """Return smoothed points, together with those at which velocities are given."""
    scales = [scales_of(term) for term in points]
    typical = float(np.median(np.concatenate(scales))) if scales else 1.0
    times = np.concatenate([*(term.times for term in points), *(term.times for term in beside)])
    y = np.concatenate([*(term.y for term in points), *(term.y for term in beside)])
    sigma = np.concatenate([*scales, *(np.full(len(term.times), _BESIDE * typical) for term in beside)])
    order = np.argsort(times, kind="stable")
    # Automatic knots are few at first, so they do not limit the number.
    count = None if setup.automatic else min(len(np.unique(times)), max(len(setup.knots), 2), most)
    with silenced(Warning), np.errstate(all="ignore"):
        curve: Any = make_smoothing_spline(
            times[order],
            y[order],
            space,
            weights=(sigma[order] / sigma.min()) ** -2.0,
            knots=count,
            on_failure="ignore",
            loss="linear" if setup.least_squares else "cauchy",
        )

    def path(x: Doubles) -> Array:
        found = np.asarray(curve(x, extrapolate="geodesic"))
        return found if np.isfinite(found).all() else np.repeat(y[order][:1], len(x), axis=0)

    return Start([path], {})


# ---- rates ----


def _signed(path: PathOfPart, points: list[PointTerm | InformationTerm]) -> PathOfPart:
    """Return a path of unit quaternions with the sign of most of the measured ones."""

    def signed(x: Doubles) -> Array:
        found = path(x)
        same = [np.sign(np.sum(found[_closest(x, term.times)] * term.y, axis=1)).sum() for term in points]
        return -found if sum(same) < 0 else found

    return signed


class _Seen(NamedTuple):
    """Measured attitudes, and the name of the offset of their times."""

    attitudes: Attitudes
    time_offset: str | None


def _attitudes(space: Space[Any], points: list[PointTerm | InformationTerm], seen: list[DirectionTerm]) -> list[_Seen]:
    """Return measured attitudes; if they are few, also attitudes computed from simultaneous directions."""
    found = [
        _Seen(Attitudes(term.times, Body(space).matrices(term.y), scales_of(term)), term.time_offset) for term in points
    ]
    if sum(len(own.attitudes.times) for own in found) >= _FEW:
        return found
    for term in seen:
        profile = np.einsum("nki,nkl->nil", term.reference, term.seen)
        sizes = np.linalg.svd(profile, compute_uv=False)
        good = sizes[:, 1] > _RANK * sizes[:, 0]
        if good.any():
            sigma = np.mean(term.noise[good], axis=1)
            found.append(_Seen(Attitudes(term.times[good], nearest_rotations(profile[good]), sigma), term.time_offset))
    return found


def _with_rates(
    setup: Setup,
    space: Space[Any],
    rates: list[RateTerm],
    attitudes: list[_Seen],
    smoothed: Callable[[Doubles], Doubles] | None,
) -> Start:
    """Return the integrated rates, aligned with measured attitudes, and estimates of the bias and the time offset."""
    first = max(rates, key=_coverage)
    name, values = first.time_offset, setup.constants

    def began(term_offset: str | None) -> float:
        return 0.0 if term_offset is None else float(values[term_offset].start[0])

    names = {own.time_offset for own in attitudes}
    # Of attitudes with different time offsets, use those without an offset, or else the most numerous ones.
    chosen = None if None in names else max(names, key=lambda one: sum(one == own.time_offset for own in attitudes))
    own = [each.attitudes for each in attitudes if each.time_offset == chosen]
    times = np.concatenate([each.times for each in own]) + began(chosen)
    order = np.argsort(times, kind="stable")
    data = Attitudes(
        times[order],
        np.concatenate([each.matrices for each in own])[order],
        np.concatenate([each.sigma for each in own])[order],
    )
    given = _rates_of(setup, first, [term for term in rates if term is not first and term.time_offset == name])
    given = given._replace(times=given.times + began(name))
    low, high = float(setup.knots[0]), float(setup.knots[-1])
    offset = None
    if name != chosen and name is not None:
        # Shifting the rates to later times is equivalent to shifting the attitudes to earlier times.
        offset = (0.0, float(given.times[-1]) - high, float(given.times[0]) - low)
    elif name != chosen and chosen is not None:
        offset = (0.0, low - float(data.times[0]), high - float(data.times[-1]))
    if offset is not None:
        offset = (0.0, min(offset[1], 0.0), max(offset[2], 0.0))
    path = Path(given, data, offset, smoothed)
    found: Values = {}
    if first.bias is not None:
        found[first.bias] = path.bias
    late = 0.0
    if name != chosen and name is not None:
        late = path.offset
        found[name] = np.array([began(name) - late])
    elif name != chosen and chosen is not None:
        found[chosen] = np.array([began(chosen) + path.offset])
    for term in rates:
        if term.bias is not None and term.bias not in found:
            found[term.bias] = _relative(first, term) + (path.bias if first.bias is not None else 0.0)
    return Start([lambda x: _rotations(space, path(x + late))], found)


def _coverage(term: RateTerm) -> float:
    """Return the total time that is covered by rates."""
    steps = np.diff(np.sort(term.times))
    return float(np.minimum(steps, 10 * np.median(steps)).sum()) if len(steps) else 0.0


def _relative(first: RateTerm, other: RateTerm) -> Doubles:
    """Return the bias of `other` minus that of `first`; zero if their times do not overlap."""
    order = np.argsort(first.times, kind="stable")
    t = first.times[order]
    both = (other.times >= t[0]) & (other.times <= t[-1])
    if not both.any():
        return np.zeros(3)
    rates = np.stack([np.interp(other.times[both], t, row) for row in first.omega[order].T], axis=-1)
    return np.asarray(np.median(other.omega[both] - rates, axis=0))


def _rates_of(setup: Setup, first: RateTerm, others: list[RateTerm]) -> Rates:
    """Return the rates of one gyroscope, with rates of others in its gaps."""
    times, omega = first.times, _without_spikes(setup, first)
    for other in others:
        known = np.unique(times)
        place = np.clip(np.searchsorted(known, other.times), 1, max(len(known) - 1, 1))
        usual = 10 * float(np.median(np.diff(known))) if len(known) > 1 else 0.0
        width = known[np.minimum(place, len(known) - 1)] - known[place - 1]
        apart = (other.times < known[0] - usual) | (other.times > known[-1] + usual) | (width > usual)
        if apart.any():
            bias = np.zeros(3) if other.bias is None and first.bias is None else _relative(first, other)
            times = np.concatenate([times, other.times[apart]])
            omega = np.concatenate([omega, _without_spikes(setup, other)[apart] - bias])
    order = np.argsort(times, kind="stable")
    noise = float(np.mean(first.noise))
    if first.bias is None:
        return Rates(times[order], omega[order], noise, np.zeros(3), None)
    constant = setup.constants[first.bias]
    spread = np.full(3, np.inf) if constant.sigma is None else np.array(constant.sigma)
    return Rates(times[order], omega[order], noise, np.array(constant.start), spread)


def _without_spikes(setup: Setup, term: RateTerm) -> Doubles:
    """Return the rates, without single outliers if the loss is robust."""
    if term.loss == "linear" or len(term.times) < 5:
        return term.omega
    order = np.argsort(term.times, kind="stable")
    omega = term.omega[order]
    padded = np.concatenate([omega[:2], omega, omega[-2:]])
    usual = np.median(np.lib.stride_tricks.sliding_window_view(padded, 5, axis=0), axis=-1)
    away = np.abs(omega - usual)
    limit = 8 * np.maximum(np.median(away, axis=0), term.noise[order])
    found = np.empty_like(omega)
    found[order] = np.where(away > limit, usual, omega)
    return found


# Vectors in the fixed frame and the same vectors in the frame of the body, at times.
_Vectors = tuple[Doubles, Doubles, Doubles]
# The number of windows with which an initial attitude is aligned in turn, and the ratio of singular values from which
# vectors determine a rotation.
_WINDOWS, _RANK = 7, 1e-3
# Smallest number of times at which windows are placed.
_GRID = 100


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
        with silenced(Warning), np.errstate(all="ignore"):
            path = make_smoothing_spline(
                times[order], y, "r:3", knots=min(count, 200), penalty="jerk", on_failure="ignore"
            )
        accelerations = path(np.clip(term.times, times.min(), times.max()), 2)
        if np.isfinite(accelerations).all():
            expected = expected + accelerations
    return term.times, expected, term.f


def _integrated(setup: Setup, space: Space[Any], rate: RateTerm, vectors: list[_Vectors]) -> Start:
    """Return the attitudes that follow from the rates and from vectors known in both frames.

    The integral of the rates is aligned with the vectors in windows that become longer, and every alignment yields a
    better bias of the rates, with which they are integrated again.
    """
    grid = setup.knots if len(setup.knots) > _GRID else np.linspace(setup.knots[0], setup.knots[-1], _GRID)
    order = np.argsort(rate.times, kind="stable")
    bias = np.zeros(3) if rate.bias is None else np.array(setup.constants[rate.bias].start)
    at = np.arange(len(grid))
    matrices = attitudes_at(rate.times[order], rate.omega[order] - bias, grid)
    for level in range(_WINDOWS - 1 if rate.bias is not None else 0, -1, -1):
        profile = np.zeros((len(grid), 3, 3))
        for times, fixed, body in vectors:
            index = _closest(grid, times)
            near = np.einsum("nij,nj->ni", matrices[index], body)
            np.add.at(profile, index, fixed[:, :, None] * near[:, None, :])
        if not level:
            break
        half = max(1, len(grid) >> (level + 1))
        total = np.concatenate([np.zeros((1, 3, 3)), np.cumsum(profile, axis=0)])
        windows = total[np.minimum(at + half + 1, len(grid))] - total[np.maximum(at - half, 0)]
        sizes = np.linalg.svd(windows, compute_uv=False)
        if not np.all(sizes[:, 1] > _RANK * sizes[:, 0]):
            continue
        # The aligned attitudes turn more slowly than the integrated ones by the remaining bias.
        aligned = np.stack([nearest_rotations(own) for own in windows]) @ matrices
        steps = [np.swapaxes(own[:-1], -1, -2) @ own[1:] for own in (aligned, matrices)]
        spin = np.swapaxes(steps[0], -1, -2) @ _SO3.log(steps[0], steps[1])
        vector = np.stack([spin[:, 2, 1], spin[:, 0, 2], spin[:, 1, 0]], axis=-1)
        bias = bias + np.median(vector / np.diff(grid)[:, None], axis=0)
        matrices = attitudes_at(rate.times[order], rate.omega[order] - bias, grid)
    frame = nearest_rotations(profile.sum(axis=0)) @ matrices[0]
    integral = Integral(Rates(rate.times[order], rate.omega[order], 0.0, bias, None), bias)
    before = integral.at(grid[:1])[0][0].T
    values = {} if rate.bias is None else {rate.bias: bias}
    return Start([lambda x: _rotations(space, frame @ before @ integral.at(x)[0])], values)


def _closest(grid: Doubles, x: Doubles) -> NDArray[np.intp]:
    """Return the index of the closest number of an increasing grid."""
    return np.searchsorted(0.5 * (grid[1:] + grid[:-1]), x)


def _seen(knots: Doubles, space: Space[Any], seen: list[DirectionTerm]) -> Array:
    """Return the attitudes at the knots from the directions seen near them (Wahba's problem)."""
    profile = np.zeros((len(knots), 3, 3))
    for term in seen:
        np.add.at(profile, _closest(knots, term.times), np.einsum("nki,nkl->nil", term.reference, term.seen))
    # Attitudes of knots without two directions are those of their neighbours.
    good = np.flatnonzero(np.linalg.svd(profile, compute_uv=False)[:, 1] > 1e-6)
    if not len(good):
        total = nearest_rotations(profile.sum(axis=0))
        return _rotations(space, np.repeat(total[None], len(knots), axis=0))
    found = np.stack([nearest_rotations(own) for own in profile[good]])
    return _rotations(space, found[_closest(good.astype(np.float64), np.arange(float(len(knots))))])


def _rotations(space: Space[Any], matrices: Doubles) -> Array:
    if isinstance(space, SpecialOrthogonal):
        return np.asarray(space.project(matrices))
    quaternions = matrix_to_quaternion(matrices, scalar_first=True)
    signs = np.cumprod([1.0, *np.where(np.sum(quaternions[1:] * quaternions[:-1], axis=-1) < 0, -1.0, 1.0)])
    return np.asarray(signs[:, None] * quaternions)
