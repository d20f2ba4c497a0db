"""Algorithm 1 of Bogfjellmo, Modin & Verdier (2018), line by line, with public operations only."""

import numpy as np


def sweeps(space, p, ends="natural"):
    """Yield the velocities v̄ of Algorithm 1 on unit knots before every sweep, and ‖δ‖ of the sweep.

    Parameters
    ----------
    space : Space
        A space with `exp`, `log` and `transvection`: E_p(v)·x of (10).
    p : ndarray, shape (N + 1, *space.point_shape)
        Points p₀, ..., p_N.
    ends : "natural" or pair of ndarray
        (20), or v_start and v_end of (19).
    """
    log, e = space.log, space.transvection
    n = len(p) - 1
    v = np.zeros_like(space.log(p[0], p[0]) + p)
    while True:
        # v̄ ← (v₀(v), v, v_N(v))
        if ends == "natural":
            q_first = e(p[1], -v[1], p[1]) if n > 1 else None
            q_last = e(p[n - 1], v[n - 1], p[n - 1]) if n > 1 else None
            v[0] = log(p[0], q_first) / 2
            v[n] = -log(p[n], q_last) / 2
        else:
            v[0], v[n] = ends
        q_plus = [e(p[i], v[i], p[i]) for i in range(n)]
        q_minus = [None] + [e(p[i], -v[i], p[i]) for i in range(1, n + 1)]
        delta = np.zeros_like(v)
        for i in range(1, n):
            delta[i] = log(p[i], e(p[i], -v[i], q_minus[i + 1])) - log(p[i], e(p[i], v[i], q_plus[i - 1])) - 2 * v[i]
        yield v.copy(), max(float(space.norm(p[i], delta[i])) for i in range(1, n))
        v[1:n] += delta[1:n] / 4
