"""Calls that type checkers must reject. Never run: `test_typing.py` gives this file to mypy and Pyright.

Each call has a comment that ignores its error. An unused comment is an error itself, so a call that is accepted by
mistake fails the test.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

import symspline as ss

sphere, states = ss.Sphere(2), ss.ComplexProjective(1)
poses = ss.Product(ss.SpecialOrthogonal(3), ss.Euclidean(3))
t, p, v = np.arange(3.0), np.eye(3), np.zeros(3)
spline = ss.CubicSpline(t, p, sphere)
smooth = ss.make_smoothing_spline(t, p, sphere)

# ---- words ----

ss.CubicSpline(t, p, sphere, bc_type=3)  # type: ignore[arg-type]
ss.CubicSpline(t, p, sphere, bc_type="not a knot")  # type: ignore[arg-type]
ss.CubicSpline(t, p, sphere, bc_type=("natural", "periodic"))  # type: ignore[arg-type]
ss.CubicSpline(t, p, sphere, bc_type=(1, v))  # type: ignore[arg-type]
ss.CubicSpline(t, p, sphere, method="bogus")  # type: ignore[arg-type]
ss.CubicSpline(t, p, sphere, extrapolate="linear")  # type: ignore[arg-type]
ss.CubicSpline(t, p, sphere, on_failure="hide")  # type: ignore[arg-type]
ss.HermiteSpline(t, p, p, sphere, extrapolate=2)  # type: ignore[arg-type]
ss.fit(t, p, sphere, method="linearized")  # type: ignore[arg-type]
ss.fit_many([(t, p)], sphere, bc_type="free")  # type: ignore[arg-type]
ss.fit_segments(t, p, sphere, max_gap=1, duplicates="last")  # type: ignore[call-overload]
ss.fit_segments(t, p, sphere, max_gap=1, criterion="gcv")  # type: ignore[call-overload]
ss.fit_segments(t, p, sphere, max_gap=1, smooth=True, bc_type="free")  # type: ignore[call-overload]
ss.make_smoothing_spline(t, p, sphere, method="flat")  # type: ignore[call-overload]
ss.make_smoothing_spline(t, p, sphere, criterion="aic")  # type: ignore[call-overload]
ss.make_smoothing_spline(t, p, sphere, loss="l1")  # type: ignore[call-overload]
ss.make_smoothing_spline(t, p, sphere, penalty="snap")  # type: ignore[call-overload]
ss.rotations.velocities(np.eye(3), v, "bodies")  # type: ignore[arg-type]
ss.rotations.as_rotation_6d(np.eye(3), order="dipy")  # type: ignore[arg-type]
ss.tensors.to_vectors(np.eye(3), order="rows")  # type: ignore[arg-type]
ss.quantum.pulses(spline, t, kind="middle")  # type: ignore[arg-type]

# ---- keywords ----

ss.CubicSpline(t, p, sphere, "natural")  # type: ignore[call-arg]
ss.CubicSpline(t, p, sphere, tolerance=1e-9)  # type: ignore[call-arg]
ss.evaluate(t, p, p, sphere, 0.5, 1)  # type: ignore[call-overload]
ss.tensors.to_vectors(np.eye(3))  # type: ignore[call-arg]
spline.jvp(0.5, p, None, None, 1)  # type: ignore[call-arg]
spline.vjp(0.5, v, 1)  # type: ignore[call-arg]
smooth.std(0.5, 1)  # type: ignore[call-arg]

# ---- arguments ----

ss.CubicSpline(t, p, 2)  # type: ignore[arg-type]
ss.CubicSpline(t, None, sphere)  # type: ignore[arg-type]
ss.CubicSpline(t, p, sphere, tol="small")  # type: ignore[arg-type]
ss.CubicSpline(t, p, sphere, max_iter=1.5)  # type: ignore[arg-type]
ss.Sphere("2")  # type: ignore[arg-type]
ss.Product(sphere, 3)  # type: ignore[call-overload]
spline(0.5, nu=1.0)  # type: ignore[call-overload]
spline(0.5, out=[0.0, 0.0, 0.0])  # type: ignore[call-overload]
spline(0.5, dtype="float32", out=v)  # type: ignore[call-overload]
spline["first"]  # type: ignore[index]
spline.save(3)  # type: ignore[arg-type]
spline.points = p  # type: ignore[misc]

# ---- results ----

complex_point: NDArray[np.complex128] = spline(0.5)  # type: ignore[assignment]
real_point: NDArray[np.float64] = ss.CubicSpline(t, np.eye(3, 2), states)(0.5)  # type: ignore[assignment]
first, second, third = ss.CubicSpline(t, (np.eye(3), v), poses)(0.5)  # type: ignore[misc]
length: str = spline.length()  # type: ignore[assignment]
lam: tuple[Any, ...] = smooth.lam  # type: ignore[assignment]
one: ss.SmoothingReport = ss.make_smoothing_spline(t, (p, v), poses).report  # type: ignore[assignment]


def needs_arrays(curve: ss.CubicSpline) -> None: ...


needs_arrays(ss.CubicSpline(t, (p, v), poses))  # type: ignore[arg-type]


def needs_a_report_of_a_fit(curve: ss.CubicSpline) -> None: ...


needs_a_report_of_a_fit(smooth)  # type: ignore[arg-type]
