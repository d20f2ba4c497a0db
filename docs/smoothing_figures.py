"""Makes the figures of smoothing splines: noisy places on a globe, and noisy numbers."""

from pathlib import Path

import numpy as np

import symspline as ss


def globe() -> ss.SmoothingSpline:
    """A curve on the sphere that is known by places with an error of 5 degrees."""
    sphere, rng = ss.Sphere(2), np.random.default_rng(2)
    t = np.linspace(0, 10, 150)
    lon, lat = np.radians([16 * t - 60, 25 + 30 * np.sin(0.75 * t)])
    truth = np.stack([np.cos(lat) * np.cos(lon), np.cos(lat) * np.sin(lon), np.sin(lat)], axis=-1)
    noisy = sphere.exp(truth, np.radians(5) * sphere.random_tangent(rng, truth))
    return ss.make_smoothing_spline(t, noisy, sphere)


def band() -> ss.SmoothingSpline:
    """Numbers at random times, with a gap."""
    rng = np.random.default_rng(0)
    t = np.sort(rng.uniform(0, 10, 140))
    t = t[(t < 6) | (t > 7.2)]
    x = np.sin(t) + t / 5 + 0.25 * rng.standard_normal(len(t))
    return ss.make_smoothing_spline(t, x[:, None], "r:1")


def main() -> None:
    folder = Path(__file__).parent
    globe().plot().savefig(folder / "smoothing_globe.png", dpi=100)
    band().plot().savefig(folder / "smoothing_band.png", dpi=100)


if __name__ == "__main__":
    main()
