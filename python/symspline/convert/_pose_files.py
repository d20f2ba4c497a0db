"""Files of poses: TUM, KITTI, EuRoC."""

from __future__ import annotations

import gzip
import os
import zlib
from collections.abc import Callable, Iterable, Sequence
from decimal import Decimal
from typing import Any, Literal, NamedTuple, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .._base.arrays import as_array, brief, cast, checked_flag, length, off_one, refuse
from .._base.input import times_of
from .._base.system import path_of, replacing
from .._base.time import warn_of_rounded_times
from .._base.typing import Array, PointsLike, TextFile
from .._core import ValidationError, number_lines
from .._spaces import Doubles, SpecialEuclidean, SpecialOrthogonal, point_tol, rotations_and_positions
from ._quaternions import matrix_to_quaternion, quaternion_to_matrix

# Columns of a TUM trajectory.
TUM = ("time", "tx", "ty", "tz", "qx", "qy", "qz", "qw")
_SO3, _SE3 = SpecialOrthogonal(3), SpecialEuclidean(3)
# The year 5138 in seconds since 1970, and 1973 in milliseconds.
_FAR = 1e11
# The last second whose nanoseconds are a number of 64 bits.
_LAST = 9.2e9
_KITTI = ("r11", "r12", "r13", "x", "r21", "r22", "r23", "y", "r31", "r32", "r33", "z")
_EUROC = "#timestamp [ns],p_x [m],p_y [m],p_z [m],q_w [],q_x [],q_y [],q_z []"


# ---- TUM: time x y z qx qy qz qw ----


@overload
def read_tum(file: TextFile, *, skipna: bool = False, dates: Literal[False] = False) -> tuple[Doubles, Array]: ...


@overload
def read_tum(file: TextFile, *, skipna: bool = False, dates: Literal[True]) -> tuple[NDArray[np.datetime64], Array]: ...


def read_tum(file: TextFile, *, skipna: bool = False, dates: bool = False) -> tuple[Array, Array]:
    """Read poses in the format of TUM's RGB-D benchmark, lines of ``time x y z qx qy qz qw``.

    Parameters
    ----------
    file : path or text file
        File to read. Comments begin with #. Files whose names end with .gz are decompressed.
    skipna : bool, default False
        True to omit lines with NaN, which otherwise raise `ValidationError`.
    dates : bool, default False
        True to read times as seconds since 1970 with all their nanoseconds. In double precision they are rounded to a
        quarter of a microsecond, which is too coarse for accelerations at 400 Hz and more.

    Returns
    -------
    t : ndarray of float, or of datetime64[ns] if `dates` is True, shape (n,)
        Times in seconds, as in the file; repeated times are kept (see `symspline.fit_segments`).
    poses : ndarray, shape (n, 4, 4)
        Points of ``se:3``. Rounded quaternions are normalised.

    Raises
    ------
    ValidationError
        If a line does not have eight numbers, or its quaternion is not a unit quaternion. The message has the number of
        the line.
    OSError
        If the file cannot be read.

    Warns
    -----
    UserWarning
        If double precision rounds the times by more than 1e-4 of the time step. Pass ``dates=True``.

    See Also
    --------
    write_tum : Write poses.

    References
    ----------
    J. Sturm, N. Engelhard, F. Endres, W. Burgard, D. Cremers, A Benchmark for the Evaluation of RGB-D SLAM Systems,
    IROS 2012.

    Examples
    --------
    >>> import io, symspline as ss
    >>> t, poses = ss.poses.read_tum(io.StringIO("0 1 2 3 0 0 0 1"))
    >>> poses[0, :3, 3].tolist()
    [1.0, 2.0, 3.0]
    """
    rows, lines = tum_rows(file, checked_flag(skipna, "skipna"))
    rows, lines = _present(rows, lines)
    check_seconds(rows[:, 0], f"{lines.file}: time")
    r = rotations_in_rows(rows[:, [7, 4, 5, 6]], lines.file, lines.place)
    if checked_flag(dates, "dates"):
        t: Array = _exact_dates(lines)
    else:
        t = rows[:, 0].copy()
        warn_of_rounded_times(
            t, f"times of {lines.file}", f"Pass dates=True to read the times of {lines.file} exactly."
        )
    return t, join(r, rows[:, 1:4])


def _present(rows: Doubles, lines: Lines) -> tuple[Doubles, Lines]:
    """Return the rows without NaN, and their lines."""
    kept = np.flatnonzero(~np.isnan(rows).any(axis=1)).tolist()
    if len(kept) == len(rows):
        return rows, lines
    if not kept:
        raise ValidationError(f"{lines.file} has no line without NaN")
    rest = Lines(lines.file, [lines.numbers[i] for i in kept], [lines.texts[i] for i in kept])
    return rows[kept], rest


def _exact_dates(lines: Lines) -> NDArray[np.datetime64]:
    """Return the first column, seconds since 1970, as dates with all nanoseconds."""
    counts = []
    for row, text in enumerate(lines.texts):
        cell = text.split()[0]
        ns = Decimal(cell) * 10**9
        if abs(ns) >= 2**63:
            raise lines.error(row, f"column 'time' holds {cell}, which is not seconds within 292 years of 1970")
        counts.append(int(ns.to_integral_value()))
    return np.array(counts, np.int64).astype("datetime64[ns]")


def tum_rows(file: TextFile, missing: bool = False) -> tuple[Doubles, Lines]:
    """Return the numbers of a TUM trajectory, shape (n, 8), and the lines that hold them.

    Numbers may be NaN if ``missing`` is True.

    Raises
    ------
    ValidationError
        If a line does not have eight finite numbers.
    OSError
        If the file cannot be read.
    """
    lines = lines_of(file)
    return parsed(lines, TUM, f"a line of a TUM trajectory has {len(TUM)}: {' '.join(TUM)}", missing=missing), lines


def write_tum(file: TextFile, t: ArrayLike, poses: PointsLike) -> None:
    r"""Write poses as lines of ``time x y z qx qy qz qw``, from which `read_tum` restores every number.

    Parameters
    ----------
    file : path or text file
        File to write.
    t : array_like, shape (n,)
        Times in seconds. Dates become seconds since 1970.
    poses : array_like, shape (n, 4, 4), or pair of rotations (n, 3, 3) and positions (n, 3)
        Poses to write. Rows of NaN, such as those in the gaps of a `SegmentedCurve`, are omitted.

    Raises
    ------
    ValidationError
        If the arrays do not meet the requirements above.

    See Also
    --------
    read_tum : Read poses.

    Examples
    --------
    >>> import io, numpy as np, symspline as ss
    >>> file = io.StringIO()
    >>> ss.poses.write_tum(file, [0.5], np.eye(4)[None])
    >>> file.getvalue()
    '0.5 0.0 0.0 0.0 0.0 0.0 0.0 1.0\n'
    """
    times, g = _timed(t, poses)
    r, x = split(g)
    if times.dtype.kind == "M":
        times = (times - np.datetime64(0, "s")) / np.timedelta64(1, "s")
    rows = np.concatenate([x, matrix_to_quaternion(r, scalar_first=False)], axis=1)
    write_tum_rows(file, times.astype(np.float64), rows)


def write_tum_rows(file: TextFile, t: Array, poses: Doubles, head: str = "") -> None:
    """Write times and the seven numbers of each pose; dates with all nanoseconds, as seconds since 1970.

    Raises
    ------
    ValidationError
        If dates are finer than nanoseconds, or too far from 1970 to be counted in them.
    """
    if t.dtype.kind == "M":
        write(file, poses, " ", head, _exact_seconds(t))
    else:
        write(file, np.column_stack([t, poses]), " ", head)


def _exact_seconds(dates: Array) -> list[str]:
    ns = dates.astype("datetime64[ns]")
    refuse(ns != dates, "t", lambda i: f"is {dates[i]}, which is not a whole number of nanoseconds near 1970")
    whole, rest = np.divmod(ns.astype(np.int64), 10**9)
    return [f"{second}.{part:09}" for second, part in zip(whole.tolist(), rest.tolist(), strict=True)]


# ---- KITTI: r11 r12 r13 x r21 ... ----


def read_kitti(file: TextFile, times: TextFile | None = None, *, skipna: bool = False) -> tuple[Doubles, Array]:
    """Read poses in the format of KITTI's odometry benchmark, lines with the twelve numbers of [R | x].

    Parameters
    ----------
    file : path or text file
        File to read.
    times : path or text file, optional
        File of the times, ``times.txt``, with one time per line. By default the times are 0, 1, 2, ...
    skipna : bool, default False
        True to omit lines with NaN, which otherwise raise `ValidationError`.

    Returns
    -------
    t : ndarray, shape (n,)
        Times.
    poses : ndarray, shape (n, 4, 4)
        Points of ``se:3``, with the rotations nearest to the rounded ones.

    Raises
    ------
    ValidationError
        If a line does not have twelve numbers, nine of them are not a rotation, or the number of times differs.
    OSError
        If a file cannot be read.

    See Also
    --------
    write_kitti : Write poses.

    References
    ----------
    A. Geiger, P. Lenz, R. Urtasun, Are we ready for Autonomous Driving? The KITTI Vision Benchmark Suite, CVPR 2012.

    Examples
    --------
    >>> import io, symspline as ss
    >>> t, poses = ss.poses.read_kitti(io.StringIO("1 0 0 5 0 1 0 6 0 0 1 7"))
    >>> poses[0, :3, 3].tolist()
    [5.0, 6.0, 7.0]
    """
    lines = lines_of(file)
    skip = checked_flag(skipna, "skipna")
    rows = parsed(lines, _KITTI, "KITTI poses are lines with the twelve numbers of [R | x]", missing=skip)
    kept = ~np.isnan(rows).any(axis=1)
    t = np.arange(len(rows), dtype=float)
    if times is not None:
        t = parsed(lines_of(times, "times"), ("time",), "times of KITTI are one number per line")[:, 0]
        warn_of_rounded_times(t, f"times of {_name(times)}", "Subtract the first time before writing the file.")
    if len(t) != len(rows):
        raise ValidationError(f"{_name(times)} has {len(t)} times, but {lines.file} {len(rows)} poses")
    t, rows = t[kept], rows[kept].reshape(-1, 3, 4)
    r = rows[:, :, :3]
    off = off_one(r)
    # |RᵀR − 1| is twice the distance from the rotations.
    bad = ~((off <= 2 * point_tol(r, 9)) & (np.linalg.det(r) > 0))
    refuse(bad, f"{lines.file}: pose ", lambda i: f"has no rotation: |RᵀR - 1| is {off[i]:.1e}")
    return t, join(_SO3.project(r), rows[:, :, 3])


def write_kitti(file: TextFile, poses: PointsLike) -> None:
    r"""Write poses as lines with the twelve numbers of [R | x].

    KITTI stores times in a separate file.

    Parameters
    ----------
    file : path or text file
        File to write.
    poses : array_like, shape (n, 4, 4), or pair of rotations (n, 3, 3) and positions (n, 3)
        Poses to write.

    See Also
    --------
    read_kitti : Read poses.

    Examples
    --------
    >>> import io, numpy as np, symspline as ss
    >>> file = io.StringIO()
    >>> ss.poses.write_kitti(file, np.eye(4)[None])
    >>> file.getvalue()
    '1.0 0.0 0.0 0.0 0.0 1.0 0.0 0.0 0.0 0.0 1.0 0.0\n'
    """
    write(file, checked_poses(poses)[:, :3].reshape(-1, 12), " ")


# ---- EuRoC: nanoseconds, x, y, z, qw, qx, qy, qz ----


def read_euroc(file: TextFile, *, skipna: bool = False) -> tuple[NDArray[np.datetime64], Array]:
    """Read poses in the format of the EuRoC data sets, lines of ``nanoseconds,x,y,z,qw,qx,qy,qz``.

    Further columns are ignored.

    Parameters
    ----------
    file : path or text file
        File to read.
    skipna : bool, default False
        True to omit lines with NaN, which otherwise raise `ValidationError`.

    Returns
    -------
    t : ndarray of datetime64[ns], shape (n,)
        Exact times. Rates of a curve with these knots are per second.
    poses : ndarray, shape (n, 4, 4)
        Points of ``se:3``.

    Raises
    ------
    ValidationError
        If a line has fewer numbers, a time is not an integer, or a quaternion is not a unit quaternion.
    OSError
        If the file cannot be read.

    See Also
    --------
    write_euroc : Write poses.

    References
    ----------
    M. Burri et al., The EuRoC micro aerial vehicle datasets, Int. J. Robotics Research 35 (2016).

    Examples
    --------
    >>> import io, symspline as ss
    >>> t, poses = ss.poses.read_euroc(io.StringIO("1000000000,1,2,3,1,0,0,0"))
    >>> t.astype(str).tolist(), poses[0, :3, 3].tolist()
    (['1970-01-01T00:00:01.000000000'], [1.0, 2.0, 3.0])
    """
    form = "EuRoC poses are lines of 'nanoseconds,x,y,z,qw,qx,qy,qz'"
    lines = lines_of(file)
    # Double precision cannot represent nanoseconds since 1970.
    ns = parsed(lines, ("nanoseconds",), form, 0, dtype=np.int64)[:, 0]
    skip = checked_flag(skipna, "skipna")
    rows = parsed(lines, ("x", "y", "z", "qw", "qx", "qy", "qz"), form, 1, missing=skip)
    ns = ns[~np.isnan(rows).any(axis=1)]
    rows, lines = _present(rows, lines)
    return ns.astype("datetime64[ns]"), join(rotations_in_rows(rows[:, 3:], lines.file, lines.place), rows[:, :3])


def write_euroc(file: TextFile, t: ArrayLike, poses: PointsLike) -> None:
    """Write poses as lines of ``nanoseconds,x,y,z,qw,qx,qy,qz``.

    Parameters
    ----------
    file : path or text file
        File to write.
    t : array_like of datetime64 or float, shape (n,)
        Times. Numbers are seconds since 1970 and are rounded to nanoseconds.
    poses : array_like, shape (n, 4, 4), or pair of rotations (n, 3, 3) and positions (n, 3)
        Poses to write. Rows of NaN, such as those in the gaps of a `SegmentedCurve`, are omitted.

    See Also
    --------
    read_euroc : Read poses.

    Examples
    --------
    >>> import io, numpy as np, symspline as ss
    >>> file = io.StringIO()
    >>> ss.poses.write_euroc(file, [0.5], np.eye(4)[None])
    >>> file.getvalue().splitlines()[1]
    '500000000,0.0,0.0,0.0,1.0,0.0,0.0,0.0'
    """
    times, g = _timed(t, poses)
    r, x = split(g)
    if times.dtype.kind != "M":
        refuse(np.abs(times.astype(np.float64)) > _LAST, "t", lambda i: f"is {times[i]}, after the year 2262")
        times = np.rint(1e9 * times.astype(np.float64)).astype(np.int64)
    ns = times.astype("datetime64[ns]").astype(np.int64).tolist()
    values = np.concatenate([x, matrix_to_quaternion(r, scalar_first=True)], axis=1)
    write(file, values, ",", _EUROC, map(str, ns))


# ---- poses of two parts ----


def join(rotations: Any, positions: ArrayLike) -> Array:
    """Combine rotations and positions into poses [[R, x], [0, 1]].

    Parameters
    ----------
    rotations : array_like, shape (..., 3, 3), or scipy.spatial.transform.Rotation
        Points of ``so:3``.
    positions : array_like, shape (..., 3)
        Positions.

    Returns
    -------
    ndarray, shape (..., 4, 4)
        Points of ``se:3``.

    See Also
    --------
    split : The inverse.

    Examples
    --------
    >>> import numpy as np, symspline as ss
    >>> ss.poses.join(np.eye(3), [1.0, 2.0, 3.0])[:3, 3].tolist()
    [1.0, 2.0, 3.0]
    """
    r, x = _SO3._array(rotations, "rotations"), as_array(positions, "positions")
    if r.shape[-2:] != (3, 3) or x.shape != (*r.shape[:-2], 3):
        raise ValidationError(
            f"rotations of shape (..., 3, 3) and positions of shape (..., 3) are needed, not {r.shape} and {x.shape}"
            + _SO3._conversion(r.shape, "points") * (r.shape[-2:] != (3, 3))
        )
    poses = np.zeros((*x.shape[:-1], 4, 4))
    poses[..., :3, :3], poses[..., :3, 3], poses[..., 3, 3] = r, x, 1.0
    return poses


def split(poses: PointsLike) -> tuple[Array, Array]:
    """Split poses into rotations and positions, points of ``so:3 x r:3``.

    Parameters
    ----------
    poses : array_like, shape (..., 4, 4), or scipy.spatial.transform.RigidTransform
        Points of ``se:3``.

    Returns
    -------
    rotations : ndarray, shape (..., 3, 3)
        Rotations.
    positions : ndarray, shape (..., 3)
        Positions.

    Raises
    ------
    ValidationError
        If the last row of a pose is not (0, 0, 0, 1), as in transposed poses.

    See Also
    --------
    join : The inverse.

    Examples
    --------
    >>> import numpy as np, symspline as ss
    >>> rotation, position = ss.poses.split(np.eye(4))
    >>> position.tolist()
    [0.0, 0.0, 0.0]
    """
    return rotations_and_positions(poses, "poses")


def _timed(t: ArrayLike, poses: PointsLike) -> tuple[Array, Array]:
    """Return the times and the poses to write, without rows of NaN."""
    array = _joined(poses)
    missing: NDArray[np.bool_] = np.zeros(array.shape[:1], bool)
    if array.ndim == 3 and array.dtype.kind == "f":
        # The last row of a pose is constant.
        missing = np.asarray(np.isnan(array[:, :3]).all(axis=(1, 2)))
    times = moments(t, len(missing))
    return times[~missing], checked_poses(array[~missing])


def _joined(poses: PointsLike) -> Array:
    """Return poses as matrices, also those that are given as rotations and positions."""
    return join(*poses) if isinstance(poses, tuple) and len(poses) == 2 else _SE3._array(poses, "poses")


def checked_poses(poses: PointsLike) -> Array:
    """Poses to write, shape (n, 4, 4)."""
    g = _joined(poses)
    _SE3.check_point(g)
    if g.ndim != 3:
        raise ValidationError(f"a file holds poses of shape (n, 4, 4), not {g.shape}")
    return g


def moments(t: ArrayLike, count: int) -> Array:
    """Times to write: numbers of seconds, or dates."""
    times = as_array(times_of(t, "t")[0], "t")
    if times.shape != (count,):
        raise ValidationError(f"t has shape {times.shape}, but there are {count} poses")
    if times.dtype.kind not in "Miuf":
        raise ValidationError(f"t must be numbers or datetime64, not {times.dtype}")
    refuse(~np.isfinite(times), "t", lambda i: f"is {times[i]}, which is not a time")
    check_seconds(times, "t")
    return times


def check_seconds(times: Array, name: str) -> None:
    """Raise if numbers look like milliseconds since 1970, or smaller units, where seconds are expected."""
    if times.dtype.kind in "iuf":
        bad = np.abs(times.astype(np.float64)) > _FAR
        advice = "convert nanoseconds to dates, .astype('datetime64[ns]')"
        refuse(bad, name, lambda i: f"is {times[i]}, which cannot be seconds; {advice}")


# ---- lines ----


class Lines(NamedTuple):
    """Lines of a file that are not comments.

    Attributes
    ----------
    file : str
        Name of the file.
    numbers : list of int
        Numbers of the lines, counted from 1.
    texts : list of str
        Lines without white space at their ends.
    """

    file: str
    numbers: list[int]
    texts: list[str]

    def place(self, row: int) -> str:
        """Name the line of a row: "line 7"."""
        return f"line {self.numbers[row]}"

    def error(self, row: int, problem: str) -> ValidationError:
        """Return the error of a row."""
        return ValidationError(f"{self.file}, {self.place(row)}: {problem}")


def rotations_in_rows(
    q: Doubles, file: object, place: Callable[[int], str], atol: float | None = None, advice: str = ""
) -> Array:
    """Return the rotations of rounded quaternions, scalar first; `place` names the line of a row in messages."""
    sizes = length(q)
    bad = np.flatnonzero(~(np.abs(sizes - 1) <= (point_tol(q, 4) if atol is None else atol)))
    if len(bad):
        raise ValidationError(
            f"{file}, {place(bad[0])}: the quaternion has length {sizes[bad[0]]:.6g}, not 1: are the columns in "
            f"another order?{advice}"
        )
    return quaternion_to_matrix(q / sizes[:, None], scalar_first=True)


def lines_of(file: Any, name: str = "file") -> Lines:
    """Return the lines that are not comments; `name` is the name of the argument."""
    path = path_of(file, name, method="read", text=True)
    if path is None:
        text = file.read()
        if not isinstance(text, str):
            raise TypeError(f"{name} must be open as text, without 'b' in its mode; pass its name, or open it so")
        text = text.removeprefix("\ufeff")
    else:
        opener = gzip.open if path.suffix == ".gz" else open
        try:
            with opener(path, "rt", encoding="utf-8-sig") as opened:
                text = opened.read()
        except UnicodeDecodeError:
            raise ValidationError(f"{_name(file)} is not text in UTF-8") from None
        except (EOFError, zlib.error):
            raise ValidationError(f"{_name(file)} is damaged: it cannot be decompressed") from None
    numbered = ((number, line.strip()) for number, line in enumerate(text.splitlines(), 1))
    kept = [(number, line) for number, line in numbered if line and not line.startswith("#")]
    return Lines(_name(file), [number for number, _ in kept], [line for _, line in kept])


def parsed(
    lines: Lines,
    columns: Sequence[str],
    form: str,
    start: int | None = None,
    dtype: Any = np.float64,
    missing: bool = False,
) -> Any:
    """Return the numbers in lines, with one column per name.

    Parameters
    ----------
    lines : Lines
        Lines of a file.
    columns : sequence of str
        Names of the columns.
    form : str
        Describes a line in messages.
    start : int, optional
        Number of the first of these columns, which are separated by commas and may have others beside them. None if
        they are separated by spaces and are the only ones.
    dtype : dtype
        Type of the numbers.
    missing : bool
        Whether numbers may be NaN.
    """
    if not lines.texts:
        raise ValidationError(f"{lines.file} is empty, it has no numbers; {form}")
    separator, span = (None, slice(None)) if start is None else (",", slice(start, start + len(columns)))
    used = None if start is None else range(span.start, span.stop)
    try:
        rows = np.loadtxt(lines.texts, dtype, delimiter=separator, usecols=used, ndmin=2)
    except ValueError as error:
        # The first line that is wrong.
        for i, text in enumerate(lines.texts):
            cells = text.partition("#")[0].split(separator)
            if len(cells[span]) != len(columns):
                raise lines.error(i, f"{len(cells)} numbers, but {form}") from None
            for column, cell in zip(columns, cells[span], strict=True):
                try:
                    dtype(cell)
                except ValueError:
                    kind = "number" if dtype is np.float64 else "whole number"
                    raise lines.error(i, f"column {column!r} holds {cell!r}, which is not a {kind}") from None
        raise ValidationError(f"{lines.file}: {form}; {brief(error)}") from None
    if rows.shape[1] != len(columns):
        raise lines.error(0, f"{rows.shape[1]} numbers, but {form}")
    bad = np.argwhere(np.isinf(rows) if missing else ~np.isfinite(rows))
    if len(bad):
        i, j = bad[0]
        remedy = ". Pass skipna=True to omit lines with NaN" if np.isnan(rows[i, j]) else ""
        raise lines.error(i, f"column {columns[j]!r} holds {rows[i, j]}, which is not a finite number{remedy}")
    return rows


def _name(file: object) -> str:
    name = getattr(file, "name", file if isinstance(file, (str, os.PathLike)) else "the file")
    return str(name)


def write(file: Any, rows: Array, separator: str, head: str = "", first: Iterable[str] | None = None) -> None:
    """Write rows of numbers as lines, which may begin with a first column of texts."""
    # The shortest text from which the same number is read.
    text = number_lines(cast(rows), separator)
    if first is not None:
        lines = zip(first, text.splitlines(), strict=True)
        text = "".join(f"{start}{separator}{line}\n" for start, line in lines)
    text = f"{head}\n" * bool(head) + text
    path = path_of(file, method="write", text=True)
    if path is None:
        file.write(text)
        return
    with replacing(path) as temporary:
        temporary.write_text(text, encoding="utf-8")
