"""Integration of angular velocities."""

from __future__ import annotations

import numpy as np

from .._spaces import Array, Doubles, SpecialOrthogonal

_SO3 = SpecialOrthogonal(3)


def hat(v: Array) -> Array:
    """Return the skew matrices of vectors."""
    out = np.zeros((*v.shape[:-1], 3, 3))
    out[..., 2, 1], out[..., 0, 2], out[..., 1, 0] = np.moveaxis(v, -1, 0)
    return out - np.swapaxes(out, -1, -2)


def integrate_from(t: Doubles, omega: Doubles, x: Doubles) -> Doubles:
    """Return rotation matrices at times x that begin with the identity and have the angular velocity ω in the body.

    ω is linear between the samples and constant beyond them.
    """
    nodes = np.unique(np.concatenate([t, x]))
    rates = np.stack([np.interp(nodes, t, column) for column in omega.T], axis=-1)
    steps = 0.5 * np.diff(nodes)[:, None] * (rates[1:] + rates[:-1])
    turned = np.empty((len(nodes), 3, 3))
    turned[0] = np.eye(3)
    exps = _SO3.exp(np.broadcast_to(np.eye(3), (len(steps), 3, 3)), hat(steps))
    for i, step in enumerate(exps):
        turned[i + 1] = turned[i] @ step
    found = np.asarray(_SO3.project(turned))[np.searchsorted(nodes, x)]
    return np.asarray(found)
