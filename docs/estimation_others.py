"""Compare `estimate` with Kalman smoothers and GTSAM on attitudes and rates of a gyroscope with an unknown bias.

python docs/estimation_others.py [--write]

All methods receive the same data, and run on one core in one process. The Kalman smoothers are part of this file. GTSAM
is used if it is installed (``pip install gtsam``).
"""

from __future__ import annotations

import importlib
import time
from collections.abc import Callable
from typing import Any, NamedTuple

import estimation
import numpy as np
from comparisons.page import insert, parser, table
from estimation import BIAS, SO3, Array, Gyro, rms

import symspline as ss

SEEDS = range(300, 310)
STRENGTHS = 2.0 ** np.arange(-12, 5)
"""Factors by which the strength of the process noise is varied."""


class Found(NamedTuple):
    """What a method estimates: attitudes at the times of the attitudes, rates at those of the gyro, and the bias."""

    attitudes: Array
    rates: Array | None
    bias: Array | None
    std: Array | None = None


# ---- Kalman smoothers ----


def exp(v: Array) -> Array:
    """The rotation matrix of a rotation vector, by Rodrigues' formula."""
    angle = float(np.sqrt(v @ v))
    k = hat(v)
    if angle < 1e-6:
        return np.eye(3) + k + 0.5 * k @ k
    return np.eye(3) + np.sin(angle) / angle * k + (1 - np.cos(angle)) / angle**2 * k @ k


def vee(r: Array) -> Array:
    """The rotation vector of one matrix that is not near half a turn."""
    v = np.array([r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1]])
    sine, cosine = 0.5 * float(np.sqrt(v @ v)), 0.5 * (float(np.trace(r)) - 1)
    return 0.5 * v * (np.arctan2(sine, cosine) / sine if sine > 1e-9 else 1.0)


def hat(v: Array) -> Array:
    return np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])


def mekf(data: Gyro) -> Found:
    """Multiplicative extended Kalman filter with a Rauch-Tung-Striebel smoother; the gyro drives the propagation.

    The state is the attitude error in the body and the bias, as in Lefferts, Markley and Shuster (1982). The rate
    between two samples is their mean.
    """
    times = data.s
    at = {int(np.argmin(np.abs(times - t))): k for k, t in enumerate(data.t)}
    r, b, cov = data.seen[0], np.zeros(3), np.diag([0.05**2] * 3 + [1.0] * 3)
    states, predicted = [(r, b, cov)], []
    for i in range(1, len(times)):
        h = times[i] - times[i - 1]
        step = (0.5 * (data.omega[i] + data.omega[i - 1]) - b) * h
        turn = exp(step)
        f = np.eye(6)
        f[:3, :3], f[:3, 3:] = turn.T, -h * np.eye(3)
        q = np.diag([(0.02 * h) ** 2] * 3 + [0.0] * 3)
        r, cov = r @ turn, f @ cov @ f.T + q
        predicted.append((r, b, cov, f))
        if i in at:
            gain = cov[:, :3] @ np.linalg.inv(cov[:3, :3] + 0.05**2 * np.eye(3))
            move = gain @ vee(r.T @ data.seen[at[i]])
            r, b, cov = r @ exp(move[:3]), b + move[3:], cov - gain @ cov[:3, :]
        states.append((r, b, cov))
    smooth = [states[-1]]
    for (r, b, cov), (ahead, bias, spread, f) in zip(states[-2::-1], predicted[::-1], strict=True):
        later, last, known = smooth[-1]
        gain = np.linalg.solve(spread, f @ cov).T
        move = gain @ np.concatenate([vee(ahead.T @ later), last - bias])
        smooth.append((r @ exp(move[:3]), b + move[3:], cov + gain @ (known - spread) @ gain.T))
    smooth.reverse()
    bias = smooth[0][1]
    std = np.sqrt(np.diag(smooth[0][2])[3:])
    return Found(np.array([smooth[i][0] for i in at]), data.omega - bias, bias, std)


def wnoa(data: Gyro, strength: float, gyro: bool = True) -> Found:
    """Kalman smoother with white noise on the angular acceleration; attitudes and rates are measurements.

    The state is the attitude error, the angular velocity and the bias. The prior is that of ``penalty="acceleration"``.
    """
    times = data.s if gyro else data.t
    at = {int(np.argmin(np.abs(times - t))): k for k, t in enumerate(data.t)}
    size = 9
    x = (data.seen[0], np.zeros(3), np.zeros(3))
    cov = np.diag([1.0] * 3 + [1.0] * 3 + [1.0 if gyro else 1e-12] * 3)
    states, predicted = [], []
    for i, t in enumerate(times):
        r, w, b = x
        if i:
            h = t - times[i - 1]
            turn = exp(w * h)
            f = np.eye(size)
            f[:3, :3], f[:3, 3:6] = turn.T, h * np.eye(3)
            q = np.zeros((size, size))
            for j in range(3):
                q[np.ix_([j, 3 + j], [j, 3 + j])] = strength * np.array([[h**3 / 3, h**2 / 2], [h**2 / 2, h]])
            r, cov = r @ turn, f @ cov @ f.T + q
            predicted.append(((r, w, b), cov, f))
        rows, residual, noise = [], [], []
        if i in at:
            rows.append(np.eye(size)[:3])
            residual.append(vee(r.T @ data.seen[at[i]]))
            noise += [0.05**2] * 3
        if gyro:
            rows.append(np.eye(size)[3:6] + np.eye(size)[6:])
            residual.append(data.omega[i] - w - b)
            noise += [0.02**2] * 3
        h_matrix = np.concatenate(rows)
        gain = np.linalg.solve(h_matrix @ cov @ h_matrix.T + np.diag(noise), h_matrix @ cov).T
        move = gain @ np.concatenate(residual)
        x, cov = (r @ exp(move[:3]), w + move[3:6], b + move[6:]), cov - gain @ h_matrix @ cov
        states.append((x, cov))
    smooth = [states[-1]]
    for ((r, w, b), cov), ((ahead, speed, bias), spread, f) in zip(
        states[-2::-1], predicted[::-1], strict=True
    ):
        (later, fast, last), known = smooth[-1]
        gain = np.linalg.solve(spread, f @ cov).T
        move = gain @ np.concatenate([vee(ahead.T @ later), fast - speed, last - bias])
        smooth.append(
            ((r @ exp(move[:3]), w + move[3:6], b + move[6:]), cov + gain @ (known - spread) @ gain.T)
        )
    smooth.reverse()
    attitudes = np.array([smooth[i][0][0] for i in at])
    rates = np.array([own[0][1] for own in smooth])
    if not gyro:
        return Found(attitudes, None, None)
    return Found(attitudes, rates, smooth[0][0][2], np.sqrt(np.diag(smooth[0][1])[6:]))


# ---- GTSAM ----


def gtsam_ahrs(gtsam: Any, data: Gyro) -> Found:
    """Preintegrated rates between the attitudes, a constant bias, and Levenberg-Marquardt.

    `AHRSFactor` is GTSAM's factor for a gyroscope with bias. The covariance of the gyro is that of continuous noise.
    """
    params = gtsam.PreintegratedRotationParams()
    step = float(data.s[1] - data.s[0])
    params.setGyroscopeCovariance(0.02**2 * step * np.eye(3))
    graph, start = gtsam.NonlinearFactorGraph(), gtsam.Values()
    seen = gtsam.noiseModel.Isotropic.Sigma(3, 0.05)
    bias = len(data.t)
    start.insert(bias, np.zeros(3))
    near = np.searchsorted(data.s, data.t - 1e-9)
    for k, r in enumerate(data.seen):
        graph.add(gtsam.PriorFactorRot3(k, gtsam.Rot3(r), seen))
        start.insert(k, gtsam.Rot3(r))
        if k:
            between = gtsam.PreintegratedAhrsMeasurements(params)
            for i in range(near[k - 1], near[k]):
                between.integrateMeasurement(
                    0.5 * (data.omega[i] + data.omega[i + 1]), data.s[i + 1] - data.s[i]
                )
            graph.add(gtsam.AHRSFactor(k - 1, k, bias, between))
    found = gtsam.LevenbergMarquardtOptimizer(graph, start).optimize()
    std = np.sqrt(np.diag(gtsam.Marginals(graph, found).marginalCovariance(bias)))
    attitudes = np.array([found.atRot3(k).matrix() for k in range(len(data.t))])
    value = np.asarray(found.atVector(bias))
    return Found(attitudes, data.omega - value, value, std)


def gtsam_wnoa(gtsam: Any, data: Gyro, strength: float) -> Found:
    """Attitudes only, with GTSAM's continuous-time Gaussian process.

    Its wheel has this process for poses and not for rotations, so that all positions are zero.
    """
    graph, start = gtsam.NonlinearFactorGraph(), gtsam.Values()
    seen = gtsam.noiseModel.Diagonal.Sigmas(np.array([0.05] * 3 + [1e-3] * 3))
    n = len(data.t)
    density = np.array([strength] * 3 + [1e-6] * 3)
    for k, r in enumerate(data.seen):
        pose = gtsam.Pose3(gtsam.Rot3(r), np.zeros(3))
        graph.add(gtsam.PriorFactorPose3(k, pose, seen))
        start.insert(k, pose)
        start.insert(n + k, np.zeros(6))
        if k:
            ends = [gtsam.StateData(i, n + i, float(data.t[i])) for i in (k - 1, k)]
            graph.add(gtsam.WnoaMotionFactorPose3(*ends, density))
    found = gtsam.LevenbergMarquardtOptimizer(graph, start).optimize()
    return Found(np.array([found.atPose3(k).rotation().matrix() for k in range(n)]), None, None)


# ---- symspline ----


def symspline(data: Gyro, **options: Any) -> Found:
    curve = ss.estimate(data.terms(), 81, SO3, criterion="gcv", **options)
    bias = curve.parameters["gyro bias"]
    return Found(curve(data.t), ss.rotations.angular_velocity(curve, data.s), bias.value, bias.std)


def attitudes_only(data: Gyro) -> Found:
    return Found(ss.make_smoothing_spline(data.t, data.seen, SO3, knots=81)(data.t), None, None)


# ---- the table ----


def best(run: Callable[[Gyro, float], Found], middle: float) -> Callable[[Gyro], Found]:
    """Return the method with the best process noise: nearest to the true rates, or else to the true attitudes."""
    errors = []
    for factor in STRENGTHS:
        each = []
        for seed in SEEDS[:3]:
            data = estimation.gyro(seed)
            found = run(data, middle * factor)
            if found.rates is None:
                each.append(rms(SO3.distance(found.attitudes, data.truth(data.t))))
            else:
                each.append(rms(found.rates - ss.rotations.angular_velocity(data.truth, data.s)))
        errors.append(np.mean(each))
    strength = middle * STRENGTHS[int(np.argmin(errors))]
    return lambda data: run(data, strength)


def row(name: str, run: Callable[[Gyro], Found]) -> list[str]:
    angles, rates, biases, ratios, spent = [], [], [], [], []
    run(estimation.gyro(SEEDS[0]))
    for seed in SEEDS:
        data = estimation.gyro(seed)
        begin = time.process_time()
        found = run(data)
        spent.append(time.process_time() - begin)
        angles.append(rms(SO3.distance(found.attitudes, data.truth(data.t))))
        if found.rates is not None:
            rates.append(rms(found.rates - ss.rotations.angular_velocity(data.truth, data.s)))
        if found.bias is not None and found.std is not None:
            biases.append(rms((found.bias - BIAS)[None]))
            ratios.append((found.bias - BIAS) / found.std)
    return [
        name,
        f"{rms(np.array(angles)):.4f}",
        f"{rms(np.array(rates)):.4f}" if rates else "–",
        f"{rms(np.array(biases)):.4f}" if biases else "–",
        f"{np.sqrt(np.mean(np.square(ratios))):.2f}" if ratios else "–",
        f"{1e3 * np.median(spent):.0f}",
    ]


def others_table() -> str:
    rows = [
        row('`estimate`, `penalty="jerk"`', lambda data: symspline(data, penalty="jerk")),
        row('`estimate`, `penalty="acceleration"`', symspline),
        row("MEKF with RTS smoother", mekf),
        row("Kalman smoother, white noise on acceleration†", best(wnoa, 0.2)),
    ]
    try:
        gtsam: Any = importlib.import_module("gtsam")
    except ImportError:
        gtsam = None
        print("(GTSAM is not installed)")
    if gtsam is not None:
        rows.append(row("GTSAM, `AHRSFactor`", lambda data: gtsam_ahrs(gtsam, data)))
    rows.append(row("attitudes only: `make_smoothing_spline`", attitudes_only))
    rows.append(row("attitudes only: Kalman smoother†", best(lambda data, q: wnoa(data, q, False), 0.2)))
    if gtsam is not None:
        rows.append(
            row(
                "attitudes only: GTSAM, Gaussian process†",
                best(lambda data, q: gtsam_wnoa(gtsam, data, q), 0.2),
            )
        )
    head = ["method", "angle, rad", "rate, rad/s", "bias, rad/s", "rms of bias error over std", "time, ms"]
    return table(head, rows)


def main() -> None:
    asked = parser(__doc__).parse_args()
    ss.set_num_threads(1)
    text = others_table()
    print(text)
    if asked.write:
        insert("others", text, estimation.PAGE)


if __name__ == "__main__":
    main()
