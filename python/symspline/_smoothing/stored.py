"""The noisy data of smoothing splines in files and pickles."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._base.time import TimeAxis
from .._base.validation import one_of
from .._core import ValidationError
from .._curves.curve import CurveArrays
from .._spaces import Space, factors_of
from .._splines.archive import Entries, Stored, entry, read_array, read_field, read_report, suffix_of, times_state
from .data import SmoothingData
from .noise import Noise, is_several, smoothed_spaces
from .posterior import Posterior
from .report import SmoothingReport
from .solve import Smoothed


def noise_state(space: Space[Any], noisy: SmoothingData, smoothed: list[Smoothed]) -> dict[str, Any]:
    """Return the entries of a smoothing spline in addition to those of a `CubicSpline`."""
    state: dict[str, Any] = {
        **times_state("data_t", noisy.t, noisy.time_axis),
        "noise": [
            vars(own.report)
            | {"band_lam": own.band_lam, "scale": own.sigma, "between": own.between}
            | {"penalty": own.penalty, "loss": noise.loss}
            # Version 1 has no matrices.
            | ({} if own.posterior is None else {"posterior": True})
            for noise, own in zip(noisy.noise, smoothed, strict=True)
        ],
    }
    first, *others = noisy.noise
    alike = all(np.array_equal(first.weights, own.weights) for own in others)
    if alike:
        state["data_weights"] = first.weights
    state |= {"data" + suffix_of(space, i): points for i, points in enumerate(noisy.points)}
    for i, (noise, own) in enumerate(zip(noisy.noise, smoothed, strict=True)):
        suffix = _suffix(space, i)
        state["band" + suffix] = own.band
        if own.posterior is not None:
            state |= posterior_state(own.posterior, suffix, noisy.batch)
        if not alike:
            state["data_weights" + suffix] = noise.weights
        if noise.information is not None:
            state["data_information" + suffix] = noise.information
    return state


def posterior_state(posterior: Posterior, suffix: str, batch: tuple[int, ...]) -> dict[str, Any]:
    """Return the entries of a posterior.

    Its blocks are numbers or matrices; rows of four numbers are the same for both, so that curves of both kinds can be
    in one file.
    """
    band, turn = posterior.band, posterior.turn
    rows, corner = math.prod(band.shape[-2:]) // 4, math.prod(turn.shape[-2:])
    return {"matrix" + suffix: band.reshape(*batch, rows, 4), "turn" + suffix: turn.reshape(*batch, corner, 1)}


def _suffix(space: Space, i: int) -> str:
    """Return the suffix of entries for the i-th space in which data were smoothed."""
    return f"_{i}" if is_several(space) else ""


def read_noise(
    state: Entries, time_axis: TimeAxis, t: NDArray[Any], curve: CurveArrays, closed: bool
) -> tuple[SmoothingData, list[Smoothed]]:
    """Return the data of a curve and the results of the smoothing.

    Parameters
    ----------
    state : Entries
        State of the smoothing spline.
    time_axis : TimeAxis
        Time axis of the data.
    t : ndarray
        Times of the data, as shown.
    curve : CurveArrays
        The curve.
    closed : bool
        Whether the curve is closed.

    Raises
    ------
    ValidationError
        If the entries do not match.
    """
    space, batch, times = curve.space, curve.batch, time_axis.knots(t)
    count, knots = times.shape[-1], curve.times.shape[-1]
    with entry("data_t"):
        if times.shape not in ((count,), (*batch, count)):
            raise ValidationError(f"the times of the data have shape {times.shape}")
        if not (np.isfinite(times).all() and (np.diff(times) >= 0).all()):
            raise ValidationError("the times of the data are not finite, or decrease")
        if np.any(times[..., 0] < curve.times[..., 0]) or np.any(times[..., -1] > curve.times[..., -1]):
            raise ValidationError("there are data before the first or after the last knot")
    points = [read_array(state, "data" + suffix_of(space, i), own) for i, own in enumerate(factors_of(space))]
    for part, rows in zip(curve.parts, points, strict=True):
        if rows.shape != (*batch, count, *part.space.point_shape):
            raise ValidationError(f"entry 'data': the data have shape {rows.shape}")
        if isinstance(state, Stored):
            # Masked curves are NaN, and so are their data.
            part.space.check_point(rows[part.space._where_finite(part.points).all(axis=-1)])
    noise, smoothed = [], []
    with entry("noise"):
        for i, (own, numbers) in enumerate(zip(smoothed_spaces(space), state["noise"], strict=True)):
            suffix = _suffix(space, i)
            weights = state["data_weights" + (suffix if "data_weights" + suffix in state else "")]
            information = state.get("data_information" + suffix)
            _check("weights", weights, (count,), (*batch, count))
            if information is not None:
                shape = (count, own.dim, own.dim)
                _check("information matrices", information, shape, batch + shape)
            if not (weights >= 0).all():
                raise ValidationError("the weights must be numbers >= 0")
            band, numbers = state["band" + suffix], dict(numbers)
            lam, scale = (read_field(key, numbers.pop(key), batch, dtype=np.float64) for key in ("band_lam", "scale"))
            between = read_field("between", numbers.pop("between"), (), dtype=np.bool_)
            known = numbers.pop("posterior", False)
            # Files of older versions do not name them.
            penalty = one_of(numbers.pop("penalty", "acceleration"), "penalty", "acceleration", "jerk")
            loss = one_of(numbers.pop("loss", "linear"), "loss", "linear", "huber", "cauchy")
            noise.append(Noise(weights, information, loss=loss))
            report = read_report(SmoothingReport, numbers, batch)
            # A closed curve repeats its first coefficients at the end.
            good = np.asarray(report.converged)
            _check("bands", band, (*batch, knots + (2 if closed else 0), 4), finite=good)
            posterior = None
            if known:
                posterior = read_posterior(state, suffix, own.dim, band.shape[-2], batch, closed, good)
            smoothed.append(Smoothed(report, band, lam, scale, between, posterior, penalty))
    return SmoothingData(time_axis, t, times, points, noise, batch), smoothed


def read_posterior(
    state: Entries, suffix: str, m: int, coefficients: int, batch: tuple[int, ...], closed: bool, good: Any
) -> Posterior:
    """Return the posterior of a curve with a number of coefficients, each of m coordinates."""
    matrix, turn = state["matrix" + suffix], state["turn" + suffix]
    size = math.isqrt(math.prod(matrix.shape[-2:]) // (4 * coefficients))
    if size not in (1, m) or math.prod(matrix.shape[-2:]) != 4 * coefficients * size**2:
        raise ValidationError(f"the matrices have shape {matrix.shape}")
    shapes = (*batch, coefficients * size, 4 * size), (*batch, *(2 * (size if closed else 0,)))
    if math.prod(turn.shape) != math.prod(shapes[1]):
        raise ValidationError(f"the matrices have shape {turn.shape}")
    matrix, turn = (own.reshape(shape) for own, shape in zip((matrix, turn), shapes, strict=True))
    _check("matrices", matrix, shapes[0], finite=good)
    _check("matrices", turn, shapes[1], finite=good)
    return Posterior.of(matrix, turn, size)


def _check(what: str, array: NDArray[Any], *shapes: tuple[int, ...], finite: Any = True) -> None:
    if array.dtype != np.float64 or array.shape not in shapes:
        raise ValidationError(f"the {what} are {array.dtype} of shape {array.shape}")
    if not np.isfinite(array[np.asarray(finite)]).all():
        raise ValidationError(f"the {what} are not finite")
