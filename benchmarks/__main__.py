"""Measures everything and writes the tables into ``benchmarks/README.md`` and the plot beside it."""

from __future__ import annotations

import argparse
import shutil
import tempfile
from collections.abc import Iterable, Iterator
from pathlib import Path

import symspline as ss

from . import cost, data, every_space, grids, limits, machine, multiples, side_by_side
from .data import FULL, QUICK, Sizes
from .tables import table
from .timing import Effort

HERE = Path(__file__).parent
PACKAGES = ("symspline", "numpy", "scipy", "splines")


def main() -> None:
    """Run the benchmarks."""
    parser = argparse.ArgumentParser("python -m benchmarks", description="Benchmarks of symspline.")
    parser.add_argument("--quick", action="store_true", help="a smoke test: tiny sizes, nothing is kept")
    parser.add_argument("--spaces", action="store_true", help="only the tables of every space")
    parser.add_argument("--grids", action="store_true", help="only the tables of grids")
    parser.add_argument(
        "--multiples", action="store_true", help="only the table of derivatives, smoothing and others"
    )
    parser.add_argument(
        "--large", action="store_true", help=f"with a curve in {every_space.LARGE.space} among the spaces"
    )
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(shutil.copytree(HERE, Path(scratch) / "benchmarks")) if given.quick else HERE
        if given.quick:
            print("A smoke test: it shows that the benchmarks run; its numbers mean nothing.\n", flush=True)
        threads = ss.num_threads()
        sizes, effort = (QUICK, Effort(2, 0, 0.1)) if given.quick else (FULL, Effort(7, 0.02, 10))
        if not given.spaces and not given.multiples:
            grid_sizes = grids.QUICK if given.quick else grids.FULL
            _write(folder, "grids", grids.pieces(grid_sizes, threads, effort))
        if given.grids:
            return
        if not given.spaces:
            of_multiples = multiples.QUICK if given.quick else multiples.FULL
            _write(folder, "multiples", _multiples(of_multiples, threads, effort))
        if given.multiples:
            return
        if not given.spaces:
            _write(folder, "measured", _pieces(folder, sizes, threads, effort))
        plan = every_space.QUICK if given.quick else every_space.FULL
        _write(folder, "spaces", _spaces(plan.with_large() if given.large else plan, threads))


def _write(folder: Path, part: str, pieces: Iterable[str]) -> None:
    """Print pieces as they come, and put them into a part of the README."""
    file = folder / "README.md"
    begin, end = (f"<!-- {part}: {side} -->" for side in ("begin", "end"))
    before, after = _around(file.read_text(encoding="utf-8"), begin, end)
    kept = []
    for piece in pieces:
        print(piece, end="\n\n", flush=True)
        kept.append(piece)
    measured = "\n\n".join((begin, *kept, end))
    file.write_text(f"{before}{measured}{after}", encoding="utf-8")


def _around(readme: str, begin: str, end: str) -> tuple[str, str]:
    """The text before and after what is measured."""
    before, found, rest = readme.partition(begin)
    _, closed, after = rest.partition(end)
    if not found or not closed:
        raise SystemExit(f"benchmarks/README.md lacks the lines {begin} and {end}")
    return before, after


def _pieces(folder: Path, sizes: Sizes, threads: int, effort: Effort) -> Iterator[str]:
    """The measured part of the README, paragraph by paragraph."""
    yield "## Where and with what"
    yield table(("", ""), machine.description(threads, PACKAGES).items())
    walk = data.rotations(max(sizes.knots))
    yield "## Beside other libraries"
    built = side_by_side.construction(walk, sizes, threads, effort)
    yield side_by_side.text(side_by_side.rows(walk, built, sizes, threads, effort))
    yield side_by_side.agreement(walk, sizes)
    yield "## Cost against the number of knots"
    cost.draw(built, folder / "cost.png")
    yield "![Time of the fit against the number of knots](cost.png)"
    yield cost.text(built)
    yield cost.memory_text(walk, sizes)
    yield "## One core against two"
    yield limits.cores_text(walk, sizes, effort)
    yield "## How far from the limit"
    yield limits.limits_text(walk, sizes, effort)


def _multiples(sizes: multiples.Sizes, threads: int, effort: Effort) -> Iterator[str]:
    yield "## Beside a fit or an evaluation"
    yield table(("", ""), machine.description(threads, PACKAGES).items())
    yield multiples.text(sizes, effort)


def _spaces(plan: every_space.Plan, threads: int) -> Iterator[str]:
    yield "## Every space"
    yield from every_space.pieces(plan, threads)


if __name__ == "__main__":
    main()
