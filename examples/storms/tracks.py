"""Storm tracks as C² splines on S², and what can be read off them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from hurdat import Storm
from numpy.typing import NDArray

from symspline import CubicSpline, Sphere, fit_many
from symspline._splines.functional import Segments, pairs, segments_of
from symspline.geo import compass, from_lonlat, to_lonlat

Array = NDArray[np.float64]
Times = NDArray[np.datetime64]

GLOBE = Sphere(2)
EARTH_RADIUS_KM = 6371.0
KMH = 3600 * EARTH_RADIUS_KM
"""km/h in one radian per second."""


def fit_tracks(storms: Sequence[Storm]) -> list[CubicSpline]:
    """The tracks of all storms, in one call.

    Natural ends: a storm's first and last fix are not where its motion rests, but positions rounded to
    0.1 degree carry more noise than a not-a-knot end bears. Cutting the tracks at every inner fix and
    comparing the velocity there with that of the whole track, natural ends are twice as close.
    """
    tracks = [(storm.times, from_lonlat(storm.lon, storm.lat)) for storm in storms]
    return fit_many(tracks, GLOBE, bc_type="natural")


def every(step: np.timedelta64, times: Times) -> Times:
    """Times from the first to the last of ``times``, one a step."""
    return np.arange(times[0], times[-1] + np.timedelta64(1, "m"), step)


# ---- one segment at a time ----


def samples(pieces: Segments, number: int) -> Times:
    """Times of every segment from its left to its right end, shape (segments, number)."""
    shares = np.linspace(0, 1, number)
    seconds = (pieces.t[:, 1:] - pieces.t[:, :1]) / np.timedelta64(1, "s") * shares
    times: Times = pieces.t[:, :1] + np.rint(seconds).astype("timedelta64[s]")
    return times


def slerp_pieces(spline: CubicSpline) -> Segments:
    """The great-circle arcs between the points of a spline, each at constant speed."""
    t, points = pairs(spline.t), pairs(spline.points)
    seconds = (t[:, 1] - t[:, 0]) / np.timedelta64(1, "s")
    ends = [GLOBE.log(points[:, 0], points[:, 1]), -GLOBE.log(points[:, 1], points[:, 0])]
    return Segments(GLOBE, t, points, np.stack(ends, axis=1) / seconds[:, None, None])


def relative_jumps(pieces: Segments) -> tuple[float, float, float]:
    """Largest jumps of γ, γ' and ∇γ' at the inner knots, relative to the largest |γ|, |γ'|, |∇γ'| there."""
    position, velocity, acceleration = (pieces.jumps(nu) for nu in (0, 1, 2))
    return position.relative, velocity.relative, acceleration.relative


# ---- motion ----


@dataclass(frozen=True)
class Motion:
    """How a place moves over the globe.

    Attributes:
        speed: km/h.
        course: degrees clockwise from north, in (-180, 180].
        turn: turn rate in degrees per hour, to the right positive: geodesic curvature times speed.
    """

    speed: Array
    course: Array
    turn: Array


def motion(point: Array, velocity: Array, acceleration: Array) -> Motion:
    """Motion from position, velocity and covariant acceleration, in radians and seconds."""
    east, north = compass(point)
    speed = np.linalg.norm(velocity, axis=-1)
    course = np.arctan2((velocity * east).sum(-1), (velocity * north).sum(-1))
    to_the_right = (np.cross(point, acceleration) * velocity).sum(-1) / speed**2
    return Motion(KMH * speed, np.degrees(course), 3600 * np.degrees(to_the_right))


def piecewise_motion(pieces: Segments, x: Times) -> Motion:
    """Motion along segments at the times x, shape (S, m)."""
    return motion(pieces.at(x), pieces.at(x, 1), pieces.at(x, 2))


def lonlat_motion(storm: Storm, x: Times) -> Motion:
    """Motion where longitude and latitude are interpolated linearly between the fixes.

    Args:
        storm: the storm; none of its segments crosses the date line.
        x: times, shape (segments, m): a row for every segment.
    """
    lon, lat = (np.radians(pairs(values)) for values in (storm.lon, storm.lat))
    ends = pairs(storm.times)
    share = (x - ends[:, :1]) / (ends[:, 1:] - ends[:, :1])
    seconds = (ends[:, 1:] - ends[:, :1]) / np.timedelta64(1, "s")
    along, up = (np.diff(values, axis=1) / seconds for values in (lon, lat))
    place = [values[:, :1] + share * np.diff(values, axis=1) for values in (lon, lat)]
    point = from_lonlat(*np.degrees(place))
    east, north = compass(point)
    sine, cosine = np.sin(place[1]), np.cos(place[1])
    velocity = (along * cosine)[..., None] * east + np.broadcast_to(up[..., None], east.shape) * north
    acceleration = (-2 * along * up * sine)[..., None] * east + (along**2 * sine * cosine)[..., None] * north
    return motion(point, velocity, acceleration)


@dataclass(frozen=True)
class Comparison:
    """Three ways to interpolate one storm: motion by name, each sampled segment by segment.

    Attributes:
        times: shape (segments, m), from the left to the right end of every segment.
        motions: shape (segments, m); where the course differs by full turns it is that next to the
            spline's, which is continuous.
    """

    times: Times
    motions: dict[str, Motion]

    def steps(self, name: str) -> tuple[float, float]:
        """The largest jumps at the fixes, of speed in km/h and of the course in degrees."""
        motion = self.motions[name]
        jumps = [np.abs(values[1:, 0] - values[:-1, -1]) for values in (motion.speed, motion.course)]
        return float(jumps[0].max()), float(jumps[1].max())


def comparison(storm: Storm, spline: CubicSpline) -> Comparison:
    """The C² spline, great-circle arcs, and longitude and latitude interpolated linearly."""
    x = samples(segments_of(spline), 73)
    smooth = piecewise_motion(segments_of(spline), x)
    course = np.unwrap(smooth.course.ravel(), period=360).reshape(x.shape)
    motions = {
        "C2 spline": smooth,
        "great circles (Slerp)": piecewise_motion(slerp_pieces(spline), x),
        "linear lon/lat": lonlat_motion(storm, x),
    }
    return Comparison(x, {name: _next_to(course, motion) for name, motion in motions.items()})


def _next_to(course: Array, motion: Motion) -> Motion:
    """The motion with its course changed by full turns to come closest to a given one."""
    return replace(motion, course=motion.course + 360 * np.rint((course - motion.course) / 360))


# ---- a storm in numbers ----


@dataclass(frozen=True)
class Summary:
    """One line of the table.

    Attributes:
        label: name and year.
        points, iterations, residual: of the fit.
        jumps: of γ, γ' and ∇γ' at the knots, relative.
        longest_step: km between two neighbouring fixes.
        mean_speed: the largest mean speed between two neighbouring fixes, km/h.
        top_speed, top_time: the largest speed of the spline, km/h, and when (to the minute).
    """

    label: str
    points: int
    iterations: int
    residual: float
    jumps: tuple[float, float, float]
    longest_step: float
    mean_speed: float
    top_speed: float
    top_time: np.datetime64


def summary(storm: Storm, spline: CubicSpline) -> Summary:
    """A storm in numbers."""
    steps = EARTH_RADIUS_KM * GLOBE.distance(spline.points[:-1], spline.points[1:])
    minutes = every(np.timedelta64(1, "m"), spline.t)
    speed = KMH * spline.speed(minutes)
    return Summary(
        storm.label,
        len(storm),
        int(spline.report.iterations),
        float(spline.report.residual),
        relative_jumps(segments_of(spline)),
        float(steps.max()),
        float((steps / (np.diff(spline.t) / np.timedelta64(1, "h"))).max()),
        float(speed.max()),
        minutes[speed.argmax()],
    )


# ---- a table of positions ----


@dataclass(frozen=True)
class Positions:
    """Positions of many storms, one row an hour: arrays of equal length."""

    storm: NDArray[np.str_]
    time: Times
    lon: Array
    lat: Array
    speed_kmh: Array


def hourly(storms: Sequence[Storm], splines: Sequence[CubicSpline]) -> Positions:
    """Hourly positions of all storms, from the first fix of each to its last."""
    hours = [every(np.timedelta64(1, "h"), spline.t) for spline in splines]
    pairs = list(zip(splines, hours, strict=True))
    lon, lat = to_lonlat(np.concatenate([spline(x) for spline, x in pairs]))
    return Positions(
        np.repeat([storm.label for storm in storms], [len(x) for x in hours]),
        np.concatenate(hours),
        lon,
        lat,
        KMH * np.concatenate([spline.speed(x) for spline, x in pairs]),
    )
