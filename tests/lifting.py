"""The horizontal lift by a general solver: X' = P'X, where P = YY* and P' = DY* + YD* do not depend on the basis Y."""

import numpy as np
from scipy.integrate import solve_ivp


def lift(spline, x, start=None):
    """The representatives X with X*X' = 0 that begin with ``start`` at the first knot, shape x.shape + (n, k)."""
    times, knots = spline._clock.at(x, (), False)[0], spline._times
    first = spline.points[0] if start is None else np.asarray(start)

    def rate(t, numbers):
        y = spline._curve.evaluate(np.array(t), "point", "raise", False)
        d = spline._curve.evaluate(np.array(t), "velocity", "raise", False)
        return ((d @ y.conj().T + y @ d.conj().T) @ numbers.reshape(first.shape)).ravel()

    flat = times.ravel()
    result = np.empty((flat.size, first.size), first.dtype)
    at = first.ravel()
    for i in range(len(knots) - 1):
        own = np.unique(flat[(flat >= knots[i]) & (flat <= knots[i + 1])])
        wanted = np.unique(np.r_[own, knots[i + 1]])
        found = solve_ivp(rate, knots[i : i + 2], at, "DOP853", wanted, rtol=1e-13, atol=1e-14)
        steps = [at if t == knots[i] else found.y[:, k] for k, t in enumerate(wanted)]
        for t, numbers in zip(wanted, steps, strict=True):
            result[flat == t] = numbers
        at = found.y[:, -1]
    return result.reshape(*times.shape, *first.shape)
