"""Places and directions on a globe: longitude and latitude in degrees, unit vectors of S², speed and course.

>>> import symspline as ss
>>> track = ss.CubicSpline([0, 3600], ss.geo.from_lonlat([0, 1], [0, 0]), "sphere:2")
>>> ss.geo.sog(track, 60).round(3), ss.geo.cog(track, 60).round(3)
(np.float64(30.888), np.float64(90.0))
"""

from __future__ import annotations

import re
import warnings
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from ._core import ConvergenceError, CutLocusError, ValidationError
from .arrays import shown
from .failures import callers_level
from .functions import fit_many
from .piecewise import check_curve
from .places import compass, from_lonlat, to_lonlat
from .segments import check_smooth, cut
from .smoothing.many import smooth_many
from .spaces import Sphere
from .spline import CubicSpline

if TYPE_CHECKING:
    import pandas as pd

__all__ = ["EARTH_RADIUS", "cog", "compass", "from_lonlat", "resample", "sog", "to_lonlat"]

EARTH_RADIUS = 6_371_008.8
"""Metres: the mean radius R₁ of the ellipsoid GRS 80 (Moritz, Geodetic reference system 1980)."""


def sog(spline: CubicSpline, x: ArrayLike, *, radius: float = EARTH_RADIUS) -> Any:
    """Speed over ground, in m/s.

    Args:
        spline: a curve on ``Sphere(2)``. Its times are dates, or seconds; of other numbers the speed is in metres per
            unit of time.
        x: times, as for calling it.
        radius: of the globe, in metres.

    Returns:
        Shape batch axes + x.shape.

    Raises:
        ValidationError: the curve is in another space, or a time is outside the knots.

    >>> import symspline as ss
    >>> north = ss.CubicSpline([0, 60], from_lonlat([5, 5], [50, 50.01]), "sphere:2")
    >>> sog(north, 30, radius=6371e3).round(6)
    np.float64(18.532488)
    """
    _check_globe(spline)
    if isinstance(radius, bool) or not isinstance(radius, (int, float, np.number)) or not 0 < radius < np.inf:
        raise ValidationError(f"radius must be a number above 0, not {shown(radius)}")
    return radius * spline.speed(x)


def cog(spline: CubicSpline, x: ArrayLike) -> Any:
    """Course over ground: degrees clockwise from north, in [0, 360); NaN where the place is at rest.

    At a pole, where every way is south or north, north is as on the meridian of 0° E.

    Args:
        spline: a curve on ``Sphere(2)``.
        x: times, as for calling it.

    Returns:
        Shape batch axes + x.shape.

    Raises:
        ValidationError: the curve is in another space, or a time is outside the knots.

    >>> import symspline as ss
    >>> west = ss.CubicSpline([0, 60], from_lonlat([5, 4], [0, 0]), "sphere:2")
    >>> cog(west, 30).round(6)
    np.float64(270.0)
    """
    _check_globe(spline)
    east, north = compass(spline(x))
    velocity = spline(x, nu=1)
    eastward, northward = (velocity * east).sum(-1), (velocity * north).sum(-1)
    # By rounding a tiny negative angle becomes 360 itself.
    degrees = np.degrees(np.arctan2(eastward, northward)) % 360 % 360
    return np.where((eastward == 0) & (northward == 0), np.nan, degrees)[()]


def resample(
    frame: pd.DataFrame,
    every: Any = "1min",
    *,
    by: str | Sequence[str] | None = None,
    time: str | None = None,
    columns: tuple[str, str] = ("lon", "lat"),
    max_gap: Any,
    min_points: int = 2,
    duplicates: str = "raise",
    smooth: bool = False,
    radius: float = EARTH_RADIUS,
    **options: Any,
) -> pd.DataFrame:
    """Places of a pandas table at regular times, with speed and course over ground: one C² curve a vessel, animal or
    storm, and a new one behind every pause.

    Args:
        frame: a table with times and places; its rows may be in any order.
        every: the step, as pandas writes it: ``"1min"``, a ``Timedelta``. Times are whole multiples of it, in UTC.
        by: the column that tells tracks apart, such as ``"mmsi"``, or several; None for one track.
        time: the column of times; None for the index.
        columns: those of longitude and latitude, in degrees.
        max_gap, min_points, duplicates, smooth: as for `symspline.fit_segments`, a pause in seconds or as a
            ``timedelta64``; ``smooth=True`` for places with noise. Between pieces there are no rows; a track without a
            piece of ``min_points`` has none.
        radius: of the globe, in metres.
        options: those of `CubicSpline`, or those of `make_smoothing_spline` but weights and frames.

    Returns:
        A table with the columns ``by``, the times, longitude and latitude under their names, ``sog`` in m/s, and
        ``cog`` in degrees clockwise from north; times keep their time zone. With ``on_failure="warn"`` or ``"ignore"``
        the numbers of a piece whose curve did not converge are NaN.

    Raises:
        ValidationError: a column is not there, a row has no place or no name, no track has a piece of ``min_points``,
            or the places or times are not what `symspline.fit_segments` takes.
        ConvergenceError, CutLocusError: as for `CubicSpline` or `make_smoothing_spline`; the message names the track.
    """
    import pandas as pd

    keys: list[Any] = [] if by is None else list(by) if isinstance(by, (list, tuple)) else [by]

    if not isinstance(frame, pd.DataFrame):
        raise ValidationError(f"frame must be a table of pandas, not {shown(frame)}")
    for name in (*keys, time, *columns):
        if name is not None and name not in frame.columns:
            raise ValidationError(
                f"there is no column {name!r}; the columns are {', '.join(map(str, frame.columns))}"
            )
    name = time or frame.index.name or "time"
    stamps = (
        frame.index.to_series(index=range(len(frame))) if time is None else frame[time].reset_index(drop=True)
    )
    if stamps.dtype.kind != "M":
        raise ValidationError(f"the times {name!r} are no dates; make them of texts by pandas.to_datetime")
    check_smooth(smooth, duplicates, options)
    for option in ("weights", "frames"):
        if smooth and option in options:
            raise ValidationError(
                f"{option} go with rows, and resample takes none; use symspline.fit_segments"
            )
    for column in [*keys, *columns]:
        missing = np.flatnonzero(frame[column].isna())
        if missing.size:
            raise ValidationError(
                f"{len(missing)} rows have no {column!r}, the first of them row {missing[0]}; leave them out: "
                f"frame.dropna(subset=[{column!r}])"
            )
    step = pd.Timedelta(every)
    zone = stamps.dt.tz
    utc = (stamps.dt.tz_convert("UTC").dt.tz_localize(None) if zone is not None else stamps).to_numpy()
    tracks: Any = {(): np.arange(len(frame))}
    if keys:
        tracks = {
            label if len(keys) > 1 else (label,): rows
            for label, rows in frame.groupby(keys if len(keys) > 1 else keys[0], sort=False).indices.items()
        }
    vectors = from_lonlat(*(frame[column].to_numpy() for column in columns))
    curves, owners = [], []
    for label, rows in tracks.items():
        # One place is no track.
        if len(rows) < 2:
            continue
        own = rows[np.argsort(utc[rows], kind="stable")]
        try:
            used = np.ones(len(own), bool) if smooth else None
            pieces = cut(utc[own], vectors[own], "sphere:2", max_gap, min_points, duplicates, used).curves
        except ValidationError as error:
            of = f"{_named(keys, label)}, rows in the order of time: " if keys else ""
            raise ValidationError(f"{of}{error}") from None
        curves += pieces
        owners += [label] * len(pieces)
    if not curves and len(frame):
        raise ValidationError(
            f"no track has {min_points} places without a pause longer than max_gap={shown(max_gap)}, in seconds"
        )
    names = [
        f"{_named(keys, label)}{', ' if keys else ''}the piece from {np.datetime_as_string(t[0][0], 's')} on"
        for (t, _), label in zip(curves, owners, strict=True)
    ]
    tables = []
    for spline, label in zip(_fitted(curves, names, smooth, options), owners, strict=True):
        x = pd.date_range(
            pd.Timestamp(spline.t[0]).ceil(step), pd.Timestamp(spline.t[-1]).floor(step), freq=step
        )
        at = x.to_numpy()
        lon, lat = to_lonlat(spline(at))
        shown_times = x if zone is None else x.tz_localize("UTC").tz_convert(zone)
        values = {name: shown_times, columns[0]: lon, columns[1]: lat}
        values |= {"sog": sog(spline, at, radius=radius), "cog": cog(spline, at)}
        if not spline.report.converged:
            values |= dict.fromkeys((*columns, "sog", "cog"), np.nan)
        tables.append(pd.DataFrame(dict(zip(keys, label, strict=True)) | values))
    if not tables:
        return pd.DataFrame(columns=[*keys, name, *columns, "sog", "cog"])
    return pd.concat(tables, ignore_index=True)


def _named(keys: list[Any], label: tuple[Any, ...]) -> str:
    """A track in messages."""
    return ", ".join(f"{key} {value}" for key, value in zip(keys, label, strict=True))


def _fitted(curves: list[tuple[Any, Any]], names: list[str], smooth: bool, options: dict[str, Any]) -> Any:
    """The curves; messages about them have their names."""
    if not curves:
        return []

    def renamed(message: object) -> str:
        return re.sub(r"\bcurve (\d+)\b", lambda found: names[int(found[1])], str(message))

    caught: list[warnings.WarningMessage] = []
    try:
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            if smooth:
                found: Any = smooth_many([(*curve, {}) for curve in curves], Sphere(2), **options)
            else:
                found = fit_many(curves, Sphere(2), **options)
    except (ValidationError, ConvergenceError, CutLocusError) as error:
        own: Any = type(error)(renamed(error))
        vars(own).update(vars(error))
        raise own from None
    for warning in caught:
        warnings.warn(renamed(warning.message), warning.category, stacklevel=callers_level())
    return found


def _check_globe(spline: CubicSpline) -> None:
    check_curve(spline)
    if str(spline.space) != "sphere:2":
        raise ValidationError(f"places on a globe are points of Sphere(2), not of {spline.space!r}")
