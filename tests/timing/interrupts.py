"""Measure how soon long calls end after Ctrl-C: python tests/timing/interrupts.py [part of a name].

Each call takes several seconds if nothing interrupts it. A timer sends a signal after half a second, and the table
shows the time until `KeyboardInterrupt` is raised. The script fails if this takes longer than a second. The signal
comes from the operating system, since a thread of Python would wait for the same lock as the call.
"""

import signal
import sys
import tempfile
import time
import warnings
from functools import cache
from pathlib import Path

import numpy as np

import symspline as ss

AFTER, LIMIT = 0.5, 1.0
M = ss.measure


def rng():
    return np.random.default_rng(0)


@cache
def walk(space, n, step=0.2):
    """Points of a random walk that are close to each other."""
    space = ss.space(space)
    if isinstance(space, ss.Product):
        return tuple(walk(str(factor), n, step) for factor in space.factors)
    p = space.random_point(rng())
    few = space.exp(p, step * space.random_tangent(rng(), np.broadcast_to(p, (50, *p.shape))))
    return few[np.arange(n) % 50]


def turns(n):
    """Rotations that turn smoothly, and their times."""
    t = np.linspace(0, n / 100, n)
    return t, ss.rotations.from_rotation_vectors(np.stack([np.sin(t), np.cos(2 * t), 0.1 * np.sin(3 * t)], axis=-1))


def noisy(n):
    t, r = turns(n)
    so3 = ss.space("so:3")
    return t, so3.exp(r, 0.01 * so3.random_tangent(rng(), r))


@cache
def spline(space="so:3", n=100_000):
    return ss.CubicSpline(None, walk(space, n), space, method="quasi-newton", on_failure="ignore")


@cache
def smooth_curve(n=100_000):
    return ss.CubicSpline(*turns(n), "so:3")


@cache
def estimated(n=3000, d=3, knots=1000):
    y = np.cumsum(rng().standard_normal((n, d)), axis=0)
    t = np.arange(float(n))
    return ss.estimate([M.Points(t, y, sigma=0.1), M.Velocities(t, y, 0 * y, sigma=9.0)], knots, f"r:{d}", lam=1.0)


def grid(n, space="so:3"):
    x, y = np.meshgrid(np.linspace(0, 9, n), np.linspace(0, 9, n), indexing="ij")
    angles = np.stack([np.sin(x + y), np.cos(2 * x - y), 0.3 * np.sin(y)], axis=-1)
    return ss.rotations.from_rotation_vectors(angles) if space == "so:3" else angles


def gyroscope(n):
    t, r = turns(n)
    c = ss.CubicSpline(t[::10], r[::10], "so:3")
    rates = ss.rotations.angular_velocity(c, np.clip(t, *c.domain)) + 0.01 * rng().standard_normal((n, 3))
    return [M.Points(t[::10], r[::10], sigma=0.01), M.BodyRates(t, rates, sigma=0.01, bias=M.Constant(3, sigma=1.0))]


def many_constants():
    t, y = np.arange(100.0), rng().standard_normal((100, 3))
    constants = {"c": M.Constant(4000, sigma=1.0)}
    unknown = M.Function(t, lambda x, p: x[:, 0] - y[:, 0] + p["c"][:100], sigma=1.0, parameters=constants)
    measured = [M.Points(t, y, sigma=0.1), unknown]
    return lambda: ss.estimate(measured, 20, "r:3", lam=1.0)


def table_of_tracks(n):
    import pandas as pd

    time = pd.date_range("2024-01-01", periods=n, freq="1min")
    place = np.cumsum(rng().standard_normal((n, 2)) * 1e-3, axis=0)
    return pd.DataFrame({"time": time, "lon": place[:, 0], "lat": place[:, 1], "by": np.arange(n) // 50})


def written(n):
    path = Path(tempfile.mkdtemp()) / "a.tum"
    t, r = turns(n)
    ss.poses.write_tum(path, t, ss.poses.join(r, np.zeros((n, 3))))
    return path


def parts(n):
    p = walk("so:3", 10)
    c = ss.CubicSpline(None, np.concatenate([p, p[:1]]), "so:3")
    return [c.shift(10.0 * i) for i in range(n)]


def concatenated(curves):
    first, *others = curves
    closed = first
    for other in others:
        closed = closed.concatenate(other)
    return closed


def on_sphere():
    """The sphere as a manifold made of functions."""
    s = ss.Sphere(2)
    given = {name: getattr(s, name) for name in ("exp", "log", "project_tangent", "inner")}
    return ss.Manifold(**given, point_shape=(3,), dim=2, injectivity_radius=np.pi)


# Statements that prepare the data, and the call. A call that is too short by itself is repeated.
CALLS = {
    "CubicSpline": ("p = walk('so:3', 2000000)", "ss.CubicSpline(None, p, 'so:3')"),
    "CubicSpline newton": (
        "p = walk('so:3', 400000)",
        "ss.CubicSpline(None, p, 'so:3', method='newton', max_iter=9999, tol=1e-300, on_failure='ignore')",
    ),
    "CubicSpline homotopy": (
        "p = walk('so:3', 400000, 1.0)",
        "ss.CubicSpline(None, p, 'so:3', method='homotopy', on_failure='ignore')",
    ),
    "CubicSpline fixed-point": (
        "p = walk('sphere:3', 2000000)",
        "ss.CubicSpline(None, p, 'sphere:3', method='fixed-point', tol=0, max_iter=9999, on_failure='ignore')",
    ),
    "CubicSpline batch": (
        "p = walk('so:3', 3200000).reshape(200000, 16, 3, 3)",
        "ss.CubicSpline(None, p, 'so:3', on_failure='ignore')",
    ),
    "CubicSpline product": ("p = walk('so:3 x r:3', 2000000)", "ss.CubicSpline(None, p, 'so:3 x r:3')"),
    "CubicSpline quotient": ("p = walk('so:3', 400000); q = ss.Quotient('so:3', '432')", "ss.CubicSpline(None, p, q)"),
    "CubicSpline manifold": ("p = walk('sphere:2', 20000); s = on_sphere()", "ss.CubicSpline(None, p, s)"),
    "CubicSpline sphere:3000": ("p = walk('sphere:3000', 20000)", "ss.CubicSpline(None, p, 'sphere:3000')"),
    "CubicSpline velocities": (
        "p = walk('so:3', 1000000)",
        "ss.CubicSpline(None, p, 'so:3', velocities={5: np.zeros((3, 3))})",
    ),
    "CubicSpline search": ("p = walk('so:3', 400000, 2.0)", "ss.CubicSpline(None, p, 'so:3', on_failure='ignore')"),
    "fit_many": ("c = [(None, walk('so:3', 16))] * 200000", "ss.fit_many(c, 'so:3')"),
    "fit_segments": (
        "p = walk('so:3', 800000); t = np.arange(800000.0) + 9 * (np.arange(800000) // 20)",
        "ss.fit_segments(t, p, 'so:3', max_gap=2)",
    ),
    "HermiteSpline.from_points": (
        "p = walk('so:3', 4000000)",
        "while True: ss.HermiteSpline.from_points(None, p, 'so:3')",
    ),
    "PiecewiseGeodesic": ("p = walk('so:3', 4000000)", "while True: ss.PiecewiseGeodesic(None, p, 'so:3')"),
    "evaluate": ("c = spline(); x = np.linspace(0, 99999, 20000000)", "c(x)"),
    "evaluate accelerations": ("c = spline(); x = np.linspace(0, 99999, 20000000)", "c(x, nu=2)"),
    "third derivative": ("c = smooth_curve(); x = np.linspace(0, 999, 5000000)", "c(x, nu=3)"),
    "lift": ("c = spline('rp:2'); x = np.linspace(0, 99999, 5000000)", "c.lift(x)"),
    "angular_velocity": ("c = spline(); x = np.linspace(0, 99999, 10000000)", "ss.rotations.angular_velocity(c, x)"),
    "length": ("c = spline('so:3', 1000000)", "while True: c.length()"),
    "arc_length": ("c = spline('so:3', 1000000)", "while True: c.arc_length(np.linspace(0, 900000.0, 3000000))"),
    "at_length": ("c = spline('so:3', 1000000)", "while True: c.at_length(np.linspace(0, 9000.0, 3000000))"),
    "bending_energy": ("c = spline('so:3', 1000000)", "while True: c.bending_energy()"),
    "extrema": ("c = smooth_curve()", "while True: c.extrema('acceleration')"),
    "solve": ("c = smooth_curve()", "while True: c.solve('speed', 1.0)"),
    "closest": ("c = smooth_curve(20000); p = walk('so:3', 2000)", "c.closest(p)"),
    "jvp": (
        "c = spline('so:3', 400000)",
        "while True: c.jvp(np.linspace(0, 90000.0, 400000), np.zeros((400000, 3, 3)))",
    ),
    "vjp": (
        "c = spline('so:3', 400000)",
        "while True: c.vjp(np.linspace(0, 90000.0, 400000), np.zeros((400000, 3, 3)))",
    ),
    "append": ("c = spline('so:3', 1000000)", "while True: c.append(1000000.0 + 5, np.eye(3)[None][0])"),
    "transport": ("c = spline('so:3', 100000)", "while True: c.transport(0.0, 99000.0, np.zeros((3, 3)))"),
    "concatenate": ("c = parts(3000)", "concatenated(c)"),
    "time_law": ("c = spline('so:3', 3000)", "while True: ss.time_law(c, max_acceleration=1.0, grid_size=100000)"),
    "retime": (
        "c = smooth_curve(10000); w = ss.time_law(c, max_acceleration=1.0)",
        "while True: c.retime(w)(np.linspace(0, 9, 1000000))",
    ),
    "BezierCurve": ("c = ss.BezierCurve(walk('so:3', 30000), 'so:3')", "c(0.5)"),
    "BSpline": (
        "c = ss.BSpline(np.arange(100004.0), walk('so:3', 100000), 3, 'so:3')",
        "c(np.linspace(3, 90000.0, 10000000))",
    ),
    "CumulativeBSpline.fit": ("a = noisy(100000)", "ss.CumulativeBSpline.fit(*a, np.linspace(0, 1000, 20000), 'so:3')"),
    "make_smoothing_spline": ("a = noisy(200000)", "ss.make_smoothing_spline(*a, 'so:3')"),
    "make_smoothing_spline one lam": ("a = noisy(1000000)", "ss.make_smoothing_spline(*a, 'so:3', 1.0)"),
    "make_smoothing_spline reml": ("a = noisy(200000)", "ss.make_smoothing_spline(*a, 'so:3', criterion='reml')"),
    "make_smoothing_spline jerk": ("a = noisy(100000)", "ss.make_smoothing_spline(*a, 'so:3', penalty='jerk')"),
    "make_smoothing_spline robust": ("a = noisy(100000)", "ss.make_smoothing_spline(*a, 'so:3', loss='cauchy')"),
    "make_smoothing_spline batch": (
        "t = np.arange(100.0); y = rng().standard_normal((5000, 100, 1))",
        "ss.make_smoothing_spline(t, y, 'r:1')",
    ),
    "make_smoothing_spline r:1": (
        "y = np.cumsum(rng().standard_normal(3000000))[:, None]",
        "ss.make_smoothing_spline(None, y, 'r:1')",
    ),
    "make_lsq_spline": ("a = noisy(300000)", "ss.make_lsq_spline(*a, 30000, 'so:3')"),
    "matrices of weights": (
        "y = walk('r:150', 3000); w = np.broadcast_to(np.eye(150), (3000, 150, 150))",
        "ss.make_smoothing_spline(None, y, 'r:150', 1.0, weights=w)",
    ),
    "band": ("c = ss.make_smoothing_spline(*noisy(20000), 'so:3', 0.0001)", "c.band(np.linspace(0, 200, 3000000))"),
    "cov": ("c = estimated()", "c.cov(np.linspace(0, 2999, 6000000))"),
    "cov of pairs": ("c = estimated()", "c.cov(np.linspace(0, 2999, 2000), np.linspace(0, 2999, 2000))"),
    "sample": ("c = estimated(20000, 20, 2000)", "c.sample(rng(), 3000)"),
    "estimate": ("m = gyroscope(40000)", "ss.estimate(m, 4000, 'so:3')"),
    "estimate auto": ("m = gyroscope(20000)", "ss.estimate(m, 'auto', 'so:3')"),
    "estimate constants": ("call = many_constants()", "call()"),
    "GridSpline": ("p = grid(1500)", "ss.GridSpline((None, None), p, 'so:3')"),
    "GridSpline.grid": (
        "g = ss.GridSpline((None, None), grid(100), 'so:3')",
        "g.grid(np.linspace(0, 99, 3000), np.linspace(0, 99, 3000))",
    ),
    "GridSpline scattered": (
        "g = ss.GridSpline((None, None), grid(100), 'so:3'); x = rng().uniform(0, 99, (1000000, 2))",
        "g(x)",
    ),
    "make_smoothing_grid": ("p = grid(300)", "ss.make_smoothing_grid((None, None), p, 'so:3')"),
    "make_smoothing_grid quotient": (
        "p = grid(150); q = ss.Quotient('so:3', '432')",
        "ss.make_smoothing_grid((None, None), p, q)",
    ),
    "make_smoothing_grid r:3": ("p = grid(1000, 'r:3')", "ss.make_smoothing_grid((None, None), p, 'r:3')"),
    "mean": ("p = walk('so:3', 2000000)", "while True: ss.space('so:3').mean(p)"),
    "mean of many sets": (
        "p = walk('spd:3', 1000000).reshape(100000, 10, 3, 3)",
        "while True: ss.space('spd:3').mean(p)",
    ),
    "mean of angles": ("p = rng().uniform(-3, 3, (2000000, 1))", "while True: ss.space('torus:1').mean(p)"),
    "mean of large matrices": ("p = walk('spd:60', 500)", "while True: ss.space('spd:60').mean(p)"),
    "median": ("p = walk('so:3', 1000000)", "while True: ss.space('so:3').median(p)"),
    "tangent_pca": ("p = walk('spd:30', 3000)", "while True: ss.tangent_pca(p, 'spd:30')"),
    "unwrap": ("p = walk('so:3', 1000000); q = ss.Quotient('so:3', '432')", "while True: q.unwrap(p)"),
    "distance in a quotient": (
        "p = walk('so:3', 1000000); q = ss.Quotient('so:3', '432')",
        "while True: q.distance(p, p[::-1])",
    ),
    "log": ("p = walk('spd:3', 4000000)", "while True: ss.space('spd:3').log(p, p[::-1])"),
    "project": ("p = walk('so:3', 4000000)", "while True: ss.space('so:3').project(p)"),
    "random_point": ("", "while True: ss.space('so:3').random_point(rng(), 1000000)"),
    "integrate": ("w = rng().standard_normal((3000000, 3))", "while True: ss.rotations.integrate(None, w)"),
    "from_quaternions": (
        "q = walk('sphere:3', 10000000)",
        "while True: ss.rotations.from_quaternions(q, scalar_first=True)",
    ),
    "geo.resample": ("d = table_of_tracks(500000)", "ss.geo.resample(d, '1min', time='time', by='by', max_gap='1h')"),
    "read_tum": ("f = written(1000000)", "ss.poses.read_tum(f)"),
    "save": (
        "c = {str(i): spline('so:3', 100) for i in range(20000)}",
        "ss.save(c, Path(tempfile.mkdtemp()) / 'a.npz')",
    ),
}


def latency(name: str) -> float | None:
    """Return the seconds from the signal to the exception; None if the call ended before the signal."""
    data, call = CALLS[name]
    names = dict(globals())
    exec(data, names)
    signal.setitimer(signal.ITIMER_REAL, AFTER)
    start = time.monotonic()
    try:
        exec(call, names)
    except KeyboardInterrupt:
        return time.monotonic() - start - AFTER
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
    return None if time.monotonic() - start < AFTER else np.inf


def main(part: str) -> int:
    """Print one row per call, and return 1 if one of them ends late."""
    signal.signal(signal.SIGALRM, signal.default_int_handler)
    warnings.simplefilter("ignore")
    late = False
    for name in CALLS:
        if part in name:
            seconds = latency(name)
            late |= seconds is not None and seconds > LIMIT
            print(f"{name:32s}", "ended before the signal" if seconds is None else f"{seconds:6.2f} s", flush=True)
            for function in (walk, spline, smooth_curve, estimated):
                function.cache_clear()
    return int(late)


if __name__ == "__main__":
    raise SystemExit(main(sys.argv[1] if len(sys.argv) > 1 else ""))
