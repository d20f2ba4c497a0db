"""Tables in JSON, GeoJSON and GPX."""

from __future__ import annotations

import json
from collections.abc import Mapping
from datetime import UTC
from typing import Any, BinaryIO

import numpy as np

from ._csv import date_texts
from ._messages import Problem, refuse
from ._streams import Source
from ._tables import Array, Layout, Table, Texts
from ._times import EXACT

_TIME, _LON, _LAT, _HEIGHT, _TRACK = "time", "lon", "lat", "ele", "track"
# Properties of lines that hold the times of their points.
_LINE_TIMES = ("coordTimes", "times")

_KINDS = "GeoJSON must be a collection of features that are points or lines"

# ---- reading ----


def read_json(path: Source) -> Table:
    """Read a list of objects with one value per column, or an object with one list per column."""
    return _table(path, _json(path))


def read_geojson(path: Source) -> Table:
    """Read a collection of features: points with properties, or lines with their times in ``coordTimes``.

    The name of a line is in the column ``track``, and heights are in the column ``ele``.
    """
    content = _json(path)
    rows: list[dict[str, Any]] = []
    try:
        features = content["features"] if content["type"] == "FeatureCollection" else [content]
        for number, feature in enumerate(features):
            rows += _feature(feature, str(number), path)
    except (KeyError, TypeError, ValueError, AttributeError):
        raise Problem(f"{path}: {_KINDS}") from None
    return _table(path, rows)


def read_gpx(path: Source) -> Table:
    """Read the time, longitude, latitude and height of all points of a GPX file, and the name of their track."""
    gpxpy = _gpxpy()
    with path.open() as file:
        try:
            gpx = gpxpy.parse(file.read().decode("utf-8-sig"))
        except (UnicodeDecodeError, ValueError, gpxpy.gpx.GPXException) as error:
            raise Problem(f"{path} is damaged or not a GPX file: {error}") from None
    rows: list[dict[str, Any]] = []
    for number, track in enumerate(gpx.tracks, 1):
        for part, segment in enumerate(track.segments, 1):
            name = track.name or str(number)
            label = f"{name}/{part}" if len(track.segments) > 1 else name
            for point in segment.points:
                time = point.time and point.time.astimezone(UTC).isoformat()
                own = {_TIME: time, _LON: point.longitude, _LAT: point.latitude, _HEIGHT: point.elevation}
                rows.append({name: value for name, value in own.items() if value is not None} | {_TRACK: label})
    refuse(path, (not rows, " has no tracks with points"))
    return _table(path, rows)


def _json(path: Source) -> Any:
    with path.open() as file:
        try:
            return json.load(file)
        except (ValueError, RecursionError) as error:
            lines = "; for JSON lines, make one list of them, such as by jq -s ." if "Extra data" in str(error) else ""
            raise Problem(f"{path} is not JSON: {error}{lines}") from None


def _table(path: Source, content: Any) -> Table:
    if isinstance(content, dict) and content and all(isinstance(values, list) for values in content.values()):
        return Table(path, {name: _column(values) for name, values in content.items()})
    shape = " is not a table: give a list of objects, one per row, or an object of lists, one per column"
    rows = isinstance(content, list) and content and all(isinstance(row, dict) for row in content)
    refuse(path, (not rows, shape))
    names = dict.fromkeys(name for row in content for name in row)
    return Table(path, {name: _column([row.get(name) for row in content]) for name in names})


def _column(values: list[Any]) -> Any:
    """Return numbers as an array, and other values as texts."""
    kinds = set(map(type, values)) - {type(None)}
    # Larger whole numbers are exact as texts only.
    if kinds and kinds <= {int, float} and all(type(own) is not int or abs(own) <= EXACT for own in values):
        return np.array([np.nan if value is None else value for value in values], np.float64)
    return Texts(["" if value is None else str(value) for value in values])


def _feature(feature: Any, number: str, path: Source) -> list[dict[str, Any]]:
    properties = dict(feature.get("properties") or {})
    coordinates = feature["geometry"]["coordinates"]
    if feature["geometry"]["type"] == "Point":
        return [_place(coordinates) | properties]
    kind = feature["geometry"]["type"]
    remedy = "; make one LineString of its parts" if kind == "MultiLineString" else ""
    refuse(path, (kind != "LineString", f": {_KINDS}, not {kind}{remedy}"))
    times = next((properties.pop(name) for name in _LINE_TIMES if name in properties), None)
    label = {_TRACK: str(properties.get("name", number))}
    rows = [_place(own) | label for own in coordinates]
    return rows if times is None else [{_TIME: time} | row for time, row in zip(times, rows, strict=True)]


def _place(coordinates: Any) -> dict[str, Any]:
    lon, lat, *height = coordinates
    return {_LON: lon, _LAT: lat} | ({_HEIGHT: height[0]} if height else {})


def _gpxpy() -> Any:
    try:
        import gpxpy
        import gpxpy.gpx
    except ImportError:
        raise Problem("GPX files need gpxpy; install it with: pip install 'symspline[gpx]'") from None
    return gpxpy


# ---- writing ----


def _values(columns: Mapping[str, Array], layout: Layout) -> dict[str, list[Any]]:
    """Return columns as lists of numbers and texts; NaN becomes None."""
    found: dict[str, list[Any]] = {}
    for name, own in columns.items():
        if own.dtype.kind == "M":
            found[name] = date_texts(own, layout.utc)
        else:
            # NaN is not equal to itself.
            found[name] = [value if value == value else None for value in own.tolist()]
    return found


def write_json(file: BinaryIO, columns: Mapping[str, Array], layout: Layout) -> None:
    """Write a list of objects, one per row and line."""
    rows = zip(*_values(columns, layout).values(), strict=True)
    lines = ",\n".join(json.dumps(dict(zip(columns, row, strict=True)), ensure_ascii=False) for row in rows)
    file.write(f"[\n{lines}\n]\n".encode())


def write_geojson(file: BinaryIO, columns: Mapping[str, Array], layout: Layout) -> None:
    """Write a collection of points, one per row and line, whose other columns are properties."""
    lon, lat = _lonlat(columns, layout, "GeoJSON")
    values = _values(columns, layout)
    places = zip(values.pop(lon), values.pop(lat), strict=True)
    features = []
    for place, *own in zip(places, *values.values(), strict=True):
        geometry = {"type": "Point", "coordinates": place}
        properties = dict(zip(values, own, strict=True))
        features.append(json.dumps({"type": "Feature", "properties": properties, "geometry": geometry}))
    collection = ",\n".join(features)
    file.write(f'{{"type": "FeatureCollection", "features": [\n{collection}\n]}}\n'.encode())


def write_gpx(file: BinaryIO, columns: Mapping[str, Array], layout: Layout) -> None:
    """Write one track per curve."""
    gpx = _gpxpy().gpx
    lon, lat = _lonlat(columns, layout, "GPX")
    rates = [name for name in columns if name.endswith(("_d1", "_d2"))]
    refuse("", (rates, "GPX has positions and no derivatives; write those to a .csv, .npz or .parquet file"))
    dates = columns[layout.time]
    refuse("", (dates.dtype.kind != "M", "GPX files have dates, but the times of these curves are numbers"))
    times = dates.astype("datetime64[us]").tolist()
    names = columns[layout.curve].tolist() if layout.curve is not None else [None] * len(times)
    whole, tracks = gpx.GPX(), {}
    for name, time, x, y in zip(names, times, columns[lon].tolist(), columns[lat].tolist(), strict=True):
        if name not in tracks:
            track, segment = gpx.GPXTrack(name=name), gpx.GPXTrackSegment()
            track.segments.append(segment)
            whole.tracks.append(track)
            tracks[name] = segment
        tracks[name].points.append(gpx.GPXTrackPoint(y, x, time=time.replace(tzinfo=UTC)))
    file.write(whole.to_xml().encode())


def _lonlat(columns: Mapping[str, Array], layout: Layout, what: str) -> tuple[str, ...]:
    if layout.lonlat is None:
        raise Problem(f"{what} has longitude and latitude: write it for curves on sphere:2, with --lonlat")
    refuse("", (layout.lonlat[0] not in columns, f"{what} needs the points beside their derivatives: give --nu 0,1"))
    return layout.lonlat
