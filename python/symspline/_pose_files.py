"""Files of poses: TUM, KITTI, EuRoC."""

from __future__ import annotations

import gzip
import os
import zlib
from collections.abc import Callable, Iterable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._arrays import as_array, brief, short_repr
from ._core import ValidationError
from ._disk import path_of, replacing
from ._input import times_of
from ._spaces import Array, SpecialEuclidean, SpecialOrthogonal
from .convert import matrix_to_quaternion, quaternion_to_matrix
from .convert._reading import length, off_one, refuse

Doubles = NDArray[np.float64]

# What stands in a line of a TUM trajectory.
TUM = ("time", "tx", "ty", "tz", "qx", "qy", "qz", "qw")
_SO3, _SE3 = SpecialOrthogonal(3), SpecialEuclidean(3)
# Files have rounded numbers, some with three decimals.
_ROUNDED = 5e-3
# The year 5138 in seconds since 1970, and 1973 in milliseconds.
_FAR = 1e11
# The last second whose nanoseconds are a number of 64 bits.
_LAST = 9.2e9
_EUROC = "#timestamp [ns],p_x [m],p_y [m],p_z [m],q_w [],q_x [],q_y [],q_z []"


# ---- TUM: time x y z qx qy qz qw ----


def read_tum(file: Any) -> tuple[Doubles, Array]:
    """Poses from a file in the format of TUM's RGB-D benchmark: lines of ``time x y z qx qy qz qw``.

    Source: Sturm et al., A Benchmark for the Evaluation of RGB-D SLAM Systems (IROS 2012). Comments begin with #.

    Args:
        file: its name, or an open file of text; names that end with .gz are decompressed.

    Returns:
        Times in seconds, shape (n,), and poses, points of ``se:3``, shape (n, 4, 4). Rounded quaternions are made unit
        vectors; times are as in the file, repeated ones too (see `symspline.fit_segments`).

    Raises:
        ValidationError: a line has not eight numbers, or the four of a quaternion are none; it is named.
        OSError: the file cannot be read.
    """
    rows, place = tum_rows(file)
    check_seconds(rows[:, 0], f"{_name(file)}: time")
    r = rotations_in_rows(rows[:, [7, 4, 5, 6]], lambda i: f"{_name(file)}, {place(i)}")
    return rows[:, 0].copy(), join(r, rows[:, 1:4])


def tum_rows(file: Any) -> tuple[Doubles, Callable[[int], str]]:
    """The numbers of a TUM trajectory as they stand there, shape (n, 8), and where a row is: "line 7".

    Raises:
        ValidationError: a line has not eight numbers that are finite.
        OSError: the file cannot be read.
    """
    name, lines = _name(file), _lines(file)
    form = f"a line of a TUM trajectory has {len(TUM)}: {' '.join(TUM)}"
    if not lines:
        raise ValidationError(f"{name} is empty, it has no numbers; {form}")
    try:
        rows = np.loadtxt([line.text for line in lines], ndmin=2)
    except ValueError as error:
        raise ValidationError(_bad_line(lines, name, form) or f"{name}: {form}; {brief(error)}") from None
    if rows.shape[1] != len(TUM):
        raise ValidationError(f"{name}, line {lines[0].number}: {rows.shape[1]} numbers, but {form}")
    bad = np.argwhere(~np.isfinite(rows))
    if len(bad):
        i, j = bad[0]
        raise ValidationError(
            f"{name}, line {lines[i].number}: column {TUM[j]!r} holds {rows[i, j]}, which is not a finite number"
        )
    return rows, lambda i: f"line {lines[i].number}"


def _bad_line(lines: list[Line], name: str, form: str) -> str | None:
    """What is wrong with the first line that is no pose."""
    for number, text in lines:
        cells = text.partition("#")[0].split()
        if len(cells) != len(TUM):
            return f"{name}, line {number}: {len(cells)} numbers, but {form}"
        for column, cell in zip(TUM, cells, strict=True):
            try:
                np.loadtxt([cell])
            except ValueError:
                return f"{name}, line {number}: column {column!r} holds {cell!r}, which is not a number"
    return None


def write_tum(file: Any, t: ArrayLike, poses: Any) -> None:
    """Write poses as lines of ``time x y z qx qy qz qw``, so that `read_tum` gets every number back.

    Args:
        file: its name, or an open file of text.
        t: times in seconds, shape (n,); dates become seconds since 1970.
        poses: shape (n, 4, 4), or a pair of rotations (n, 3, 3) and positions (n, 3).

    Raises:
        ValidationError: the arrays are not what is described above.
    """
    r, x = split(_checked(poses))
    write_tum_rows(
        file, _seconds(t, len(x)), np.concatenate([x, _quaternions(r, scalar_first=False)], axis=1)
    )


def write_tum_rows(file: Any, t: Array, poses: Doubles, head: str = "") -> None:
    """Write times and the seven numbers of each pose; dates with all nanoseconds, as seconds since 1970.

    Raises
    ------
    ValidationError
        Dates are finer than nanoseconds, or too far from 1970 to be counted in them.
    """
    times = list(map(repr, t.tolist())) if t.dtype.kind != "M" else _exact_seconds(t)
    rows = (f"{time} {' '.join(map(repr, pose))}\n" for time, pose in zip(times, poses.tolist(), strict=True))
    _write_lines(file, rows, head)


def _exact_seconds(dates: Array) -> list[str]:
    ns = dates.astype("datetime64[ns]")
    refuse(ns != dates, "t", lambda i: f"is {dates[i]}, which is not a whole number of nanoseconds near 1970")
    whole, rest = np.divmod(ns.astype(np.int64), 10**9)
    return [f"{second}.{part:09}" for second, part in zip(whole.tolist(), rest.tolist(), strict=True)]


# ---- KITTI: r11 r12 r13 x r21 ... ----


def read_kitti(file: Any, times: Any = None) -> tuple[Doubles, Array]:
    """Poses from a file in the format of KITTI's odometry benchmark: lines with the twelve numbers of [R | x].

    Source: Geiger, Lenz & Urtasun, Are we ready for Autonomous Driving? (CVPR 2012).

    Args:
        file: its name, or an open file of text.
        times: the file of their times, ``times.txt``, one a line; None for 0, 1, 2, …

    Returns:
        Times, shape (n,), and poses, points of ``se:3``, shape (n, 4, 4), with the nearest rotations to the rounded
        ones.

    Raises:
        ValidationError: a line has not twelve numbers, nine of them are no rotation, or the times are not as many.
        OSError: a file cannot be read.
    """
    rows = _numbers(file, 12, "KITTI poses are lines with the twelve numbers of [R | x]").reshape(-1, 3, 4)
    r = rows[:, :, :3]
    off = off_one(r)
    refuse(
        ~((off <= _ROUNDED) & (np.linalg.det(r) > 0)),
        f"{_name(file)}: pose ",
        lambda i: f"has no rotation: |RᵀR - 1| is {off[i]:.1e}",
    )
    t = np.arange(len(rows), dtype=float)
    if times is not None:
        t = _numbers(times, 1, "times of KITTI are one number a line", "times")[:, 0].copy()
    if len(t) != len(rows):
        raise ValidationError(f"{_name(times)} has {len(t)} times, but {_name(file)} {len(rows)} poses")
    return t, join(_SO3.project(r), rows[:, :, 3])


def write_kitti(file: Any, poses: Any) -> None:
    """Write poses as lines with the twelve numbers of [R | x]; KITTI has times in a file of their own.

    Args:
        file: its name, or an open file of text.
        poses: shape (n, 4, 4), or a pair of rotations (n, 3, 3) and positions (n, 3).
    """
    _write(file, _checked(poses)[:, :3].reshape(-1, 12).tolist(), " ")


# ---- EuRoC: nanoseconds, x, y, z, qw, qx, qy, qz ----


def read_euroc(file: Any) -> tuple[NDArray[np.datetime64], Array]:
    """Poses from a file in the format of the EuRoC data sets: ``nanoseconds,x,y,z,qw,qx,qy,qz``, and more columns that
    are not read.

    Source: Burri et al., The EuRoC micro aerial vehicle datasets (IJRR 2016).

    Args:
        file: its name, or an open file of text.

    Returns:
        Times as ``datetime64[ns]``, exact, with which rates are per second, shape (n,), and poses, points of ``se:3``,
        shape (n, 4, 4).

    Raises:
        ValidationError: a line has fewer numbers, a time is no whole number, or the four of a quaternion are none.
        OSError: the file cannot be read.
    """
    form = "EuRoC poses are lines of 'nanoseconds,x,y,z,qw,qx,qy,qz'"
    lines = _lines(file)
    # Doubles do not hold nanoseconds since 1970.
    ns = _parsed(lines, file, form, delimiter=",", usecols=0, dtype=np.int64, ndmin=1)
    rows = _parsed(lines, file, form, delimiter=",", usecols=range(1, 8), ndmin=2)
    _check_rows(rows, file, form)
    r = rotations_in_rows(rows[:, 3:], lambda i: f"{_name(file)}, line {lines[i].number}")
    return ns.astype("datetime64[ns]"), join(r, rows[:, :3])


def write_euroc(file: Any, t: ArrayLike, poses: Any) -> None:
    """Write poses as lines of ``nanoseconds,x,y,z,qw,qx,qy,qz``.

    Args:
        file: its name, or an open file of text.
        t: ``datetime64``, or seconds since 1970 as numbers, which are rounded to nanoseconds; shape (n,).
        poses: shape (n, 4, 4), or a pair of rotations (n, 3, 3) and positions (n, 3).
    """
    r, x = split(_checked(poses))
    times = _moments(t, len(x))
    if times.dtype.kind != "M":
        refuse(np.abs(times.astype(np.float64)) > _LAST, "t", lambda i: f"is {times[i]}, after the year 2262")
        times = np.rint(1e9 * times.astype(np.float64)).astype(np.int64)
    ns = times.astype("datetime64[ns]").astype(np.int64).tolist()
    values = np.concatenate([x, _quaternions(r, scalar_first=True)], axis=1).tolist()
    _write(file, ([time, *row] for time, row in zip(ns, values, strict=True)), ",", _EUROC)


# ---- poses of two parts ----


def join(rotations: Any, positions: ArrayLike) -> Array:
    """Poses [[R, x], [0, 1]] of rotations and positions.

    Args:
        rotations: points of ``so:3``, shape (..., 3, 3), or a SciPy ``Rotation``.
        positions: shape (..., 3).

    Returns:
        Points of ``se:3``, shape (..., 4, 4).
    """
    r, x = _SO3._array(rotations, "rotations"), as_array(positions, "positions")
    if r.shape[-2:] != (3, 3) or x.shape != (*r.shape[:-2], 3):
        raise ValidationError(
            f"rotations of shape (..., 3, 3) and positions of shape (..., 3) are needed, not {r.shape} and {x.shape}"
        )
    poses = np.zeros((*x.shape[:-1], 4, 4))
    poses[..., :3, :3], poses[..., :3, 3], poses[..., 3, 3] = r, x, 1.0
    return poses


def split(poses: ArrayLike) -> tuple[Array, Array]:
    """Rotations and positions of poses: points of ``so:3 x r:3``.

    Args:
        poses: points of ``se:3``, shape (..., 4, 4).

    Returns:
        Shapes (..., 3, 3) and (..., 3).
    """
    g = as_array(poses, "poses")
    if g.shape[-2:] != (4, 4):
        raise ValidationError(f"poses must have shape (..., 4, 4), not {g.shape}")
    return g[..., :3, :3].copy(), g[..., :3, 3].copy()


def _checked(poses: Any) -> Array:
    """Poses to write, shape (n, 4, 4)."""
    g = join(*poses) if isinstance(poses, tuple) and len(poses) == 2 else as_array(poses, "poses")
    _SE3.check_point(g)
    if g.ndim != 3:
        raise ValidationError(f"a file holds poses of shape (n, 4, 4), not {g.shape}")
    return g


def _quaternions(r: Array, scalar_first: bool) -> Array:
    return matrix_to_quaternion(r, scalar_first=scalar_first)


def _moments(t: ArrayLike, count: int) -> Array:
    """Times to write: numbers of seconds, or dates."""
    times = as_array(times_of(t, "t")[0], "t")
    if times.shape != (count,):
        raise ValidationError(f"t has shape {times.shape}, but there are {count} poses")
    if times.dtype.kind not in "Miuf":
        raise ValidationError(f"t must be numbers or datetime64, not {times.dtype}")
    refuse(~np.isfinite(times), "t", lambda i: f"is {times[i]}, which is no time")
    check_seconds(times, "t")
    return times


def _seconds(t: ArrayLike, count: int) -> Doubles:
    times = _moments(t, count)
    if times.dtype.kind == "M":
        return (times - np.datetime64(0, "s")) / np.timedelta64(1, "s")
    return times.astype(np.float64)


def check_seconds(times: Array, name: str) -> None:
    """Raise if numbers look like milliseconds since 1970, or smaller parts, where seconds are meant."""
    if times.dtype.kind in "iuf":
        refuse(
            np.abs(times.astype(np.float64)) > _FAR,
            name,
            lambda i: (
                f"is {times[i]}, which can be no seconds; of nanoseconds make dates, .astype('datetime64[ns]')"
            ),
        )


# ---- lines ----


def rotations_in_rows(q: Doubles, place: Callable[[int], str], atol: float = _ROUNDED) -> Array:
    """The rotations of quaternions, scalar first, as they stand rounded in a file, each at its place."""
    sizes = length(q)
    bad = np.flatnonzero(~(np.abs(sizes - 1) <= atol))
    if len(bad):
        raise ValidationError(
            f"{place(bad[0])}: the quaternion has length {sizes[bad[0]]:.6g}, not 1: are the columns in another order?"
        )
    return quaternion_to_matrix(q / sizes[:, None], scalar_first=True)


def _numbers(file: Any, columns: int, form: str, name: str = "file") -> Doubles:
    rows: Doubles = _parsed(_lines(file, name), file, form, ndmin=2)
    if rows.size and rows.shape[1] != columns:
        raise ValidationError(f"{_name(file)}: {form}, not of {rows.shape[1]} numbers")
    _check_rows(rows, file, form)
    return rows


def _check_rows(rows: Doubles, file: Any, form: str) -> None:
    if not rows.size:
        raise ValidationError(f"{_name(file)} has no numbers; {form}")
    bad = np.asarray(~np.isfinite(rows).all(axis=1))
    refuse(bad, f"{_name(file)}: row ", lambda i: f"is not finite: {rows[i]}")


class Line(NamedTuple):
    """A line of a file: its number, counted from 1, and what stands there."""

    number: int
    text: str


def _lines(file: Any, name: str = "file") -> list[Line]:
    """The lines that are no comments; ``name`` is the argument's."""
    path = path_of(file, name, method="read", text=True)
    if path is None:
        text = file.read()
        if not isinstance(text, str):
            raise TypeError(
                f"{name} must be open as text, without 'b' in its mode; pass its name, or open it so"
            )
        text = text.removeprefix("\ufeff")
    else:
        opener: Any = gzip.open if path.suffix == ".gz" else open
        try:
            with opener(path, "rt", encoding="utf-8-sig") as opened:
                text = opened.read()
        except (UnicodeDecodeError, EOFError, zlib.error) as error:
            what = (
                "not text in UTF-8"
                if isinstance(error, UnicodeDecodeError)
                else "damaged: it cannot be decompressed"
            )
            raise ValidationError(f"{_name(file)} is {what}") from None
    lines = (Line(number, line.strip()) for number, line in enumerate(text.splitlines(), 1))
    return [line for line in lines if line.text and not line.text.startswith("#")]


def _parsed(lines: list[Line], file: Any, form: str, **options: Any) -> Any:
    if not lines:
        return np.zeros((0, 0))
    try:
        return np.loadtxt([line.text for line in lines], **options)
    except ValueError:
        raise ValidationError(_bad_row(lines, _name(file), form, options)) from None


def _bad_row(lines: list[Line], name: str, form: str, options: dict[str, Any]) -> str:
    """What is wrong with the first line that is none of this form."""
    for line in lines:
        try:
            np.loadtxt([line.text], **options)
        except ValueError:
            return f"{name}, line {line.number}: {form}; this line is {short_repr(line.text)}"
    return f"{name}: {form}; its lines differ in how many numbers they have"


def _name(file: Any) -> str:
    name = getattr(file, "name", file if isinstance(file, (str, os.PathLike)) else "the file")
    return str(name)


def _write(file: Any, rows: Iterable[list[Any]], separator: str, head: str = "") -> None:
    # The shortest text that reads back as the same double.
    _write_lines(file, (f"{separator.join(map(repr, row))}\n" for row in rows), head)


def _write_lines(file: Any, lines: Iterable[str], head: str) -> None:
    text = f"{head}\n" * bool(head) + "".join(lines)
    path = path_of(file, method="write", text=True)
    if path is None:
        file.write(text)
        return
    with replacing(path) as temporary:
        temporary.write_text(text, encoding="utf-8")
