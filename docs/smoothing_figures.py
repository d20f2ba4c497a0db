"""Makes the figure of the band of a smoothing spline."""

from pathlib import Path

import numpy as np

import symspline as ss


def band() -> ss.SmoothingSpline:
    """Numbers at random times, with a gap."""
    rng = np.random.default_rng(0)
    t = np.sort(rng.uniform(0, 10, 140))
    t = t[(t < 6) | (t > 7.2)]
    x = np.sin(t) + t / 5 + 0.25 * rng.standard_normal(len(t))
    return ss.make_smoothing_spline(t, x[:, None], "r:1")


def main() -> None:
    band().plot().savefig(Path(__file__).with_name("smoothing_band.png"), dpi=100)


if __name__ == "__main__":
    main()
