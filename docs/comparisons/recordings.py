"""Recordings of poses and orientations, read from files; they may be compressed with gzip.

- TUM trajectories: lines of ``time x y z qx qy qz qw``, comments begin with ``#``.
- Xsens sensors: exported text with a header, columns ``Gyr_X`` … in rad/s and ``Quat_w`` ….
"""

from __future__ import annotations

import gzip
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

Array = NDArray[np.float64]


class Recording(NamedTuple):
    """Samples of a motion."""

    t: Array
    """Times in seconds from the first sample, shape (n,)."""
    rotations: Array
    """Rotation matrices from body to world, shape (n, 3, 3)."""
    positions: Array | None
    """Positions in metres, shape (n, 3)."""
    rates: Array | None
    """Angular velocity in the frame of the body, rad/s, shape (n, 3); see `rate_times`."""

    @property
    def rate_times(self) -> Array:
        """When the rates were measured: each is the mean over the interval before its sample, and so
        belongs to the middle of it."""
        return self.t - np.diff(self.t, prepend=2 * self.t[0] - self.t[1]) / 2

    def pick(self, index: NDArray[np.int_]) -> Recording:
        """Some of the samples."""
        return Recording(*(None if part is None else part[index] for part in self))


def read(file: Path) -> Recording:
    """A recording in one of the formats above."""
    whole = gzip.decompress(file.read_bytes()) if file.suffix == ".gz" else file.read_bytes()
    lines = whole.decode("utf-8").splitlines()
    return _xsens(lines) if any("Quat_w" in line for line in lines[:20]) else _tum(lines)


def _tum(lines: list[str]) -> Recording:
    numbers = np.loadtxt(lines, ndmin=2)
    if numbers.shape[1] != 8:
        raise ValueError(f"a line of a TUM trajectory has 8 numbers, not {numbers.shape[1]}")
    rotations = Rotation.from_quat(numbers[:, 4:]).as_matrix()
    return Recording(numbers[:, 0] - numbers[0, 0], rotations, numbers[:, 1:4], None)


def _xsens(lines: list[str]) -> Recording:
    head = next(i for i, line in enumerate(lines) if "Quat_w" in line)
    frequency = next(line for line in lines[:head] if "Sample rate" in line).split(":")[1]
    names = lines[head].split()
    column = dict(zip(names, np.loadtxt(lines[head + 1 :]).T, strict=True))
    t = (column["Counter"] - column["Counter"][0]) / float(frequency.strip().removesuffix("Hz"))
    quaternions = np.stack([column[f"Quat_{axis}"] for axis in "xyzw"], axis=-1)
    rates = np.stack([column[f"Gyr_{axis}"] for axis in "XYZ"], axis=-1)
    return Recording(t, Rotation.from_quat(quaternions).as_matrix(), None, rates)
