"""Positions and directions on a globe: longitude, latitude, speed and course.

Longitudes and latitudes are in degrees; points are unit vectors of ``Sphere(2)``.

Examples
--------
>>> import symspline as ss
>>> track = ss.CubicSpline([0, 3600], ss.geo.from_lonlat([0, 1], [0, 0]), "sphere:2")
>>> ss.geo.sog(track, 60).round(3), ss.geo.cog(track, 60).round(3)
(np.float64(30.888), np.float64(90.0))
"""

from __future__ import annotations

import re
import warnings
from collections.abc import Callable, Mapping, Sequence
from datetime import timedelta
from functools import partial
from typing import TYPE_CHECKING, Any, Literal, NamedTuple, Unpack, cast, overload

import numpy as np
from numpy.typing import NDArray

from ._base.angles import compass, from_lonlat, to_lonlat
from ._base.arrays import checked_flag, checked_number, short_repr
from ._base.exceptions import SymsplineError
from ._base.faults import warn
from ._base.time import seconds_of
from ._base.typing import AxesLook, Duplicates, File, FloatArray, Keywords, PageLook, TimesLike
from ._core import ValidationError
from ._curves.options import require_matplotlib
from ._estimation.uncertainty import Jacobians, Motion, check_uncertain, standard_errors
from ._smoothing.noise import grouped, smoothed_spaces
from ._smoothing.segments import check_smooth, cut, smooth_many
from ._spaces import Sphere, factors_of
from ._splines.base import check_timed, checked_items
from ._splines.composed import SegmentedCurve
from ._splines.cubic import AnyCubicSpline
from ._splines.functional import fit_many

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["EARTH_RADIUS", "cog", "compass", "from_lonlat", "plot", "resample", "sog", "to_lonlat"]


def __dir__() -> list[str]:
    return __all__


EARTH_RADIUS = 6_371_008.8
"""Mean radius in metres: R₁ of the ellipsoid GRS 80 (Moritz, Geodetic reference system 1980)."""

_Track = AnyCubicSpline | SegmentedCurve[Any, Any]
_SeveralTracks = _Track | Sequence[_Track] | Mapping[str, _Track]
# Values of the column ``quality`` of resampled tables.
_QUALITIES = ["good", "lam at bound", "not converged"]
# Names of columns of times.
_TIME_NAMES = ("time", "times", "timestamp", "date", "datetime", "date_time", "utc", "fix_time", "t")


# Columns of numbers that identify tracks, and columns of angles in degrees.
NAMED = re.compile(
    r"(?<![a-z])(id|ids|ident|mmsi|imo|animal|individual|tag|track|trip|vessel|ship|vehicle|bird|device|segment|deployment)"
    r"(?![a-z])",
    re.IGNORECASE,
)
_ANGLE = re.compile(
    r"(?<![a-z])(heading|hdg|course|cog|cap|bearing|azimuth|direction|dir|yaw|track angle|wind from)(?![a-z])",
    re.IGNORECASE,
)
# A path of several tracks is longer than the tracks by this factor.
ZIGZAG = 2.0


@overload
def sog(
    spline: AnyCubicSpline, x: TimesLike, *, radius: float = EARTH_RADIUS, return_std: Literal[False] = False
) -> FloatArray: ...


@overload
def sog(
    spline: AnyCubicSpline, x: TimesLike, *, radius: float = EARTH_RADIUS, return_std: Literal[True]
) -> tuple[FloatArray, FloatArray]: ...


def sog(
    spline: AnyCubicSpline, x: TimesLike, *, radius: float = EARTH_RADIUS, return_std: bool = False
) -> FloatArray | tuple[FloatArray, FloatArray]:
    r"""Compute the speed over ground.

    Parameters
    ----------
    spline : CubicSpline
        Curve on ``Sphere(2)``, or on a product with one ``Sphere(2)``, such as positions with heights on
        ``"sphere:2 x r:1"``. If its times are dates or seconds, the speed is in metres per second; for other times it
        is in metres per unit of time. Heights do not count.
    x : array_like
        Times, as for ``spline(x)``.
    radius : float, default EARTH_RADIUS
        Radius of the globe in metres.
    return_std : bool, default False
        True to return standard errors as well. `spline` must then be a `SmoothingSpline`.

    Returns
    -------
    speed : float or ndarray, shape ``(*batch axes, *x.shape)``
        Speed.
    std : float or ndarray, shape ``(*batch axes, *x.shape)``
        Standard error of the speed in the same unit, only if `return_std` is True. It is NaN where the speed is zero.

    Raises
    ------
    ValidationError
        If the curve is on another space, a time is outside the knots, or standard errors are requested of a curve
        without a covariance.

    See Also
    --------
    cog : Compute the course over ground.
    symspline.SmoothingSpline.cov : Compute the covariance of a curve.

    Notes
    -----
    If the curve moves by :math:`E\xi` in parallel frames E, its velocity v changes by :math:`E\xi'`. The variance of
    the speed is that of :math:`\langle v/|v|, E\xi'\rangle`, to first order. It is valid if the speed is large compared
    with its standard error.

    Examples
    --------
    >>> import symspline as ss
    >>> north = ss.CubicSpline([0, 60], from_lonlat([5, 5], [50, 50.01]), "sphere:2")
    >>> sog(north, 30, radius=6371e3).round(6)
    np.float64(18.532488)

    Positions with an error of about ten metres, every ten seconds:

    >>> import numpy as np
    >>> rng, t = np.random.default_rng(0), np.arange(0, 600, 10.0)
    >>> lat = 50 + 1e-4 * t + 1e-4 * rng.standard_normal(60)
    >>> track = ss.make_smoothing_spline(t, from_lonlat(5 + 1e-4 * rng.standard_normal(60), lat), "sphere:2")
    >>> speed, std = sog(track, 300, return_std=True)
    >>> bool(0 < std < 0.3), bool(abs(speed - 11.12) < 3 * std)
    (True, True)
    """
    number = _globe_in(spline)
    size = checked_number(radius, "radius must be a number above 0", lambda r: 0 < r < np.inf)
    speed: FloatArray = size * np.sqrt((_part(spline(x, nu=1), number) ** 2).sum(-1))[()]
    if not checked_flag(return_std, "return_std"):
        return speed
    return speed, size * _standard_errors(spline, x, number, _speeds)


@overload
def cog(spline: AnyCubicSpline, x: TimesLike, *, return_std: Literal[False] = False) -> FloatArray: ...


@overload
def cog(spline: AnyCubicSpline, x: TimesLike, *, return_std: Literal[True]) -> tuple[FloatArray, FloatArray]: ...


def cog(
    spline: AnyCubicSpline, x: TimesLike, *, return_std: bool = False
) -> FloatArray | tuple[FloatArray, FloatArray]:
    r"""Compute the course over ground.

    The course is in degrees clockwise from north, in [0, 360). It is NaN where the velocity is zero. At a pole, north
    is the direction of north on the meridian of 0° E.

    Parameters
    ----------
    spline : CubicSpline
        Curve on ``Sphere(2)``.
    x : array_like
        Times, as for ``spline(x)``.
    return_std : bool, default False
        True to return standard errors as well. `spline` must then be a `SmoothingSpline`.

    Returns
    -------
    course : float or ndarray, shape ``(*batch axes, *x.shape)``
        Course in degrees.
    std : float or ndarray, shape ``(*batch axes, *x.shape)``
        Standard error of the course in degrees, only if `return_std` is True. It is NaN at a pole, and where the
        velocity is zero.

    Raises
    ------
    ValidationError
        If the curve is on another space, a time is outside the knots, or standard errors are requested of a curve
        without a covariance.

    See Also
    --------
    sog : Compute the speed over ground.
    symspline.SmoothingSpline.cov : Compute the covariance of a curve.

    Notes
    -----
    If the curve moves by :math:`E\xi` in parallel frames E, its velocity v changes by :math:`E\xi'`. With the unit
    vector n to the right of v, the unit vector e to the east and the latitude φ, the course changes by

    .. math:: \langle n, E\xi'\rangle / |v| + \tan\varphi\, \langle e, E\xi\rangle

    to first order. The second term is the convergence of meridians, and matters close to a pole only. The standard
    error is valid if it is small compared with 57°. At low speed the course is not determined.

    Examples
    --------
    >>> import symspline as ss
    >>> west = ss.CubicSpline([0, 60], from_lonlat([5, 4], [0, 0]), "sphere:2")
    >>> cog(west, 30).round(6)
    np.float64(270.0)

    Positions with an error of about ten metres, every ten seconds:

    >>> import numpy as np
    >>> rng, t = np.random.default_rng(0), np.arange(0, 600, 10.0)
    >>> lat = 50 + 1e-4 * t + 1e-4 * rng.standard_normal(60)
    >>> track = ss.make_smoothing_spline(t, from_lonlat(5 + 1e-4 * rng.standard_normal(60), lat), "sphere:2")
    >>> course, std = cog(track, 300, return_std=True)
    >>> bool(0 < std < 1), bool(abs((course + 180) % 360 - 180) < 3 * std)
    (True, True)
    """
    number = _globe_in(spline)
    east, north = compass(_part(spline(x), number))
    velocity = _part(spline(x, nu=1), number)
    eastward, northward = (velocity * east).sum(-1), (velocity * north).sum(-1)
    # By rounding a tiny negative angle becomes 360 itself.
    degrees = np.degrees(np.arctan2(eastward, northward)) % 360 % 360
    course: FloatArray = np.where((eastward == 0) & (northward == 0), np.nan, degrees)[()]
    if not checked_flag(return_std, "return_std"):
        return course
    return course, np.degrees(_standard_errors(spline, x, number, _courses))


def _standard_errors(spline: Any, x: TimesLike, number: int | None, jacobians: Any) -> FloatArray:
    part = 0 if number is None else sum(map(len, grouped(spline.space, smoothed_spaces(spline.space))[:number]))

    def of_part(motions: list[Motion]) -> Jacobians:
        return [{part: blocks[0]} if blocks else {} for blocks in jacobians(motions)]

    errors = standard_errors(check_uncertain(spline), x, [part], of_part, spline._where(None))
    std: FloatArray = errors[..., 0][()]
    return std


def _directions(v: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the lengths of velocities and unit vectors along them, NaN where the velocity is zero."""
    speed = np.sqrt((v * v).sum(axis=-1, keepdims=True))
    # NaN marks directions that do not exist.
    speed = np.where(speed > 0, speed, np.nan)
    return speed, v / speed


def _speeds(motions: list[Motion]) -> Jacobians:
    """Return the derivatives of the speed on the unit sphere."""
    (motion,) = motions
    _, ahead = _directions(motion.v)
    return [{}, {0: np.einsum("ni,nji->nj", ahead, motion.frames)[:, None]}]


def _courses(motions: list[Motion]) -> Jacobians:
    """Return the derivatives of the course in radians."""
    (motion,) = motions
    speed, ahead = _directions(motion.v)
    right = np.cross(ahead, motion.p) / speed
    east, north = compass(motion.p)
    # The last component of north is the cosine of the latitude. At a pole the course has no derivative.
    cosine = np.where(north[:, 2:] > 0, north[:, 2:], np.nan)
    convergence = motion.p[:, 2:] / cosine * east
    return [{0: np.einsum("ni,nji->nj", side, motion.frames)[:, None]} for side in (convergence, right)]


def resample(
    frame: pd.DataFrame,
    every: str | timedelta | np.timedelta64 = "1min",
    *,
    by: str | Sequence[str] | None = None,
    time: str | None = None,
    columns: tuple[str, str] = ("lon", "lat"),
    interpolate: str | Sequence[str] = (),
    max_gap: float | str | timedelta | np.timedelta64,
    min_points: int = 2,
    duplicates: Duplicates = "raise",
    smooth: bool = False,
    radius: float = EARTH_RADIUS,
    **options: Any,
) -> pd.DataFrame:
    """Resample the positions of a pandas table to regular times.

    One C² curve is fitted per track (a vessel, an animal, a storm), and a new one after every gap. The result includes
    speed and course over ground, and the quality of every row.

    Parameters
    ----------
    frame : pandas.DataFrame
        Table of times and positions. The rows may be in any order.
    every : str or pandas.Timedelta, default "1min"
        Step between the new times, which are whole multiples of it in UTC.
    by : str or sequence of str, optional
        Column, or columns, whose values identify the tracks, such as ``"mmsi"``. By default the table is one track, and
        a warning is issued if it seems to hold several. An empty list means one track without this warning.
    time : str, optional
        Column of the times: dates, or texts in ISO 8601. By default the index.
    columns : tuple of str, default ("lon", "lat")
        Columns of longitude and latitude, in degrees.
    interpolate : str or sequence of str, optional
        Columns of numbers to interpolate linearly in time, such as depths or temperatures. Columns of angles in degrees
        are recognised by names such as ``heading``, ``course`` or ``wind_direction``. They are interpolated along the
        shorter arc.
    max_gap : float, str or timedelta64
        Longest gap within a curve, in seconds or as a duration such as ``"3h"``; see `symspline.fit_segments`. The
        result has no rows within gaps.
    min_points : int, default 2
        Segments with fewer points are dropped.
    duplicates : str, default "raise"
        Treatment of duplicate times; see `symspline.fit_segments`.
    smooth : bool, default False
        True to fit smoothing splines to noisy positions.
    radius : float, default EARTH_RADIUS
        Radius of the globe in metres.
    **options
        Options of `CubicSpline`, or with ``smooth=True`` those of `make_smoothing_spline` except weights and frames.

    Returns
    -------
    pandas.DataFrame
        The columns ``by``, the times, longitude and latitude under their names, ``sog`` in m/s, and ``cog`` in degrees
        clockwise from north. Times keep their time zone. With ``smooth=True`` there are the standard errors
        ``position_std`` (of each of the two coordinates, in metres), ``sog_std`` and ``cog_std``, and the smoothing
        parameter ``lam`` at these times, which varies along a track with the option ``lam="adaptive"``.

        The column ``quality`` is categorical: ``"good"``; ``"lam at bound"`` for a smoothing spline whose λ is at a
        bound, so that the track is a great circle or is not smoothed; or ``"not converged"``, with
        ``on_failure="warn"`` or ``"ignore"``, where the numbers of the curve are NaN.

        Next are the other columns of `frame` that are constant, which means that no track has two different values.
        Examples are the name of a ship or the species of an animal; missing values do not count. The columns in
        `interpolate` are last. All others are dropped.

    Raises
    ------
    ValidationError
        If a column does not exist, a position, a time or a name is missing, every segment has fewer than ``min_points``
        points, or `symspline.fit_segments` does not accept the positions or times.
    ConvergenceError, CutLocusError
        As for `CubicSpline` and `make_smoothing_spline`. The message names the track.

    Warns
    -----
    UserWarning
        If a track is not in the result, because it has fewer than `min_points` positions between gaps or no time of the
        result; or if `by` is omitted and the table seems to hold several tracks.

    Examples
    --------
    >>> import pandas as pd
    >>> times = pd.to_datetime(["2026-01-01 00:00", "2026-01-01 00:10", "2026-01-01 00:20"])
    >>> table = pd.DataFrame({"lon": [10.0, 10.1, 10.2], "lat": [0.0, 0.0, 0.0]}, index=times)
    >>> track = resample(table, "5min", max_gap=3600)
    >>> len(track), track["lon"].iloc[1].round(3), track["sog"].iloc[1].round(2)
    (5, np.float64(10.05), np.float64(18.53))

    A download from Movebank, with a sensor:

    >>> storks = pd.DataFrame(
    ...     {
    ...         "timestamp": ["2013-08-06 09:57:00.000", "2013-08-06 10:57:00.000", "2013-08-06 11:56:00.000"],
    ...         "location-long": [11.02, 11.05, 11.20],
    ...         "location-lat": [47.75, 47.76, 47.90],
    ...         "external-temperature": [20.0, 22.0, 24.0],
    ...         "individual-taxon-canonical-name": "Ciconia ciconia",
    ...         "individual-local-identifier": "DER AN858",
    ...     }
    ... )
    >>> hourly = resample(
    ...     storks,
    ...     "1h",
    ...     by="individual-local-identifier",
    ...     time="timestamp",
    ...     columns=("location-long", "location-lat"),
    ...     max_gap="6h",
    ...     interpolate="external-temperature",
    ... )
    >>> list(hourly.columns[:3]), hourly["external-temperature"].round(2).tolist()
    (['individual-local-identifier', 'timestamp', 'location-long'], [20.1, 22.1])
    """
    import pandas as pd

    table, more = _read_tracks(frame, by, time, columns, interpolate)
    check_smooth(smooth, duplicates, options)
    for option in ("weights", "frames"):
        if smooth and option in options:
            raise ValidationError(
                f"resample does not support {option}, because they belong to rows; use symspline.fit_segments"
            )
    computed = ["sog", "cog", *(["position_std", "sog_std", "cog_std", "lam"] if smooth else []), "quality"]
    table_names = [*table.keys, table.name, *table.columns]
    if clash := [name for name in (*table_names, *more) if name in computed]:
        raise ValidationError(f"the column {clash[0]!r} has the name of a column of the result. Rename it.")
    max_gap = seconds_of(max_gap, "max_gap")
    step = _step(every)
    curves: list[tuple[Any, Any]] = []
    names: list[str] = []
    owners: list[int] = []
    for track, rows in enumerate(table.rows):
        # A curve needs two positions.
        if len(rows) < 2:
            continue
        of = table.called(track)
        try:
            vectors = from_lonlat(*(frame[column].to_numpy()[rows] for column in table.columns))
            used = np.ones(len(rows), bool) if smooth else None
            segments = cut(table.times[rows], vectors, "sphere:2", max_gap, min_points, duplicates, used).curves
        except ValidationError as error:
            raise ValidationError(f"{of}rows in the order of time: {error}" if of else str(error)) from None
        curves += segments
        names += [f"{of}the segment from {np.datetime_as_string(t[0][0], 's')} on" for t, _ in segments]
        owners += [track] * len(segments)
    if not curves and len(frame):
        raise ValidationError(
            f"every track has fewer than {min_points} positions between gaps longer than max_gap={max_gap:g} "
            "seconds; increase max_gap or decrease min_points"
        )
    if not curves:
        return pd.DataFrame(columns=[*table_names, *computed, *more])
    _warn_of_merged(table, by is not None or bool(table.keys))
    angles = [c for c in more if _are_angles(c, frame[c].to_numpy(np.float64, na_value=np.nan))]
    parts = []
    for spline, owner in zip(_fitted(curves, names, smooth, options), owners, strict=True):
        x = pd.date_range(pd.Timestamp(spline.t[0]).ceil(step), pd.Timestamp(spline.t[-1]).floor(step), freq=step)
        rates = pd.DataFrame({table.name: x} | _along(spline, x.to_numpy(), table.columns, radius, smooth))
        for column in more:
            interpolated = table.angles if column in angles else table.linear
            rates[column] = interpolated(column, owner, x.to_numpy())
        parts.append(rates)
    result = pd.concat(parts, ignore_index=True)
    tracks = np.repeat(owners, [len(part) for part in parts])
    _warn_of_missing(table, set(owners), set(tracks.tolist()), every, min_points)
    if table.zone is not None:
        result[table.name] = result[table.name].dt.tz_localize("UTC").dt.tz_convert(table.zone)
    constant = table.constant([*table_names, *computed, *more])
    for column in (*table.keys, *constant):
        result[column] = table.first_values(column, tracks)
    return result[[*table_names, *computed, *constant, *more]]


def _warn_of_merged(table: _Tracks, named: bool) -> None:
    """Warn if the rows of several tracks seem to be merged into one."""
    column = None if named else table.mixed()
    if column is not None:
        warn(
            f"the table seems to hold several tracks: the path through all rows is more than {ZIGZAG:g} times as long "
            f"as the paths of each {column!r}. Pass by={column!r} to fit one curve per {column}, or by=[] if the "
            "table is one track.",
            UserWarning,
        )


def _warn_of_missing(table: _Tracks, fitted: set[int], shown: set[int], every: object, min_points: int) -> None:
    """Warn about tracks that have no rows in the result."""
    gone = [track for track in range(len(table.rows)) if track not in shown]
    if not gone:
        return
    names = ", ".join(_reason(table, track, track in fitted, every, min_points) for track in gone[:3])
    more = f", and {len(gone) - 3} more" if len(gone) > 3 else ""
    count = f"{len(gone)} of {len(table.rows)} tracks are" if len(table.rows) > 1 else "the track is"
    warn(f"{count} not in the result: {names}{more}", UserWarning)


def _reason(table: _Tracks, track: int, fitted: bool, every: object, min_points: int) -> str:
    rows, of = table.rows[track], table.called(track).rstrip(", ")
    if fitted:
        why = f"no multiple of every={short_repr(every)} lies between its first and last position"
    elif len(rows) < min_points:
        why = f"{len(rows)} position{'s' * (len(rows) != 1)}, but min_points={min_points}"
    else:
        why = f"fewer than min_points={min_points} positions between gaps longer than max_gap"
    return f"{of} ({why})" if of else why


def _step(every: object) -> Any:
    """Return the step between the new times."""
    import pandas as pd

    advice = "Pass a text such as '1h' or '10min', or a pandas.Timedelta."
    if isinstance(every, (int, float, np.number)) and not isinstance(every, np.timedelta64):
        raise ValidationError(f"every must be a duration, not {short_repr(every)}. {advice}")
    try:
        step = pd.Timedelta(every)
    except (ValueError, TypeError):
        raise ValidationError(f"every must be a duration, not {short_repr(every)}. {advice}") from None
    if pd.isna(step) or step <= pd.Timedelta(0):
        raise ValidationError(f"every must be more than 0, not {short_repr(every)}. {advice}")
    return step


@overload
def plot(
    spline: _SeveralTracks,
    file: File | None = None,
    *,
    radius: float = EARTH_RADIUS,
    ax: None = None,
    **look: Unpack[PageLook],
) -> Figure: ...


@overload
def plot(
    spline: _SeveralTracks, file: None = None, *, radius: float = EARTH_RADIUS, ax: Axes, **look: Unpack[AxesLook]
) -> Axes: ...


def plot(
    spline: _SeveralTracks,
    file: File | None = None,
    *,
    radius: float = EARTH_RADIUS,
    ax: Axes | None = None,
    color: str | tuple[float, ...] | Sequence[Any] | None = None,
    label: str | Sequence[str] | None = None,
    title: str | None = None,
    figsize: tuple[float, float] | float | None = None,
    show: bool = False,
) -> Figure | Axes:
    """Plot a track, or several, on the Earth, with land, its speed in km/h and its acceleration.

    Tracks that fit into a circle of 25 degrees around a point are enlarged, with a scale bar. Longer ones are
    drawn on a globe and on a map.

    Parameters
    ----------
    spline : CubicSpline, SegmentedCurve, or a list or dict of them
        Curve on ``Sphere(2)``, or on a product with one ``Sphere(2)`` such as positions with heights, or a batch of
        curves. The tracks in a list have different colours, and those in a dict also their keys as labels.
    file : str, path or file object, optional
        File to which the figure is saved, such as ``"track.pdf"``.
    radius : float, default EARTH_RADIUS
        Radius of the globe in metres.
    ax : matplotlib.axes.Axes, optional
        Axes into which the globe or the enlarged track is drawn, without the other panels.
    color, label : optional
        As for `symspline.CubicSpline.plot`; for several tracks, lists with one entry per track.
    title, figsize, show : optional
        As for `symspline.CubicSpline.plot`.

    Returns
    -------
    matplotlib.figure.Figure or matplotlib.axes.Axes
        The figure, which you can modify or save, or `ax`.

    Raises
    ------
    ImportError
        If Matplotlib is not installed.
    ValidationError
        If the curve is on another space, or an argument is invalid.

    See Also
    --------
    symspline.CubicSpline.plot : Plot a curve on any space, without land and in radians.

    Notes
    -----
    If times are not dates, the speed is in kilometres per unit of time. The land is that of Natural Earth at 1:110
    million, which is in the public domain. Its coastlines are accurate to some ten kilometres, so that views narrower
    than two degrees show no land.

    Examples
    --------
    >>> import numpy as np
    >>> import symspline as ss
    >>> times = np.array(["2024-03-01T00", "2024-03-01T08", "2024-03-01T20"], "datetime64[s]")
    >>> flight = ss.CubicSpline(times, from_lonlat([0, -74, -47], [51, 41, -24]), "sphere:2")
    >>> figure = plot(flight)
    """
    require_matplotlib()
    from ._plotting import checked_look, compare
    from ._plotting import plot as draw

    size = checked_number(radius, "radius must be a number above 0", lambda r: 0 < r < np.inf)
    if isinstance(spline, (list, tuple, dict)):
        names = list(map(str, spline)) if isinstance(spline, dict) and label is None else label
        tracks = checked_items(list(spline.values()) if isinstance(spline, dict) else spline, "spline")
        for track in tracks:
            if not isinstance(track, tuple):
                _globe_in(track)
        several = checked_look(file, ax, None, None, title, figsize, show)
        compared: Figure | Axes = compare(tracks, names, file, colors=color, ax=ax, show=show, radius=size, **several)
        return compared
    _globe_in(cast(Any, spline))
    look = checked_look(file, ax, color, label, title, figsize, show)
    drawn: Figure | Axes = draw(spline, file, ax=ax, show=show, radius=size, **look)
    return drawn


def _along(
    spline: Any, at: NDArray[np.datetime64], columns: tuple[Any, Any], radius: float, smooth: bool
) -> dict[Any, Any]:
    """Return the columns of a segment: positions, speed, course, standard errors, λ and quality."""
    import pandas as pd

    lon, lat = to_lonlat(spline(at))
    values: dict[Any, Any] = {columns[0]: lon, columns[1]: lat}
    quality = "good"
    if smooth:
        speed, speed_std = sog(spline, at, radius=radius, return_std=True)
        course, course_std = cog(spline, at, return_std=True)
        values |= {"sog": speed, "cog": course, "position_std": radius * spline.std(at)}
        values |= {"sog_std": speed_std, "cog_std": course_std, "lam": spline.lam_at(at)}
        quality = "lam at bound" if spline.report.at_bound else quality
    else:
        values |= {"sog": sog(spline, at, radius=radius), "cog": cog(spline, at)}
    if not spline.report.converged:
        values, quality = dict.fromkeys(values, np.nan), "not converged"
    return values | {"quality": pd.Categorical([quality] * len(at), _QUALITIES)}


def _fitted(curves: list[tuple[Any, Any]], names: list[str], smooth: bool, options: Keywords) -> Any:
    """Fit the curves, and name them in messages by their names instead of their numbers."""
    if not curves:
        return []

    def renamed(note: object) -> str:
        curve = getattr(note, "curve", None)
        return str(note).replace(f"curve {curve[0]}", names[curve[0]]) if curve else str(note)

    caught: list[warnings.WarningMessage] = []
    try:
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            if smooth:
                splines: Any = smooth_many([(*curve, {}) for curve in curves], Sphere(2), **options)
            else:
                splines = fit_many(curves, Sphere(2), **options)
    except SymsplineError as error:
        raise error._with_message(renamed(error)) from None
    for warning in caught:
        note = warning.message
        warn(renamed(note), warning.category, getattr(note, "curve", None), getattr(note, "node", None))
    return splines


def _globe_in(spline: AnyCubicSpline | SegmentedCurve[Any, Any]) -> int | None:
    """Return the factor of a product space that is Sphere(2), or None if the space itself is Sphere(2)."""
    check_timed(spline)
    space = spline.space
    if space == Sphere(2):
        return None
    globes = [i for i, factor in enumerate(factors_of(space)) if factor == Sphere(2)]
    if len(globes) != 1:
        raise ValidationError(f"the curve must be on Sphere(2), or on a product with one Sphere(2), not on {space!r}")
    return globes[0]


def _part(values: Any, number: int | None) -> FloatArray:
    """Return the part of a point or vector in a factor; None for a space that is not a product."""
    part: FloatArray = values if number is None else values[number]
    return part


# ---- tables of tracks in pandas ----


def _are_angles(name: object, values: NDArray[np.float64]) -> bool:
    """Whether the name and the range of a column suggest angles in degrees, such as headings."""
    text = re.sub(r"[_.-]", " ", str(name))
    inside = np.nanmin(values, initial=0.0) >= -180 and np.nanmax(values, initial=0.0) <= 360
    return bool(_ANGLE.search(text)) and bool(inside)


def are_tracks(labels: NDArray[np.intp], steps: Callable[[NDArray[np.intp]], NDArray[np.float64]]) -> bool:
    """Whether rows with these labels, numbers from 0 on, seem to be several tracks.

    Parameters
    ----------
    labels : ndarray
        Label of each row.
    steps : callable
        Function that returns the lengths of the steps along rows, given their numbers.
    """
    if not 2 <= labels.max(initial=-1) + 1 <= len(labels) / 2:
        return False
    order = np.argsort(labels, kind="stable")
    within = steps(order)[np.diff(labels[order]) == 0].sum()
    return bool(steps(np.arange(len(labels))).sum() > ZIGZAG * within)


def _lengths(points: NDArray[np.float64], order: NDArray[np.intp]) -> NDArray[np.float64]:
    """Return the chords between neighbouring points in an order."""
    return np.asarray(np.linalg.norm(np.diff(points[order], axis=0), axis=1))


class _Tracks(NamedTuple):
    """A table of tracks after validation.

    Attributes
    ----------
    frame : pandas.DataFrame
        The table.
    keys : list
        Columns that identify the tracks.
    columns : tuple
        Columns of longitude and latitude.
    name : str
        Name of the times in the result.
    times : ndarray of datetime64
        Times of all rows, in UTC if there is a time zone.
    zone : tzinfo or None
        Time zone of the times.
    rows : list of ndarray
        Rows of each track in the order of time. Tracks are in the order of their first rows.
    """

    frame: pd.DataFrame
    keys: list[Any]
    columns: tuple[Any, Any]
    name: Any
    times: NDArray[np.datetime64]
    zone: object
    rows: list[NDArray[np.intp]]

    def called(self, track: int) -> str:
        """Return a name of a track for messages, such as "mmsi 211, trip 3, "; empty if there is only one."""
        return _called(self.frame, self.keys, self.rows[track][0])

    def constant(self, left_out: Sequence[Any]) -> list[Any]:
        """Return the other columns that have at most one value per track. Missing values do not count."""
        codes = np.empty(len(self.frame), np.intp)
        for track, rows in enumerate(self.rows):
            codes[rows] = track
        names = []
        for column in self.frame.columns:
            # Values such as lists cannot be compared.
            try:
                if column not in left_out and (self.frame[column].groupby(codes).nunique() < 2).all():
                    names.append(column)
            except TypeError:
                continue
        return names

    def first_values(self, column: object, tracks: NDArray[np.intp]) -> pd.Series:
        """Return the first value of a column that is not missing, for each of these tracks."""
        values = self.frame[column].reset_index(drop=True)
        known = values.notna().to_numpy()
        first = np.array([rows[np.argmax(known[rows])] for rows in self.rows], np.intp)
        return values.iloc[first[tracks]].reset_index(drop=True)

    def mixed(self) -> Any:
        """Return a column whose values seem to be the names of several tracks in one; None if there is none.

        The path through all rows of a track is then at least twice as long as the paths through the rows of each name.
        """
        others = [c for c in self.frame.columns if c not in (*self.keys, *self.columns, self.name)]
        for rows in self.rows:
            points = from_lonlat(*(self.frame[column].to_numpy(np.float64)[rows] for column in self.columns))
            for column in others:
                values = self.frame[column]
                if values.dtype.kind in "fcmMb" or (values.dtype.kind in "iu" and not NAMED.search(str(column))):
                    continue
                try:
                    codes = values.iloc[rows].factorize()[0]
                except TypeError:
                    continue
                if (codes >= 0).all() and are_tracks(codes, partial(_lengths, points)):
                    return column
        return None

    def angles(self, column: object, track: int, x: NDArray[np.datetime64]) -> NDArray[np.float64]:
        """Interpolate angles in degrees along the shorter arc, in [0, 360), or in (-180, 180] if one is negative."""
        rows = self.rows[track]
        values = self.frame[column].to_numpy(np.float64, na_value=np.nan)
        numbers = values[rows]
        numbers[~np.isnan(numbers)] = np.unwrap(numbers[~np.isnan(numbers)], period=360.0)
        degrees = self._interpolated(numbers, rows, x) % 360
        return np.where(degrees > 180, degrees - 360, degrees) if np.nanmin(values, initial=0.0) < 0 else degrees

    def linear(self, column: object, track: int, x: NDArray[np.datetime64]) -> NDArray[np.float64]:
        """Interpolate a column linearly in time. Values at equal times are averaged, and missing ones are omitted."""
        rows = self.rows[track]
        return self._interpolated(self.frame[column].to_numpy(np.float64, na_value=np.nan)[rows], rows, x)

    def _interpolated(
        self, values: NDArray[np.float64], rows: NDArray[np.intp], x: NDArray[np.datetime64]
    ) -> NDArray[np.float64]:
        rows, values = rows[~np.isnan(values)], values[~np.isnan(values)]
        if not len(rows):
            return np.full(len(x), np.nan)
        times, inverse = np.unique(self.times[rows], return_inverse=True)
        means = np.bincount(inverse, values) / np.bincount(inverse)
        at, known = ((moments - times[0]) / np.timedelta64(1, "s") for moments in (x, times))
        return np.asarray(np.interp(at, known, means, left=np.nan, right=np.nan))


def _read_tracks(
    frame: object, by: object, time: object, columns: tuple[str, str], interpolate: str | Sequence[str]
) -> tuple[_Tracks, list[Any]]:
    """Check a table, and return its tracks and the columns to interpolate."""
    import pandas as pd

    if not isinstance(frame, pd.DataFrame):
        raise ValidationError(f"frame must be a pandas DataFrame, not {short_repr(frame)}")
    if twice := [name for name, again in zip(frame.columns, frame.columns.duplicated(), strict=True) if again]:
        raise ValidationError(f"frame has two columns with the name {twice[0]!r}. Rename or drop one of them.")
    lon, lat = columns
    dated = isinstance(frame.index, pd.DatetimeIndex)
    keys = [] if by is None else list(by) if isinstance(by, (list, tuple)) else [by]
    more = [interpolate] if isinstance(interpolate, str) else list(interpolate)
    for name in (*keys, time, lon, lat, *more):
        if name is not None and name not in frame.columns:
            place = ". Pass columns=(longitude, latitude) with their names." if name in (lon, lat) else ""
            index = ". It is a level of the index: pass frame.reset_index()." if name in frame.index.names else ""
            raise ValidationError(
                f"column {name!r} does not exist; the columns are {', '.join(map(str, frame.columns))}{index or place}"
            )
    for name in more:
        if name in (*keys, time, lon, lat) or frame[name].dtype.kind not in "iuf":
            raise ValidationError(
                f"interpolate has the column {name!r}, but only columns of numbers other than times, positions and "
                "names of tracks can be interpolated"
            )
    if (
        time is None
        and not dated
        and (likely := [column for column in frame.columns if _may_be_times(column, frame[column])])
    ):
        raise ValidationError(f"the index of frame holds no dates. Pass the column of the times: time={likely[0]!r}.")
    if time is None and not dated:
        raise ValidationError(
            f"the index of frame holds no dates, but {frame.index.dtype}. Pass time= with the name of the column "
            f"of times; the columns are {', '.join(map(str, frame.columns))}."
        )
    name = time if time is not None else frame.index.name or "time"
    stamps = frame.index.to_series(index=range(len(frame))) if time is None else frame[time].reset_index(drop=True)
    for column in keys:
        _refuse_missing(frame, frame[column], column, [])
    stamps = _dates(stamps, name)
    for column, values in ((lon, frame[lon]), (lat, frame[lat]), (name, stamps)):
        _refuse_missing(frame, values, column, keys)
    zone = stamps.dt.tz
    times = (stamps.dt.tz_convert("UTC").dt.tz_localize(None) if zone is not None else stamps).to_numpy()
    codes = frame.groupby(keys, sort=False, observed=True).ngroup().to_numpy() if keys else np.zeros(len(frame), int)
    order = np.lexsort((times, codes))
    rows = np.split(order, np.flatnonzero(np.diff(codes[order])) + 1) if len(frame) else []
    return _Tracks(frame, keys, (lon, lat), name, times, zone, rows), more


def _may_be_times(name: object, values: pd.Series) -> bool:
    """Whether a column seems to contain times: it contains dates, or has a name such as "time"."""
    return values.dtype.kind == "M" or str(name).lower() in _TIME_NAMES


def _dates(stamps: pd.Series, name: object) -> pd.Series:
    """Return times as dates. Texts must be in ISO 8601, which has no ambiguous days and months."""
    import pandas as pd

    if stamps.dtype.kind != "M" and len(stamps) and pd.api.types.is_string_dtype(stamps):
        try:
            stamps = pd.to_datetime(stamps, format="ISO8601")
        except ValueError as error:
            raise ValidationError(
                f"column {name!r} must hold dates, or texts in ISO 8601 with one time zone: {error}. Convert it with "
                "pandas.to_datetime."
            ) from None
    if stamps.dtype.kind != "M":
        raise ValidationError(
            f"column {name!r} must hold dates, not {stamps.dtype}. Convert it with pandas.to_datetime. If its "
            "numbers count from 1970, pass the argument unit, such as unit='s'."
        )
    return stamps


def _refuse_missing(frame: pd.DataFrame, values: pd.Series, column: object, keys: list[Any]) -> None:
    missing = np.flatnonzero(values.isna())
    if missing.size:
        of = _called(frame, keys, missing[0]).rstrip(", ")
        raise ValidationError(
            f"{len(missing)} rows have no {column!r}, the first of them row {missing[0]}{f' ({of})' if of else ''}; "
            f"drop them by frame.dropna(subset=[{column!r}])"
        )


def _called(frame: pd.DataFrame, keys: list[Any], row: int) -> str:
    return "".join(f"{key} {frame[key].iloc[row]}, " for key in keys)
