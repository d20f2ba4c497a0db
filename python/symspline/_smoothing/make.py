"""Making smoothing splines."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Unpack, overload

import numpy as np
from numpy.typing import ArrayLike

from .._arrays import short_repr, whole_number
from .._core import ValidationError
from .._curves.ends import End, freeze_bc_type, is_closed
from .._curves.fit import FitProblem, Points, fit, mask_of
from .._curves.solve import Options, Progress
from .._errors import raise_or_warn
from .._far import warn_of_far_points
from .._options import check_on_failure, check_progress, checked_extrapolate
from .._signs import warn_of_signs
from .._spaces import Product, Space, SpecialEuclidean, factors_of
from .._spaces import space as space_named
from .._typing import (
    ChoiceOptions,
    Criterion,
    Extrapolate,
    FloatArray,
    Loss,
    LsqOptions,
    Numbers,
    OnFailure,
    P,
    PointsLike,
    PProduct,
    SmoothingBCType,
    SmoothingMethod,
)
from ..manifolds._manifold import refuse_functions
from .data import (
    Given,
    Knots,
    SmoothingData,
    has_all_times,
    in_gaps,
    knots_for,
    merge_close_knots,
    points_of,
    read_noisy,
    thin_knots,
)
from .factors import grouped, is_several, join, parts_of_factor, smoothed_spaces, split_ends
from .report import SmoothingReport
from .solve import NO_CURVE, Asked, n_knots_for_df, one_a_curve, smoothed
from .spline import SmoothingSpline
from .spread import warn_of_spread
from .warned import warn_of_bounds

_FIT = Options("auto", 1e-12, None)
# Knots from which fewer are tried first, and how many.
_MANY, _FIRST = 4000, 2000
# How often λ may ask for other knots.
_TRIES = 4


@overload
def make_smoothing_spline(  # type: ignore[overload-overlap]
    t: ArrayLike | None,
    points: PointsLike,
    space: Product[PProduct],
    lam: Numbers | None = None,
    **options: Unpack[ChoiceOptions],
) -> SmoothingSpline[PProduct, tuple[SmoothingReport, ...]]: ...


@overload
def make_smoothing_spline(
    t: ArrayLike | None,
    points: PointsLike,
    space: SpecialEuclidean,
    lam: Numbers | None = None,
    **options: Unpack[ChoiceOptions],
) -> SmoothingSpline[FloatArray, tuple[SmoothingReport, ...]]: ...


@overload
def make_smoothing_spline(
    t: ArrayLike | None,
    points: PointsLike,
    space: Space[P] | str,
    lam: Numbers | None = None,
    **options: Unpack[ChoiceOptions],
) -> SmoothingSpline[P]: ...


def make_smoothing_spline(
    t: ArrayLike | None,
    points: PointsLike,
    space: Space[Any] | str,
    lam: Numbers | None = None,
    *,
    weights: Numbers | None = None,
    frames: Numbers | None = None,
    knots: ArrayLike | None = None,
    criterion: Criterion = "gcv",
    gamma: float = 1.4,
    sigma: Numbers | None = None,
    bc_type: SmoothingBCType = "natural",
    loss: Loss = "linear",
    method: SmoothingMethod = "auto",
    tol: float = 1e-3,
    max_iter: int = 50,
    extrapolate: Extrapolate = None,
    on_failure: OnFailure = "raise",
    atol: float | None = None,
    where: ArrayLike | None = None,
    progress: Progress | None = None,
) -> SmoothingSpline[Any, Any]:
    """Fit a C² curve close to noisy points.

    The curve minimises a weighted sum of squared distances to the data and the integrated squared acceleration. The
    data determine the weight λ between the two, unless `lam` is given. In flat space the result is SciPy's
    ``make_smoothing_spline``.

    Parameters
    ----------
    t : array_like of float or datetime64, shape (N,) or (..., N), or None
        Times of the data, not decreasing. Several data may have one time; consecutive copies of a datum count as one
        datum with the sum of their weights. None means 0, 1, ..., N - 1.
    points : array_like, shape (..., N, *space.point_shape)
        Noisy points. Leading axes are batch axes; each curve has its own λ. For a `Product` a tuple of arrays.
    space : Space or str
        A space or its name. Points of `SpecialEuclidean` are smoothed as rotations and positions, which have a λ and a
        noise level each: a rigid motion has no invariant metric. The curve is a curve of the space through the poses
        that result.
    lam : float, array_like or tuple, optional
        λ ≥ 0 in units of weight · time³. With 0 the curve comes as near to the data as its knots allow; large values
        give a geodesic. For a batch also one for each curve; for products and poses also a tuple with one for each
        part. Chosen by `criterion` if omitted.
    weights : array_like or tuple, optional
        Weights ≥ 0 of the data, shape (N,) or (..., N): the inverse variances of their noise up to a common factor.
        Points of weight 0 are left out, and may be NaN. Or information matrices W, shape (N, m, m) or (..., N, m, m)
        with m = ``space.dim``: inverse covariances of the noise, possibly rank-deficient. Then eᵀWe takes the place of
        w d², where e are the coordinates of ``space.log(y, γ(t))``. For a product a tuple with one of these for each
        factor. For poses also a pair, for rotations and positions; of matrices for whole poses the correlation of the
        two is not used.
    frames : array_like or tuple, optional
        Tangent vectors that the information matrices refer to, m at every point and not necessarily orthonormal, shape
        (..., N, m, *space.point_shape). Default ``space.frame(points)``. For rotations,
        ``symspline.rotations.velocities(points[:, None], np.eye(3))`` are the axes of the body, in radians.
    knots : int or array_like, optional
        Knots of the curve: how many, or an increasing array that reaches from the first to the last time. About four
        times the degrees of freedom are enough. By default all times of the data are knots; of more than 4000 times,
        as many as the degrees of freedom need.
    criterion : {"gcv", "reml", "cp"}, default "gcv"
        How λ is chosen: by generalised cross-validation, by restricted maximum likelihood, or by Mallows' C_p, which
        needs `sigma`.
    gamma : float, default 1.4
        How much a degree of freedom counts in ``"gcv"``. With 1, cross-validation as Craven and Wahba define it, a
        curve through all data is chosen now and then.
    sigma : float, array_like or tuple, optional
        Standard deviation of the noise in a coordinate for weight one, as a length in the space: radians on the unit
        sphere. Also one for each curve, or a tuple for products and poses.
    bc_type : {"natural", "clamped", "periodic"} or pair, default "natural"
        Conditions at the ends, or ``(1, velocity)`` at either end, as for `CubicSpline`. Velocities are tangent at the
        first and the last point, from where they are transported to the curve. A closed curve has the period of its
        knots.
    loss : {"linear", "huber", "cauchy"}, default "linear"
        Least squares, or a loss that limits the influence of outliers. Cauchy's is the better one for many or distant
        outliers.
    method : {"auto", "linearized", "newton"}, default "auto"
        ``"linearized"`` solves the linearised problem in frames along the curve repeatedly. Its result differs from the
        minimum by about 1e-4 of the error, and by more where segments are long. ``"newton"`` is the full Gauss-Newton
        method, which is much slower. ``"auto"`` uses the first, and the second where the first converges slowly.
    tol : float, default 1e-3
        The search ends when no point moves by more than this fraction of its standard deviation.
    max_iter : int, default 50
        The largest number of iterations, each of which fits a spline. Robust losses have
        three stages with a limit each; the last of them may take 20 times as many.
    extrapolate, on_failure, atol, progress
        As for `CubicSpline`.
    where : array_like of bool, optional
        Mask over the batch. Curves where it is False are not fitted and evaluate to NaN. With ``on_failure="warn"`` or
        ``"ignore"`` the same holds for curves with invalid points or with data at fewer than two times.

    Returns
    -------
    SmoothingSpline
        A `CubicSpline` that knows λ, the degrees of freedom, the noise level and standard deviations.

    Raises
    ------
    ValidationError
        If the input does not meet the requirements above.
    ConvergenceError
        If the search did not end, or no spline joins the points that it led to.

    Warns
    -----
    SmoothingWarning
        If the chosen λ lies at a bound: the curve goes through all data, does not bend at all, or is the roughest one
        that was found.
    UserWarning
        If the data are about as far from their curve as random points of a compact space would be.

    Examples
    --------
    >>> import numpy as np
    >>> import symspline as ss
    >>> sphere, rng = ss.Sphere(2), np.random.default_rng(0)
    >>> t = np.linspace(0, 1, 100)
    >>> truth = np.stack([np.cos(2 * t), np.sin(2 * t), t], axis=-1) / np.sqrt(1 + t**2)[:, None]
    >>> noisy = sphere.exp(truth, 0.05 * sphere.random_tangent(rng, truth))
    >>> s = ss.make_smoothing_spline(t, noisy, sphere)
    >>> bool(sphere.distance(s(t), truth).max() < 0.05), round(s.sigma, 2)
    (True, 0.05)
    """
    space = space_named(space)
    refuse_functions(space, "smoothing splines are not made")
    policy = checked_extrapolate(extrapolate)
    check_on_failure(on_failure)
    check_progress(progress)
    if criterion == "cp" and sigma is None:
        raise ValidationError("criterion='cp' needs the standard deviation of the noise. Pass sigma.")
    for name, word in (("criterion", criterion), ("loss", loss), ("method", method)):
        if not isinstance(word, str):
            raise ValidationError(f"{name} must be a word, not {short_repr(word)}")
    if isinstance(gamma, bool) or not (isinstance(gamma, (int, float, np.number)) and 1 <= gamma < np.inf):
        raise ValidationError(f"gamma must be a number >= 1, not {short_repr(gamma)}")
    if isinstance(tol, bool) or not (isinstance(tol, (int, float, np.number)) and 0 < tol < np.inf):
        raise ValidationError(f"tol must be a number > 0, not {short_repr(tol)}")
    asked = Asked(
        criterion, float(gamma), loss, method, float(tol), whole_number(max_iter, "max_iter", 1), False
    )
    given = read_noisy(t, points, space, weights, frames, bc_type, atol)
    lams = _in_parts(space, lam, "lam", given.batch)
    sigmas = _in_parts(space, sigma, "sigma", given.batch)
    if loss != "linear" and sigma is None and any(own.is_singular for own in given.weighing):
        raise ValidationError(
            f"loss={loss!r} estimates the noise level from the data, but `weights` has matrices without information in "
            "some directions. Pass sigma; it is 1 if the matrices are inverse covariances."
        )
    if given.times.shape[-1] == 2:
        # Two points have no outlier, and do not determine the size of the noise.
        asked = asked._replace(loss="linear")
    mask = mask_of(where, given.batch)
    some_given, faults = given.sound(space, mask, on_failure == "raise")
    noisy, chosen = some_given.checked(space), some_given.chosen
    if chosen is not None:
        lams, sigmas = ([own[chosen] for own in each] for each in (lams, sigmas))
    ends = [
        own
        for factor, of_factor in zip(factors_of(space), some_given.ends, strict=True)
        for own in split_ends(factor, of_factor)
    ]
    named = _names(given.batch, chosen)
    every = knots_for(given, knots)
    free = knots is None or has_all_times(every, noisy)

    def run(at: Knots, raise_lam: bool = False) -> list[Any]:
        own = at.of_curves(chosen)
        each = zip(points_of(noisy, space), noisy.weighing, _chosen(lams, own), sigmas, ends, strict=True)
        return [
            smoothed(
                part,
                noisy,
                points_of_part,
                weighing,
                own,
                one_lam,
                one_sigma,
                end,
                asked._replace(raise_lam=raise_lam),
                named,
                free,
                progress,
            )
            for (part, points_of_part), weighing, one_lam, one_sigma, end in each
        ]

    if is_closed(bc_type) and every.times.shape[-1] < 4:
        raise ValidationError(
            f"A closed curve needs at least 4 knots, and there are {every.times.shape[-1]}. Give more data, or knots."
        )
    if knots is None:
        found, at = _with_enough(every, noisy, lams, run)
        finer = in_gaps(at, given)
        # The knots in gaps come first: a larger λ than the criterion asks for harms the whole curve.
        if any(NO_CURVE in fault.what for _, _, own in found for fault in own):
            found, at = run(finer, raise_lam=True), finer
    else:
        found, at = run(every), every
    carried = [
        transport_end_velocities(end, part, own, curve_points, noisy)
        for end, (part, own), (curve_points, _, _) in zip(ends, points_of(noisy, space), found, strict=True)
    ]
    whole = _whole(given, noisy, chosen)
    at_knots = [
        join(factor, [_at_places(own, given.batch, chosen) for own, _, _ in parts])
        for factor, parts in zip(factors_of(space), grouped(space, found), strict=True)
    ]
    conditions = [
        _joined(factor, [_ends_at_places(one, given.batch, chosen) for one in own])
        for factor, own in zip(factors_of(space), grouped(space, carried), strict=True)
    ]
    parts = [
        Points(np.ascontiguousarray(factor._as_doubles(own)), 0.0, given.batch, at.times.shape[-1])
        for factor, own in zip(factors_of(space), at_knots, strict=True)
    ]
    good = None if chosen is None else _flags(given.batch, chosen)
    curve, reports, _ = fit(FitProblem(space, at.times, parts, conditions, _FIT, check=False, mask=good))
    noise = [part.map(lambda column: _at_places(column, given.batch, chosen)) for _, part, _ in found]
    spline = SmoothingSpline._of(
        given.clock, at.t, curve, _conditions(bc_type, conditions, space), policy, reports, whole, noise
    )
    faults += next((own for _, _, own in found if own), [])
    if faults:
        raise_or_warn(sorted(faults, key=lambda fault: fault.curve), on_failure, spline)
    warn_of_bounds(
        space,
        [part.report for part in noise],
        [_at_places(np.isnan(own), given.batch, chosen) for own in lams],
        [np.sum(own.weights > 0, axis=-1) for own in given.weighing],
    )
    warn_of_spread(space, curve, whole, [part.report.df for part in noise])
    nodes = given.times.shape[-1]
    warn_of_signs(
        space,
        [
            [
                Points(one._as_doubles(own), 0.0, given.batch, nodes)
                for one, own in zip(factors_of(space), whole.points, strict=True)
            ]
        ],
    )
    warn_of_far_points([curve], [reports])
    return spline


@overload
def make_lsq_spline(  # type: ignore[overload-overlap]
    t: ArrayLike | None,
    points: PointsLike,
    knots: ArrayLike,
    space: Product[PProduct],
    *,
    weights: Numbers | None = None,
    loss: Loss = "linear",
    **options: Unpack[LsqOptions],
) -> SmoothingSpline[PProduct, tuple[SmoothingReport, ...]]: ...


@overload
def make_lsq_spline(
    t: ArrayLike | None,
    points: PointsLike,
    knots: ArrayLike,
    space: SpecialEuclidean,
    *,
    weights: Numbers | None = None,
    loss: Loss = "linear",
    **options: Unpack[LsqOptions],
) -> SmoothingSpline[FloatArray, tuple[SmoothingReport, ...]]: ...


@overload
def make_lsq_spline(
    t: ArrayLike | None,
    points: PointsLike,
    knots: ArrayLike,
    space: Space[P] | str,
    *,
    weights: Numbers | None = None,
    loss: Loss = "linear",
    **options: Unpack[LsqOptions],
) -> SmoothingSpline[P]: ...


def make_lsq_spline(
    t: ArrayLike | None,
    points: PointsLike,
    knots: ArrayLike,
    space: Space[Any] | str,
    *,
    weights: Numbers | None = None,
    loss: Loss = "linear",
    **options: Unpack[LsqOptions],
) -> SmoothingSpline[Any, Any]:
    """The C² curve with natural ends and given knots that comes nearest to the data: ``Σ w d(y, γ(t))²`` is least.

    Args:
        t, points, space, weights, loss: as for `make_smoothing_spline`.
        knots: an array, or how many there are to be; there must be data beside every knot.
        options: the other keywords of `make_smoothing_spline`.

    >>> import numpy as np
    >>> import symspline as ss
    >>> t = np.linspace(0, 1, 40)
    >>> ss.make_lsq_spline(t, np.sin(3 * t)[:, None], 6, "r:1")(0.5).round(3)
    array([0.997])
    """
    if knots is None:
        raise ValidationError("knots must be given: an array of times, or how many there are to be")
    return make_smoothing_spline(t, points, space, 0.0, weights=weights, knots=knots, loss=loss, **options)


def _chosen(lams: list[Any], at: Knots) -> list[Any]:
    """Between two knots there is nothing to choose: the curve is the nearest geodesic, whatever λ is."""
    if at.times.shape[-1] > 2:
        return lams
    cube = np.ravel(at.times[..., 1] - at.times[..., 0]) ** 3
    return [np.where(np.isnan(lam), cube, lam) for lam in lams]


def _in_parts(space: Space, value: Any, name: str, batch: tuple[int, ...]) -> list[Any]:
    """A number a curve in every space in which data are smoothed."""
    spaces = smoothed_spaces(space)
    if is_several(space) and isinstance(value, tuple):
        if len(value) != len(spaces):
            raise ValidationError(
                f"`{name}` has {len(value)} entries, but there are {len(spaces)} parts to smooth: "
                f"{', '.join(map(repr, spaces))}. Give one for each."
            )
        return [one_a_curve(one, name, batch) for one in value]
    return [one_a_curve(value, name, batch)] * len(spaces)


def _names(batch: tuple[int, ...], chosen: Any) -> Callable[[int], tuple[int, str]]:
    """The number of a curve among those that are made to its number in the batch, and what messages call it."""

    def name(number: int) -> tuple[int, str]:
        there = number if chosen is None else int(chosen[number])
        return there, f" of curve {','.join(map(str, np.unravel_index(there, batch)))}" if batch else ""

    return name


def _flags(batch: tuple[int, ...], chosen: Any) -> Any:
    flags = np.zeros(batch, bool)
    flags.flat[chosen] = True
    return flags


def _at_places(column: Any, batch: tuple[int, ...], chosen: Any) -> Any:
    """What belongs to the curves that are made, at their places in the batch: NaN, False or zero for the others."""
    if chosen is None:
        return column
    rows = np.asarray(column)
    nothing = np.nan if rows.dtype.kind in "fc" else 0
    out = np.full((int(np.prod(batch)), *rows.shape[1:]), nothing, rows.dtype)
    out[chosen] = rows
    return out.reshape(*batch, *rows.shape[1:])


def _ends_at_places(ends: list[End] | None, batch: tuple[int, ...], chosen: Any) -> list[End] | None:
    return ends and [(kind, None if v is None else _at_places(v, batch, chosen)) for kind, v in ends]


def _whole(given: Given, noisy: SmoothingData, chosen: Any) -> SmoothingData:
    """The data of all curves; NaN for points of those that are left out."""
    if chosen is None:
        return noisy
    points = [_at_places(own, given.batch, chosen) for own in noisy.points]
    return SmoothingData(given.clock, given.t, given.times, points, given.weighing, given.batch)


def _with_enough(
    whole: Knots, noisy: SmoothingData, lams: list[Any], run: Callable[[Knots], list[Any]]
) -> tuple[list[Any], Knots]:
    """What is found with as many of the knots as λ and the degrees of freedom ask for; and these knots."""
    given = all(np.isfinite(lam).all() for lam in lams)
    at = merge_close_knots(whole, noisy, _of_all(lams) if given else None)
    if at.times.shape[-1] > _MANY:
        at = thin_knots(at, _FIRST)
    for tries in range(_TRIES):
        found = run(at)
        count = at.times.shape[-1]
        known = [np.asarray(part.report.lam) for _, part, _ in found]
        better = merge_close_knots(whole, noisy, _of_all(known))
        most = 2 * max(n_knots_for_df(part.report.df) for _, part, _ in found)
        if better.times.shape[-1] > max(_MANY, most):
            better = thin_knots(better, max(_FIRST, most))
        wanted = better.times.shape[-1]
        # A rough curve is rougher still with more knots; one that is stiff needs fewer.
        if tries == _TRIES - 1 or count >= wanted > 0.8 * count or (most <= 2 * count and wanted > count):
            break
        at = better
    return found, at


def _of_all(lams: list[Any]) -> float:
    """The λ by which knots are thinned that all curves have: as many as the roughest needs, if they are not too many
    for the stiffest."""
    flat = np.concatenate([np.ravel(lam) for lam in lams])
    flat = flat[np.isfinite(flat)]
    return float(max(flat.min(), 1e-3 * flat.max())) if flat.size else 0.0


def transport_end_velocities(
    ends: list[End] | None, space: Space, data: Any, points: Any, noisy: SmoothingData
) -> list[End] | None:
    """Velocities at the first and the last of the data, carried to the ends of the curve."""
    axis = len(noisy.batch)
    result: list[End] = []
    for (kind, vector), index in zip(ends or [], (0, -1), strict=ends is not None):
        if vector is not None:
            y, x = (np.take(rows, index, axis=axis) for rows in (data, points))
            good = np.isfinite(x).all(axis=tuple(range(axis, x.ndim)))
            moved = np.array(space._numbers(vector))
            moved[good] = space._apply("transport", p=y[good], q=x[good], v=moved[good])
            vector = np.ascontiguousarray(space._as_doubles(moved))
        result.append((kind, vector))
    return None if ends is None else result


def _joined(space: Space, ends: list[list[End] | None]) -> list[End] | None:
    """The conditions at the ends of a factor from those of its parts."""
    if ends[0] is None or len(ends) == 1:
        return ends[0]
    parts: tuple[Space, ...] = parts_of_factor(space)
    joined: list[End] = []
    for each in zip(*[own or [] for own in ends], strict=True):
        vectors = [vector for _, vector in each]
        if any(vector is None for vector in vectors):
            joined.append((each[0][0], None))
            continue
        rows = [part._numbers(vector) for part, vector in zip(parts, vectors, strict=True)]
        joined.append((each[0][0], np.ascontiguousarray(space._as_doubles(join(space, rows, 0.0)))))
    return joined


def _conditions(bc_type: Any, carried: list[list[End] | None], space: Space) -> Any:
    """The same as a user may write it."""
    if isinstance(bc_type, str):
        return bc_type

    def one(e: int) -> Any:
        each = [(ends or [])[e] for ends in carried]
        if each[0][1] is None:
            return "natural"
        vectors = tuple(
            factor._numbers(vector)
            for factor, (_, vector) in zip(factors_of(space), each, strict=True)
            if vector is not None
        )
        return (1, vectors if isinstance(space, Product) else vectors[0])

    return freeze_bc_type((one(0), one(1)))
