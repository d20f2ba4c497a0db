"""Lines and subspaces of many dimensions: how far they turn away from the first one, and ratios of coordinates."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.figure import SubFigure
from numpy.typing import NDArray

from .components import SUBSCRIPTS, components, draw_numbers
from .curves import Curve

Array = NDArray[np.float64]


def draw_principal_angles(panel: SubFigure, curves: Sequence[Curve]) -> None:
    """Grassmannians and projective spaces: the principal angles to the first point against time."""
    n, k = np.reshape(curves[0].points[0], (len(curves[0].points[0]), -1)).shape
    names = [f"θ{i + 1}".translate(SUBSCRIPTS) for i in range(min(k, n - k))]
    label = "principal angles to\nfirst point, degrees"

    def numbers(curve: Curve) -> tuple[Array, Array]:
        first = curve.points[0]
        return curve.marked(lambda points: principal_angles(points, first)[:, : len(names)])

    draw_numbers(panel, curves, label, names, [numbers(curve) for curve in curves])


def draw_ratios(panel: SubFigure, curves: Sequence[Curve]) -> None:
    """Complex hyperbolic space: the ratios zᵢ/z₀, which fill the unit ball whatever the phases, against time."""
    n = curves[0].points.shape[1] - 1
    names = [f"{part} z{i + 1}/z0".translate(SUBSCRIPTS) for i in range(n) for part in ("Re", "Im")]
    ratios = [c.marked(lambda points: components(points[:, 1:] / points[:, :1])) for c in curves]
    draw_numbers(panel, curves, "coordinates\nin the unit ball", names, ratios)


def principal_angles(points: NDArray[Any], first: NDArray[Any] | None = None) -> Array:
    """Degrees between a subspace, the first of all by default, and others, the largest first; shape (m, k).

    Of small angles the sines are exact, of large ones the cosines.
    """
    bases = points.reshape(*points.shape[:2], -1)
    base = bases[0] if first is None else first.reshape(bases.shape[1:])
    shadow = base.conj().T @ bases
    cosines = np.linalg.svd(shadow, compute_uv=False)[:, ::-1]
    sines = np.linalg.svd(bases - base @ shadow, compute_uv=False)
    return np.degrees(np.arctan2(sines, cosines))
