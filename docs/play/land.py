"""Write ``land.json``, the coastlines of the globe, from the file that the package draws its maps with.

Run it as ``python docs/play/land.py``. The rings are those of Natural Earth at 1:110 million, in tenths of a degree:
longitude and latitude of the first corner, and then differences.
"""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

HERE = Path(__file__).parent
SOURCE = HERE.parents[1] / "python/symspline/_plotting/land.npz"


def rings() -> list[list[int]]:
    """Return the rings as lists of whole numbers."""
    with np.load(SOURCE) as file:
        found = np.split(file["points"].astype(int), file["starts"])
    out = []
    for ring in found:
        corners = np.rint(ring / 10).astype(int)
        moved = np.append(True, (np.diff(corners, axis=0) != 0).any(axis=1))
        corners = corners[moved]
        out.append(np.diff(corners, axis=0, prepend=0).ravel().tolist())
    return out


if __name__ == "__main__":
    text = json.dumps(rings(), separators=(",", ":"))
    (HERE / "land.json").write_text(text + "\n")
