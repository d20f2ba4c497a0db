"""Make the tables of ``guide/adaptive.md``: accuracy and time of smoothing with λ and noise that vary.

python docs/smoothing_adaptive.py [--write] [PART ...]

About 90 seconds on one core. Parts: lam, noise, spaces, time.
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
from scipy.interpolate import CubicSpline
from scipy.ndimage import gaussian_filter1d

import symspline as ss

Array = NDArray[np.float64]
Rng = np.random.Generator
Motion = Callable[[Array], Array]

PAGE = Path(__file__).parent / "guide/adaptive.md"
COUNTS = (100, 200, 1000, 5000)
SEEDS = 10

# ---- motions between t = 0 and 1; the first four are those of Donoho & Johnstone (1994) ----

AT = np.array([0.1, 0.13, 0.15, 0.23, 0.25, 0.4, 0.44, 0.65, 0.76, 0.78, 0.81])
HEIGHTS = np.array([4, 5, 3, 4, 5, 4.2, 2.1, 4.3, 3.1, 5.1, 4.2])
WIDTHS = np.array([5, 5, 6, 10, 10, 30, 10, 10, 5, 8, 5]) / 1000
STEPS = np.array([4, -5, 3, -4, 5, -4.2, 2.1, 4.3, -3.1, 2.1, -4.2])


def doppler(_: Rng) -> Motion:
    return lambda t: np.sqrt(t * (1 - t)) * np.sin(2.1 * np.pi / (t + 0.05))


def bumps(_: Rng) -> Motion:
    return lambda t: (1 + np.abs((t[:, None] - AT) / WIDTHS)) ** -4 @ HEIGHTS


def blocks(_: Rng) -> Motion:
    """Steps, smoothed by a Gaussian kernel of standard deviation 0.003."""
    x = np.linspace(-0.1, 1.1, 24_001)
    y = gaussian_filter1d(np.heaviside(x[:, None] - AT, 0.5) @ STEPS, 0.003 / (x[1] - x[0]))
    return lambda t: np.interp(t, x, y)


def heavisine(_: Rng) -> Motion:
    return lambda t: 4 * np.sin(4 * np.pi * t) - np.sign(t - 0.3) - np.sign(0.72 - t)


def burst(rng: Rng) -> Motion:
    """Return a slow motion with a few fast oscillations in about 7 % of the recording."""
    middle, slow, fast = rng.uniform(0.15, 0.85), rng.uniform(0, 6), rng.uniform(0, 6)
    return lambda t: 0.3 * np.sin(3 * t + slow) + _oscillations(t, middle, fast)


def _oscillations(t: Array, middle: float, phase: Any) -> Array:
    x = (t - middle) / 0.0217
    return np.asarray(np.exp(-0.5 * x**2) * np.sin(2 * np.pi * x + phase))


def one_sine(rng: Rng) -> Motion:
    rate, phase = rng.uniform(15, 40), rng.uniform(0, 6)
    return lambda t: np.sin(rate * t + phase)


def five_sines(rng: Rng) -> Motion:
    return _sum_of_sines(rng, rng.uniform(5, 70, 5))


def matern(rng: Rng) -> Motion:
    """Return sixty sines with random rates, which resemble a stationary process with a Matérn covariance."""
    return _sum_of_sines(rng, 25 * rng.standard_t(5, 60))


def _sum_of_sines(rng: Rng, rates: Array) -> Motion:
    sizes, phases = rng.standard_normal(len(rates)), rng.uniform(0, 2 * np.pi, len(rates))
    return lambda t: np.sin(np.multiply.outer(t, rates) + phases) @ sizes


def wiener(rng: Rng) -> Motion:
    """Return an integrated Wiener process, for which one λ is exactly right."""
    x = np.linspace(-0.02, 1.02, 8001)
    spline = CubicSpline(x, np.cumsum(np.cumsum(rng.standard_normal(len(x)))) / 1e4)
    return lambda t: np.asarray(spline(t))


MOTIONS: dict[str, Callable[[Rng], Motion]] = {
    "Doppler": doppler,
    "bumps": bumps,
    "blocks": blocks,
    "heavisine": heavisine,
    "burst between rests": burst,
    "one sine": one_sine,
    "five sines": five_sines,
    "Matérn-like": matern,
    "integrated Wiener": wiener,
}
SPACES = {"S²": "sphere:2", "SO(3)": "so:3", "SPD(2)": "spd:2"}


def on_space(space: ss.Space, rng: Rng, bursts: bool) -> Motion:
    """Return a slow motion on a space, with or without a burst of amplitude 0.4 in every coordinate."""
    p = space.random_point(rng)
    frame = np.asarray(space.frame(p))
    slow, fast, middle = rng.uniform(0, 6, space.dim), rng.uniform(0, 6, space.dim), rng.uniform(0.2, 0.8)

    def motion(t: Array) -> Array:
        at = np.asarray(space.exp(p, np.tensordot(0.4 * np.sin(3 * t[:, None] + slow), frame, 1)))
        if not bursts:
            return at
        b = 0.4 * _oscillations(t[:, None], middle, fast)
        return np.asarray(space.exp(at, space.transport(p, at, np.tensordot(b, frame, 1))))

    return motion


# ---- recordings and their fits ----


class Recording(NamedTuple):
    """Noisy points of a motion at random times."""

    space: ss.Space
    t: Array
    noisy: Array
    truth: Array
    busy: NDArray[np.bool_]
    """The fifth of the data with the largest second derivative."""

    def error(self, curve: ss.SmoothingSpline) -> float:
        """Root mean squared distance to the true points."""
        return float(np.sqrt(np.mean(self.space.distance(curve(self.t), self.truth) ** 2)))

    def coverage(self, curve: ss.SmoothingSpline, part: NDArray[np.bool_]) -> list[float]:
        """Shares of true points in the 95 % band: in a part of the recording and in the other one."""
        inside = self.space.distance(curve(self.t), self.truth) <= curve.band(self.t)
        return [float(inside[part].mean()), float(inside[~part].mean())]


def record(
    space: ss.Space, motion: Motion, rng: Rng, count: int, sigma: float, uneven: bool = False
) -> Recording:
    """Record a motion with noise. If it is uneven, it is five times larger in 30 % of the recording."""
    t, h = np.sort(rng.random(count)), 1e-3
    before, truth, after = (motion(np.clip(t + e, 0, 1)) for e in (-h, 0, h))
    bends = space.norm(truth, space.log(truth, before) + space.log(truth, after))
    sizes = np.where(uneven & is_noisy(t), 5 * sigma, sigma).reshape(-1, *[1] * len(space.point_shape))
    noisy = np.asarray(space.exp(truth, sizes * space.random_tangent(rng, truth)))
    return Recording(space, t, noisy, truth, bends > np.quantile(bends, 0.8))


def is_noisy(t: Array) -> NDArray[np.bool_]:
    return (t > 0.4) & (t < 0.7)


def recordings(name: str, count: int, signal_to_noise: float = 7, uneven: bool = False) -> list[Recording]:
    """Record a motion of numbers ten times."""
    made, x = [], np.linspace(0.001, 0.999, 4000)
    for seed in range(SEEDS):
        rng = np.random.default_rng([seed, count, list(MOTIONS).index(name)])
        motion = MOTIONS[name](rng)
        sigma = float(np.std(motion(x))) / signal_to_noise
        made.append(record(ss.space("r:1"), _one_column(motion), rng, count, sigma, uneven))
    return made


def _one_column(motion: Motion) -> Motion:
    return lambda t: motion(t)[:, None]


def fit(data: Recording, **options: Any) -> ss.SmoothingSpline:
    return ss.make_smoothing_spline(data.t, data.noisy, data.space, on_failure="warn", **options)


def best(data: Recording, like: ss.SmoothingSpline) -> float:
    """Smallest error of any constant λ."""
    return min(data.error(fit(data, lam=lam, knots=like.t)) for lam in 10 ** np.arange(-14, -1, 0.25))


def is_varying(values: Array) -> bool:
    return bool(np.ptp(values) > 1e-9 * values.max())


# ---- tables ----


def lam_table(counts: Sequence[int] = COUNTS, names: Sequence[str] = tuple(MOTIONS)) -> str:
    """Errors relative to the best constant λ, and coverage of bands with 1000 data."""
    rows = []
    for name in names:
        cells, accepted, worst, covered = [], [], 0.0, "–"
        for count in counts:
            ratios, coverages, share = [], [], 0
            for data in recordings(name, count):
                one, own = fit(data), fit(data, lam="adaptive")
                errors = np.array([data.error(c) for c in (one, fit(data, criterion="reml"), own)])
                ratios.append(errors / min(best(data, one), errors[0], errors[1]))
                worst = max(worst, errors[2] / errors[0])
                share += is_varying(own.lam_at(data.t))
                coverages.append(data.coverage(one, data.busy) + data.coverage(own, data.busy))
            gcv, reml, adaptive = np.mean(ratios, axis=0)
            cells.append(f"{gcv:.2f}, {reml:.2f} → {adaptive:.2f}")
            accepted.append(f"{share}")
            if count == 1000:
                c = np.mean(coverages, axis=0)
                covered = f"{c[0]:.2f}, {c[1]:.2f} → {c[2]:.2f}, {c[3]:.2f}"
        rows.append([name, *cells, ", ".join(accepted), f"{worst:.2f}", covered])
    head = [
        "motion",
        *(f"n = {count}" for count in counts),
        f"accepted of {SEEDS}",
        "worst",
        "coverage busy, elsewhere",
    ]
    return table(head, rows)


def noise_table(names: Sequence[str] = ("one sine", "integrated Wiener", "burst between rests")) -> str:
    """Recordings of 1000 data with noise that is five times larger in 30 % of the recording."""
    rows = []
    for name in names:
        coverages, ratios = [], []
        chosen = {"neither": 0, "λ": 0, "σ": 0, "both": 0}
        for data in recordings(name, 1000, 12, uneven=True):
            noisy = is_noisy(data.t)
            ways = [fit(data), fit(data, noise="adaptive"), fit(data, lam="adaptive", noise="adaptive")]
            coverages.append(np.ravel([data.coverage(curve, noisy) for curve in ways]))
            errors = [data.error(curve) for curve in ways]
            ratios.append([errors[1] / errors[0], errors[2] / errors[0]])
            which = is_varying(ways[2].lam_at(data.t)) + 2 * is_varying(ways[2].sigma_at(data.t))
            chosen[list(chosen)[which]] += 1
        c, r = np.mean(coverages, axis=0), np.mean(ratios, axis=0)
        row: list[object] = [
            name,
            *(f"{c[i]:.2f}, {c[i + 1]:.2f}" for i in (0, 2, 4)),
            *(f"{x:.2f}" for x in r),
        ]
        rows.append([*row, ", ".join(f"{n} {word}" for word, n in chosen.items() if n)])
    one, sigma, both = "one σ", '`noise="adaptive"`', "both adaptive"
    head = [
        "motion",
        *(f"coverage, {way}" for way in (one, sigma, both)),
        f"error, {sigma}",
        f"error, {both}",
    ]
    return table([*head, "varies, if both may"], rows)


def space_table(names: Sequence[str] = tuple(SPACES), count: int = 1000) -> str:
    """Curved spaces, with noise of 0.03."""
    rows = []
    for name in names:
        for words, bursts in (("burst", True), ("slow motion alone", False)):
            ratios, coverages, share = [], [], 0
            for seed in range(SEEDS):
                rng, space = np.random.default_rng([seed, bursts]), ss.space(SPACES[name])
                data = record(space, on_space(space, rng, bursts), rng, count, 0.03)
                one, own = fit(data), fit(data, lam="adaptive")
                ratios.append(data.error(own) / data.error(one))
                share += is_varying(own.lam_at(data.t))
                coverages.append([data.coverage(curve, data.busy)[0] for curve in (one, own)])
            c = np.mean(coverages, axis=0)
            rows.append([f"{name}, {words}", f"{np.mean(ratios):.2f}", share, f"{c[0]:.2f} → {c[1]:.2f}"])
    return table(["motion", "error over that of one λ", f"accepted of {SEEDS}", "coverage busy"], rows)


def time_table(counts: Sequence[int] = (200, 1000, 5000, 20_000), repeats: int = 5) -> str:
    """Medians of interleaved calls."""
    rows = []
    for name in ("burst between rests", "one sine"):
        row: list[object] = [name]
        for count in counts:
            data, seconds = recordings(name, count)[0], []
            for _ in range(repeats + 1):
                begin = [time.perf_counter()]
                for options in ({}, {"lam": "adaptive"}):
                    fit(data, **options)
                    begin.append(time.perf_counter())
                seconds.append(np.diff(begin))
            one, own = 1e3 * np.median(seconds[1:], axis=0)
            row.append(f"{one:.{int(one < 10)}f} → {own:.{int(own < 10)}f} ms ({own / one:.1f})")
        rows.append(row)
    return table(["motion", *(f"n = {count}" for count in counts)], rows)


PARTS: dict[str, Callable[[], str]] = {
    "lam": lam_table,
    "noise": noise_table,
    "spaces": space_table,
    "time": lambda: f"{time_table()}\n\n{versions('symspline')}",
}


def main() -> None:
    arguments = parser(__doc__)
    arguments.add_argument("parts", nargs="*", metavar="PART", help="tables to make; all by default")
    asked = arguments.parse_args()
    ss.set_num_threads(1)
    warnings.simplefilter("ignore", UserWarning)
    for part in asked.parts or PARTS:
        text = PARTS[part]()
        print(f"{part}\n\n{text}\n", flush=True)
        if asked.write:
            insert(part, text, PAGE)


if __name__ == "__main__":
    main()
