"""Peak memory of one fit, measured in a process of its own: ``python -m benchmarks.memory FILE``."""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

import symspline as ss

from .data import SPHERE, Array, knots


def of_fit(points: Array) -> dict[str, int]:
    """Bytes of input, output and growth of the peak in a fit on all cores."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "points.npy"
        np.save(file, points)
        command = [sys.executable, "-m", "benchmarks.memory", str(file)]
        root = Path(__file__).parents[1]
        answer = subprocess.run(command, cwd=root, check=True, stdout=subprocess.PIPE, text=True).stdout
    sizes: dict[str, int] = json.loads(answer)
    return sizes


def peak() -> int:
    """The largest resident memory of this process so far, in bytes.

    On Linux, ru_maxrss also counts what the parent held before it started this process.
    """
    status = Path("/proc/self/status")
    if status.exists():
        for line in status.read_text().splitlines():
            if line.startswith("VmHWM:"):
                return 1024 * int(line.split()[1])
    import resource

    unit = 1 if sys.platform == "darwin" else 1024
    return unit * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss


def _fit(file: str) -> dict[str, int]:
    points = np.load(file)
    t = knots(len(points))
    # Threads, and what they need once, are made here.
    ss.CubicSpline(t[:3000], points[:3000], SPHERE)
    before = peak()
    spline = ss.CubicSpline(t, points, SPHERE)
    growth = peak() - before
    output = spline.points.nbytes + spline.velocities.nbytes
    return {"input": t.nbytes + points.nbytes, "output": output, "growth": growth}


if __name__ == "__main__":
    print(json.dumps(_fit(sys.argv[1])))
