"""How fast many curves are in blocks of dask, and in how little memory: the tables of ``xarray.md``.

python docs/many_curves.py [--write] [--curves N] [PART ...]

Parts: rates (a minute or two on two idle cores), store (half a minute for a million curves).
"""

from __future__ import annotations

import os
import resource
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

import dask.array
import numpy as np
import xarray as xr
from comparisons.page import insert, parser, table, versions
from distributed import Client, LocalCluster, futures_of, wait
from numpy.typing import NDArray

import symspline as ss
import symspline.xarray as sx

PAGE = Path(__file__).parent / "xarray.md"
KNOTS = 24
CHUNK = 10_000
TO = np.linspace(0, KNOTS - 1, 2 * KNOTS - 1)
LIMIT = "1GiB"


def tracks(count: int, seed: Any = 0) -> NDArray[np.float64]:
    """Points on S² along great circles, 0.15 apart, with noise: shape (count, KNOTS, 3)."""
    rng = np.random.default_rng(seed)
    a, b = np.linalg.qr(rng.standard_normal((count, 3, 2)))[0].transpose(2, 0, 1)[..., None, :]
    angle = 0.15 * np.arange(KNOTS)[:, None]
    points = np.cos(angle) * a + np.sin(angle) * b + 0.03 * rng.standard_normal((count, KNOTS, 3))
    return points / np.linalg.norm(points, axis=-1, keepdims=True)


def attitudes(count: int, seed: Any = 0) -> NDArray[np.float64]:
    """Rotation matrices about the points of `tracks` by angles up to 2."""
    vectors = tracks(count, seed) * np.linspace(0, 2, KNOTS)[:, None]
    return ss.rotations.from_rotation_vectors(vectors)


def named(points: Any) -> xr.DataArray:
    """An array whose dimensions have names."""
    return xr.DataArray(points, dims=("curve", "time", "row", "column")[: np.ndim(points)])


def simulated(count: int, chunk: int, make: Callable[[int, Any], Any] = tracks) -> xr.DataArray:
    """Curves that are made block by block."""
    sizes = tuple(min(chunk, count - i) for i in range(0, count, chunk))
    shape = make(1, 0).shape[1:]

    def block(block_info: Any = None) -> NDArray[np.float64]:
        place = block_info[None]
        return make(place["chunk-shape"][0], place["chunk-location"][0])

    chunks = (sizes, *((size,) for size in shape))
    return named(dask.array.map_blocks(block, chunks=chunks, dtype=float, meta=np.empty((0,) * len(chunks))))


def spaced(number: float) -> str:
    """A whole number with its thousands apart."""
    return f"{number:,.0f}".replace(",", " ")


# ---- curves per second ----

WORK: dict[str, tuple[Callable[[xr.DataArray], Any], Callable[[int, Any], Any]]] = {
    "S², fit": (lambda da: sx.fit(da, "sphere:2", point_dims=("row",)), tracks),
    "S², resample": (lambda da: sx.resample(da, "sphere:2", TO, point_dims=("row",)), tracks),
    "SO(3), fit": (lambda da: sx.fit(da, "so:3", point_dims=("row", "column")), attitudes),
}


@contextmanager
def cluster(workers: int, memory: str | int = 0) -> Iterator[Client]:
    """Worker processes of one thread each on this machine."""
    with (
        tempfile.TemporaryDirectory() as folder,
        LocalCluster(
            n_workers=workers,
            threads_per_worker=1,
            memory_limit=memory,
            dashboard_address=":0",
            local_directory=folder,
        ) as made,
        Client(made) as client,
    ):
        yield client


def seconds(call: Callable[[], Any]) -> tuple[float, float]:
    """How long a call takes, and how much time of processors it takes in this process."""
    start = time.perf_counter(), time.process_time()
    call()
    return time.perf_counter() - start[0], time.process_time() - start[1]


WAYS = (
    "one thread",
    "one thread, block by block",
    "one thread of dask",
    "one worker process",
    "two threads",
    "two threads of dask",
    "two worker processes",
)


def rates_table(count: int = 5 * CHUNK, rounds: int = 4, chunk: int = CHUNK) -> str:
    """Curves per second: the best of some rounds, in each of which every way has its turn."""
    with cluster(2) as client:
        columns = [_rates(work, make, count, rounds, chunk, client) for work, make in WORK.values()]
    rows = [[way, *(spaced(count / column[way][0]) for column in columns)] for way in WAYS]
    blocks, of_dask = WAYS[1:3]
    costs = (column[of_dask][1] / column[blocks][1] for column in columns)
    rows.append([f"processor time of {of_dask} : of {blocks}", *(f"{cost:.2f}" for cost in costs)])
    return table(["curves per second", *WORK], rows)


def _rates(
    work: Callable[[xr.DataArray], Any],
    make: Callable[[int, Any], Any],
    count: int,
    rounds: int,
    chunk: int,
    client: Client,
) -> dict[str, tuple[float, ...]]:
    """The least time, and the least time of processors, that each way takes."""
    lazy = simulated(count, chunk, make)
    plain = lazy.compute(scheduler="threads")
    blocks = plain.chunk(curve=chunk)
    # The first worker alone, and both. They have the points before.
    names = sorted(client.scheduler_info()["workers"])
    crews = [names[:1], names]
    own = (named(lazy.data.map_blocks(np.copy, name=f"{make.__name__} of {len(crew)}")) for crew in crews)
    there = [client.persist(da, workers=crew) for da, crew in zip(own, crews, strict=True)]
    wait(there)
    client.rebalance(futures_of(there[1]))

    def alone(n: int) -> None:
        ss.set_num_threads(n)
        try:
            work(plain)
        finally:
            ss.set_num_threads(0)

    def block_by_block() -> None:
        ss.set_num_threads(1)
        try:
            # As dask does, all curves are kept until the last are there.
            kept = [work(plain.isel(curve=slice(i, i + chunk))) for i in range(0, count, chunk)]
            kept.clear()
        finally:
            ss.set_num_threads(0)

    def threads(n: int) -> None:
        # As on the way to a store, blocks are not put together to one array.
        work(blocks).persist(scheduler="threads", num_workers=n)

    def workers(n: int) -> None:
        wait(client.persist(work(there[n - 1]), workers=crews[n - 1]))

    calls = [partial(call, n) for n in (1, 2) for call in (alone, threads, workers)]
    calls.insert(1, block_by_block)
    found = [[seconds(call) for call in calls] for _ in range(rounds)]
    return {
        way: tuple(map(min, zip(*times, strict=True)))
        for way, times in zip(WAYS, zip(*found, strict=True), strict=True)
    }


# ---- from disk to disk ----


def alone(block: int, count: int) -> xr.DataArray:
    """Velocities of the first curves of a block, without dask."""
    return sx.fit(named(tracks(count, block)[:9]), "sphere:2", point_dims=("row",)).velocities


def peak() -> float:
    """The most memory that this process ever had, in MiB."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / (2**20 if sys.platform == "darwin" else 2**10)


def raw(ds: xr.Dataset) -> dict[str, Any]:
    """Random numbers are not worth compressing."""
    return {name: {"compressors": None} for name in ds.variables}


def store_table(count: int = 1_000_000, chunk: int = 2 * CHUNK) -> str:
    """Curves from one zarr store to another, and the peak memory of the workers."""
    with tempfile.TemporaryDirectory() as directory:
        given, found = f"{directory}/given.zarr", f"{directory}/found.zarr"
        made = simulated(count, chunk).to_dataset(name="tracks")
        simulating, _ = seconds(lambda: made.to_zarr(given, encoding=raw(made), consolidated=False))
        ds = sx.fit(xr.open_zarr(given, consolidated=False).tracks, "sphere:2", point_dims=("row",))
        with cluster(2, LIMIT) as client:
            client.run(lambda: (ss.Sphere, sx.fit, xr.open_zarr))
            before = max(client.run(peak).values())
            took, _ = seconds(lambda: ds.to_zarr(found, encoding=raw(ds), consolidated=False))
            most = max(client.run(peak).values())
        check = xr.open_zarr(found, consolidated=False)
        converged = int(check.converged.sum())
        blocks = range(0, count, chunk)
        same = all(
            bool((check.velocities[start : start + 9].compute() == alone(i, min(chunk, count - start))).all())
            for i, start in ((0, 0), (len(blocks) - 1, blocks[-1]))
        )
        sizes = [sum(p.stat().st_size for p in Path(s).rglob("*") if p.is_file()) for s in (given, found)]
    rows = [
        [
            "curves, knots each",
            f"{spaced(count)}, {KNOTS}",
        ],
        ["read, written", ", ".join(f"{size / 1e9:.2f} GB" for size in sizes)],
        ["simulated and written in", f"{simulating:.0f} s"],
        [
            "read, fitted and written in",
            f"{took:.1f} s: {spaced(count / took)} curves per second",
        ],
        [
            "peak memory of a worker",
            f"{most:.0f} MiB, of which {before:.0f} MiB before the first block; limit {LIMIT}",
        ],
        ["converged", spaced(converged)],
        ["bit-identical to the run without dask", "yes" if same else "no"],
    ]
    return table(["two workers", ""], rows)


PARTS: dict[str, Callable[[int], str]] = {
    "rates": lambda _: rates_table(),
    "store": store_table,
}


def main() -> None:
    arguments = parser(__doc__)
    arguments.add_argument(
        "--curves", type=int, default=1_000_000, help="how many curves go from disk to disk"
    )
    arguments.add_argument("parts", nargs="*", metavar="PART", default=list(PARTS), help=", ".join(PARTS))
    given = arguments.parse_args()
    for part in given.parts:
        load = os.getloadavg()[0]
        text = f"{PARTS[part](given.curves)}\n\n{versions('dask', 'distributed', 'numpy', 'xarray', 'zarr')}"
        text += f" {os.cpu_count()} cores, which had {load:.1f} processes of others in the minute before."
        print(text, flush=True)
        if given.write:
            insert(part, text, PAGE)


if __name__ == "__main__":
    main()
