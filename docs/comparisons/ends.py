"""Which end conditions serve real recordings best: the error in the first and the last interval alone.

python docs/comparisons/ends.py [FILE ...] [--write]

The recording is cut into curves of six kept samples each, so that there are many ends.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from angles import angle
from page import insert, parser, table, versions
from reconstruct import ORIENTATIONS, POSES, motions, split
from recordings import Recording, read

EVERY = (2, 5, 10, 20)
INTERVALS = 5


def text(recording: Recording, every: Sequence[int] = EVERY) -> str:
    """The table of a recording."""
    found = {k: errors(recording, k) for k in every}
    methods = next(iter(found.values()))[1]
    rows = [
        [k, curves, *(f"{error:.3g}" for error in by_method.values())]
        for k, (curves, by_method) in found.items()
    ]
    return table(("every", "curves", *methods), rows)


def errors(recording: Recording, k: int) -> tuple[int, dict[str, float]]:
    """Number of curves, and by method the root mean square of the angle in degrees."""
    orientations = recording._replace(positions=None)
    length = INTERVALS * k
    found: dict[str, list[np.ndarray]] = defaultdict(list)
    # One sample more: the angular velocity at the last knot is measured around it.
    starts = range(0, len(recording.t) - length - 1, length)
    for start in starts:
        piece = orientations.pick(np.arange(start, start + length + 2))
        kept, hidden = split(piece, k)
        outer = (hidden.t < kept.t[1]) | (hidden.t > kept.t[-2])
        for method, motion in motions(piece, kept).items():
            found[method].append(angle(hidden.rotations[outer], motion.rotations(hidden.t[outer])))
    return len(starts), {
        method: float(np.rad2deg(np.sqrt(np.mean(np.concatenate(parts) ** 2))))
        for method, parts in found.items()
    }


def main() -> None:
    arguments = parser(__doc__)
    arguments.add_argument("files", nargs="*", type=Path, metavar="FILE")
    given = arguments.parse_args()
    if given.write and given.files:
        arguments.error("--write is for the recordings in data, without FILE")
    found = []
    for file in given.files or (POSES, ORIENTATIONS):
        found += [f"**{file.name.removesuffix('.gz')}**, angle rms in °", text(read(file))]
    found.append(versions("symspline", "scipy"))
    whole = "\n\n".join(found)
    print(whole)
    if given.write:
        insert("ends", whole)


if __name__ == "__main__":
    main()
