"""Coverage of 95 % bands in gaps and beyond the ends.

`python -m tests.trust.bands [recordings per cell] [part of a cell]` prints a table.

Recordings have 600 random times in 60 s, three coordinates and noise of 0.02, and a gap in the middle or no data after
the end. On curved spaces the motion is scaled to 0.35 rad and has 400 data with noise of 0.01 rad.
"""

import sys
import warnings

import numpy as np

import symspline as ss

from .outcome import outcome_of

SPAN = 60.0


def smooth(rng, m):
    """Three sines per axis."""
    w = rng.uniform(0.2, 1.2, (m, 3))
    a, p = rng.uniform(1, 5, (m, 3)) / (1 + 3 * w), rng.uniform(0, 6, (m, 3))
    return lambda t: (a * np.sin(np.multiply.outer(t, w) + p)).sum(axis=-1)


def oscillating(rng, m):
    """One sine per axis."""
    w, p = rng.uniform(1, 3, m), rng.uniform(0, 6, m)
    return lambda t: np.sin(np.multiply.outer(t, w) + p)


def walk(rng, m):
    """Integrated Wiener process."""
    grid = np.linspace(-1, SPAN + 10, 3551)
    speed = np.cumsum(np.sqrt(0.02 * 0.05) * rng.standard_normal((len(grid), m)), axis=0)
    places = np.cumsum(speed, axis=0) * 0.02
    return lambda t: np.stack([np.interp(t, grid, own) for own in places.T], axis=-1)


def bursts(rng, m):
    """Seven bursts of about four seconds."""
    centre, size = rng.uniform(0, SPAN, 7), rng.standard_normal((7, m))
    w, p = rng.uniform(1.5, 4, (7, m)), rng.uniform(0, 6, (7, m))

    def at(t):
        near = np.exp(-0.5 * ((np.asarray(t)[:, None] - centre) / 1.2) ** 2)
        return np.einsum("nj,jm,njm->nm", near, size, np.sin(np.multiply.outer(t, w) + p))

    return at


FAMILIES = {"smooth": smooth, "oscillating": oscillating, "walk": walk, "bursts": bursts}
OPTIONS = {"gcv": {}, "reml": {"criterion": "reml"}, "gcv jerk": {"penalty": "jerk"}}
SPACES = {"r:3": ss.Euclidean(3), "sphere:2": ss.Sphere(2), "so:3": ss.SpecialOrthogonal(3)}


def recording(space, family, seed, length, at_end):
    """Return the motion, times and noisy points, and the ends of the part without data."""
    rng = np.random.default_rng([seed, *family.encode()])
    flat = isinstance(space, ss.Euclidean)
    count, noise = (600, 0.02) if flat else (400, 0.01)
    own = FAMILIES[family](rng, space.dim)
    t = np.sort(rng.uniform(0, SPAN, count))
    first, last = (SPAN - length, SPAN) if at_end else (0.5 * (SPAN - length), 0.5 * (SPAN + length))
    t = t[(t < first) | (t > last)]
    if flat:
        return own, t, own(t) + noise * rng.standard_normal((len(t), space.dim)), first, last
    scale = 0.35 / np.std(own(np.linspace(0, SPAN, 600)), axis=0).max()
    origin = np.eye(3) if isinstance(space, ss.SpecialOrthogonal) else np.array([0.0, 0.0, 1.0])
    frame = space.frame(origin)

    def motion(x):
        return space.exp(np.broadcast_to(origin, (len(x), *origin.shape)), np.tensordot(scale * own(x), frame, 1))

    p = motion(t)
    return motion, t, space.exp(p, noise * space.random_tangent(rng, p)), first, last


def shares(space, family, seed, length, options, at_end=False):
    """Return the shares of true points within the bands: before and after, inside, beside the gap, and elsewhere."""
    motion, t, y, first, last = recording(space, family, seed, length, at_end)
    curve = ss.make_smoothing_spline(t, y, space, extrapolate="geodesic", **options)
    a, b = (t[-1], last) if at_end else (first, last)

    def within(x, **how):
        return np.mean(space.distance(curve(x), motion(x)) < curve.band(x, **how))

    inside = np.linspace(a, b, 43)[1:-1]
    beside = np.linspace(a - 1, a, 20) if at_end else np.r_[np.linspace(a - 1, a, 20), np.linspace(b, b + 1, 20)]
    far = np.linspace(3, SPAN - 3, 200)
    far = far[(far < a - 3) | (far > b + 3)]
    error = np.sqrt(np.mean(space.distance(curve(inside), motion(inside)) ** 2))
    widths = [np.sqrt(np.mean(curve.band(inside, calibrated=how) ** 2)) for how in (False, True)]
    return [
        within(inside, calibrated=False),
        within(inside),
        within(beside, calibrated=False),
        within(beside),
        within(far, calibrated=False),
        within(far),
        error,
        *widths,
    ]


def largest_error(space, family, seed, length, options, at_end=False):
    """Return the largest error in the gap, or in the 3 s after the end, in standard deviations of a coordinate."""
    motion, t, y, first, last = recording(space, family, seed, length, at_end)
    curve = ss.make_smoothing_spline(t, y, space, extrapolate="geodesic", **options)
    x = np.linspace(t[-1] if at_end else first, last, 43)[1:-1]
    return np.max(space.distance(curve(x), motion(x)) / (curve.std(x) * np.sqrt(space.dim)))


def _kind(family, name, length, at_end):
    def outcome(seed):
        return outcome_of(lambda: largest_error(SPACES["r:3"], family, seed, length, OPTIONS[name], at_end))

    return outcome


KINDS = {
    f"bands, {family}, {name}, {'after the end' if at_end else 'gap of 5 s'}": _kind(
        family, name, 3.0 if at_end else 5.0, at_end
    )
    for family in FAMILIES
    for name in OPTIONS
    for at_end in (False, True)
}


def main(count, part):
    """Print one row per cell, as soon as it is known."""
    print("| recording | n | inside | beside | far | error | width |\n|:--|--:|--:|--:|--:|--:|--:|")
    cells = [
        (space, family, name, length, at_end)
        for space in SPACES
        for family in FAMILIES
        for name in OPTIONS
        for length, at_end in ((2.0, False), (5.0, False), (10.0, False), (3.0, True))
        if space == "r:3" or (length == 5.0 and name != "gcv jerk")
    ]
    for space, family, name, length, at_end in cells:
        label = f"{space} {family}, {name}, {'end' if at_end else f'{length:g} s'}"
        if part not in label:
            continue
        found = []
        for seed in range(count):
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                try:
                    found.append(shares(SPACES[space], family, 1000 + seed, length, OPTIONS[name], at_end))
                except ss.SymsplineError as error:
                    print(f"seed {seed}: {error}", file=sys.stderr)
        a = np.array(found)
        pairs = [f"{a[:, i].mean():.2f} → {a[:, i + 1].mean():.2f}" for i in (0, 2, 4)]
        error, plain, wide = np.median(a[:, 6:], axis=0)
        print(f"| {label} | {len(a)} | {' | '.join(pairs)} | {error:.2g} | {plain:.2g} → {wide:.2g} |", flush=True)


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 200, sys.argv[2] if len(sys.argv) > 2 else "")
