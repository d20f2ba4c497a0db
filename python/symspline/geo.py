"""Places and directions on a globe: longitude and latitude in degrees, unit vectors of S², speed and course.

>>> import symspline as ss
>>> track = ss.CubicSpline([0, 3600], ss.geo.from_lonlat([0, 1], [0, 0]), "sphere:2")
>>> ss.geo.sog(track, 60).round(3), ss.geo.cog(track, 60).round(3)
(np.float64(30.888), np.float64(90.0))
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._core import ValidationError
from .arrays import as_array

if TYPE_CHECKING:
    from .spline import CubicSpline

Array = NDArray[np.float64]

EARTH_RADIUS = 6_371_008.8
"""Metres: the mean radius R₁ of the ellipsoid GRS 80 (Moritz, Geodetic reference system 1980)."""


def from_lonlat(lon: ArrayLike, lat: ArrayLike) -> Array:
    """The unit vectors of places on a globe.

    Args:
        lon, lat: degrees east and north, shape (...).

    Returns:
        Shape (..., 3): x points to 0° E 0° N, y to 90° E 0° N, z to the north pole.

    >>> from_lonlat(90, 0).round(15)
    array([0., 1., 0.])
    """
    east, north = np.radians(_floats(lon, "lon")), np.radians(_floats(lat, "lat"))
    x, y, z = np.broadcast_arrays(np.cos(north) * np.cos(east), np.cos(north) * np.sin(east), np.sin(north))
    return np.stack([x, y, z], axis=-1)


def to_lonlat(points: ArrayLike) -> tuple[Array, Array]:
    """Longitude in (-180, 180] and latitude, in degrees, of unit vectors of shape (..., 3).

    >>> lon, lat = to_lonlat([0, 1, 0])
    >>> float(lon), float(lat)
    (90.0, 0.0)
    """
    x, y, z = np.moveaxis(_floats(points, "points"), -1, 0)
    return np.degrees(np.arctan2(y, x)), np.degrees(np.arctan2(z, np.hypot(x, y)))


def compass(points: ArrayLike) -> tuple[Array, Array]:
    """Unit vectors to the east and to the north at unit vectors of shape (..., 3); at a pole, those of
    0° E.

    >>> east, north = compass([1, 0, 0])
    >>> east + 0.0, north + 0.0
    (array([0., 1., 0.]), array([0., 0., 1.]))
    """
    x, y, z = np.moveaxis(_floats(points, "points"), -1, 0)
    horizontal = np.hypot(x, y)
    pole = horizontal == 0
    cosine, sine = (np.where(pole, at, w / np.where(pole, 1, horizontal)) for at, w in ((1, x), (0, y)))
    zero = np.zeros_like(x)
    return np.stack([-sine, cosine, zero], axis=-1), np.stack([-z * cosine, -z * sine, horizontal], axis=-1)


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


def _check_globe(spline: CubicSpline) -> None:
    if str(spline.space) != "sphere:2":
        raise ValidationError(f"places on a globe are points of Sphere(2), not of {spline.space!r}")


def _floats(value: ArrayLike, name: str) -> Array:
    return np.asarray(as_array(value, name), dtype=float)
