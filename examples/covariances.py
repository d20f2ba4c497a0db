"""
Covariances that change
=======================

The covariance of two measured quantities at three times, and between them.
"""

# %%
# The naive way
# -------------
# Interpolate the entries: a cubic curve through positive definite matrices may leave them, and has correlations beyond
# one. The usual remedy is log-Euclidean: interpolate the logarithms of the matrices. These matrices stay positive,
# but the answer depends on units: with one quantity in grams in place of kilograms it is another one.

import matplotlib.pyplot as plt
import numpy as np
from scipy.interpolate import CubicSpline

import symspline as ss

t = [0.0, 1.0, 2.0, 3.0]
given = np.array(
    [[[4, 1.9], [1.9, 1]], [[0.1, 0.02], [0.02, 0.4]], [[0.2, -0.15], [-0.15, 0.3]], [[3, -1], [-1, 2]]]
)
x = np.linspace(0, 3, 301)


def log_euclidean(matrices):
    values, vectors = np.linalg.eigh(matrices)
    logs = CubicSpline(t, np.einsum("nij,nj,nkj->nik", vectors, np.log(values), vectors), bc_type="natural")(
        x
    )
    values, vectors = np.linalg.eigh(logs)
    return np.einsum("nij,nj,nkj->nik", vectors, np.exp(values), vectors)


grams = np.diag([1.0, 1000.0])
entries = CubicSpline(t, given, bc_type="natural")(x)
in_kilograms = log_euclidean(given)
in_grams = np.linalg.inv(grams) @ log_euclidean(grams @ given @ grams) @ np.linalg.inv(grams)

# %%
# The spline
# ----------
# The affine-invariant metric of ``spd:2`` does not depend on units: you can change them before or after the fit.

spline = ss.CubicSpline(t, given, "spd:2")
rescaled = ss.CubicSpline(t, grams @ given @ grams, "spd:2")
again = np.linalg.inv(grams) @ rescaled(x) @ np.linalg.inv(grams)
print(f"grams or kilograms: {np.abs(again / spline(x) - 1).max():.0e} apart")


def correlation(matrices):
    # Not defined where a diagonal entry is negative.
    scale = matrices[:, 0, 0] * matrices[:, 1, 1]
    return matrices[:, 0, 1] / np.sqrt(np.where(scale > 0, scale, np.nan))


figure, (above, below) = plt.subplots(2, figsize=(9, 6), sharex=True, layout="constrained")
for matrices, style, label in (
    (entries, {"color": "0.6"}, "entries"),
    (in_kilograms, {"color": "C1"}, "log-Euclidean, kilograms"),
    (in_grams, {"color": "C1", "linestyle": ":"}, "log-Euclidean, grams"),
    (spline(x), {"color": "C0"}, "spline"),
):
    above.plot(x, np.linalg.eigvalsh(matrices)[:, 0], **style, label=label)
    below.plot(x, correlation(matrices), **style)
above.axhline(0, color="k", linewidth=0.7)
above.set(ylabel="smaller eigenvalue", title="Positive definite only above the line")
above.legend()
below.axhspan(1, 2, color="0.9")
below.axhspan(-2, -1, color="0.9")
below.set(ylim=(-1.5, 1.5), ylabel="correlation", xlabel="t", xticks=t)
ellipses = spline.plot()
plt.show()
