"""Making smoothing splines."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from .._core import ValidationError
from ..arrays import shown, whole_number
from ..curves.fit import Asked as Fitted
from ..curves.fit import Points, fit, read_ends
from ..curves.solve import Fault, Options, Progress
from ..failures import fail
from ..options import check_on_failure, check_progress, checked_policy
from ..spaces import Product, Space, factors_of
from ..spaces import space as space_named
from .data import Knots, knots_for, points_of, read_noisy
from .solve import Asked, enough, one_a_curve, smoothed, stiffness
from .spline import SmoothingSpline

_FIT = Options("auto", 1e-12, None)
# Knots from which fewer are tried first, and how many.
_MANY, _FIRST = 4000, 2000
# λ from which fewer knots are taken, see `stiffness`: rounding would spoil its choice.
_STIFF = 1e11


def make_smoothing_spline(
    t: ArrayLike | None,
    points: Any,
    space: Space | str,
    lam: Any = None,
    *,
    weights: ArrayLike | None = None,
    knots: Any = None,
    criterion: str = "gcv",
    sigma: Any = None,
    loss: str = "linear",
    method: str = "auto",
    tol: float = 1e-3,
    max_iter: int = 50,
    extrapolate: bool | str | None = None,
    on_failure: str = "raise",
    atol: float | None = None,
    progress: Progress | None = None,
) -> SmoothingSpline:
    """The C² curve γ with natural ends that makes ``Σ w d(y, γ(t))² + λ ∫ |∇γ'|² dt`` least.

    In flat space it is SciPy's ``make_smoothing_spline``. λ is chosen from the data unless it is given.

    Args:
        t: times of the data, not decreasing; several data may have one time. None for 0, 1, …, shape (N,) or
            (..., N).
        points: noisy points y, shape (..., N, *space.point_shape); leading axes are independent curves, each with a
            λ of its own. For a `Product` a tuple of arrays.
        space: a space or its name. In `SpecialEuclidean`, which has no invariant metric, the curve solves the same
            equations in the frames of the space, in which lengths and angles count alike; a product of R³ and SO(3)
            has a λ for each.
        lam: λ >= 0; 0 comes nearest to the data, and large ones give a geodesic. None to choose it; for a batch also
            one a curve, for a product also a tuple with one of every factor. Its unit is weight · time³.
        weights: of the data, >= 0, shape (N,) or (..., N): one over the variance of their noise, up to a factor. Points
            of weight zero are left out, and may be NaN.
        knots: of the curve: None for all times of data, a number of them, or an array that reaches from the first
            to the last time. About four times the degrees of freedom are enough. Of more than 4000
            times None takes so many that further ones would not change the curve.
        criterion: how λ is chosen: ``"gcv"`` (generalised cross-validation), ``"gcv1.4"`` (the same with every
            degree of freedom counted 1.4 times, safer where motion is nearly geodesic or noise is correlated),
            ``"reml"``, or ``"cp"`` (Mallows' C_p, which needs ``sigma``).
        sigma: standard deviation of the noise in a coordinate for weight one, if it is known; also one a curve, or a
            tuple for a product.
        loss: ``"linear"`` for least squares; ``"huber"`` or ``"cauchy"`` if there are outliers.
        method: ``"flat"`` solves the problem of numbers in frames along the curve, again and again; its result is
            within about 1e-4 of the error of the minimum. ``"newton"`` is the Gauss-Newton method for the minimum
            itself, and much slower. ``"auto"`` takes the first, and the second where it converges slowly: where
            curves are nearly geodesic over long distances.
        tol: the search ends when no point moves by more than this part of its standard deviation.
        max_iter: most splines that are fitted.
        extrapolate, on_failure, atol, progress: as for `CubicSpline`.

    Raises:
        ValidationError: the input is not what is described above.
        ConvergenceError: the search did not end, or no spline goes through the points that it led to.

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
    policy = checked_policy(extrapolate)
    check_on_failure(on_failure)
    check_progress(progress)
    if criterion == "cp" and sigma is None:
        raise ValidationError("criterion 'cp' needs sigma, the standard deviation of the noise")
    if not (isinstance(tol, (int, float, np.number)) and 0 < tol < np.inf):
        raise ValidationError(f"tol must be a number > 0, not {shown(tol)}")
    asked = Asked(criterion, loss, method, float(tol), whole_number(max_iter, "max_iter", 1))
    noisy = read_noisy(t, points, space, weights, atol)
    lams = _in_factors(space, lam, "lam", noisy.batch)
    sigmas = _in_factors(space, sigma, "sigma", noisy.batch)

    def run(at: Knots) -> list[Any]:
        # Two knots make a geodesic, whatever λ is.
        used = [np.zeros_like(lam) for lam in lams] if at.times.shape[-1] == 2 else lams
        each = zip(points_of(noisy, space), used, sigmas, strict=True)
        return [
            smoothed(factor, noisy, own, at, one_lam, one_sigma, asked, progress)
            for (factor, own), one_lam, one_sigma in each
        ]

    at, whole = knots_for(noisy, knots), None
    if knots is None and at.times.shape[-1] > _MANY:
        at, whole = knots_for(noisy, _FIRST), at
    found = run(at)
    while whole is not None:
        count = max(enough(part.report.df) for _, part, _ in found)
        if count <= at.times.shape[-1]:
            break
        # A rough curve is rougher still with more knots.
        at = knots_for(noisy, 2 * count) if 2 * count < whole.times.shape[-1] else whole
        whole = None if at.times.shape == whole.times.shape else whole
        found = run(at)
    if knots is None and all(stiffness(at, noisy, part.report.lam) > _STIFF for _, part, _ in found):
        count = max(enough(part.report.df) for _, part, _ in found)
        if count < at.times.shape[-1]:
            at = knots_for(noisy, count)
            found = run(at)
    parts = [
        Points(np.ascontiguousarray(factor._as_doubles(own)), 0.0, noisy.batch, at.times.shape[-1])
        for factor, (own, _, _) in zip(factors_of(space), found, strict=True)
    ]
    ends = read_ends("natural", space, noisy.batch)
    curve, reports, _ = fit(Fitted(space, at.times, parts, ends, _FIT, False), None)
    spline = SmoothingSpline._of(
        noisy.clock, at.t, curve, "natural", policy, reports, noisy, [part for _, part, _ in found]
    )
    faults: list[Fault] = next((faults for _, _, faults in found if faults), [])
    if faults:
        fail(faults, on_failure, spline)
    return spline


def make_lsq_spline(
    t: ArrayLike | None,
    points: Any,
    knots: Any,
    space: Space | str,
    *,
    weights: ArrayLike | None = None,
    loss: str = "linear",
    **options: Any,
) -> SmoothingSpline:
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


def _in_factors(space: Space, value: Any, name: str, batch: tuple[int, ...]) -> list[Any]:
    """A number a curve in every factor."""
    factors = factors_of(space)
    if isinstance(space, Product) and isinstance(value, tuple):
        if len(value) != len(factors):
            raise ValidationError(f"{name} has {len(value)} entries, but the product {len(factors)} factors")
        return [one_a_curve(one, name, batch) for one in value]
    return [one_a_curve(value, name, batch)] * len(factors)
