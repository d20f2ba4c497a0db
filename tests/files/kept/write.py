"""Write one file of each kind: ``python tests/files/kept/write.py`` after a new format version, and never again for it.

Later versions must read these files. `values.json` holds what each curve gave when it was written.
"""

import json
import pickle
from pathlib import Path

import numpy as np

import symspline as ss

VERSION = 2
FOLDER = Path(__file__).parent
P = np.eye(3)
DATES = np.array(["2024-01-01T00", "2024-01-01T06", "2024-01-02T00"], "M8[m]")
POSES = (np.broadcast_to(np.eye(3), (3, 3, 3)), np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0]]))
TURNS = ss.rotations.from_rotation_vectors(np.arange(6)[:, None] * [0, 0.1, 0.2])
MEASURED = [
    ss.measure.Points(np.arange(6), TURNS, sigma=0.1),
    ss.measure.BodyRates([1, 2.5, 4], [[0, 0.1, 0.25]] * 3, sigma=0.05, bias=ss.measure.Constant(3)),
]
NOISY_SURFACE = np.sin(np.arange(20.0) ** 2).reshape(5, 4, 1)


def curves():
    """A curve, or a mapping of curves, of each kind."""
    spline = ss.CubicSpline([0, 1, 3], P, "sphere:2", bc_type=((1, [0, 0.5, 0]), "not-a-knot"))
    noisy, weights = P[[0, 0, 1, 1, 2, 2]], [1, 2, 1, 1, 0, 1]
    smooth = ss.make_smoothing_spline(np.arange(6), noisy, "sphere:2", 0.25, weights=weights)
    batch, times = np.stack([P, P[::-1]]), [[0, 1, 2], [0, 2, 3]]
    return {
        "cubic": spline,
        "dates": ss.CubicSpline(DATES, P, "sphere:2", extrapolate="geodesic"),
        "batch": ss.CubicSpline(times, batch, "sphere:2", where=[True, False]),
        "product": ss.CubicSpline(None, POSES, "so:3 x r:3", bc_type="clamped"),
        "complex": ss.CubicSpline(None, [[1, 0], [0.6, 0.8j]], "cp:1", bc_type=((1, [0, 0.5j]), "natural")),
        "hermite": ss.HermiteSpline([0, 1], P[:2], [[0, 0.5, 0], [0.25, 0, 0]], "sphere:2"),
        "geodesics": ss.PiecewiseGeodesic(DATES, POSES, "so:3 x r:3", extrapolate="geodesic"),
        "smoothing": smooth,
        "estimate": ss.estimate(MEASURED, 5, "so:3", lam=0.1),
        "estimate_points": ss.estimate(MEASURED[:1], 5, "so:3", lam=0.1),
        "bspline": ss.BSpline([0, 0, 0, 1, 2, 2, 2], [*P, P[0]], 2, "sphere:2"),
        "cumulative": ss.CumulativeBSpline.fit(range(6), TURNS, 2, "so:3"),
        "cumulative_product": ss.CumulativeBSpline(None, (TURNS[:5], np.arange(15.0).reshape(5, 3)), "so:3 x r:3"),
        "bezier": ss.BezierCurve([P, P[::-1]], "sphere:2"),
        "grid": ss.GridSpline(
            (DATES, None), TURNS[None] @ TURNS[[0, 2, 1], None], "so:3", bc_type=("natural", "clamped")
        ),
        "smoothing_grid": ss.make_smoothing_grid((range(5), [0, 1, 3, 4]), NOISY_SURFACE, "r:1", lam=(0.1, 0.2)),
        "part": ss.CubicSpline(DATES, P, "sphere:2").restrict(DATES[0], DATES[1] + np.timedelta64(90, "m")),
        "segments": ss.SegmentedCurve(
            [spline.restrict(0, 1), spline.reverse().shift(2.5), spline.restrict(2.5).shift(9)]
        ),
        "sections": ss.CubicSpline(
            range(6),
            TURNS,
            "so:3",
            bc_type=([(1, still := np.zeros((3, 3))), (2, still)], "natural"),
            velocities={3: still},
        ),
        "several": {"a": spline, "b": spline},
        "several_smoothing": {"a": smooth, "b": smooth},
    }


def values(found):
    """Numbers that describe a curve, or each curve of a mapping."""
    if isinstance(found, dict):
        return {name: values(curve) for name, curve in found.items()}
    numbers = {"class": type(found).__name__, "space": str(found.space)}
    if isinstance(found, ss.GridSpline):
        x = (found.axes[0][0] + (found.axes[0][-1] - found.axes[0][0]) // 3, 1.5)
        return numbers | {f"nu={nu}": [plain(found(x, nu))] for nu in [(0, 0), (1, 0), (0, 2)]}
    start, end = np.ravel(found.domain[0])[0], np.ravel(found.domain[1])[-1]
    for nu in range(3):
        factors = found(start + (end - start) // 2, nu)
        numbers[f"nu={nu}"] = [plain(part) for part in (factors if isinstance(factors, tuple) else [factors])]
    if getattr(found, "report", None) is not None:
        numbers["converged"] = plain(found.report.converged)
        numbers["iterations"] = plain(found.report.iterations)
    if hasattr(found, "std"):
        numbers |= {"std": plain(found.std(1.5)), "lam": found.lam}
        numbers |= {name: [plain(own.value), plain(own.std)] for name, own in found.parameters.items()}
        # Files of estimates do not hold their measurements.
        if not hasattr(found, "measurements"):
            numbers["residuals"] = plain(found.residuals)
    return numbers


def plain(array):
    """Numbers as JSON holds them, real and imaginary parts one after the other."""
    array = np.asarray(array)
    return [array.real.tolist(), array.imag.tolist()] if array.dtype.kind == "c" else array.tolist()


if __name__ == "__main__":
    folder = FOLDER / f"version_{VERSION}"
    folder.mkdir(exist_ok=True)
    for name, found in curves().items():
        ss.save(found, folder / f"{name}.npz")
        (folder / f"{name}.pickle").write_bytes(pickle.dumps(found, protocol=4))
    numbers = {name: values(found) for name, found in curves().items()}
    (folder / "values.json").write_text(json.dumps(numbers, indent=1) + "\n", encoding="utf-8")
