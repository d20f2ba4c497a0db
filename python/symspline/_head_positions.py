"""Files of head positions in magnetoencephalography, in the format of MaxFilter and MNE-Python."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ._arrays import as_array, cast, refuse
from ._core import ValidationError
from ._pose_files import Lines, check_seconds, checked_poses, lines_of, moments, parsed, rotations_in_rows, split, write
from ._spaces import Array, Doubles
from .convert import matrix_to_quaternion

_COLUMNS = ("Time", "q1", "q2", "q3", "q4", "q5", "q6", "g-value", "error", "velocity")
# Files have five decimals, so that |q|² of a rotation by almost 180° can exceed 1.
_ROUNDED = 1e-4


def read_head_pos(file: Any) -> tuple[Doubles, tuple[Array, Array]]:
    r"""Read head positions in the format of MaxFilter and MNE-Python, ``.pos``.

    A line has the time, the vector part (q1, q2, q3) of a unit quaternion, the translation (q4, q5, q6) in metres, the
    goodness of fit, the error and the velocity. A pose maps device coordinates to head coordinates.

    Parameters
    ----------
    file : path, text file or ndarray, shape (n, 10)
        File to read, or the array that ``mne.chpi.read_head_pos`` and ``mne.chpi.compute_head_pos`` return. A first
        line with the names of the columns is skipped.

    Returns
    -------
    t : ndarray, shape (n,)
        Times in seconds.
    poses : tuple of ndarray
        Rotations, shape (n, 3, 3), and translations, shape (n, 3): points of ``so:3 x r:3``.

    Raises
    ------
    ValidationError
        If a line does not have ten finite numbers, or the length of the vector part exceeds 1.
    OSError
        If the file cannot be read.

    See Also
    --------
    write_head_pos : Write head positions.
    read_tum : Read poses of a robot.

    Notes
    -----
    The scalar part of the quaternion is :math:`\sqrt{1 - q_1^2 - q_2^2 - q_3^2}`, as in ``quat_to_rot`` of MNE-Python.
    For angles close to 180° it is sensitive to the rounding of the file.

    References
    ----------
    A. Gramfort et al., MEG and EEG data analysis with MNE-Python, Frontiers in Neuroscience 7 (2013).

    Examples
    --------
    >>> import io, symspline as ss
    >>> text = " Time q1 q2 q3 q4 q5 q6 g-value error velocity\n 9.5 0.0 0.0 0.6 0.001 0.002 0.04 0.99 0.1 0.0\n"
    >>> t, (rotations, positions) = ss.poses.read_head_pos(io.StringIO(text))
    >>> t, rotations[0].round(8) + 0.0, positions[0]
    (array([9.5]), array([[ 0.28, -0.96,  0.  ],
           [ 0.96,  0.28,  0.  ],
           [ 0.  ,  0.  ,  1.  ]]), array([0.001, 0.002, 0.04 ]))
    """
    if isinstance(file, np.ndarray):
        rows, name = file, "file"
        if rows.ndim != 2 or rows.shape[1] != len(_COLUMNS) or rows.dtype.kind not in "iuf":
            raise ValidationError(f"file must be an array of numbers of shape (n, 10), not {rows.dtype} {rows.shape}")
        rows = cast(rows)
        refuse(~np.isfinite(rows).all(axis=1), "file", lambda i: "has a value that is not finite")
        place: Callable[[int], str] = "row {}".format
    else:
        lines = lines_of(file)
        if lines.texts and lines.texts[0].split()[0].lower() == _COLUMNS[0].lower():
            lines = Lines(lines.file, lines.numbers[1:], lines.texts[1:])
        rows = parsed(lines, _COLUMNS, f"a line of head positions has {len(_COLUMNS)}: {' '.join(_COLUMNS)}")
        name, place = lines.file, lines.place
    check_seconds(rows[:, 0], f"{name}: time")
    vector = rows[:, 1:4]
    square = (vector * vector).sum(axis=1)
    bad = np.flatnonzero(square > 1 + _ROUNDED)
    if len(bad):
        raise ValidationError(
            f"{name}, {place(bad[0])}: q1, q2 and q3 have length {np.sqrt(square[bad[0]]):.6g}, but the vector part of "
            "a unit quaternion is at most 1 long. Check the order of the columns."
        )
    scalar = np.sqrt(np.maximum(1 - square, 0))
    rotations = rotations_in_rows(np.column_stack([scalar, vector]), name, place, _ROUNDED)
    return rows[:, 0].copy(), (rotations, rows[:, 4:7].copy())


def write_head_pos(file: Any, t: ArrayLike, poses: Any, *, gof: ArrayLike = 1.0, error: ArrayLike = 0.0) -> None:
    """Write head positions, from which `read_head_pos` and MNE-Python read the same poses.

    Parameters
    ----------
    file : path or text file
        File to write.
    t : array_like, shape (n,)
        Times in seconds, in increasing order.
    poses : pair of rotations (n, 3, 3) and translations (n, 3), or array_like, shape (n, 4, 4)
        Poses, which map device coordinates to head coordinates, in metres.
    gof : array_like, default 1.0
        Goodness of fit, for all poses or of each.
    error : array_like, default 0.0
        Error in centimetres, for all poses or of each.

    Raises
    ------
    ValidationError
        If the arrays do not meet the requirements above.

    See Also
    --------
    read_head_pos : Read head positions.

    Notes
    -----
    The column of velocities has the distance from the previous position per time in cm/s, as MNE-Python writes it.

    Examples
    --------
    >>> import io, numpy as np, symspline as ss
    >>> file = io.StringIO()
    >>> ss.poses.write_head_pos(file, [0.5], (np.eye(3)[None], [[0.0, 0.01, 0.04]]), gof=0.99)
    >>> print(file.getvalue().strip())
    Time q1 q2 q3 q4 q5 q6 g-value error velocity
    0.5 0.0 0.0 0.0 0.0 0.01 0.04 0.99 0.0 0.0
    """
    rotations, positions = split(checked_poses(poses))
    times = moments(t, len(positions))
    if times.dtype.kind == "M":
        times = (times - np.datetime64(0, "s")) / np.timedelta64(1, "s")
    times = times.astype(np.float64)
    steps = np.diff(times)
    refuse(np.append(False, steps <= 0), "t", lambda i: f"is {times[i]}, which is not after the time before it")
    more = []
    for name, given in (("gof", gof), ("error", error)):
        values = as_array(given, name)
        if values.dtype.kind not in "iuf" or values.shape not in ((), times.shape):
            raise ValidationError(f"{name} must be a number or an array of shape {times.shape}, not {values.shape}")
        if not np.isfinite(values).all():
            raise ValidationError(f"{name} must be finite")
        more.append(np.broadcast_to(values, times.shape))
    speed = np.append(0.0, 100 * np.linalg.norm(np.diff(positions, axis=0), axis=1) / steps)[: len(times)]
    # Only the vector part is stored, because the scalar part is not negative.
    vector = matrix_to_quaternion(rotations, scalar_first=True)[:, 1:] + 0.0
    write(file, np.column_stack([times, vector, positions, *more, speed]), " ", " ".join(_COLUMNS))
