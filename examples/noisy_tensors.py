"""
A noisy diffusion tensor
========================

A diffusion tensor is measured every week for a year: a bundle of fibres is lost, and another one grows.
"""

# %%
# The naive way
# -------------
# A moving mean of the entries over nine weeks: it keeps part of the noise, is flat at the ends where it has only one
# side, and somebody must say how many weeks.

import matplotlib.pyplot as plt
import numpy as np

import symspline as ss

spd, rng = ss.SymmetricPositiveDefinite(3), np.random.default_rng(1)
weeks = np.arange(53.0)
# In 1e-3 mm²/s, in the order of FSL.
given = [[1.7, 0, 0, 0.3, 0, 0.3], [0.9, 0.2, 0, 0.7, 0, 0.6], [0.5, 0.3, 0, 1.4, 0, 0.4]]
truth = ss.CubicSpline([0, 26, 52], ss.tensors.from_vectors(given, order="fsl"), spd)
measured = spd.exp(truth(weeks), 0.15 * spd.random_tangent(rng, truth(weeks)))

means = np.stack([measured[max(0, i - 4) : i + 5].mean(axis=0) for i in range(53)])

# %%
# The smooth curve
# ----------------

smooth = ss.make_smoothing_spline(weeks, measured, spd)
off = spd.distance(smooth(weeks), truth(weeks))
print(
    f"noise {smooth.sigma:.2f} in every coordinate; the curve is off by {off.mean():.2f}, at most {off.max():.2f}"
)


def anisotropy(tensors):
    values = np.linalg.eigvalsh(tensors)
    return np.sqrt(4.5) * values.std(axis=-1) / np.linalg.norm(values, axis=-1)


figure = plt.figure(figsize=(9, 5), layout="constrained")
axes, ellipses = figure.subplots(2, sharex=True, height_ratios=(2, 1))
axes.plot(weeks, anisotropy(measured), "o", color="0.7", label="measured")
axes.plot(weeks, anisotropy(means), color="0.5", linewidth=1, label="moving mean of entries")
axes.plot(weeks, anisotropy(smooth(weeks)), label="smooth")
axes.plot(weeks, anisotropy(truth(weeks)), "k--", linewidth=1, label="true")
axes.set(ylabel="fractional anisotropy")
axes.legend()
angle = np.linspace(0, 2 * np.pi, 100)
for row, (tensors, colour) in enumerate([(smooth(weeks), "C0"), (measured, "0.7")]):
    for week in range(0, 53, 4):
        ring = np.linalg.cholesky(tensors[week, :2, :2]) @ [np.cos(angle), np.sin(angle)]
        ellipses.fill(week + 1.4 * ring[0], row + 0.35 * ring[1], color=colour)
ellipses.set(yticks=[0, 1], yticklabels=["smooth", "measured"], xlabel="weeks")
plt.show()
