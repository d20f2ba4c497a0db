"""Integration of angular velocities."""

from __future__ import annotations

from typing import Any

import numpy as np

from .. import _core
from .._spaces import Doubles, Euclidean
from .._splines.cubic import CubicSpline
from ..convert._quaternions import quaternion_to_matrix


def integrated(t: Doubles, omega: Doubles, interpolation: str = "linear") -> Doubles:
    """Return rotations that begin with the identity and have given angular velocities in the body frame.

    Each step is the exponential of the Magnus expansion of fourth order for the polynomial that interpolates ω. With
    s measured from the middle of the step, :math:`\\Omega = m_0 + m_0 \\times m_1` for the moments
    :math:`m_0 = \\int \\omega\\,ds` and :math:`m_1 = \\int s\\,\\omega\\,ds / h`.

    Parameters
    ----------
    t : ndarray, shape (n,) or (..., n)
        Increasing times of the core.
    omega : ndarray, shape (..., n, 3)
        Angular velocities.
    interpolation : {"linear", "cubic"}
        Interpolation of ω between the times, by a not-a-knot spline for ``"cubic"``.

    Returns
    -------
    ndarray, shape (..., n, 4)
        Unit quaternions, scalar first.

    References
    ----------
    S. Blanes, F. Casas, J. A. Oteo, J. Ros, The Magnus expansion and some of its applications, Phys. Rep. 470 (2009),
    Section 5. The commutator has the opposite sign here, because the unknown is on the left in R' = Rω.
    """
    h = np.diff(t)[..., None]
    before, after = omega[..., :-1, :], omega[..., 1:, :]
    zeroth, first = h * (before + after) / 2, h * (after - before) / 12
    if interpolation == "cubic" and omega.shape[-2] > 2:
        curve: Any = CubicSpline(t, omega, Euclidean(3), bc_type="not-a-knot")
        start, end = curve.velocities[..., :-1, :], curve.velocities[..., 1:, :]
        zeroth = zeroth + h * h * (start - end) / 12
        first = h * (after - before) / 10 - h * h * (start + end) / 120
    vectors = zeroth + np.cross(zeroth, first)
    half = np.sqrt((vectors * vectors).sum(axis=-1)) / 2
    steps = np.zeros((*omega.shape[:-1], 4))
    steps[..., 0, 0] = 1.0
    steps[..., 1:, 0] = np.cos(half)
    # np.sinc has a factor of π in its argument.
    steps[..., 1:, 1:] = vectors * np.sinc(half / np.pi)[..., None] / 2
    return _core.quaternion_products(steps)


def attitudes_at(t: Doubles, omega: Doubles, x: Doubles) -> Doubles:
    """Return rotation matrices at times x that begin with the identity and have the angular velocity ω in the body.

    ω is linear between the samples and constant beyond them. Times of the samples may repeat.
    """
    nodes = np.unique(np.concatenate([t, x]))
    rates = np.stack([np.interp(nodes, t, column) for column in omega.T], axis=-1)
    return quaternion_to_matrix(integrated(nodes, rates)[np.searchsorted(nodes, x)], scalar_first=True)
