"""Lines and subspaces of many dimensions: how far they turn away from the first one, and ratios of coordinates."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.figure import SubFigure
from numpy.typing import NDArray

from .components import SUBSCRIPTS, components, draw_numbers
from .curves import Curve


def draw_principal_angles(panel: SubFigure, curves: Sequence[Curve]) -> None:
    """Grassmannians and projective spaces: the principal angles to the first point against time."""
    n, k = np.reshape(curves[0].points[0], (len(curves[0].points[0]), -1)).shape
    names = [f"θ{i + 1}".translate(SUBSCRIPTS) for i in range(min(k, n - k))]
    label = "principal angles to\nfirst point, degrees"
    draw_numbers(panel, curves, label, names, [principal_angles(c.points)[:, : len(names)] for c in curves])


def draw_ratios(panel: SubFigure, curves: Sequence[Curve]) -> None:
    """Complex hyperbolic space: the ratios zᵢ/z₀, which fill the unit ball whatever the phases, against time."""
    n = curves[0].points.shape[1] - 1
    names = [f"{part} z{i + 1}/z0".translate(SUBSCRIPTS) for i in range(n) for part in ("Re", "Im")]
    ratios = [components(c.points[:, 1:] / c.points[:, :1]) for c in curves]
    draw_numbers(panel, curves, "coordinates\nin the unit ball", names, ratios)


def principal_angles(points: NDArray[Any]) -> NDArray[np.float64]:
    """Degrees between the first subspace and all others, the largest first; shape (m, k).

    Of small angles the sines are exact, of large ones the cosines.
    """
    bases = points.reshape(*points.shape[:2], -1)
    shadow = bases[0].conj().T @ bases
    cosines = np.linalg.svd(shadow, compute_uv=False)[:, ::-1]
    sines = np.linalg.svd(bases - bases[0] @ shadow, compute_uv=False)
    return np.degrees(np.arctan2(sines, cosines))
