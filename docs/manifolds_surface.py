import numpy as np
from scipy.integrate import solve_ivp

import symspline as ss


def surface(f, gradient, hessian, n):
    """The surface f = 0 in Rⁿ, with lengths as in Rⁿ; all functions take rows of points."""

    def tangential(p, v):
        g = gradient(p)
        return v - (np.sum(v * g, axis=1) / np.sum(g * g, axis=1))[:, None] * g

    def project(x):  # Newton's method along the gradient
        for _ in range(6):
            g = gradient(x)
            x = x - (f(x) / np.sum(g * g, axis=1))[:, None] * g
        return x

    def rates(_, y):  # the acceleration of a geodesic is normal to the surface
        x, v = y.reshape(2, -1, n)
        g = gradient(x)
        bend = np.sum(v * (hessian(x) @ v[..., None])[..., 0], axis=1) / np.sum(g * g, axis=1)
        return np.concatenate([v, -bend[:, None] * g]).ravel()

    def exp(p, v):
        start = np.concatenate([p, v]).ravel()
        end = solve_ivp(rates, (0, 1), start, method="DOP853", rtol=1e-13, atol=1e-15).y[:, -1]
        return project(end[: p.size].reshape(-1, n))

    def log(p, q):  # shooting: Newton's method, with derivatives of exp by differences
        steps = 1e-5 * np.linalg.svd(gradient(p)[:, None, :])[2][:, 1:]
        v = tangential(p, q - p)
        for _ in range(10):
            tried = np.concatenate([v[:, None], v[:, None] + steps, v[:, None] - steps], axis=1)
            x = exp(np.repeat(p, 2 * n - 1, axis=0), tried.reshape(-1, n)).reshape(tried.shape)
            changes = np.swapaxes(x[:, 1:n] - x[:, n:], 1, 2) / 2
            correction = np.sum(np.linalg.pinv(changes) @ (q - x[:, 0])[..., None] * steps, axis=1)
            v = v + correction
            if not np.abs(correction).max(initial=0) > 1e-9:
                break
        return v

    return ss.Manifold(
        exp=exp,
        log=log,
        project_tangent=tangential,
        inner=lambda p, u, v: np.sum(u * v, axis=1),
        project=project,
        point_shape=n,
        dim=n - 1,
    )
