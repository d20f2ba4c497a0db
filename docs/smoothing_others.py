"""Programs that smooth on a manifold beside symspline, on the same data, in one process and on one core.

    python docs/smoothing_others.py

Those of GTSAM, spheresmooth and geomstats that are installed are run (``pip install gtsam spheresmooth``; geomstats
wants an older NumPy, and so an environment of its own, with autograd and ``GEOMSTATS_BACKEND=autograd``).
"""

from __future__ import annotations

import importlib
import statistics
import time
import warnings
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

import symspline as ss

Array = NDArray[np.float64]
RUNS = 5
SLOW = 5.0
"""Seconds from which one run says enough."""


class Row(NamedTuple):
    """A program and what it was given; errors and seconds, its own and ours."""

    what: str
    error: float
    ours: float
    seconds: float
    our_seconds: float

    def __str__(self) -> str:
        return (
            f"| {self.what} | {self.error:.3g} | {self.ours:.3g} | {self.error / self.ours:.2f} "
            f"| {1e3 * self.seconds:.0f} | {1e3 * self.our_seconds:.1f} |"
        )


HEAD = """\
| program | its error | ours | ratio | its time (ms) | ours |
| :-- | --: | --: | --: | --: | --: |"""


def timed(run: Callable[[], Array]) -> tuple[Array, float]:
    """What it makes, and the median of some runs, after one to warm up."""
    start = time.perf_counter()
    found = run()
    first = time.perf_counter() - start
    if first > SLOW:
        return found, first
    seconds = []
    for _ in range(RUNS):
        start = time.perf_counter()
        run()
        seconds.append(time.perf_counter() - start)
    return found, statistics.median(seconds)


def row(what: str, space: ss.Space, t: Array, noisy: Array, truth: Array, run: Callable[[], Array]) -> Row:
    """Its curve at the times of the data beside ours, both by the root of the mean squared distance to the truth."""

    def error(points: Array) -> float:
        return float(np.sqrt(np.mean(space.distance(points, truth) ** 2)))

    # Both warmed up before the one that is measured first.
    ours, our_seconds = timed(lambda: ss.make_smoothing_spline(t, noisy, space)(t))
    theirs, seconds = timed(run)
    return Row(what, error(theirs), error(ours), seconds, our_seconds)


def path(space: ss.Space, n: int, sigma: float, straight: bool = False) -> tuple[Array, Array, Array]:
    """Times, noisy points and true ones, of a smooth curve or of a geodesic."""
    rng = np.random.default_rng(0)
    points = [space.random_point(rng)]
    for _ in range(8):
        v = space.random_tangent(rng, points[-1])
        points.append(space.exp(points[-1], 0.6 * v / space.norm(points[-1], v)))
    t = np.linspace(0, 1, n)
    if straight:
        truth = space.geodesic(points[0], points[2], t)
    else:
        truth = ss.CubicSpline(np.linspace(0, 1, 9), np.array(points), space)(t)
    return t, space.exp(truth, sigma * space.random_tangent(rng, truth)), truth


def gtsam_rows(gtsam: Any) -> Iterator[Row]:
    """Priors at all data and a random walk between them, as in its smoothing examples; of its sizes the one that comes
    nearest to the truth, which nobody knows, and its time without the search."""
    space = ss.SpecialOrthogonal(3)
    for n, sigma in ((100, 0.1), (1000, 0.1), (1000, 0.02)):
        t, noisy, truth = path(space, n, sigma)

        def run(walk: float, noisy: Array = noisy, sigma: float = sigma) -> Array:
            graph, start = gtsam.NonlinearFactorGraph(), gtsam.Values()
            seen = gtsam.noiseModel.Isotropic.Sigma(3, sigma)
            moved = gtsam.noiseModel.Isotropic.Sigma(3, walk)
            for k, r in enumerate(noisy):
                graph.add(gtsam.PriorFactorRot3(k, gtsam.Rot3(r), seen))
                start.insert(k, gtsam.Rot3(r))
                if k:
                    graph.add(gtsam.BetweenFactorRot3(k - 1, k, gtsam.Rot3(), moved))
            found = gtsam.LevenbergMarquardtOptimizer(graph, start).optimize()
            return np.array([found.atRot3(k).matrix() for k in range(len(noisy))])

        walks = sigma * 2.0 ** np.arange(-7, 2)
        errors = [np.mean(space.distance(run(walk), truth) ** 2) for walk in walks]
        best = float(walks[int(np.argmin(errors))])
        yield row(
            f"GTSAM, random walk with the best step*, SO(3), {n} points, σ = {sigma}",
            space,
            t,
            noisy,
            truth,
            lambda best=best, run=run: run(best),
        )


def spheresmooth_rows(spheresmooth: Any) -> Iterator[Row]:
    """Piecewise geodesics whose knots are pruned, λ by BIC among those of its documentation."""
    space = ss.Sphere(2)
    for n, sigma in ((100, 0.1),):
        t, noisy, truth = path(space, n, sigma)

        def run(t: Array = t, noisy: Array = noisy) -> Array:
            dimension = 20
            found = spheresmooth.penalized_linear_spherical_spline(
                t,
                noisy,
                dimension=dimension,
                initial_knots=spheresmooth.knots_quantile(t, dimension=dimension),
                lambdas=np.exp(np.linspace(np.log(1e-7), np.log(1), 10)),
            )
            return np.asarray(found["fits"][int(np.argmin(found["bic_list"]))]["gamma"])

        yield row(f"spheresmooth, S², {n} points, σ = {sigma}", space, t, noisy, truth, run)


def geomstats_rows(geomstats: Any) -> Iterator[Row]:
    """Its regression by geodesics, on geodesics: the truth is of its kind. symspline chooses λ all the same."""
    del geomstats
    hypersphere = importlib.import_module("geomstats.geometry.hypersphere").Hypersphere
    regression = importlib.import_module("geomstats.learning.geodesic_regression").GeodesicRegression
    space = ss.Sphere(2)
    for n, sigma in ((50, 0.1), (200, 0.1)):
        t, noisy, truth = path(space, n, sigma, straight=True)

        def run(t: Array = t, noisy: Array = noisy) -> Array:
            fitted = regression(hypersphere(dim=2), initialization="frechet")
            fitted.fit(t, noisy)
            return np.asarray(fitted.predict(t))

        yield row(
            f"geomstats, regression by a geodesic, S², {n} points, σ = {sigma}", space, t, noisy, truth, run
        )


PROGRAMS = {"gtsam": gtsam_rows, "spheresmooth": spheresmooth_rows, "geomstats": geomstats_rows}


def main() -> None:
    ss.set_num_threads(1)
    print(HEAD)
    for name, rows in PROGRAMS.items():
        try:
            module = importlib.import_module(name)
        except ImportError:
            print(f"({name} is not installed)")
            continue
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            for one in rows(module):
                print(one, flush=True)


if __name__ == "__main__":
    main()
