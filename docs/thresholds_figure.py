"""Makes thresholds.png: the multipliers of Algorithm 1 for zigzags, by their formula and measured."""

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from scipy.optimize import brentq

import symspline as ss

SPACES = {
    "S²": (ss.Sphere(2), lambda d: 0.5 * (1 + d * np.tan(d / 2)), 1.7),
    "H²": (ss.Hyperbolic(2), lambda d: 0.5 * (1 - d / np.tanh(d / 2)), 3.4),
}


def zigzag(space: ss.Space, step: float, count: int = 40) -> np.ndarray:
    """Points that alternate between two positions."""
    side = step * (np.arange(count + 1) % 2 - 0.5)
    cos, sin = (np.cos, np.sin) if space == ss.Sphere(2) else (np.cosh, np.sinh)
    return np.stack([cos(side), sin(side), 0 * side], axis=-1)


def multiplier(space: ss.Space, step: float) -> float:
    """The factor by which a sweep (17) multiplies the wave that grows fastest, measured for small vectors."""
    p = zigzag(space, step)[:-1]
    normal = np.zeros_like(p)
    normal[:, 2] = 1.0
    sign = (-1.0) ** np.arange(len(p)) if space == ss.Sphere(2) else np.ones(len(p))
    v = 1e-6 * sign[:, None] * normal
    return float((swept(space, p, v) * normal).sum(axis=-1)[0] / (v * normal).sum(axis=-1)[0])


def swept(space: ss.Space, p: np.ndarray, v: np.ndarray) -> np.ndarray:
    """One sweep (17) for a closed curve."""
    plus, minus = space.exp(p, v), space.exp(p, -v)
    after, before = np.roll(minus, -1, axis=0), np.roll(plus, 1, axis=0)
    w = space.log(p, space.transvection(p, -v, after)) - space.log(p, space.transvection(p, v, before))
    return w / 4 + v / 2


def main() -> None:
    figure = Figure(figsize=(8.5, 3.2), layout="constrained")
    for axes, (name, (space, formula, most)) in zip(figure.subplots(1, 2), SPACES.items(), strict=True):
        steps = np.linspace(0.05, most, 200)
        axes.plot(steps, formula(steps), color="C0", label="formula")
        some = np.linspace(0.2, most, 12)
        axes.plot(
            some, [multiplier(space, step) for step in some], "o", color="C1", markersize=4, label="measured"
        )
        limit = np.sign(formula(most))
        threshold = brentq(lambda d, f=formula, y=limit: f(d) - y, 0.5, most)
        axes.axhline(limit, color="0.4", linewidth=0.8)
        axes.axvline(threshold, color="0.4", linewidth=0.8, linestyle="--")
        axes.annotate(f"D = {threshold:.4f}  ", (threshold, formula(0.1)), ha="right", va="center")
        axes.set(xlabel="step D", ylabel="multiplier of a sweep", title=name, xlim=(0, most))
        axes.legend(loc="upper left" if limit > 0 else "lower left")
    figure.savefig(Path(__file__).with_name("theory") / "thresholds.png", dpi=110)


if __name__ == "__main__":
    main()
