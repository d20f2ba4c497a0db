"""Fits of smoothing splines."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import Any, Unpack, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .._base.arrays import checked_flag, checked_number, short_repr, whole_number
from .._base.faults import is_silent
from .._base.typing import (
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
    Progress,
    SmoothingBCType,
    SmoothingMethod,
    SmoothingNoise,
    SmoothingPenalty,
    TimesLike,
)
from .._core import ValidationError
from .._curves.ends import NATURAL, End, freeze_bc_type
from .._curves.failures import raise_or_warn, warn_of_far_data, warn_of_far_points, warn_of_held_points, warn_of_signs
from .._curves.fit import Fit, Points, Problem, fit, mask_of
from .._curves.missing import counts_all_samples, data_without_missing, with_remedy
from .._curves.options import check_policies
from .._curves.solve import DEFAULTS, in_batch
from .._spaces import AnySpace, Array, Doubles, Product, Space, SpecialEuclidean, factors_of, space_named
from ..manifolds._manifold import refuse_functions
from .audit import audit
from .noise import (
    Part,
    SmoothingData,
    at_times,
    check_profiles,
    checked_ends,
    grouped,
    join,
    parts_of,
    parts_of_factor,
    read_adaptive_noise,
    read_noisy,
    read_smoothness,
    smoothed_spaces,
    valid_curves,
)
from .report import SmoothingReport, SmoothingWarning
from .solve import (
    NO_CURVE,
    Knots,
    SmoothCurves,
    SolverOptions,
    faults_of,
    geodesic_knots,
    has_all_times,
    in_gaps,
    in_long_gaps,
    knots_for,
    smoothed,
    with_enough_knots,
)
from .spline import AnySmoothingSpline, SmoothingSpline

# Largest dimension in which the full Gauss–Newton solver is used; its matrices have (2 dim)² entries.
_LARGE = 64


@overload
def make_smoothing_spline(  # type: ignore[overload-overlap]
    t: TimesLike | None,
    points: PointsLike,
    space: Product[PProduct],
    lam: Numbers | None = None,
    **options: Unpack[ChoiceOptions],
) -> SmoothingSpline[PProduct, tuple[SmoothingReport, ...]]: ...


@overload
def make_smoothing_spline(
    t: TimesLike | None,
    points: PointsLike,
    space: SpecialEuclidean,
    lam: Numbers | None = None,
    **options: Unpack[ChoiceOptions],
) -> SmoothingSpline[FloatArray, tuple[SmoothingReport, ...]]: ...


@overload
def make_smoothing_spline(
    t: TimesLike | None,
    points: PointsLike,
    space: Space[P] | str,
    lam: Numbers | None = None,
    **options: Unpack[ChoiceOptions],
) -> SmoothingSpline[P]: ...


@counts_all_samples
def make_smoothing_spline(
    t: TimesLike | None,
    points: PointsLike,
    space: AnySpace | str,
    lam: Numbers | None = None,
    *,
    weights: Numbers | None = None,
    frames: Numbers | None = None,
    knots: TimesLike | None = None,
    criterion: Criterion = "gcv",
    gamma: float = 1.2,
    penalty: SmoothingPenalty = "acceleration",
    sigma: Numbers | None = None,
    noise: SmoothingNoise | tuple[SmoothingNoise, ...] = "constant",
    bc_type: SmoothingBCType | None = None,
    loss: Loss = "linear",
    method: SmoothingMethod = "auto",
    tol: float = 1e-3,
    max_iter: int = 50,
    extrapolate: Extrapolate = None,
    on_failure: OnFailure = "raise",
    atol: float | None = None,
    where: ArrayLike | None = None,
    progress: Progress | None = None,
    skipna: bool = False,
) -> AnySmoothingSpline:
    r"""Fit a C² curve close to noisy points.

    The curve minimises a weighted sum of squared distances to the data and the integrated squared acceleration or
    jerk. The data determine the weight λ between the two, unless `lam` is given. On a Euclidean space the result equals
    SciPy's ``make_smoothing_spline`` with the same λ.

    Parameters
    ----------
    t : array_like of float or datetime64, shape (N,) or (..., N), or None
        Times of the data, in non-decreasing order. Several data may have the same time; consecutive copies of a datum
        count as one datum with the sum of their weights. None means 0, 1, ..., N - 1.
    points : array_like, shape (..., N, *space.point_shape)
        Noisy points. Leading axes are batch axes; each curve has its own λ. For a `Product`, a tuple of arrays.
    space : Space or str
        A space or its name. Points of `SpecialEuclidean` are smoothed as rotations and positions, each with its own λ
        and noise level, because rigid motions have no invariant metric. The curve is the spline of the space through
        the smoothed poses.
    lam : float, "adaptive", array_like or tuple, optional
        Weight λ ≥ 0 of the penalty, in units of weight · time³, or weight · time⁵ for the jerk. With 0 the curve is as
        close to the data as its knots allow; ``numpy.inf`` gives a geodesic, see Notes. ``"adaptive"`` lets λ vary
        along the curve if the data require it, for motion that rests and bursts; see Notes. For a batch also an array
        with one value per curve; for products and poses also a tuple with one entry per part. An array with one more
        axis has one value per segment between knots. By default `criterion` chooses λ.
    weights : array_like or tuple, optional
        Weights ≥ 0 of the data, shape (N,) or (..., N): the inverse variances of their noise up to a common factor.
        Points of weight 0 are ignored and may be NaN. Alternatively information matrices W, shape (N, m, m) or (...,
        N, m, m) with m = ``space.dim``: inverse covariances of the noise, possibly rank-deficient; see Notes. For a
        product, a tuple with one of these per factor. For poses also a pair, for rotations and positions; matrices for
        whole poses are used without the correlation between the two.
    frames : array_like or tuple, optional
        Tangent vectors to which the information matrices refer, m at every point and not necessarily orthonormal,
        shape (..., N, m, *space.point_shape). Default ``space.frame(points)``. For rotations,
        ``symspline.rotations.velocities(points[:, None], np.eye(3))`` are the axes of the body, in radians.
    knots : int or array_like, optional
        Knots of the curve: their number, or an increasing array that reaches from the first to the last time. About
        four times the degrees of freedom are enough. By default all times of the data are knots; if there are more
        than 4000 times, as many as the degrees of freedom require. Short parts of the recording, in which all times
        are knots, determine the first number, so that fast motion is not taken for noise.
    criterion : {"gcv", "reml", "cp"}, default "gcv"
        Criterion for λ: generalised cross-validation, restricted maximum likelihood, or Mallows' C_p, which requires
        `sigma`.
    gamma : float, default 1.2
        Weight of a degree of freedom in ``"gcv"``, at least 1. With 1, which is cross-validation as Craven and Wahba
        define it, the chosen curve occasionally passes through all data. Larger values smooth more: 1.4 suits motion
        along geodesics, and loses accuracy for other motion.
    penalty : {"acceleration", "jerk"}, default "acceleration"
        The derivative whose squared integral is the penalty. With ``"jerk"``, which suits motions with accelerations,
        large λ give curves of constant acceleration, and the ends are free.
    sigma : float, array_like or tuple, optional
        Standard deviation of the noise in one coordinate for weight one, as a length in the space: radians on the unit
        sphere. Also an array with one value per curve, or a tuple for products and poses.
    noise : {"constant", "adaptive"} or tuple, default "constant"
        ``"adaptive"`` lets the standard deviation of the noise vary along the curve if the data require it, for sensors
        that are quiet and noisy by turns. For products and poses also a tuple with one entry per part.
    bc_type : {"natural", "clamped", "periodic", "not-a-knot"} or pair, optional
        End conditions, or ``(1, velocity)`` at either end, as for `CubicSpline`. The default is ``"natural"``, and
        ``"not-a-knot"`` for the jerk, for which only this and ``"periodic"`` are available. Velocities must be tangent
        at the first and the last datum; they are transported to the curve. The period of a closed curve is that of its
        knots.
    loss : {"linear", "huber", "cauchy"}, default "linear"
        Least squares, or a loss that limits the influence of outliers. Use ``"cauchy"`` for many or distant outliers.
        λ is chosen from data without outliers. If their noise is so small that the curve follows nearly all of them,
        the result is the least-squares curve of these data, with λ chosen by ``"reml"``.
    method : {"auto", "linearized", "newton"}, default "auto"
        ``"linearized"`` solves the linearised problem in frames along the curve repeatedly. Its result differs from
        the minimum by about 1e-4 of the error, and by more where segments are long. ``"newton"`` is the full
        Gauss–Newton solver, which is much slower. ``"auto"`` uses the first, and the second where the first converges
        slowly.
    tol : float, default 1e-3
        The iteration ends when no point moves by more than this fraction of its standard deviation.
    max_iter : int, default 50
        Largest number of iterations, each of which fits a spline. Robust losses have several stages with a limit each;
        the last of them may take 20 times as many.
    extrapolate, on_failure, atol : optional
        As for `CubicSpline`.
    where : array_like of bool, optional
        Mask over the batch. Curves where it is False are not fitted and evaluate to NaN. With ``on_failure="warn"`` or
        ``"ignore"`` the same holds for curves with invalid points or with data at fewer than two times.
    progress : callable, optional
        Function that is called from time to time with the finished and the total number of points.
    skipna : bool, default False
        True to omit missing samples, where the point or its time is NaN, NaT or masked. Curves of a batch may lack
        different samples.

    Returns
    -------
    SmoothingSpline
        A `CubicSpline` with λ, the degrees of freedom, the noise level and standard deviations.

    Raises
    ------
    ValidationError
        If the input does not meet the requirements above.
    ConvergenceError
        If the iteration does not converge, or no spline joins the smoothed points. Its attribute ``spline`` holds the
        curves.

    Warns
    -----
    SmoothingWarning
        In these cases:

        - The chosen λ is at a bound: the curve follows nearly all data, has no bending energy, or is the roughest one
          that was found.
        - The residuals are not those of independent noise: they are more than 1.75 times as large as the noise
          estimated from neighbouring data, they are correlated, there are outliers under least squares, or `sigma` is
          wrong. With a given λ, residuals are examined only if `sigma` is given.
        - The motion or the noise varies along the recording, and `lam` or `noise` is not ``"adaptive"``.
        - A robust loss may have rejected the wrong data, or an outlier in a gap moves the curve.
        - Another curve may fit better, because the noise is large or consecutive data are far apart.
        - Many points are exact copies of the point before at a later time, as in a log that is faster than its sensor.
    ConvergenceWarning
        If a curve fails and `on_failure` is ``"warn"``.
    FarPointsWarning
        If a curve has at least four segments and more than half of its steps, or of the steps between neighbouring
        data, exceed 0.6 of the distance to the cut locus.
    UserWarning
        If the data are about as far from their curve as random points of a compact space would be.

    See Also
    --------
    make_lsq_spline : Fit a curve with given knots by least squares.
    CubicSpline : Interpolate points by a C² curve.
    fit_segments : Fit a recording with gaps.

    Notes
    -----
    Let :math:`y_j` be the data at the times :math:`t_j` with the weights :math:`w_j`. The curve minimises

    .. math:: \sum_j w_j\, d(y_j, \gamma(t_j))^2 + \lambda \int \lVert\nabla_{\gamma'}\gamma'\rVert^2 \, dt

    among the C² splines with the given knots, or the same with :math:`\nabla_{\gamma'}^2\gamma'`, whose integral is a
    sum over the segments of differences of the accelerations at the knots. For information matrices,
    :math:`e_j^T W_j e_j` replaces :math:`w_j d^2`, where :math:`e_j` are the coordinates of ``space.log(y, γ(t))``.

    With ``lam=numpy.inf`` the curve is the geodesic with the least sum of squared distances, the least-squares line of
    geodesic regression (Fletcher 2013). It has two knots, or more if it is so long that its ends do not determine it.
    Ends are natural and the penalty is the acceleration. Poses of `SpecialEuclidean` are regressed as rotations and
    positions, so that the curve passes through poses on a geodesic of ``"so:3 x r:3"`` at the times of the data.

    With ``lam="adaptive"`` every segment has a λ of its own. Its logarithm is linear between up to 64 nodes and a
    random walk there, whose variance is estimated as well. The restricted likelihood is maximised by Fisher scoring
    from two starts, the λ that `criterion` chooses and one so small that every burst shows. λ varies only if this
    increases twice the logarithm of the likelihood by more than 6, ``report.gain``; otherwise the result is that of one
    λ. `criterion` then chooses the level. The same holds for σ with ``noise="adaptive"``. With both, the data decide
    which of the two varies, because each takes the other for itself; both vary if the gain exceeds 18. In gaps between
    data that are long, λ is the harmonic mean, because nothing shows whether there was a burst. See
    `SmoothingSpline.lam_at` and `SmoothingSpline.sigma_at`.

    References
    ----------
    P. T. Fletcher, Geodesic regression and the theory of least squares on Riemannian manifolds, Int. J. Comput. Vis.
    105 (2013).

    P. Craven, G. Wahba, Smoothing noisy data with spline functions, Numer. Math. 31 (1979).

    T. Krivobokova, C. M. Crainiceanu, G. Kauermann, Fast adaptive penalized splines, J. Comput. Graph. Statist. 17
    (2008).

    C. Gu, Smoothing Spline ANOVA Models, 2nd ed., Springer (2013), Section 3.2.

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
    check_policies(extrapolate, on_failure, progress)
    if criterion == "cp" and sigma is None:
        raise ValidationError("criterion='cp' needs the standard deviation of the noise. Pass sigma.")
    bc_type = checked_ends(bc_type, penalty, method)
    for name, word in (("criterion", criterion), ("loss", loss), ("method", method)):
        if not isinstance(word, str):
            raise ValidationError(f"{name} must be a word, not {short_repr(word)}")
    gamma = checked_number(gamma, "gamma must be a number >= 1", lambda x: 1 <= x < np.inf)
    tol = checked_number(tol, "tol must be a number > 0", lambda x: 0 < x < np.inf)
    options = SolverOptions(criterion, gamma, penalty, method, tol, whole_number(max_iter, "max_iter", 1), False)
    if checked_flag(skipna, "skipna"):
        t, points, weights, frames = data_without_missing(t, points, weights, frames, space)
    spaces = smoothed_spaces(space)
    whole, data, of_factors = read_noisy(t, points, space, spaces, weights, frames, sigma, loss, bc_type, atol)
    batch = whole.batch
    smoothness = read_smoothness(space, spaces, lam, batch)
    noise_adapts = read_adaptive_noise(space, spaces, noise)
    lams = [given.lam for given in smoothness]
    for given_lam, adapts in zip(lams, noise_adapts, strict=True):
        if adapts and np.any((given_lam == 0) | np.isinf(given_lam)):
            raise ValidationError(
                "noise='adaptive' needs a penalty: pass a lam other than 0 and inf, or omit lam. If you know the "
                "noise, pass weights."
            )
    has_infinite = np.isinf(lams).any()
    if has_infinite:
        for name, value, required in (("penalty", penalty, "acceleration"), ("bc_type", bc_type, "natural")):
            if value != required:
                raise ValidationError(
                    f"lam=inf fits a geodesic, whose {name} is {required!r}, not {value!r}. Pass a finite lam, or omit "
                    f"{name}."
                )
    if loss != "linear" and sigma is None and any(noise.is_singular for noise in whole.noise):
        raise ValidationError(
            f"loss={loss!r} estimates the noise level from the data, but `weights` has matrices without information in "
            "some directions. Pass sigma; it is 1 if the matrices are inverse covariances."
        )
    strict, mask = on_failure == "raise", mask_of(where, batch)
    try:
        noisy, of_factors, chosen, faults = valid_curves(whole, data, of_factors, space, mask, strict)
    except ValidationError as error:
        raise with_remedy(error, data) from None
    if chosen is not None:
        smoothness = [given.of_curves(chosen) for given in smoothness]
        lams = [given.lam for given in smoothness]
    parts = parts_of(noisy, space, spaces, smoothness, noise_adapts, of_factors)
    every = knots_for(whole, knots)
    which = "the times of the data, which are the knots," if knots is None else "the knots"
    has_profile = check_profiles(smoothness, every.times.shape[-1] - 1, which)
    if knots is None and penalty == "jerk":
        every = in_long_gaps(every, whole)
    for needs, what, remedy in (
        (penalty == "jerk", "penalty='jerk'", "Pass more data, or use penalty='acceleration'."),
        (parts[0].ends is None, "A closed curve", "Pass more data or knots."),
    ):
        if needs and every.times.shape[-1] < 4:
            raise ValidationError(f"{what} needs at least 4 knots, but there are {every.times.shape[-1]}. {remedy}")
    # A geodesic has no freedom between its knots.
    geodesics = lams[0].size > 0 and bool(np.isinf(lams).all())
    free = not geodesics and (knots is None or has_all_times(every, noisy))

    def run(at: Knots, raise_lam: bool = False, adapt: bool = False) -> list[SmoothCurves]:
        if chosen is not None:
            at = at.of_curves(chosen)
        # There is nothing to choose between two knots.
        with_lam = parts if at.times.shape[-1] > 2 else [_with_lam(part, at) for part in parts]
        how = options._replace(raise_lam=raise_lam)
        return smoothed(with_lam, noisy, at, how, free, progress, adapt)

    def df_of_part(part: Part, rows: SmoothingData, at: Knots) -> Doubles:
        (result,) = smoothed([part], rows, at, options, free, None)
        return np.ravel(result.smoothed.report.df)

    if geodesics:
        at = geodesic_knots(every, space, lambda at: [result.points for result in run(at)])
        options = geodesic_options(space, options)
        results = run(at)
    elif knots is None and not has_profile:
        results, at = with_enough_knots(every, noisy, parts, lams, run, df_of_part, penalty)
        fails = False
        for result in results:
            fails |= NO_CURVE in result.states
        # Knots in gaps are tried before a larger λ, which would affect the whole curve.
        if fails:
            at = in_gaps(at, whole)
            results = run(at, raise_lam=True, adapt=True)
    else:
        results, at = run(every, adapt=True), every

    faults_of_fit = faults_of(parts, results, noisy, at.times.shape[-1], options)
    whole, good = whole._replace(points=noisy.points), np.ones(batch, bool)
    if chosen is not None:
        # Points of masked curves are NaN.
        spread = partial(in_batch, batch, chosen)
        good, results = spread(good.ravel()[chosen]), [result.map(spread) for result in results]
        whole = whole._replace(points=[spread(rows) for rows in noisy.points])
        parts = [part.map(spread, noise) for part, noise in zip(parts, whole.noise, strict=True)]
        faults_of_fit = [fault._replace(curve=int(chosen[fault.curve])) for fault in faults_of_fit]
    parts, whole = with_adapted_noise(parts, whole, results, at)
    if has_infinite:
        results = [with_infinite_lam(result, part.lam, batch) for result, part in zip(results, parts, strict=True)]
    faults += faults_of_fit
    spline, fitted = _spline_through(whole, space, parts, results, at, good, bc_type, extrapolate)
    # Errors that this data cause do not show the reason.
    silent = is_silent(UserWarning)
    far_data = not silent and warn_of_far_data(space, whole.points)
    if faults:
        raise_or_warn(sorted(faults, key=lambda fault: fault.curve), on_failure, spline)
    if silent:
        return spline
    # Between two knots there is nothing to choose. Masked curves are not examined.
    audit(spline, parts, results, good, good & (at.times.shape[-1] > 2))
    warn_of_signs(space, [whole.points])
    if whole.used.all():
        warn_of_held_points(whole.times, whole.points, batch, SmoothingWarning)
    if not far_data:
        warn_of_far_points([fitted.curve], [fitted.columns])
    return spline


def with_adapted_noise(
    parts: list[Part], whole: SmoothingData, results: list[SmoothCurves], at: Knots
) -> tuple[list[Part], SmoothingData]:
    """Return the data with the noise that was found to vary along the curves."""
    if all(result.smoothed.noise_profile is None for result in results):
        return parts, whole
    noise = []
    for of_part, result in zip(whole.noise, results, strict=True):
        profile = result.smoothed.noise_profile
        if profile is not None:
            # Masked curves have no profile.
            of_part = of_part.divided(np.exp(at_times(at.times, np.nan_to_num(profile), whole.times)))
        noise.append(of_part)
    pairs = zip(parts, noise, strict=True)
    parts = [part._replace(noise=of_part._replace(sigma=part.noise.sigma)) for part, of_part in pairs]
    return parts, whole._replace(noise=noise)


def _spline_through(
    whole: SmoothingData,
    space: Space,
    parts: list[Part],
    results: list[SmoothCurves],
    at: Knots,
    good: NDArray[np.bool_],
    bc_type: SmoothingBCType,
    policy: Extrapolate,
) -> tuple[AnySmoothingSpline, Fit]:
    """Return the spline through smooth points, and its fit. Curves where `good` is False are masked."""
    points: list[Points] = []
    conditions: list[list[End] | None] = []
    # Loops take fewer calls of functions than comprehensions, and most fits are short.
    noise, smoothed = [], []
    for factor, of_factor in zip(factors_of(space), grouped(space, zip(parts, results, strict=True)), strict=True):
        rows = []
        for part, result in of_factor:
            rows.append(result.points)
            noise.append(part.noise._replace(sigma=np.empty(0)))
            smoothed.append(result.smoothed)
        doubles = np.ascontiguousarray(factor._as_doubles(join(factor, rows)))
        points.append(Points(doubles, 0.0, whole.batch, at.times.shape[-1]))
        conditions.append(_ends_of_curve(factor, of_factor))
    mask = None if good.all() else good
    fitted = fit(Problem(space, at.times, points, conditions, DEFAULTS, check=False, mask=mask))
    kept = bc_type if isinstance(bc_type, str) else _conditions(conditions, space)
    curve: AnySmoothingSpline = SmoothingSpline._fitted(whole.time_axis, at.t, fitted.curve, kept, policy, fitted)
    return curve._with_noise(whole._replace(noise=noise), smoothed), fitted


@overload
def make_lsq_spline(  # type: ignore[overload-overlap]
    t: TimesLike | None, points: PointsLike, knots: TimesLike, space: Product[PProduct], **options: Unpack[LsqOptions]
) -> SmoothingSpline[PProduct, tuple[SmoothingReport, ...]]: ...


@overload
def make_lsq_spline(
    t: TimesLike | None, points: PointsLike, knots: TimesLike, space: SpecialEuclidean, **options: Unpack[LsqOptions]
) -> SmoothingSpline[FloatArray, tuple[SmoothingReport, ...]]: ...


@overload
def make_lsq_spline(
    t: TimesLike | None, points: PointsLike, knots: TimesLike, space: Space[P] | str, **options: Unpack[LsqOptions]
) -> SmoothingSpline[P]: ...


def make_lsq_spline(
    t: TimesLike | None,
    points: PointsLike,
    knots: TimesLike,
    space: AnySpace | str,
    *,
    weights: Numbers | None = None,
    loss: Loss = "linear",
    **options: Any,
) -> AnySmoothingSpline:
    """Fit a C² curve with given knots to noisy points by least squares.

    The curve minimises the weighted sum of squared distances to the data. There is no penalty on its acceleration; the
    number of knots determines its smoothness.

    Parameters
    ----------
    t : array_like of float or datetime64, shape (N,) or (..., N), or None
        Times of the data, in non-decreasing order. None means 0, 1, ..., N - 1.
    points : array_like, shape (..., N, *space.point_shape)
        Noisy points. For a `Product`, a tuple of arrays.
    knots : int or array_like
        Number of knots, or an increasing array that reaches from the first to the last time. There must be data near
        every knot.
    space : Space or str
        A space or its name, such as ``Sphere(2)`` or ``"sphere:2"``.
    weights : array_like or tuple, optional
        Weights or information matrices, as for `make_smoothing_spline`.
    loss : {"linear", "huber", "cauchy"}, default "linear"
        Least squares, or a loss that limits the influence of outliers.
    **options
        Further keyword arguments of `make_smoothing_spline`.

    Returns
    -------
    SmoothingSpline
        The curve. Its ends are natural unless `bc_type` is given.

    Raises
    ------
    ValidationError
        If the input does not meet the requirements above.
    ConvergenceError
        If the iteration does not converge, or the data do not determine the curve.

    See Also
    --------
    make_smoothing_spline : Fit a curve whose smoothness the data determine.

    Examples
    --------
    >>> import numpy as np
    >>> import symspline as ss
    >>> t = np.linspace(0, 1, 40)
    >>> ss.make_lsq_spline(t, np.sin(3 * t)[:, None], 6, "r:1")(0.5).round(3)
    array([0.997])
    """
    if knots is None:
        raise ValidationError("knots must not be None. Pass an array of times, or the number of knots.")
    return make_smoothing_spline(t, points, space, 0.0, weights=weights, knots=knots, loss=loss, **options)


def _with_lam(part: Part, at: Knots) -> Part:
    """Return a part of a curve with two knots with λ, the cube of the interval between them unless it is given.

    The curve is the nearest geodesic for every λ.
    """
    cube = np.ravel(at.times[..., 1] - at.times[..., 0]) ** 3
    return part._replace(lam=np.where(np.isfinite(part.lam), part.lam, cube))


def transport_end_velocities(part: Part, ends: list[End], curve_points: Array) -> list[End]:
    """Transport velocities at the first and the last datum to the ends of the curve."""
    space, axis = part.space, part.axis
    result: list[End] = []
    for (kind, vector), index in zip(ends, (0, -1), strict=True):
        if vector is not None:
            y, x = (np.take(rows, index, axis=axis) for rows in (part.points, curve_points))
            good = space._where_finite(x)
            moved = np.array(space._numbers(vector))
            moved[good] = space._apply("transport", p=y[good], q=x[good], v=moved[good])
            vector = np.ascontiguousarray(space._as_doubles(moved))
        result.append((kind, vector))
    return result


def _ends_of_curve(space: Space, of_factor: list[tuple[Part, SmoothCurves]]) -> list[End] | None:
    """Combine the end conditions of the parts of a factor, with velocities at the ends of the curve."""
    ends: list[list[End]] = []
    for part, result in of_factor:
        if part.ends is None or part.ends is NATURAL:
            return part.ends
        ends.append(transport_end_velocities(part, part.ends, result.points))
    if len(ends) == 1:
        return ends[0]
    joined: list[End] = []
    for of_parts in zip(*ends, strict=True):
        pairs = zip(parts_of_factor(space), of_parts, strict=True)
        rows = [part._numbers(vector) for part, (_, vector) in pairs if vector is not None]
        vector = np.ascontiguousarray(space._as_doubles(join(space, rows, 0.0))) if rows else None
        joined.append((of_parts[0][0], vector))
    return joined


def _conditions(transported: list[list[End] | None], space: Space) -> Any:
    """Return end conditions with velocities in the form of the argument `bc_type`."""

    def one(e: int) -> object:
        of_factors = [(ends or [])[e] for ends in transported]
        if of_factors[0][1] is None:
            return "natural"
        pairs = zip(factors_of(space), of_factors, strict=True)
        vectors = tuple(factor._numbers(vector) for factor, (_, vector) in pairs if vector is not None)
        return (1, vectors if isinstance(space, Product) else vectors[0])

    return freeze_bc_type((one(0), one(1)))


# ---- geodesic regression: an infinite λ ----


def geodesic_options(space: Space, options: SolverOptions) -> SolverOptions:
    """Return the options for a geodesic, by default those of the full Gauss–Newton solver.

    The linearised solver is inaccurate for one long segment.
    """
    if options.method != "auto" or any(part.dim > _LARGE for part in smoothed_spaces(space)):
        return options
    return options._replace(method="newton")


def with_infinite_lam(result: SmoothCurves, lam: Doubles, batch: tuple[int, ...]) -> SmoothCurves:
    """Return smooth curves whose report has the λ that was given where it is infinite."""
    if not np.isinf(lam).any():
        return result
    report, given = result.smoothed.report, lam.reshape(batch) if batch else lam[0]
    infinite = np.isinf(given)
    lams: Any = np.where(infinite, given, report.lam)
    bound: Any = report.at_bound & ~infinite
    if not batch:
        lams, bound = float(lams), bool(bound)
    smoothed = result.smoothed._replace(report=replace(report, lam=lams, at_bound=bound))
    return result._replace(smoothed=smoothed)
