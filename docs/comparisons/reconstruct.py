"""Keeps every 10th, 20th and 40th sample of a recording, and reconstructs the others.

python docs/comparisons/reconstruct.py [FILE ...] [--every K] [--write]

Files are TUM trajectories or exports of Xsens sensors, see `recordings`; by default one of each, which are
in ``data``.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from angles import angle, body_rate
from methods import Motion, of_orientations, of_poses
from numpy.typing import NDArray
from page import HERE, insert, parser, table, versions
from recordings import Recording, read
from scipy.interpolate import make_interp_spline

import symspline as ss

Array = NDArray[np.float64]

EVERY = (10, 20, 40)
POSES = HERE / "data/freiburg1_xyz-groundtruth.txt.gz"
ORIENTATIONS = HERE / "data/data_xsens.txt.gz"


def text(recording: Recording, every: Sequence[int] = EVERY) -> str:
    """The table of a recording."""
    parts = ["angle rms, °", "max, °"]
    parts += ["position rms, mm", "max, mm"] if recording.positions is not None else []
    parts += ["angular velocity rms, °/s"] if recording.rates is not None else []
    rows: list[list[object]] = []
    if recording.rates is not None:
        rows.append([1, None, "symspline, not-a-knot", None, None, f"{np.rad2deg(_floor(recording)):.2f}"])
    for k in every:
        longest = None
        for method, found in errors(recording, k).items():
            if longest is None:
                longest = f"{np.rad2deg(_longest_step(recording, k)):.0f}"
            rows.append([k, longest, method, *(f"{number:.3g}" for number in found)])
    return table(("every", "longest step, °", "method", *parts), rows)


def errors(recording: Recording, k: int) -> dict[str, list[float]]:
    """By method: root mean square and maximum of the angle in degrees, of the position in mm, and root mean
    square of the angular velocity in degrees per second; what the recording has of these."""
    kept, hidden = split(recording, k)
    found = {}
    for method, motion in motions(recording, kept).items():
        wrong = np.rad2deg(angle(hidden.rotations, motion.rotations(hidden.t)))
        numbers = [_rms(wrong), wrong.max()]
        if motion.positions is not None:
            off = 1e3 * np.linalg.norm(motion.positions(hidden.t) - hidden.positions, axis=-1)
            numbers += [_rms(off), off.max()]
        if motion.rates is not None:
            inside = (recording.rate_times >= kept.t[0]) & (recording.rate_times <= kept.t[-1])
            off = motion.rates(recording.rate_times[inside]) - recording.rates[inside]
            numbers.append(np.rad2deg(_rms(np.linalg.norm(off, axis=-1))))
        found[method] = [float(number) for number in numbers]
    return found


def split(recording: Recording, k: int) -> tuple[Recording, Recording]:
    """Every k-th sample, and the others up to the last of them."""
    index = np.arange((len(recording.t) - 1) // k * k + 1)
    return recording.pick(index[index % k == 0]), recording.pick(index[index % k != 0])


def motions(recording: Recording, kept: Recording) -> dict[str, Motion]:
    """All methods that apply."""
    if recording.positions is not None:
        return of_poses(kept)
    if recording.rates is None:
        return of_orientations(kept)
    # Samples lie halfway between two measurements; after the last sample there is none.
    ends = make_interp_spline(recording.rate_times, recording.rates, k=1)(kept.t[[0, -1]])
    return of_orientations(kept, ends)


def _floor(recording: Recording) -> float:
    """How far the measured rates are from those of a curve through all samples."""
    spline = ss.CubicSpline(recording.t, recording.rotations, ss.SpecialOrthogonal(3), bc_type="not-a-knot")
    x = recording.rate_times[1:]
    return _rms(np.linalg.norm(body_rate(spline(x), spline(x, nu=1)) - recording.rates[1:], axis=-1))


def _longest_step(recording: Recording, k: int) -> float:
    rotations = split(recording, k)[0].rotations
    return float(angle(rotations[:-1], rotations[1:]).max())


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))


def main() -> None:
    arguments = parser(__doc__)
    arguments.add_argument("files", nargs="*", type=Path, metavar="FILE")
    arguments.add_argument(
        "--every", action="append", type=int, metavar="K", help="instead of 10, 20, 40; may be repeated"
    )
    given = arguments.parse_args()
    if given.write and (given.files or given.every):
        arguments.error("--write is for the recordings in data and every 10th, 20th and 40th sample")
    found = []
    for file in given.files or (POSES, ORIENTATIONS):
        found += [f"**{file.name.removesuffix('.gz')}**", text(read(file), given.every or EVERY)]
    found.append(versions("symspline", "scipy"))
    whole = "\n\n".join(found)
    print(whole)
    if given.write:
        insert("reconstruct", whole)


if __name__ == "__main__":
    main()
