"""Measure how accurate estimated curves are, and compare with the goals: the tables of ``estimation.md``.

python docs/estimation.py [--write] [PART ...]

About ten minutes on one core. The parts are fusion, lam, jerk, rotations, imu, coverage, poses, outliers, time. All
data are synthetic, with seeds that were not used to develop the method: 100 and above, for the IMU 200 and above.
"""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from comparisons.page import insert, parser, table, versions
from numpy.typing import NDArray
from scipy.stats import chi2

import symspline as ss

Array = NDArray[np.float64]

PAGE = Path(__file__).parent / "estimation.md"
FIRST = 100
"""The first seed."""
SO3 = ss.SpecialOrthogonal(3)
BIAS = np.array([0.03, -0.02, 0.05])
ROTATION = 0.4
"""The rate of the slowest sine of the rotations with 501 attitudes."""
GRAVITY = np.array([0.0, 0.0, -9.80665])


def seeds(count: int) -> range:
    return range(FIRST, FIRST + count)


def rms(x: Any) -> float:
    """Root mean square of distances, or of the lengths of vectors."""
    array = np.asarray(x)
    return float(np.sqrt(np.mean(array**2 if array.ndim == 1 else np.sum(array**2, axis=-1))))


# ---- motions ----


def turning(end: float, rng: np.random.Generator, rate: float = 0.5) -> ss.CubicSpline:
    """A rotation whose rotation vector is a sum of sines with random phases."""
    t = np.linspace(0, end, 40 * round(end) + 1)
    v = np.zeros((len(t), 3))
    for k in (1, 2, 3):
        v += np.array([0.8, 0.6, 0.4]) / k * np.sin(rate * k * t[:, None] + rng.uniform(0, 2 * np.pi, 3))
    return ss.CubicSpline(t, ss.rotations.from_rotation_vectors(v), SO3, bc_type="not-a-knot")


def moving(end: float, rng: np.random.Generator) -> ss.CubicSpline:
    """A path of some ten metres: sums of sines with random rates and phases."""
    t = np.linspace(0, end, 40 * round(end) + 1)
    rate, phase = rng.uniform(0.15, 0.6, (3, 3, 1)), rng.uniform(0, 2 * np.pi, (3, 3, 1))
    size = rng.uniform(2, 20, (3, 3, 1))
    return ss.CubicSpline(t, (size * np.sin(rate * t + phase)).sum(axis=0).T, "r:3", bc_type="not-a-knot")


def wander(space: ss.Space, rng: np.random.Generator, steps: int = 6, step: float = 0.6) -> ss.CubicSpline:
    """A C² curve through random points that are a step apart, from time 0 to 10."""
    points = [space.random_point(rng)]
    for _ in range(steps):
        v = space.random_tangent(rng, points[-1])
        size = np.sqrt(np.sum(v**2)) if isinstance(space, ss.SpecialEuclidean) else space.norm(points[-1], v)
        points.append(space.exp(points[-1], step * v / size))
    return ss.CubicSpline(np.linspace(0, 10, steps + 1), np.array(points), space, bc_type="not-a-knot")


def turned(rng: np.random.Generator, attitudes: Array, sigma: float) -> Array:
    """Rotations with noise of a standard deviation about each axis of the body."""
    noise = ss.rotations.from_rotation_vectors(sigma * rng.standard_normal((len(attitudes), 3)))
    return np.asarray(attitudes @ noise)


# ---- attitudes and rates ----


class Gyro(NamedTuple):
    """Attitudes at times t and angular velocities at times s."""

    truth: ss.CubicSpline
    t: Array
    seen: Array
    s: Array
    omega: Array

    def terms(self) -> list[ss.measure.Measurement]:
        bias = ss.measure.Constant(3)
        return [
            ss.measure.Points(self.t, self.seen, sigma=0.05),
            ss.measure.BodyRates(self.s, self.omega, sigma=0.02, bias=bias),
        ]


def gyro(seed: int, end: float = 20.0, attitudes: int = 101, rates: int = 1001) -> Gyro:
    """Attitudes with 0.05 rad of noise, and rates with 0.02 rad/s and a bias.

    The motion is as fast as that of the study in which the method was designed: on seeds 0 to 9, attitudes alone yield
    errors of 0.033 rad and 0.042 rad/s.
    """
    rng = np.random.default_rng(seed)
    truth = turning(end, rng, 0.28)
    t, s = np.linspace(0, end, attitudes), np.linspace(0, end, rates)
    omega = ss.rotations.angular_velocity(truth, s) + BIAS + 0.02 * rng.standard_normal((rates, 3))
    return Gyro(truth, t, turned(rng, truth(t), 0.05), s, omega)


def off(curve: ss.Curve[Any], truth: ss.CubicSpline, x: Array) -> tuple[float, float]:
    """Errors of the angle and of the angular velocity."""
    found = [ss.rotations.angular_velocity(own, x) for own in (curve, truth)]
    return rms(SO3.distance(curve(x), truth(x))), rms(found[0] - found[1])


def fusion_table(count: int = 20) -> str:
    """Errors of curves from attitudes only, and from attitudes and rates together."""
    found: dict[str, list[list[float]]] = {}
    x = np.linspace(0, 20, 2001)
    for seed in seeds(count):
        data = gyro(seed)
        knots = np.linspace(0, 20, 81)
        plain = ss.make_smoothing_spline(data.t, data.seen, SO3, knots=knots)
        found.setdefault("attitudes only, GCV", []).append(
            [*off(plain, data.truth, x), np.nan, np.nan, plain.report.iterations]
        )
        for penalty in ("acceleration", "jerk"):
            curve = ss.estimate(data.terms(), knots, SO3, penalty=penalty)
            bias = curve.parameters["gyro bias"]
            error = bias.value - BIAS
            cells = [rms(error[None]), float(np.max(np.abs(error) / bias.std)), curve.report.iterations]
            found.setdefault(f"fused, {penalty}", []).append([*off(curve, data.truth, x), *cells])
    rows = []
    for name, each in found.items():
        angle, rate, bias_error, ratio, iterations = np.array(each).T
        rows.append(
            [
                name,
                f"{rms(angle):.4f}",
                f"{rms(rate):.4f}",
                f"{rms(bias_error):.4f}" if np.isfinite(bias_error).all() else "–",
                f"{ratio.max():.1f}" if np.isfinite(ratio).all() else "–",
                f"{np.median(iterations):.0f} (≤ {iterations.max():.0f})",
            ]
        )
    head = [
        "",
        "angle, rad",
        "rate, rad/s",
        "bias, rad/s",
        "largest error of a bias, in its std",
        "iterations",
    ]
    return table(head, rows)


def lam_table(count: int = 8) -> str:
    """Iterations from a cold start over λ."""
    rows = []
    for penalty in ("acceleration", "jerk"):
        chosen = [ss.estimate(gyro(seed).terms(), 81, SO3, penalty=penalty) for seed in seeds(count)]
        row: list[object] = [penalty]
        for factor in (1e-2, 1e-1, 1.0, 1e1, 1e2):
            default, tight = [], []
            for seed, curve in zip(seeds(count), chosen, strict=True):
                for tol, into in ((1e-3, default), (1e-9, tight)):
                    lam = float(curve.lam) * factor
                    again = ss.estimate(
                        gyro(seed).terms(), 81, SO3, penalty=penalty, lam=lam, tol=tol, on_failure="ignore"
                    )
                    into.append(again.report.iterations if again.report.converged else np.inf)
            row.append(f"≤ {max(default)}, ≤ {max(tight)}")
        rows.append(row)
    return table(["penalty", "λ/λ̂ = 0.01", "0.1", "1", "10", "100"], rows)


# ---- the penalty on the jerk ----


def sway(rng: np.random.Generator) -> tuple[Callable[[Array], Array], Callable[[Array], Array]]:
    """A smooth path in the plane and its acceleration: three sines per coordinate."""
    size = rng.uniform(0.3, 1.0, (3, 2))
    rate, phase = rng.uniform(0.425, 2.125, (3, 2)), rng.uniform(0, 2 * np.pi, (3, 2))

    def path(t: Array) -> Array:
        return np.asarray((size * np.sin(rate * t[:, None, None] + phase)).sum(axis=1))

    def acceleration(t: Array) -> Array:
        return np.asarray((-(rate**2) * size * np.sin(rate * t[:, None, None] + phase)).sum(axis=1))

    return path, acceleration


def jerk_table(count: int = 8) -> str:
    """Errors per coordinate of smoothed positions and accelerations in the plane."""
    t = np.linspace(0, 10, 1001)
    away = np.minimum(t, 10 - t)
    regions = t[away >= 1], t[away >= 0.1], t[away < 0.1]
    rows = []
    for penalty, words in (("acceleration", "acceleration, natural ends"), ("jerk", "jerk, free ends")):
        found = []
        for seed in seeds(count):
            rng = np.random.default_rng(seed)
            path, acceleration = sway(rng)
            y = path(t) + 0.005 * rng.standard_normal((len(t), 2))
            curve = ss.make_smoothing_spline(t, y, "r:2", penalty=penalty, knots=np.linspace(0, 10, 81))
            errors = [rms(curve(x, nu=2) - acceleration(x)) / np.sqrt(2) for x in regions]
            found.append([1e3 * rms(curve(t) - path(t)) / np.sqrt(2), *errors, float(curve.df)])
        position, *regional, df = np.array(found).T
        errors = [f"{rms(own):.3f}" for own in regional]
        rows.append([words, f"{rms(position):.2f}", *errors, f"{np.mean(df):.0f}"])
    head = [
        "penalty",
        "position, mm",
        "acceleration, m/s², 1 s or more from the ends",
        "0.1 s or more",
        "less than 0.1 s",
        "degrees of freedom",
    ]
    return table(head, rows)


def rotations_table(count: int = 8) -> str:
    """Errors of smoothed attitudes and angular accelerations."""
    t, x = np.linspace(0, 10, 501), np.linspace(0.1, 9.9, 981)
    rows = []
    for penalty in ("acceleration", "jerk"):
        for words in ("GCV", "best λ*"):
            found = []
            for seed in seeds(count):
                rng = np.random.default_rng(seed)
                truth = turning(10, rng, ROTATION)
                seen, knots = turned(rng, truth(t), 0.01), np.linspace(0, 10, 61)
                curve = ss.make_smoothing_spline(t, seen, SO3, penalty=penalty, knots=knots)
                exact = ss.rotations.angular_acceleration(truth, x)

                def errors(own: Any, truth: Any = truth, exact: Array = exact) -> list[float]:
                    change = ss.rotations.angular_acceleration(own, x) - exact
                    inner = rms(change[(x >= 0.5) & (x <= 9.5)])
                    angle = 1e3 * rms(SO3.distance(own(t), truth(t)))
                    return [angle, inner, rms(change), own.report.iterations]

                tried = [errors(curve)]
                if words == "best λ*":
                    lams = float(curve.lam) * 2.0 ** np.arange(-5, 6)
                    tried += [
                        errors(
                            ss.make_smoothing_spline(t, seen, SO3, float(lam), penalty=penalty, knots=knots)
                        )
                        for lam in lams
                    ]
                found.append(min(tried))
            angle, inner, change, iterations = np.array(found).T
            many = f"{np.median(iterations):.0f} (≤ {iterations.max():.0f})"
            cells = [f"{rms(angle):.2f}", f"{rms(inner):.3f}", f"{rms(change):.3f}", many]
            rows.append([f"{penalty}, {words}", *cells])
    head = [
        "penalty",
        "angle, mrad",
        "angular acceleration, rad/s², 0.5 s or more from the ends",
        "0.1 s or more",
        "iterations",
    ]
    return table(head, rows)


# ---- an IMU ----


IMU_SEEDS = range(200, 240)


def imu_table(seeds: Sequence[int] = IMU_SEEDS, end: float = 60.0) -> str:
    """How often the errors of the biases are within three standard deviations, and the errors of the motion."""
    columns = [_imu_column(seeds, end, criterion) for criterion in ("gcv", "reml")]
    return table(["", "GCV", "REML"], [[name, *(own[name] for own in columns)] for name in columns[0]])


def _imu_column(seeds: Sequence[int], end: float, criterion: Any) -> dict[str, str]:
    failed, ratios, spent = 0, [], []
    motions: list[list[float]] = []
    for seed in seeds:
        rng = np.random.default_rng(seed)
        turn, path = turning(end, rng, 0.4), moving(end, rng)
        s, g = np.linspace(0, end, round(200 * end) + 1), np.linspace(0, end, round(10 * end) + 1)
        biases = {
            "gyro bias": 0.05 * rng.standard_normal(3),
            "accelerometer bias": 0.2 * rng.standard_normal(3),
        }
        omega = ss.rotations.angular_velocity(turn, s) + biases["gyro bias"]
        force = np.einsum("nij,ni->nj", turn(s), path(s, nu=2) - GRAVITY) + biases["accelerometer bias"]
        omega += 0.01 * rng.standard_normal(omega.shape)
        force += 0.1 * rng.standard_normal(force.shape)
        y = path(g) + 0.3 * rng.standard_normal((len(g), 3))
        terms = [
            ss.measure.Points(g, y, sigma=0.3, factor=1),
            ss.measure.BodyRates(s, omega, sigma=0.01, bias=ss.measure.Constant(3)),
            ss.measure.SpecificForce(s, force, sigma=0.1, bias=ss.measure.Constant(3)),
        ]
        begin = time.process_time()
        knots = np.linspace(0, end, round(5 * end) + 1)
        curve = ss.estimate(
            terms, knots, "so:3 x r:3", penalty="jerk", criterion=criterion, on_failure="ignore"
        )
        if not curve.report[0].converged:
            failed += 1
            continue
        spent.append(time.process_time() - begin)
        found = [(curve.parameters[name], true) for name, true in biases.items()]
        ratios.append(np.concatenate([(own.value - true) / own.std for own, true in found]))
        attitudes, positions = curve(g)
        errors = [rms(positions - path(g)), rms(SO3.distance(attitudes, turn(g)))]
        motions.append([*errors, *(float(own.std.mean()) for own, _ in found), curve.report[0].iterations])
    position, angle, first, second, iterations = np.array(motions).T
    inside = np.abs(ratios) <= 3
    return {
        "recordings that converge": f"{len(seeds) - failed} of {len(seeds)}",
        "recordings with both biases within three standard deviations": f"{inside.all(axis=1).sum()} of {len(seeds)}",
        "components of the biases within three standard deviations": f"{inside.mean():.3f}",
        "rms of error over standard deviation": f"{np.sqrt(np.mean(np.square(ratios))):.2f}",
        "mean standard deviation of the gyro bias": f"{1e3 * first.mean():.2f} mrad/s",
        "mean standard deviation of the accelerometer bias": f"{1e3 * second.mean():.1f} mm/s²",
        "position error": f"{1e2 * rms(position):.1f} cm",
        "attitude error": f"{1e3 * rms(angle):.1f} mrad",
        "iterations": f"{np.median(iterations):.0f} (≤ {iterations.max():.0f})",
        "median time": f"{np.median(spent):.1f} s",
    }


# ---- covariances ----


def ellipsoids(curve: Any, truth: Any, x: Array, spaces: Sequence[ss.Space]) -> list[Array]:
    """For every part, whether the true points lie in the ellipsoids of 95 % at times x."""
    several = len(spaces) > 1
    covs, frames = (own if several else (own,) for own in (curve.cov(x), curve.frames(x)))
    found = []
    for space, cov, frame, p, q in zip(
        spaces, covs, frames, curve_parts(curve, x), curve_parts(truth, x), strict=True
    ):
        vectors = space.log(p, q)
        e = np.asarray(space.inner(p[:, None], frame, np.broadcast_to(vectors[:, None], frame.shape)))
        squares = np.einsum("ni,nij,nj->n", e, np.linalg.inv(cov), e)
        found.append(squares <= chi2.ppf(0.95, space.dim))
    return found


def curve_parts(curve: Any, x: Array) -> list[Array]:
    points = curve(x)
    if isinstance(curve.space, ss.SpecialEuclidean):
        return list(ss.poses.split(points))
    return list(points) if isinstance(points, tuple) else [points]


COVERED = {"S²": "sphere:2", "SO(3)": "so:3", "SPD(3)": "spd:3", "SE(3), attitude": "se:3"}


def coverage_table(count: int = 40, sigma: float = 0.05) -> str:
    """Share of the true points in the ellipsoids of 95 %: all, and without the first and the last tenth."""
    rows = []
    for words, name in COVERED.items():
        space = ss.space(name)
        poses = isinstance(space, ss.SpecialEuclidean)
        spaces = [SO3, ss.Euclidean(3)] if poses else [space]
        names = ["SE(3), attitude", "SE(3), position"] if poses else [words]
        cells: list[list[str]] = [[] for _ in spaces]
        for kind in ("points", "points and velocities"):
            for penalty in ("acceleration", "jerk"):
                all_of: list[list[Array]] = []
                x = np.linspace(0, 10, 101)
                for seed in seeds(count):
                    rng = np.random.default_rng(seed)
                    truth = wander(space, rng)
                    t = np.sort(rng.uniform(0, 10, 100))
                    t[[0, -1]] = 0, 10
                    if poses:
                        r, p = ss.poses.split(truth(t))
                        y = ss.poses.join(turned(rng, r, sigma), p + sigma * rng.standard_normal(p.shape))
                    else:
                        y = space.exp(truth(t), sigma * space.random_tangent(rng, truth(t)))
                    given: list[ss.measure.Measurement] = [ss.measure.Points(t, y, sigma=sigma)]
                    if kind != "points":
                        if poses:
                            w, v = pose_rates(truth, t)
                            given += [
                                ss.measure.Function(
                                    t,
                                    pose_residual(
                                        w + sigma * rng.standard_normal(w.shape),
                                        v + sigma * rng.standard_normal(v.shape),
                                    ),
                                    sigma=sigma,
                                    nu=1,
                                )
                            ]
                        else:
                            v = space.transport(truth(t), y, truth(t, nu=1)) + sigma * space.random_tangent(
                                rng, y
                            )
                            given.append(ss.measure.Velocities(t, y, v, sigma=sigma))
                    curve = ss.estimate(given, np.linspace(0, 10, 61), space, penalty=penalty)
                    all_of.append(ellipsoids(curve, truth, x, spaces))
                for i in range(len(spaces)):
                    hit = np.array([own[i] for own in all_of])
                    cells[i].append(f"{hit.mean():.3f}, {hit[:, 10:-10].mean():.3f}")
        rows += [[own, *cell] for own, cell in zip(names, cells, strict=True)]
    head = [
        "space",
        "points, acceleration",
        "points, jerk",
        "with velocities, acceleration",
        "with velocities, jerk",
    ]
    return table(head, rows)


def pose_rates(truth: Any, t: Array) -> tuple[Array, Array]:
    """Angular velocities in the body, and velocities of the position."""
    poses, change = truth(t), truth(t, nu=1)
    return body_rates(poses, change), np.asarray(change[:, :3, 3])


def body_rates(poses: Array, change: Array) -> Array:
    spin = np.swapaxes(poses[:, :3, :3], -1, -2) @ change[:, :3, :3]
    return np.stack([spin[:, 2, 1], spin[:, 0, 2], spin[:, 1, 0]], axis=-1)


def pose_residual(w: Array, v: Array) -> Callable[[Array, Array], Array]:
    def residual(poses: Array, change: Array) -> Array:
        return np.concatenate([body_rates(poses, change) - w, change[:, :3, 3] - v], axis=-1)

    return residual


# ---- poses ----


def poses_table(count: int = 6) -> str:
    """Errors on ``se:3`` and on the product, for drives along x = (v t, 3 sin 0.2 t, 0)."""
    rows = []
    t = np.linspace(0, 180, 1800)
    s = np.linspace(0, 180, 3600)
    for speed in (0.1, 0.5, 5.0):
        for kind in ("poses", "poses and rates"):
            found: dict[str, list[list[float]]] = {"se:3": [], "so:3 x r:3": []}
            for seed in seeds(count):
                rng = np.random.default_rng(seed)
                p, r, _ = drive(t, speed)
                _, _, omega = drive(s, speed)
                y, seen = p + 0.005 * rng.standard_normal(p.shape), turned(rng, r, 0.005)
                gyro = omega + 0.01 * rng.standard_normal(omega.shape)
                for name in found:
                    points = ss.poses.join(seen, y) if name == "se:3" else (seen, y)
                    given: list[ss.measure.Measurement] = [ss.measure.Points(t, points, sigma=0.005)]
                    if kind != "poses":
                        given.append(ss.measure.BodyRates(s, gyro, sigma=0.01, bias=ss.measure.Constant(3)))
                    curve = ss.estimate(given, 400, name, penalty="acceleration")
                    attitudes, positions = curve_parts(curve, t)
                    found[name].append([1e3 * rms(SO3.distance(attitudes, r)), 1e3 * rms(positions - p)])
            cells = [np.sqrt(np.mean(np.square(each), axis=0)) for each in found.values()]
            rows.append(
                [
                    f"{180 * speed:g} m, {kind}",
                    *(f"{own[0]:.2f} mrad, {own[1]:.2f} mm" for own in cells),
                    ", ".join(f"{x:.3f}" for x in cells[0] / cells[1]),
                ]
            )
    return table(["drive", "`se:3`", "`so:3 x r:3`", "ratios"], rows)


def drive(t: Array, speed: float) -> tuple[Array, Array, Array]:
    """Positions, attitudes and angular velocities of a car that looks where it goes."""
    p = np.stack([speed * t, 3 * np.sin(0.2 * t), 0 * t], axis=-1)
    v = 0.6 * np.cos(0.2 * t)
    heading, turn = np.arctan2(v, speed), -0.12 * np.sin(0.2 * t) * speed / (speed**2 + v**2)
    up = np.array([0.0, 0.0, 1.0])
    return p, ss.rotations.from_rotation_vectors(heading[:, None] * up), turn[:, None] * up


# ---- outliers ----


def outlier_table(count: int = 60) -> str:
    """How many curves converge, and errors over those of linear loss on the same data without outliers."""
    x = np.linspace(0, 10, 501)
    rows = []
    for words in ("points", "points and velocities"):
        for share in (0.0, 0.15):
            for loss in ("huber", "cauchy"):
                ratios, failed = [], 0
                for seed in seeds(count):
                    rng = np.random.default_rng(seed)
                    path, _ = sway(rng)
                    t = np.sort(rng.uniform(0, 10, 150))
                    clean = path(t) + 0.05 * rng.standard_normal((150, 2))
                    bad = rng.random(150) < share
                    dirty = clean + bad[:, None] * rng.standard_normal((150, 2))
                    v = (path(t + 1e-4) - path(t - 1e-4)) / 2e-4 + 0.1 * rng.standard_normal((150, 2))

                    def fit(y: Array, loss: str, t: Array = t, v: Array = v, words: str = words) -> Any:
                        if words == "points":
                            return ss.make_smoothing_spline(t, y, "r:2", loss=loss, on_failure="ignore")
                        given = [
                            ss.measure.Points(t, y, sigma=0.05, loss=loss),
                            ss.measure.Velocities(t, y, v, sigma=0.1),
                        ]
                        return ss.estimate(given, 60, "r:2", on_failure="ignore")

                    inside = x[(x >= t[0]) & (x <= t[-1])]
                    best, robust = fit(clean, "linear"), fit(dirty, loss)
                    failed += not robust.report.converged
                    ratios.append(rms(robust(inside) - path(inside)) / rms(best(inside) - path(inside)))
                rows.append(
                    [
                        f"{words}, {100 * share:.0f} %",
                        loss,
                        f"{count - failed} of {count}",
                        f"{np.median(ratios):.2f}",
                        f"{np.max(ratios):.2f}",
                    ]
                )
    return table(["data, outliers", "loss", "converged", "median error", "largest error"], rows)


# ---- time ----


def time_table(repeats: int = 3) -> str:
    """Seconds of processor time, the least of some calls, and the numbers of knots and iterations."""
    rows = []
    for end, attitudes, rates in (
        (20.0, 101, 1001),
        (200.0, 1001, 10_001),
        (200.0, 10_000, 100_000),
        (2000.0, 10_000, 100_000),
    ):
        data = gyro(FIRST, end, attitudes, rates)
        row: list[object] = [f"{attitudes}, {rates}, {end:g} s"]
        for knots in (round(2 * end), round(4 * end), "auto"):
            best, count, number = np.inf, 0, 0
            for _ in range(1 if knots == "auto" and rates > 50_000 else repeats):
                begin = time.process_time()
                curve = ss.estimate(data.terms(), knots, SO3)
                best = min(best, time.process_time() - begin)
                count, number = curve.report.iterations, len(curve.t)
            row.append(f"{best:.2f} s ({number}, {count})")
        rows.append(row)
    return table(
        ["attitudes, rates, length", "2 knots per second", "4 knots per second", "automatic knots"], rows
    )


PARTS: dict[str, Callable[[], str]] = {
    "fusion": fusion_table,
    "lam": lam_table,
    "jerk": jerk_table,
    "rotations": rotations_table,
    "imu": imu_table,
    "coverage": coverage_table,
    "poses": poses_table,
    "outliers": outlier_table,
    "time": lambda: f"{time_table()}\n\n{versions('symspline', 'numpy')}",
}


def main() -> None:
    arguments = parser(__doc__)
    arguments.add_argument("parts", nargs="*", metavar="PART", help="tables to make; all by default")
    asked = arguments.parse_args()
    ss.set_num_threads(1)
    warnings.simplefilter("ignore", ss.SmoothingWarning)
    for part in asked.parts or PARTS:
        begin = time.perf_counter()
        text = PARTS[part]()
        print(f"{part}, {time.perf_counter() - begin:.0f} s\n\n{text}\n", flush=True)
        if asked.write:
            insert(part, text, PAGE)


if __name__ == "__main__":
    main()
