"""Rotation matrices and unit quaternions, and longitudes and latitudes as points of S²."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .._core import ValidationError
from .arrays import as_array, refuse
from .typing import FloatArray

Rows = tuple[tuple[Any, ...], ...]


def rotation_rows(w: Any, x: Any, y: Any, z: Any) -> Rows:
    """Return the rows of the rotation matrix of a unit quaternion."""
    return (
        (1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)),
        (2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)),
        (2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)),
    )


def matrices_of_quaternions(q: Any) -> NDArray[np.float64]:
    """Return the rotation matrices of quaternions (w, x, y, z), which need not have unit length."""
    q = np.asarray(q, np.float64)
    q = q / np.linalg.norm(q, axis=-1, keepdims=True)
    return np.stack([np.stack(row, axis=-1) for row in rotation_rows(*np.moveaxis(q, -1, 0))], axis=-2)


def quaternion_rows(matrix: Any) -> Rows:
    """Return the rows of 4qqᵀ for the unit quaternion q of a rotation matrix, shape (..., 3, 3).

    All rows are multiples of q. The row with the largest diagonal entry has no cancellation.

    References
    ----------
    S. W. Shepperd, Quaternion from rotation matrix, J. Guidance and Control 1 (1978).
    """
    (a, b, c), (d, e, f), (g, h, i) = ([matrix[..., row, column] for column in range(3)] for row in range(3))
    return (
        (1 + a + e + i, h - f, c - g, d - b),
        (h - f, 1 + a - e - i, b + d, c + g),
        (c - g, b + d, 1 - a + e - i, f + h),
        (d - b, c + g, f + h, 1 - a - e + i),
    )


# ---- positions on a globe: longitude and latitude in degrees, and unit vectors of S² ----


def from_lonlat(lon: ArrayLike, lat: ArrayLike) -> FloatArray:
    """Convert longitude and latitude to unit vectors.

    Parameters
    ----------
    lon, lat : array_like, shape (...)
        Degrees east and north.

    Returns
    -------
    ndarray, shape (..., 3)
        Unit vectors: x points to 0° E 0° N, y to 90° E 0° N, z to the north pole.

    Raises
    ------
    ValidationError
        If a latitude is beyond a pole or a longitude exceeds ten turns. The two may then be swapped, or a value may
        represent a missing one.

    See Also
    --------
    to_lonlat : Convert unit vectors to longitude and latitude.

    Examples
    --------
    >>> from symspline import geo
    >>> geo.from_lonlat(90, 0).round(15)
    array([0., 1., 0.])
    """
    east, north = _degrees(lon, "lon", 3600), _degrees(lat, "lat", 90)
    try:
        east, north = np.broadcast_arrays(east, north)
    except ValueError:
        raise ValidationError(
            f"lon of shape {east.shape} and lat of shape {north.shape} do not broadcast. Pass one of each per position."
        ) from None
    return np.stack([np.cos(north) * np.cos(east), np.cos(north) * np.sin(east), np.sin(north)], axis=-1)


def to_lonlat(points: ArrayLike) -> tuple[FloatArray, FloatArray]:
    """Convert unit vectors to longitude and latitude.

    Parameters
    ----------
    points : array_like, shape (..., 3)
        Unit vectors.

    Returns
    -------
    lon : ndarray, shape (...)
        Degrees east, in (-180, 180].
    lat : ndarray, shape (...)
        Degrees north.

    See Also
    --------
    from_lonlat : Convert longitude and latitude to unit vectors.

    Examples
    --------
    >>> from symspline import geo
    >>> lon, lat = geo.to_lonlat([0, 1, 0])
    >>> float(lon), float(lat)
    (90.0, 0.0)
    """
    x, y, z = np.moveaxis(_vectors(points), -1, 0)
    return np.degrees(np.arctan2(y, x)), np.degrees(np.arctan2(z, np.hypot(x, y)))


def compass(points: ArrayLike) -> tuple[FloatArray, FloatArray]:
    """Compute the directions east and north at unit vectors.

    Parameters
    ----------
    points : array_like, shape (..., 3)
        Unit vectors.

    Returns
    -------
    east : ndarray, shape (..., 3)
        Unit tangent vectors to the east. At a pole, that of the meridian of 0° E.
    north : ndarray, shape (..., 3)
        Unit tangent vectors to the north.

    Examples
    --------
    >>> from symspline import geo
    >>> east, north = geo.compass([1, 0, 0])
    >>> east + 0.0, north + 0.0
    (array([0., 1., 0.]), array([0., 0., 1.]))
    """
    x, y, z = np.moveaxis(_vectors(points), -1, 0)
    horizontal = np.hypot(x, y)
    pole = horizontal == 0
    cosine, sine = (np.where(pole, at, w / np.where(pole, 1, horizontal)) for at, w in ((1, x), (0, y)))
    zero = np.zeros_like(x)
    return np.stack([-sine, cosine, zero], axis=-1), np.stack([-z * cosine, -z * sine, horizontal], axis=-1)


def _degrees(value: ArrayLike, name: str, most: float) -> FloatArray:
    """Convert an angle from degrees to radians."""
    angles = _floats(value, name)
    advice = "Check whether lon and lat are swapped, or whether the value represents a missing one."
    # The limit itself may be rounded up in single precision.
    beyond = np.abs(angles) > most * (1 + 1e-7)
    refuse(beyond, name, lambda i: f"is {angles[i]}, but {name} must be from -{most} to {most} degrees. {advice}")
    return np.radians(angles)


def _vectors(points: ArrayLike) -> FloatArray:
    array = _floats(points, "points")
    if array.shape[-1:] != (3,):
        raise ValidationError(f"points must be unit vectors of shape (..., 3), not {array.shape}")
    return array


def _floats(value: ArrayLike, name: str) -> FloatArray:
    array = as_array(value, name)
    if array.dtype.kind not in "iuf":
        raise ValidationError(f"{name} must be real numbers, not {array.dtype}")
    return array.astype(float)
