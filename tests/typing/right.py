"""Types that type checkers infer. Never run: `test_typing.py` gives this file to mypy and Pyright."""

import io
from datetime import datetime, timedelta
from pathlib import Path
from typing import Any, assert_type

import numpy as np
from numpy.typing import NDArray

import symspline as ss

Float = NDArray[np.float64]
Complex = NDArray[np.complex128]
Number = float | NDArray[np.float64]
# A pose, as a point of Product(SpecialOrthogonal(3), Euclidean(3)).
Pose = tuple[NDArray[np.float64], NDArray[np.float64]]

sphere, states = ss.Sphere(2), ss.ComplexProjective(1)
poses = ss.Product(ss.SpecialOrthogonal(3), ss.Euclidean(3))
mixed = ss.Product(sphere, states, poses.factors[1])
rng = np.random.default_rng(0)
t, x = np.arange(3.0), np.linspace(0, 2, 9)


# ---- spaces ----

assert_type(poses, ss.Product[Pose])
assert_type(mixed, ss.Product[tuple[Float, Complex, NDArray[Any]]])
assert_type(ss.Product("sphere:2", states), ss.Product[tuple[NDArray[Any], ...]])
assert_type(ss.space("sphere:2"), ss.Space[NDArray[Any]])
assert_type(sphere.random_point(rng, 3), Float)
assert_type(sphere.exp([1, 0, 0], [0, 1, 0]), Float)
assert_type(states.transport([1, 0], [0, 1], [0, 1]), Complex)
assert_type(poses.random_point(rng, 3), Pose)
assert_type(poses.geodesic(poses.random_point(rng), poses.random_point(rng), 0.5), Pose)
assert_type(sphere.distance([1, 0, 0], [[0, 1, 0]]), Float)
assert_type(states.inner([1, 0], [0, 1], [0, 1]), Float)


def first_of(space: ss.Space) -> NDArray[Any]:
    """An annotation without a parameter means that points are arrays."""
    return space.random_point(rng)


first_of(sphere)
first_of(states)
first_of(ss.space("sphere:2"))


# ---- curves ----

p = sphere.random_point(rng, 3)
spline = ss.CubicSpline(t, p, sphere)
assert_type(spline, ss.CubicSpline[Float])
assert_type(spline(0.5), Float)
assert_type(spline(x, 1), Float)
assert_type(spline(x, nu=2, extrapolate="geodesic"), Float)
assert_type(spline(x, dtype="float32"), NDArray[Any])
assert_type(spline(x, out=np.empty((9, 3))), np.ndarray[tuple[int, int], np.dtype[np.float64]])
assert_type(spline.lift(x), Float)
assert_type(spline.transport(0, 1, [0, 0, 1]), Float)
assert_type(spline.points, Float)
assert_type(spline.control_points, Float)
assert_type(spline.speed(x), Float)
assert_type(spline.length(), Number)
assert_type(spline.bending_energy(), Number)
assert_type(spline.space, ss.Space[Float])
assert_type(spline[0], ss.CubicSpline[Float])
assert_type(next(iter(spline)), ss.CubicSpline[Float])
assert_type(spline.report, ss.Report)
assert_type(spline.report.residual, Number)
assert_type(spline.jvp(x, points=p), Float)
assert_type(spline.vjp(x, spline(x)), ss.Gradient[Float])
assert_type(spline.vjp(x, spline(x)).points, Float)
spline.save(Path("curve.npz"))
spline.save(io.BytesIO())

assert_type(ss.CubicSpline(None, [[1, 0], [0, 1]], states)(0.5), Complex)
assert_type(ss.CubicSpline(None, p, "sphere:2")(0.5), NDArray[Any])
assert_type(ss.CubicSpline(None, poses.random_point(rng, 3), poses)(0.5), Pose)
rotation, position = ss.CubicSpline(None, poses.random_point(rng, 3), poses)(x, 1)
assert_type(position, Float)
assert_type(ss.CubicSpline(None, poses.random_point(rng, 3), poses)(x, dtype="float32"), tuple[NDArray[Any], ...])

assert_type(ss.HermiteSpline(t, p, np.zeros((3, 3)), sphere)(x), Float)
assert_type(ss.BezierCurve(p, sphere)(0.5), Float)
assert_type(ss.BSpline([0, 0, 0, 1, 1, 1], p, 2, sphere).control_points, Float)
assert_type(ss.BSpline([0, 0, 0, 1, 1, 1], p, 2, sphere).domain, tuple[float, float])


def halfway(curve: ss.Curve) -> NDArray[Any]:
    """The same holds for curves."""
    return curve(0.5)


def anywhere(curve: ss.Curve[Any], at: float) -> Number:
    """Also on products."""
    curve(at)
    return curve.length()


# Dates and durations.
days = [datetime(2024, 1, 1), datetime(2024, 1, 2), datetime(2024, 1, 4)]
ss.CubicSpline(days, p, sphere)(datetime(2024, 1, 3))
ss.CubicSpline(np.array(days, "datetime64[s]"), p, sphere)(np.datetime64("2024-01-03"))
ss.CubicSpline([timedelta(0), timedelta(1), timedelta(3)], p, sphere)([timedelta(2)])

halfway(spline)
anywhere(ss.CubicSpline(None, poses.random_point(rng, 3), poses), 0.5)

# All end conditions, solvers and policies.
v = np.zeros(3)
for ends in ("natural", "not-a-knot", "clamped", "periodic"):
    ss.CubicSpline(t, p, sphere, bc_type=ends)
ss.CubicSpline(t, p, sphere, bc_type=((1, v), (2, v)))
ss.CubicSpline(t, p, sphere, bc_type=("natural", (1, [0, 0, 1])))
for method in ("auto", "quasi-newton", "newton", "fixed-point", "homotopy"):
    ss.CubicSpline(t, p, sphere, method=method)
for where in ("raise", "geodesic", "periodic", True, False, None):
    ss.CubicSpline(t, p, sphere, extrapolate=where)
for action in ("raise", "warn", "ignore"):
    ss.CubicSpline(t, p, sphere, on_failure=action)

# ---- functions ----

assert_type(ss.fit(t, p, sphere, method="newton"), tuple[Float, ss.Report])
assert_type(ss.evaluate(t, p, np.zeros((3, 3)), sphere, x, nu=1), Float)
assert_type(ss.evaluate(t, p, np.zeros((3, 3)), "sphere:2", x), NDArray[Any])
assert_type(ss.fit_many([(t, p), (None, p)], sphere), list[ss.CubicSpline[Float]])
assert_type(
    ss.fit_segments(t, p, sphere, max_gap=1.5, bc_type="not-a-knot"), ss.SegmentedCurve[Float, ss.CubicSpline[Float]]
)
assert_type(ss.fit_segments(t, p, sphere, max_gap=1.5)[0], ss.CubicSpline[Float])
ss.fit_segments(t, p, sphere, max_gap=np.timedelta64(5, "m"), duplicates="mean")
# A file does not show to type checkers what it holds.
loaded: ss.CubicSpline[Float] = ss.load("curve.npz")  # pyright: ignore[reportAny]
assert_type(loaded(0.5), Float)
ss.save({"one": spline}, "curves.npz")
ss.save(ss.CubicSpline(None, poses.random_point(rng, 3), poses), "curve.npz")

# ---- smoothing ----

smooth = ss.make_smoothing_spline(t, p, sphere, criterion="reml", loss="cauchy")
assert_type(smooth, ss.SmoothingSpline[Float])
assert_type(smooth(0.5), Float)
assert_type(smooth.report, ss.SmoothingReport)
assert_type(smooth.report.converged, bool | NDArray[np.bool_])
assert_type(smooth.lam, Number)
assert_type(smooth.sigma, Number)
assert_type(smooth.std(x), Float)
assert_type(smooth.band(x, 0.9), Float)
assert_type(smooth.residuals, Float)
assert_type(smooth.data[1], Float)
assert_type(smooth[0].lam, Number)

both = ss.make_smoothing_spline(t, poses.random_point(rng, 3), poses, lam=(1.0, None))
assert_type(both(0.5), Pose)
assert_type(both.lam, tuple[Number, ...])
assert_type(both.report[0], ss.SmoothingReport)
assert_type(both.std(x), tuple[Float, ...])

motion = ss.make_lsq_spline(t, np.stack([np.eye(4)] * 3), 2, ss.SpecialEuclidean(3))
assert_type(motion(0.5), Float)
assert_type(motion.sigma, tuple[Number, ...])
assert_type(ss.make_lsq_spline(t, p, 2, "sphere:2").sigma, Number)


# A smoothing spline is a cubic spline with a report of another type. An annotation without parameters means the report
# of a spline through points.


def first_residual(spline: ss.CubicSpline) -> Number:
    return spline.report.residual


def on_any_report(spline: ss.CubicSpline[Any, Any]) -> Number:
    return spline.length()


first_residual(spline)
on_any_report(spline)
on_any_report(smooth)
on_any_report(both)
smoothed: ss.CubicSpline[Float, ss.SmoothingReport] = smooth
assert_type(smoothed.report, ss.SmoothingReport)

# ---- other modules ----

track = ss.make_smoothing_spline(t, p, "sphere:2")
assert_type(ss.geo.sog(track, x), Float)
assert_type(ss.geo.sog(track, x, return_std=True), tuple[Float, Float])
assert_type(ss.geo.cog(track, x, return_std=False), Float)
assert_type(ss.geo.cog(track, x, return_std=True)[1], Float)
assert_type(ss.quantum.hamiltonian(track, x), NDArray[Any])
assert_type(ss.subspaces.reduced_operator(track, np.eye(3), x), NDArray[Any])
assert_type(ss.rotations.angular_velocity(track, x, "world"), NDArray[Any])
assert_type(ss.rotations.angular_velocity(motion, x, return_std=True), tuple[NDArray[Any], NDArray[Any]])
assert_type(ss.poses.imu(motion, x), ss.poses.Imu)
assert_type(ss.poses.imu(motion, x, return_std=True), tuple[ss.poses.Imu, ss.poses.Imu])
assert_type(ss.poses.twist(motion, x, "world"), NDArray[Any])

turning = ss.CubicSpline(None, np.stack([np.eye(3)] * 2), "so:3")
assert_type(ss.rotations.angular_velocity(turning, x, "world"), NDArray[Any])
assert_type(ss.rotations.integrate(t, np.ones((3, 3)), interpolation="linear"), NDArray[Any])
assert_type(ss.poses.twist(ss.CubicSpline(None, poses.random_point(rng, 3), poses), x, "world"), NDArray[Any])
ss.tensors.to_vectors(np.eye(3), order="dipy")
