"""Initial curves of an estimate, and the search for the best result and the knots."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .. import _core
from .._base.arrays import short_repr
from .._base.exceptions import ConvergenceError, SymsplineError
from .._base.faults import silenced, warn
from .._base.time import TimeAxis
from .._base.typing import Progress
from .._core import ValidationError
from .._smoothing import SmoothingWarning, make_smoothing_spline
from .._smoothing.noise import split
from .._smoothing.solve import places
from .._spaces import AnySpace, Array, Doubles, Euclidean, Product, SpecialOrthogonal, factors_of, nearest_rotations
from .._splines.base import Curve
from .._splines.cubic import CubicSpline
from ..convert._quaternions import matrix_to_quaternion
from ..measure import Points
from .problem import (
    DirectionTerm,
    ForceTerm,
    PointTerm,
    RateTerm,
    Setup,
    Solution,
    Term,
    Values,
    VelocityTerm,
    body_of,
    iterate,
    projected,
    residuals,
)
from .rates import Attitudes, Integral, Path, Rates, attitudes_at

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
        # Loops take fewer calls of functions than comprehensions; most spaces have few parts.
        points = []
        for path in self.paths:
            points.append(path(knots))
        return points


def starts(setup: Setup, space: AnySpace, axis: TimeAxis, start: object) -> Iterator[Start]:
    """Yield initial curves in decreasing order of promise, computed on demand."""
    if start is not None:
        if not isinstance(start, Curve) or start.space != space:
            raise ValidationError(f"start must be a curve on {space!r}, not {short_repr(start)}")
        yield Start([_of_curve(start, axis, part) for part in range(len(setup.spaces))], {})
        return
    candidates_of_parts = [_candidates(setup, part, space) for part, space in enumerate(setup.spaces)]
    chosen = [candidates[0]() for candidates in candidates_of_parts]
    yield _joined(chosen)
    for part, candidates in enumerate(candidates_of_parts):
        for candidate in candidates[1:]:
            yield _joined([*chosen[:part], candidate(), *chosen[part + 1 :]])


def _joined(parts: list[Start]) -> Start:
    values: Values = {}
    for start in parts:
        values |= start.values
    return Start([path for start in parts for path in start.paths], values)


def _of_curve(start: Curve[Any], axis: TimeAxis, part: int) -> PathOfPart:
    """Return the path of one part of a curve passed by the user."""

    def path(x: Doubles) -> Array:
        points = start(axis.shown(x, ()), extrapolate="geodesic")
        of_factors = points if isinstance(start.space, Product) else (points,)
        return [
            part_points
            for factor, rows in zip(factors_of(start.space), of_factors, strict=True)
            for part_points in split(factor, rows)
        ][part]

    return path


def _candidates(setup: Setup, part: int, space: AnySpace) -> list[Callable[[], Start]]:
    """Return functions that compute initial curves of one part, the most promising first."""
    points = [term for term in setup.terms if isinstance(term, PointTerm) and term.parts == [part]]
    rates = [term for term in setup.terms if isinstance(term, RateTerm) and term.parts == [part]]
    seen = [term for term in setup.terms if isinstance(term, DirectionTerm) and term.parts == [part]]
    candidates: list[Callable[[], Start]] = []
    times = np.concatenate([term.times for term in points]) if points else np.empty(0)
    spread = len(np.unique(times)) > 1
    if rates and rates[0].body.is_rotation:
        attitudes = _attitudes(space, points, seen)
        forces = [term for term in setup.terms if isinstance(term, ForceTerm) and term.parts[0] == part]

        def smoothed(x: Doubles) -> Doubles:
            return body_of(space).matrices(_smoothed(setup, space, points, []).paths[0](x))

        def aligned() -> Start:
            start = _with_rates(setup, space, rates, attitudes, smoothed if spread else None)
            return start._replace(paths=[_signed(start.paths[0], points)]) if space != _SO3 else start

        def by_vectors() -> Start:
            vectors = [_force_vectors(setup, term) for term in forces]
            vectors += [(np.repeat(term.times, term.seen.shape[1]), *_rows(term.reference, term.seen)) for term in seen]
            # The rows of a rotation matrix are the fixed axes in the frame of the body.
            turned = [(np.repeat(term.times, 3), body_of(space).matrices(term.y)) for term in points]
            vectors += [(times, *_rows(np.eye(3), matrices)) for times, matrices in turned]
            return _integrated(setup, space, rates[0], vectors)

        several = sum([len(attitude.attitudes.times) for attitude in attitudes])
        candidates = [aligned] if several else []
        if forces or (seen and several < _FEW) or not several:
            candidates.insert(0 if several < _FEW else 1, by_vectors)
        if spread and not setup.automatic and _are_dense(setup, points, rates):
            # The motion between attitudes is so small that attitudes alone suffice, which is faster.
            return [lambda: _smoothed(setup, space, points, [], _MOST_WITH_RATES), *candidates]
    beside = [term for term in setup.terms if isinstance(term, VelocityTerm) and term.parts == [part]]
    if beside and not isinstance(space, Euclidean):
        candidates.append(lambda: _smoothed(setup, space, points, beside))
    if spread:
        candidates.append(lambda: _smoothed(setup, space, points, []))
    if candidates:
        return candidates
    if seen:
        return [lambda: Start([lambda x: _seen(x, space, seen)], {})]
    if len(times):
        return [lambda: Start([lambda x: np.repeat(points[0].y[:1], len(x), axis=0)], {})]
    if isinstance(space, Euclidean):
        return [lambda: Start([lambda x: np.zeros((len(x), *space.point_shape))], {})]
    raise ValidationError(
        f"there is no initial curve on {space!r}: no measurement has points of it, rates or directions. Pass `start`."
    )


def _are_dense(setup: Setup, points: list[PointTerm], rates: list[RateTerm]) -> bool:
    """Whether attitudes determine the path between them: the body turns by little from one to the next."""
    if not setup.least_squares or {term.time_offset for term in (*points, *rates)} != {None}:
        return False
    times = np.unique(np.concatenate([setup.knots[[0, -1]], *[term.times for term in points]]))
    sigma = np.concatenate([term.scales for term in points]).max()
    speed = np.linalg.norm(np.concatenate([term.omega for term in rates]), axis=1).max()
    return bool(np.diff(times).max() * speed + 3 * sigma < _SMALL)


# ---- points ----


def _smoothed(
    setup: Setup,
    space: AnySpace,
    points: list[PointTerm],
    beside: list[VelocityTerm],
    most: int = _MOST,
) -> Start:
    """Return smoothed points, together with those at which velocities are given."""
    scales = [term.scales for term in points]
    typical = float(np.median(np.concatenate(scales))) if scales else 1.0
    both: list[PointTerm | VelocityTerm] = [*points, *beside]
    times, y = np.concatenate([term.times for term in both]), np.concatenate([term.y for term in both])
    sigma = np.concatenate([*scales, *[np.full(len(term.times), _BESIDE * typical) for term in beside]])
    order = np.argsort(times, kind="stable")
    # Automatic knots are few at first, so they do not limit the number.
    count = None if setup.automatic else min(len(np.unique(times)), max(len(setup.knots), 2), most)
    with silenced(Warning), np.errstate(all="ignore"):
        curve = make_smoothing_spline(
            times[order],
            y[order],
            space,
            weights=(sigma[order] / sigma.min()) ** -2.0,
            knots=count,
            on_failure="ignore",
            loss="linear" if setup.least_squares else "cauchy",
        )

    def path(x: Doubles) -> Array:
        points = np.asarray(curve(x, extrapolate="geodesic"))
        return points if np.isfinite(points).all() else np.repeat(y[order][:1], len(x), axis=0)

    return Start([path], {})


# ---- rates ----


def _signed(path: PathOfPart, points: list[PointTerm]) -> PathOfPart:
    """Return a path of unit quaternions with the sign of most of the measured ones."""

    def signed(x: Doubles) -> Array:
        quaternions = path(x)
        same = [np.sign(np.sum(quaternions[_closest(x, term.times)] * term.y, axis=1)).sum() for term in points]
        return -quaternions if sum(same) < 0 else quaternions

    return signed


class _Seen(NamedTuple):
    """Measured attitudes, and the name of the offset of their times."""

    attitudes: Attitudes
    time_offset: str | None


def _attitudes(space: AnySpace, points: list[PointTerm], seen: list[DirectionTerm]) -> list[_Seen]:
    """Return measured attitudes; if they are few, also attitudes computed from simultaneous directions."""
    known, count = [], 0
    for term in points:
        attitudes = Attitudes(term.times, body_of(space).matrices(term.y), term.scales)
        known.append(_Seen(attitudes, term.time_offset))
        count += len(term.times)
    if count >= _FEW:
        return known
    for direction in seen:
        profile = np.einsum("nki,nkl->nil", direction.reference, direction.seen)
        sizes = np.linalg.svd(profile, compute_uv=False)
        good = sizes[:, 1] > _RANK * sizes[:, 0]
        if good.any():
            sigma = np.mean(direction.noise[good], axis=1)
            attitudes = Attitudes(direction.times[good], nearest_rotations(profile[good]), sigma)
            known.append(_Seen(attitudes, direction.time_offset))
    return known


def _with_rates(
    setup: Setup,
    space: AnySpace,
    rates: list[RateTerm],
    attitudes: list[_Seen],
    smoothed: Callable[[Doubles], Doubles] | None,
) -> Start:
    """Return the integrated rates, aligned with measured attitudes, and estimates of the bias and the time offset."""
    first = max(rates, key=_coverage)
    name, values = first.time_offset, setup.constants

    def began(term_offset: str | None) -> float:
        return 0.0 if term_offset is None else float(values[term_offset].start[0])

    # Of attitudes with different time offsets, use those without an offset, or else the most numerous ones.
    offsets = [attitude.time_offset for attitude in attitudes]
    chosen = None if None in offsets else max(dict.fromkeys(offsets), key=offsets.count)
    alike = [attitude.attitudes for attitude in attitudes if attitude.time_offset == chosen]
    data = Attitudes(*map(np.concatenate, zip(*alike, strict=True))).later(began(chosen))
    data = data.taken(np.argsort(data.times, kind="stable"))
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
    constants: Values = {}
    if first.bias is not None:
        constants[first.bias] = path.bias
    late = 0.0
    if name != chosen and name is not None:
        late = path.offset
        constants[name] = np.array([began(name) - late])
    elif name != chosen and chosen is not None:
        constants[chosen] = np.array([began(chosen) + path.offset])
    for term in rates:
        if term.bias is not None and term.bias not in constants:
            constants[term.bias] = _relative(first, term) + (path.bias if first.bias is not None else 0.0)
    return Start([lambda x: _rotations(space, path(x + late))], constants)


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
    filtered = np.empty_like(omega)
    filtered[order] = np.where(away > limit, usual, omega)
    return filtered


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
    points = [
        points_term
        for points_term in setup.terms
        if isinstance(points_term, PointTerm) and points_term.roots is None and points_term.parts == [term.parts[1]]
    ]
    times = np.concatenate([term.times for term in points]) if points else np.empty(0)
    expected = np.tile(-term.gravity, (len(term.times), 1))
    count = len(np.unique(times))
    if count > 5:
        order = np.argsort(times, kind="stable")
        y = np.concatenate([term.y for term in points])[order]
        with silenced(Warning), np.errstate(all="ignore"):
            path = make_smoothing_spline(
                times[order], y, "r:3", knots=min(count, 200), penalty="jerk", on_failure="ignore"
            )
        accelerations = path(np.clip(term.times, times.min(), times.max()), 2)
        if np.isfinite(accelerations).all():
            expected = expected + accelerations
    return term.times, expected, term.f


def _integrated(setup: Setup, space: AnySpace, rate: RateTerm, vectors: list[_Vectors]) -> Start:
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
        aligned = np.stack([nearest_rotations(window) for window in windows]) @ matrices
        steps = [np.swapaxes(attitudes[:-1], -1, -2) @ attitudes[1:] for attitudes in (aligned, matrices)]
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


def _seen(knots: Doubles, space: AnySpace, seen: list[DirectionTerm]) -> Array:
    """Return the attitudes at the knots from the directions seen near them (Wahba's problem)."""
    profile = np.zeros((len(knots), 3, 3))
    for term in seen:
        np.add.at(profile, _closest(knots, term.times), np.einsum("nki,nkl->nil", term.reference, term.seen))
    # Attitudes of knots without two directions are those of their neighbours.
    good = np.flatnonzero(np.linalg.svd(profile, compute_uv=False)[:, 1] > 1e-6)
    if not len(good):
        total = nearest_rotations(profile.sum(axis=0))
        return _rotations(space, np.repeat(total[None], len(knots), axis=0))
    rotations = np.stack([nearest_rotations(matrix) for matrix in profile[good]])
    return _rotations(space, rotations[_closest(good.astype(np.float64), np.arange(float(len(knots))))])


def _rotations(space: AnySpace, matrices: Doubles) -> Array:
    if isinstance(space, SpecialOrthogonal):
        return projected(space, matrices)
    quaternions = matrix_to_quaternion(matrices, scalar_first=True)
    signs = np.cumprod([1.0, *np.where(np.sum(quaternions[1:] * quaternions[:-1], axis=-1) < 0, -1.0, 1.0)])
    return np.asarray(signs[:, None] * quaternions)


# ---- search ----

# A sensor contradicts a curve if the mean square of its residuals exceeds the first number by more than the second
# number of standard errors.
_LARGE, _DEVIATIONS = 1.5, 4.0
# Knots are divided again if the residuals exceed their standard deviations by this factor and more knots may help.
_MISSES = 1.2
# Two results are equally good if their losses differ by less than the first number. They are different if they are
# farther apart than the second number of standard deviations.
_EQUAL, _APART = 10.0, 5.0
# Points move by more than this number of standard deviations if there are too few knots. Intervals are then divided
# where points move by more than the second number, and at so many knots on both sides.
_MOVED, _MOVING, _BESIDES = 0.5, 0.2, 4
# Largest number of times that intervals are divided, and that this is repeated without an effect.
_HALVINGS, _IN_VAIN = 14, 2
# With fewer knots per datum than this, the motion may be so fast that dividing intervals has no effect at first.
_FEW_KNOTS = 0.1
_UNCONFIRMED = (
    "The automatic knots may be too few: the residuals are larger than the given standard deviations, and with twice "
    "as many knots the estimate does not converge. Check sigma, and pass knots."
)
# Intervals of given knots are gaps if they are longer than this number of median intervals.
_LONG = 5.0
# Initial number of equal intervals, and the largest number of times that they are bisected.
_FIRST, _ROUNDS = 12, 24
# The mean square of residuals in standard deviations may exceed one by this number plus three of its standard errors.
_SLACK = 0.1
# Times closer than this fraction of the mean distance of the knots are merged.
_CLOSE = 1e-6
# Intervals shorter than this multiple of the median time step of a sensor are not bisected.
_CLOSEST = 1.01
# Intervals without data are gaps if they are longer than this number of usual knot distances.
_GAP = 2.5
# Largest number of knots for which the residuals of the initial curve itself are computed.
_MOST_COMPARED = 200_000


class Starts:
    """Initial curves in decreasing order of promise, computed on demand and stored."""

    def __init__(self, setup: Setup, space: AnySpace, axis: TimeAxis, start: object) -> None:
        self._coming = starts(setup, space, axis, start)
        self._known: list[Start] = []

    def __getitem__(self, number: int) -> Start:
        """Return the initial curve with this number; raise IndexError if there are fewer."""
        while len(self._known) <= number:
            following = next(self._coming, None)
            if following is None:
                raise IndexError(number)
            self._known.append(following)
        return self._known[number]


class Search(NamedTuple):
    """The best result of several initial curves.

    Attributes
    ----------
    solution : Solution
        The best result.
    rival : float
        Distance in standard deviations to another result that is equally good, or 0.
    place : int
        Index of the knot at which that result is farthest away.
    """

    solution: Solution
    rival: float = 0.0
    place: int = 0

    def warn_of_rival(self, shown: Array) -> None:
        """Warn if another curve is equally good."""
        if self.rival:
            warn(
                "Two different curves agree equally well with the measurements. The other one is up to "
                f"{self.rival:.2g} standard deviations away, at t = {shown[self.place]}. To decide between them, pass "
                "`start`, a Constant with sigma, or further measurements.",
                SmoothingWarning,
            )


def solved(
    setup: Setup, begin: Starts, progress: Progress | None, coarse: tuple[Setup, Solution] | None = None
) -> Search:
    """Iterate from the first initial curve, and from further ones while a sensor contradicts the best result.

    A result with fewer knots comes before the initial curves if no sensor contradicts it.
    """
    best: Solution | None = None
    refused: SymsplineError | None = None
    rival, place = 0.0, 0
    number = 0 if coarse is None or _contradicts(*coarse) else -1
    while best is None or best.failure or _contradicts(setup, best):
        near = None
        try:
            if number < 0 and coarse is not None:
                start, near = _of_solution(*coarse), [float(report.lam) for report in coarse[1].reports]
            else:
                start = begin[number]
        except IndexError:
            break
        number += 1
        try:
            solution = iterate(setup, start.points(setup.knots), start.values, progress, near)
        except (ValidationError, ConvergenceError) as error:
            refused = refused or error
            continue
        if best is None:
            best = solution
        elif not solution.failure:
            better = bool(best.failure) or solution.loss < best.loss
            if not best.failure and abs(solution.loss - best.loss) < _EQUAL:
                apart, at = _distance(setup, solution, best)
                if apart > _APART:
                    rival, place = apart, at
            else:
                rival = 0.0 if better else rival
            best = solution if better else best
    if best is None:
        assert refused is not None
        raise refused
    return Search(best, rival, place)


def _of_solution(setup: Setup, solution: Solution) -> Start:
    """Return the curve of a solution as an initial curve."""
    paths: list[PathOfPart] = []
    for space, points in zip(setup.spaces, solution.points, strict=True):
        paths.append(CubicSpline(setup.knots, points, space, bc_type=setup.bc_type))
    return Start(paths, solution.values)


def _contradicts(setup: Setup, solution: Solution) -> bool:
    """Whether the residuals of a sensor are larger than its noise."""
    for term, rows_of_term in zip(setup.terms, solution.rows, strict=True):
        rows = rows_of_term.residuals
        squares = np.sum(rows**2, axis=1)
        size = rows.shape[1]
        if term.loss == "linear":
            if squares.mean() / size > _LARGE + _DEVIATIONS * np.sqrt(2 / rows.size):
                return True
        elif np.median(squares) > (_LARGE + _DEVIATIONS * np.sqrt(4 / rows.size)) * _core.chi_squared(size, 0.5):
            return True
    return False


def _distance(setup: Setup, one: Solution, other: Solution) -> tuple[float, int]:
    """Return the largest distance of two results at the knots in standard deviations, and where it is."""
    squares = np.zeros(len(setup.knots))
    for space, p, q in zip(setup.spaces, one.points, other.points, strict=True):
        squares += space._apply("distance", p=p, q=q) ** 2
    apart = np.sqrt(squares / one.variances.sum(axis=1))
    at = int(np.argmax(apart))
    return float(apart[at]), at


def automatic(
    setup: Setup, begin: Starts, axis: TimeAxis, ends: Array, data: Doubles, progress: Progress | None
) -> tuple[Array, Setup, Search]:
    """Choose the knots, and estimate.

    The first knots reproduce the initial curve. All intervals are then divided until the residuals do not decrease, and
    those where points move until none of them moves by more than half of its standard deviation.
    """

    def with_knots(knots: Doubles) -> tuple[Array, Setup]:
        shown = shown_times(axis, ends, knots)
        times = axis.knots(shown)
        later = np.append(True, np.diff(times) > 0)
        later[-1] = True
        return shown[later], setup.with_knots(times[later])

    knots = filled(that_reproduce(setup, begin[0], data), data)
    most = 2 * len(data) + len(setup.knots)
    shown, now = with_knots(knots)
    before: tuple[Array, Setup, Search] | None = None
    in_vain = 0
    for _ in range(_HALVINGS):
        refused: SymsplineError | None = None
        divided: NDArray[np.bool_] | None = None
        try:
            search = solved(now, begin, progress, None if before is None else (before[1], before[2].solution))
        except (ValidationError, ConvergenceError) as error:
            refused = error
        if refused or search.solution.failure:
            # With more knots the numerical problem may become too difficult. The last result then remains.
            if before is not None:
                if _misses(before[2].solution):
                    warn(_UNCONFIRMED, SmoothingWarning)
                return before
            if len(now.knots) > most:
                break
        else:
            if before is not None:
                reports, reports_before = search.solution.reports, before[2].solution.reports
                sigma, last = float(reports[0].sigma), float(reports_before[0].sigma)
                at_bound = any(bool(report.at_bound) for report in reports)
                few = at_bound or len(now.knots) < _FEW_KNOTS * len(data)
                in_vain = 0 if sigma < 0.95 * last or few else in_vain + 1
                moved = _moved(before[1], before[2].solution, now, search.solution)
                if not _misses(search.solution) or in_vain >= _IN_VAIN:
                    if moved.max() <= _MOVED:
                        break
                    # The curve has enough knots where it hardly moved.
                    divided = _around(moved > _MOVING)
            if len(now.knots) > most:
                break
            before = (shown, now, search)
        shown, now = with_knots(graded(bisected(now.knots, divided)))
    if refused:
        raise refused
    return shown, now, search


def _misses(solution: Solution) -> bool:
    """Whether the residuals are so large that more knots may be needed."""
    return float(solution.reports[0].sigma) > _MISSES


def _around(chosen: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return the intervals at most `_BESIDES` knots away from chosen knots."""
    near = np.convolve(chosen, np.ones(2 * _BESIDES + 1), "same") > 0
    return np.asarray(near[1:] | near[:-1])


def _moved(coarse: Setup, before: Solution, fine: Setup, solution: Solution) -> Doubles:
    """Return the distances of the curve with fewer knots at the knots, in standard deviations."""
    x = np.clip(fine.knots, coarse.knots[0], coarse.knots[-1])
    # The distances are the lengths of the residuals of points.
    points: list[Term] = []
    for part, (space, y) in enumerate(zip(fine.spaces, solution.points, strict=True)):
        noise = np.ones((len(x), space.dim))
        points.append(PointTerm("", Points(x, y, sigma=1.0), x, part, space, y, noise))
    apart = residuals(replace(coarse, terms=points), before.points, before.values)
    if apart is None:
        return np.full(len(x), np.inf)
    squares = np.zeros(len(x))
    for rows in apart:
        squares += (rows**2).sum(axis=1)
    return np.asarray(np.sqrt(squares / solution.variances.sum(axis=1)))


# ---- knots as dense as the measurements require, and in gaps as dense as next to them ----


def merged(times: Doubles, count: int) -> NDArray[np.intp]:
    """Return the indices of increasing times, omitting times too close to the one before for this number of knots."""
    least = _CLOSE * float(times[-1] - times[0]) / max(count, len(times))
    cells = np.floor((times - times[0]) / least) if least > 0 else np.arange(len(times))
    # Two times in neighbouring cells may also be close.
    apart = np.append(True, (np.diff(cells) > 0) & (np.diff(times) > least))
    apart[-1] = True
    index = np.flatnonzero(apart)
    if len(index) > 2 and times[index[-1]] - times[index[-2]] <= least:
        index = np.delete(index, -2)
    return index


def filled(knots: Doubles, data: Doubles) -> Doubles:
    """Add knots in the gaps of the data, as close together as next to the gap.

    The uncertainty grows within a gap. One cubic cannot represent this, so that bands would be too narrow.
    """
    h = np.diff(knots)
    # Longest distance without data within each interval.
    inner = np.unique(np.concatenate([knots, data]))
    widest = np.maximum.reduceat(np.diff(inner), np.searchsorted(inner, knots[:-1]))
    usual = float(np.median(h[widest <= 0.5 * h])) if np.any(widest <= 0.5 * h) else float(np.median(h))
    gaps = (widest > 0.5 * h) & (h > _GAP * usual)
    parts = np.where(gaps, np.ceil(h / usual), 1.0)
    # Gaps receive at most as many knots as the rest.
    more = parts.sum() - len(h)
    if more > len(h):
        parts = np.where(gaps, np.maximum(np.ceil(parts * len(h) / more), 2.0), 1.0)
    i, j = places(parts.astype(int))
    return np.append(knots[i] + h[i] * (j / parts[i]), knots[-1])


def graded(knots: Doubles) -> Doubles:
    """Add knots until the lengths of neighbouring intervals differ by at most a factor of two."""
    while True:
        h = np.diff(knots)
        long = h > 2.01 * np.minimum(np.append(np.inf, h[:-1]), np.append(h[1:], np.inf))
        if not long.any():
            return knots
        knots = bisected(knots, long)


def bisected(knots: Doubles, chosen: NDArray[np.bool_] | None = None) -> Doubles:
    """Add the midpoints of all intervals, or of the chosen ones."""
    middles = 0.5 * (knots[1:] + knots[:-1])
    return np.sort(np.concatenate([knots, middles if chosen is None else middles[chosen]]))


def shown_times(axis: TimeAxis, ends: Array, x: Doubles) -> Array:
    """Convert times of the core to the form passed by the user; the first and the last one are `ends`."""
    times: Array
    if axis.origin is not None and not axis.dates:
        # Large integers cannot be represented as floating-point numbers.
        times = axis.origin + np.rint(x).astype(np.int64)
    else:
        times = np.array(axis.shown(x, ()))
        times = times.astype(np.promote_types(times.dtype, ends.dtype))
    times[[0, -1]] = ends[[0, -1]]
    return times


def first_knots(begin: float, end: float) -> Doubles:
    """Return the knots with which the search for automatic knots begins."""
    return np.linspace(begin, end, _FIRST + 1)


def that_reproduce(setup: Setup, start: Start, data: Doubles) -> Doubles:
    """Return knots for which the spline through an initial curve has the same residuals as that curve.

    An interval is bisected if the mean square of the residuals of a sensor, over three intervals, exceeds one by more
    than three standard errors, and the residuals differ from those of the initial curve.

    Parameters
    ----------
    setup : Setup
        The problem, with the first knots.
    start : Start
        Initial curve.
    data : ndarray
        All times of the measurements, merged.
    """
    fine = np.unique(np.concatenate([setup.knots, data]))
    fine = fine[merged(fine, len(fine))]
    base = None if len(fine) > _MOST_COMPARED else residuals(setup.with_knots(fine), start.points(fine), start.values)
    knots = setup.knots
    values = {name: np.array(constant.start) for name, constant in setup.constants.items()} | start.values
    for _ in range(_ROUNDS):
        of_spline = residuals(setup.with_knots(knots), start.points(knots), start.values)
        if of_spline is None:
            bad = np.diff(knots) > 0
        else:
            bad = np.zeros(len(knots) - 1, bool)
            for k, (term, rows) in enumerate(zip(setup.terms, of_spline, strict=True)):
                bad |= _exceeding(knots, term.shifted_times(values), rows, None if base is None else base[k])
        if not bad.any() or len(knots) > 2 * len(fine):
            break
        knots = bisected(knots, bad)
    return graded(knots)


def _exceeding(knots: Doubles, times: Doubles, rows: Doubles, base: Doubles | None) -> NDArray[np.bool_]:
    """Return the intervals in which residuals are larger than their noise and differ from those of the start."""
    i = np.clip(np.searchsorted(knots, times, side="right") - 1, 0, len(knots) - 2)
    size = rows.shape[1]

    def three(weights: Doubles | None) -> Doubles:
        sums = np.bincount(i, weights, minlength=len(knots) - 1)
        return np.convolve(sums, np.ones(3), "same")

    count = three(None)
    squares = three(np.sum(rows**2, axis=1)) / np.maximum(size * count, 1)
    large = squares > 1 + _SLACK + 3 * np.sqrt(2 / np.maximum(size * count, 1))
    if base is not None:
        apart = three(np.sum((rows - base) ** 2, axis=1)) / np.maximum(size * count, 1)
        # More knots would not reduce residuals that the initial curve has as well.
        large &= apart > _SLACK
    # At most about one knot per sample, by the median time step because some samples may be very close together.
    steps = np.diff(np.unique(times))
    least = _CLOSEST * float(np.median(steps)) if len(steps) else np.inf
    return np.asarray(large & (np.bincount(i, minlength=len(knots) - 1) > 1) & (np.diff(knots) > least))


# ---- warnings about knots ----


def warn_of_gaps(shown: Array, knots: Doubles, data: Doubles) -> None:
    """Warn if a gap in the data contains no given knots."""
    h = np.diff(knots)
    if len(h) < 4 or not len(data):
        return
    within = np.searchsorted(data, knots[1:], side="left") - np.searchsorted(data, knots[:-1], side="right")
    long = (h > _LONG * np.median(h)) & (within == 0)
    long &= (data[0] < knots[1:]) & (data[-1] > knots[:-1])
    if long.any():
        i = int(np.argmax(np.where(long, h, 0)))
        warn(
            f"There are no data and no knots between knots[{i}] = {shown[i]} and knots[{i + 1}] = {shown[i + 1]}. The "
            "curve is a single cubic there, and its bands are too narrow. Add knots in this gap, as close together as "
            "next to it, or pass the number of knots.",
            SmoothingWarning,
        )


def warn_of_turns(setup: Setup, shown: Array) -> None:
    """Warn if measured rates turn a body by more than half a turn between two knots."""
    for term in setup.terms:
        if not isinstance(term, RateTerm) or not term.body.is_rotation:
            continue
        order = np.argsort(term.times, kind="stable")
        t, omega = term.times[order], term.omega[order]
        angles = np.concatenate([np.zeros((1, 3)), np.cumsum(0.5 * np.diff(t)[:, None] * (omega[1:] + omega[:-1]), 0)])
        # The norm of the integrated rates is a lower bound of the turn, and hardly affected by noise.
        at = np.stack([np.interp(setup.knots, t, row) for row in angles.T], axis=-1)
        turns = np.linalg.norm(np.diff(at, axis=0), axis=1)
        i = int(np.argmax(turns))
        if turns[i] > np.pi:
            warn(
                f"{term.label} turns the body by {np.degrees(turns[i]):.0f}° between knots[{i}] = {shown[i]} and "
                f"knots[{i + 1}] = {shown[i + 1]}. The curve has at most half a turn between two knots. Pass more "
                "knots, or knots='auto', and check the unit of the rates.",
                SmoothingWarning,
            )
            return
