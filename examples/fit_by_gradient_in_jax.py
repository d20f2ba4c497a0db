"""
Fitting by gradient in JAX
==========================

Four hundred noisy directions were measured at arbitrary times. Eight points of a curve are to be chosen so that the
curve is as close to all of them as possible. The sum of squares is minimised by gradient descent over the points.
"""

# %%
# The naive way
# -------------
# Means of the directions near each of the eight times, as points of the curve. A mean over an interval of a bent
# curve lies inside the bend, so such a curve cuts the corners.

import jax
import jax.numpy as jnp
import matplotlib.pyplot as plt
import numpy as np

import symspline as ss
from symspline.jax import curve

sphere, rng = ss.Sphere(2), np.random.default_rng(0)
seen_at = np.sort(rng.uniform(0, 7, 400))
truth = ss.geo.from_lonlat(80 * np.sin(0.9 * seen_at), 50 * np.cos(0.7 * seen_at))
seen = sphere.exp(truth, 0.1 * sphere.random_tangent(rng, truth))

t = np.arange(8.0)
points = sphere.project(np.stack([seen[np.abs(seen_at - knot) < 0.5].mean(axis=0) for knot in t]))
naive = ss.CubicSpline(t, points, sphere)

# %%
# The gradient
# ------------
# `symspline.jax.curve` is the spline as a function that JAX differentiates. A step goes along the geodesics of the
# sphere, so that the points stay on it.


@jax.jit
def loss(points):
    return jnp.mean(jnp.sum((curve(seen_at, t, points, "sphere:2") - seen) ** 2, axis=-1))


gradient = jax.jit(jax.grad(loss))
losses = [float(loss(points))]
for _ in range(30):
    points = sphere.exp(points, -4.0 * sphere.project_tangent(points, np.asarray(gradient(points), float)))
    losses.append(float(loss(points)))
fitted = ss.CubicSpline(t, points, sphere)

x = np.linspace(0, 7, 500)
exact = ss.geo.from_lonlat(80 * np.sin(0.9 * x), 50 * np.cos(0.7 * x))
errors = [np.degrees(sphere.distance(spline(x), exact).mean()) for spline in (naive, fitted)]
print(f"off by {errors[0]:.1f} degrees at first, and by {errors[1]:.1f} in the end")

figure, (left, right) = plt.subplots(1, 2, figsize=(10, 4), width_ratios=(2, 1), layout="constrained")
left.plot(*ss.geo.to_lonlat(seen), ".", color="0.85", label="seen")
for spline, colour, label in ((naive, "0.5", "means"), (fitted, "C0", "fitted")):
    left.plot(*ss.geo.to_lonlat(spline(x)), color=colour, label=label)
    left.plot(*ss.geo.to_lonlat(spline.points), "o", color=colour, markersize=4)
left.plot(*ss.geo.to_lonlat(exact), "k:", linewidth=1, label="true")
left.set(xlabel="longitude", ylabel="latitude")
left.legend(ncols=2)
right.semilogy(losses)
right.set(xlabel="step", title="mean squared distance")
plt.show()
