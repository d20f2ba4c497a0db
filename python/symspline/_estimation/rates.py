"""Integration of angular velocities."""

from __future__ import annotations

from math import isqrt
from typing import Any

import numpy as np

from .._cubic import CubicSpline
from .._spaces import Array, Doubles, Euclidean
from ..convert import quaternion_to_matrix


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
    ndarray, shape (4, ..., n)
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
    steps = np.zeros((4, *omega.shape[:-1]))
    steps[0, ..., 0] = 1.0
    steps[0, ..., 1:] = np.cos(half)
    # np.sinc has a factor of π in its argument.
    steps[1:, ..., 1:] = np.moveaxis(vectors * np.sinc(half / np.pi)[..., None] / 2, -1, 0)
    return running_products(steps)


def attitudes_at(t: Doubles, omega: Doubles, x: Doubles) -> Doubles:
    """Return rotation matrices at times x that begin with the identity and have the angular velocity ω in the body.

    ω is linear between the samples and constant beyond them. Times of the samples may repeat.
    """
    nodes = np.unique(np.concatenate([t, x]))
    rates = np.stack([np.interp(nodes, t, column) for column in omega.T], axis=-1)
    found = integrated(nodes, rates)[:, np.searchsorted(nodes, x)]
    return quaternion_to_matrix(np.moveaxis(found, 0, -1), scalar_first=True)


def running_products(q: Doubles) -> Doubles:
    """Return the products q₀, q₀q₁, q₀q₁q₂, … of unit quaternions, shape (4, ..., n).

    The sequence is cut into √n blocks. The products within all blocks are computed together, and those of the blocks
    by recursion, so that a few hundred calls of NumPy process 100 000 quaternions.
    """
    n = q.shape[-1]
    length = isqrt(max(n - 1, 0)) + 1
    blocks = -(-n // length)
    padded = np.zeros((*q.shape[:-1], blocks * length))
    padded[0] = 1.0
    padded[..., :n] = q
    table = np.ascontiguousarray(np.moveaxis(padded.reshape(*q.shape[:-1], blocks, length), -1, 0))
    for k in range(1, length):
        table[k] = unit(product(table[k - 1], table[k]))
    if blocks > 1:
        before = running_products(table[-1])[..., :-1]
        rest = np.moveaxis(table[..., 1:], 0, -1)
        table[..., 1:] = np.moveaxis(unit(product(before[..., None], rest)), -1, 0)
    return np.asarray(np.moveaxis(table, 0, -1).reshape(*q.shape[:-1], blocks * length)[..., :n])


def product(p: Array, q: Array) -> Doubles:
    """Return products of quaternions, whose components are on the first axis, scalar first."""
    a, b, c, d = p
    w, x, y, z = q
    return np.stack(
        [
            a * w - b * x - c * y - d * z,
            a * x + b * w + c * z - d * y,
            a * y - b * z + c * w + d * x,
            a * z + b * y - c * x + d * w,
        ]
    )


def unit(q: Array) -> Doubles:
    """Return quaternions of length one, which keeps rounding errors from accumulating in the length."""
    return np.asarray(q / np.sqrt((q * q).sum(axis=0)))
