"""Making smoothing splines."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from .._core import ValidationError
from ..arrays import shown, whole_number
from ..curves.ends import End, is_closed, kept
from ..curves.fit import Asked as Fitted
from ..curves.fit import Points, fit
from ..curves.solve import Fault, Options, Progress
from ..failures import fail
from ..far import warn_of_far_points
from ..manifolds.manifold import refuse_functions
from ..options import check_on_failure, check_progress, checked_policy
from ..signs import warn_of_signs
from ..spaces import Product, Space, factors_of
from ..spaces import space as space_named
from .data import Knots, Noisy, knots_for, points_of, read_noisy, some, sparse
from .solve import Asked, enough, one_a_curve, smoothed
from .spline import SmoothingSpline
from .spread import warn_of_spread

_FIT = Options("auto", 1e-12, None)
# Knots from which fewer are tried first, and how many.
_MANY, _FIRST = 4000, 2000
# How often λ may ask for other knots.
_TRIES = 4


def make_smoothing_spline(
    t: ArrayLike | None,
    points: Any,
    space: Space | str,
    lam: Any = None,
    *,
    weights: Any = None,
    frames: Any = None,
    knots: Any = None,
    criterion: str = "gcv",
    sigma: Any = None,
    bc_type: Any = "natural",
    loss: str = "linear",
    method: str = "auto",
    tol: float = 1e-3,
    max_iter: int = 50,
    extrapolate: bool | str | None = None,
    on_failure: str = "raise",
    atol: float | None = None,
    progress: Progress | None = None,
) -> SmoothingSpline:
    """The C² curve γ that makes ``Σ w d(y, γ(t))² + λ ∫ |∇γ'|² dt`` least.

    In flat space it is SciPy's ``make_smoothing_spline``. λ is chosen from the data unless it is given.

    Args:
        t: times of the data, not decreasing; several data may have one time, and copies of a datum in a row are one
            of their weight. None for 0, 1, …, shape (N,) or (..., N).
        points: noisy points y, shape (..., N, *space.point_shape); leading axes are independent curves, each with a
            λ of its own. For a `Product` a tuple of arrays.
        space: a space or its name. In `SpecialEuclidean`, which has no invariant metric, the curve solves the same
            equations in the frames of the space, in which lengths and angles count alike; a product of R³ and SO(3)
            has a λ for each.
        lam: λ >= 0; 0 comes nearest to the data, and large ones give a geodesic. None to choose it; for a batch also
            one a curve, for a product also a tuple with one of every factor. Its unit is weight · time³.
        weights: of the data, >= 0, shape (N,) or (..., N): one over the variance of their noise, up to a factor. Points
            of weight zero are left out, and may be NaN. Or information matrices W, shape (N, m, m) or (..., N, m, m)
            with m = ``space.dim``, inverse covariances of the noise, for points of which some directions are known
            better than others: eᵀWe takes the place of w d², e being the coordinates of ``space.log(y, γ(t))``.
            Directions without any information are allowed. For a product a tuple with one of these for
            every factor.
        frames: the tangent vectors that the matrices refer to, m at every point and not necessarily orthonormal,
            shape (..., N, m, *space.point_shape); None for those of ``space.frame(points)``. Of rotations
            ``symspline.rotations.velocities(points[:, None], np.eye(3))`` are the axes of the body, in radians.
        knots: of the curve: None for all times of data, a number of them, or an array that reaches from the first
            to the last time. About four times the degrees of freedom are enough. Of more than 4000
            times None takes so many that further ones would not change the curve.
        criterion: how λ is chosen: ``"gcv"`` (generalised cross-validation), ``"gcv1.4"`` (the same with every
            degree of freedom counted 1.4 times, safer where motion is nearly geodesic or noise is correlated),
            ``"reml"``, or ``"cp"`` (Mallows' C_p, which needs ``sigma``).
        sigma: standard deviation of the noise in a coordinate for weight one, if it is known, as a length in the space:
            radians on the unit sphere. Also one a curve, or a tuple for a product.
        bc_type: conditions at the ends: ``"natural"``, ``"clamped"``, ``(1, velocity)`` at either end, as for
            `CubicSpline`, or ``"periodic"``. Velocities are tangent at the first and the last of the points, and are
            carried from there to the curve in parallel. A closed curve has the period of its knots.
        loss: ``"linear"`` for least squares; ``"huber"`` or ``"cauchy"`` if there are outliers.
        method: ``"flat"`` solves the problem of numbers in frames along the curve, again and again, with the curvature
            of the space in its matrix where curves are nearly geodesic over long distances; its result is within
            about 1e-4 of the error of the minimum, more where segments are long. ``"newton"`` is the Gauss-Newton
            method for the minimum itself, and much slower. ``"auto"`` takes the first, and the second where it
            converges slowly.
        tol: the search ends when no point moves by more than this part of its standard deviation.
        max_iter: most splines that are fitted.
        extrapolate, on_failure, atol, progress: as for `CubicSpline`.

    Raises:
        ValidationError: the input is not what is described above.
        ConvergenceError: the search did not end, or no spline goes through the points that it led to.

    Warns:
        UserWarning: data are about as far from their curve as random points of a compact space would be.

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
    policy = checked_policy(extrapolate)
    check_on_failure(on_failure)
    check_progress(progress)
    if criterion == "cp" and sigma is None:
        raise ValidationError("criterion 'cp' needs sigma, the standard deviation of the noise")
    for name, word in (("criterion", criterion), ("loss", loss), ("method", method)):
        if not isinstance(word, str):
            raise ValidationError(f"{name} must be a word, not {shown(word)}")
    if isinstance(tol, bool) or not (isinstance(tol, (int, float, np.number)) and 0 < tol < np.inf):
        raise ValidationError(f"tol must be a number > 0, not {shown(tol)}")
    asked = Asked(criterion, loss, method, float(tol), whole_number(max_iter, "max_iter", 1))
    noisy, ends = read_noisy(t, points, space, weights, frames, bc_type, atol)
    if loss != "linear" and sigma is None and any(own.is_singular for own in noisy.weighing):
        raise ValidationError(
            f"loss {loss!r} with weights that know nothing of some directions needs sigma, the size of the noise: "
            "1 where they are inverse covariances"
        )
    if noisy.times.shape[-1] == 2:
        # Of two points none is an outlier, and nothing says how large the noise is.
        asked = asked._replace(loss="linear")
    lams = _in_factors(space, lam, "lam", noisy.batch)
    sigmas = _in_factors(space, sigma, "sigma", noisy.batch)

    def run(at: Knots) -> list[Any]:
        each = zip(points_of(noisy, space), noisy.weighing, _chosen(lams, at), sigmas, ends, strict=True)
        return [
            smoothed(factor, noisy, own, weighing, at, one_lam, one_sigma, end, asked, progress)
            for (factor, own), weighing, one_lam, one_sigma, end in each
        ]

    whole = knots_for(noisy, knots)
    if is_closed(bc_type) and whole.times.shape[-1] < 4:
        raise ValidationError(f"a closed curve needs at least 4 knots, not {whole.times.shape[-1]}")
    if knots is None:
        found, at = _with_enough(whole, noisy, lams, run)
    else:
        found, at = run(whole), whole
    parts = [
        Points(np.ascontiguousarray(factor._as_doubles(own)), 0.0, noisy.batch, at.times.shape[-1])
        for factor, (own, _, _) in zip(factors_of(space), found, strict=True)
    ]
    carried = [
        _carried(end, factor, own, curve_points, noisy)
        for end, (factor, own), (curve_points, _, _) in zip(ends, points_of(noisy, space), found, strict=True)
    ]
    curve, reports, _ = fit(Fitted(space, at.times, parts, carried, _FIT, False), None)
    spline = SmoothingSpline._of(
        noisy.clock,
        at.t,
        curve,
        _conditions(bc_type, carried, space),
        policy,
        reports,
        noisy,
        [part for _, part, _ in found],
    )
    faults: list[Fault] = next((faults for _, _, faults in found if faults), [])
    if faults:
        fail(faults, on_failure, spline)
    warn_of_spread(space, curve, noisy, [part.report.df for _, part, _ in found])
    nodes = noisy.times.shape[-1]
    warn_of_signs(
        space,
        [[Points(one._as_doubles(own), 0.0, noisy.batch, nodes) for one, own in points_of(noisy, space)]],
    )
    warn_of_far_points([curve], [reports])
    return spline


def make_lsq_spline(
    t: ArrayLike | None,
    points: Any,
    knots: Any,
    space: Space | str,
    *,
    weights: Any = None,
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


def _chosen(lams: list[Any], at: Knots) -> list[Any]:
    """Between two knots there is nothing to choose: the curve is the nearest geodesic, whatever λ is."""
    if at.times.shape[-1] > 2:
        return lams
    cube = np.ravel(at.times[..., 1] - at.times[..., 0]) ** 3
    return [np.where(np.isnan(lam), cube, lam) for lam in lams]


def _in_factors(space: Space, value: Any, name: str, batch: tuple[int, ...]) -> list[Any]:
    """A number a curve in every factor."""
    factors = factors_of(space)
    if isinstance(space, Product) and isinstance(value, tuple):
        if len(value) != len(factors):
            raise ValidationError(f"{name} has {len(value)} entries, but the product {len(factors)} factors")
        return [one_a_curve(one, name, batch) for one in value]
    return [one_a_curve(value, name, batch)] * len(factors)


def _with_enough(
    whole: Knots, noisy: Noisy, lams: list[Any], run: Callable[[Knots], list[Any]]
) -> tuple[list[Any], Knots]:
    """What is found with as many of the knots as λ and the degrees of freedom ask for; and these knots."""
    given = all(np.isfinite(lam).all() for lam in lams)
    at = sparse(whole, noisy, _of_all(lams) if given else None)
    if at.times.shape[-1] > _MANY:
        at = some(at, _FIRST)
    for tries in range(_TRIES):
        found = run(at)
        count = at.times.shape[-1]
        known = [np.asarray(part.report.lam) for _, part, _ in found]
        better = sparse(whole, noisy, _of_all(known))
        most = 2 * max(enough(part.report.df) for _, part, _ in found)
        if better.times.shape[-1] > max(_MANY, most):
            better = some(better, max(_FIRST, most))
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


def _carried(ends: list[End] | None, space: Space, data: Any, points: Any, noisy: Noisy) -> list[End] | None:
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

    return kept((one(0), one(1)))
