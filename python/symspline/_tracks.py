"""Tables of tracks in pandas: which columns hold what, the rows of each track, and columns that results keep."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ._base.arrays import short_repr
from ._base.lonlat import from_lonlat
from ._core import ValidationError

if TYPE_CHECKING:
    import pandas as pd

# Columns of a Movebank download, of its interface for programs, which has underscores, and of tables from R. See the
# Movebank Attribute Dictionary, http://vocab.nerc.ac.uk/collection/MVB.
_MOVEBANK = ("location-long", "location-lat", "timestamp", "individual-local-identifier")
_LAYOUTS = (
    ("lon", "lat", None, None),
    _MOVEBANK,
    tuple(name.replace("-", "_") for name in _MOVEBANK),
    # R replaces hyphens by dots.
    tuple(name.replace("-", ".") for name in _MOVEBANK),
)


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


def are_angles(name: Any, values: NDArray[np.float64]) -> bool:
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


class Tracks(NamedTuple):
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
    zone: Any
    rows: list[NDArray[np.intp]]

    def called(self, track: int) -> str:
        """Return a name of a track for messages, such as "mmsi 211, trip 3, "; empty if there is only one."""
        return _called(self.frame, self.keys, self.rows[track][0])

    def constant(self, left_out: Sequence[Any]) -> list[Any]:
        """Return the other columns that have at most one value per track. Missing values do not count."""
        codes = np.empty(len(self.frame), np.intp)
        for track, rows in enumerate(self.rows):
            codes[rows] = track
        found = []
        for column in self.frame.columns:
            # Values such as lists cannot be compared.
            try:
                if column not in left_out and (self.frame[column].groupby(codes).nunique() < 2).all():
                    found.append(column)
            except TypeError:
                continue
        return found

    def first_values(self, column: Any, tracks: NDArray[np.intp]) -> pd.Series:
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

    def angles(self, column: Any, track: int, x: NDArray[np.datetime64]) -> NDArray[np.float64]:
        """Interpolate angles in degrees along the shorter arc, in [0, 360), or in (-180, 180] if one is negative."""
        rows = self.rows[track]
        values = self.frame[column].to_numpy(np.float64, na_value=np.nan)
        own = values[rows]
        own[~np.isnan(own)] = np.unwrap(own[~np.isnan(own)], period=360.0)
        found = self._interpolated(own, rows, x) % 360
        return np.where(found > 180, found - 360, found) if np.nanmin(values, initial=0.0) < 0 else found

    def linear(self, column: Any, track: int, x: NDArray[np.datetime64]) -> NDArray[np.float64]:
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
        at, known = ((own - times[0]) / np.timedelta64(1, "s") for own in (x, times))
        return np.asarray(np.interp(at, known, means, left=np.nan, right=np.nan))


def read_tracks(
    frame: Any, by: Any, time: Any, columns: tuple[str, str] | None, interpolate: str | Sequence[str]
) -> tuple[Tracks, list[Any]]:
    """Check a table, and return its tracks and the columns to interpolate."""
    import pandas as pd

    if not isinstance(frame, pd.DataFrame):
        raise ValidationError(f"frame must be a pandas DataFrame, not {short_repr(frame)}")
    if twice := [name for name, again in zip(frame.columns, frame.columns.duplicated(), strict=True) if again]:
        raise ValidationError(f"frame has two columns with the name {twice[0]!r}. Rename or drop one of them.")
    lon, lat, stamp, owner = _layout(frame, columns)
    dated = isinstance(frame.index, pd.DatetimeIndex)
    time = stamp if time is None and not dated and stamp in frame.columns else time
    by = owner if by is None and owner in frame.columns else by
    keys = [] if by is None else list(by) if isinstance(by, (list, tuple)) else [by]
    more = [interpolate] if isinstance(interpolate, str) else list(interpolate)
    for name in (*keys, time, lon, lat, *more):
        if name is not None and name not in frame.columns:
            index = ". It is a level of the index: pass frame.reset_index()." if name in frame.index.names else ""
            raise ValidationError(
                f"column {name!r} does not exist; the columns are {', '.join(map(str, frame.columns))}{index}"
            )
    for name in more:
        if name in (*keys, time, lon, lat) or frame[name].dtype.kind not in "iuf":
            raise ValidationError(
                f"interpolate has the column {name!r}, but only columns of numbers other than times, positions and "
                "names of tracks can be interpolated"
            )
    if time is None and not dated and (found := [own for own in frame.columns if _may_be_times(own, frame[own])]):
        raise ValidationError(f"the index of frame holds no dates. Pass the column of the times: time={found[0]!r}.")
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
    return Tracks(frame, keys, (lon, lat), name, times, zone, rows), more


def _layout(frame: pd.DataFrame, columns: tuple[str, str] | None) -> tuple[Any, Any, Any, Any]:
    """Return the columns of longitude, latitude, time and track, the last two None if the layout has none."""
    if columns is None:
        found = [own for own in _LAYOUTS if set(own[:2]) <= set(frame.columns)]
        lon, lat, time, owner = found[0] if found else _LAYOUTS[0]
        return lon, lat, time, owner
    lon, lat = columns
    return lon, lat, None, None


def _may_be_times(name: Any, values: pd.Series) -> bool:
    """Whether a column seems to contain times: it contains dates, or has a name such as "time"."""
    return values.dtype.kind == "M" or str(name).lower() in _TIME_NAMES


def _dates(stamps: pd.Series, name: Any) -> pd.Series:
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


def _refuse_missing(frame: pd.DataFrame, values: pd.Series, column: Any, keys: list[Any]) -> None:
    missing = np.flatnonzero(values.isna())
    if missing.size:
        of = _called(frame, keys, missing[0]).rstrip(", ")
        raise ValidationError(
            f"{len(missing)} rows have no {column!r}, the first of them row {missing[0]}{f' ({of})' if of else ''}; "
            f"drop them by frame.dropna(subset=[{column!r}])"
        )


def _called(frame: pd.DataFrame, keys: list[Any], row: int) -> str:
    return "".join(f"{key} {frame[key].iloc[row]}, " for key in keys)
