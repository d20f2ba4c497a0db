"""Measures everything and writes the tables into ``benchmarks/README.md`` and the plot beside it."""

from __future__ import annotations

import argparse
import shutil
import tempfile
from collections.abc import Iterator
from pathlib import Path

import symspline as ss

from . import cost, data, limits, machine, side_by_side
from .data import FULL, QUICK, Sizes
from .tables import table
from .timing import Effort

HERE = Path(__file__).parent
BEGIN, END = "<!-- measured: begin -->", "<!-- measured: end -->"


def main() -> None:
    """Run the benchmarks."""
    parser = argparse.ArgumentParser("python -m benchmarks", description="Benchmarks of symspline.")
    parser.add_argument("--quick", action="store_true", help="a smoke test: tiny sizes, nothing is kept")
    quick = parser.parse_args().quick
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(shutil.copytree(HERE, Path(scratch) / "benchmarks")) if quick else HERE
        if quick:
            print("A smoke test: it shows that the benchmarks run; its numbers mean nothing.\n", flush=True)
        _run(folder, *((QUICK, Effort(2, 0, 0.1)) if quick else (FULL, Effort(7, 0.02, 10))))


def _run(folder: Path, sizes: Sizes, effort: Effort) -> None:
    file, threads = folder / "README.md", ss.num_threads()
    before, after = _around(file.read_text(encoding="utf-8"))
    pieces = []
    for piece in _pieces(folder, sizes, threads, effort):
        print(piece, end="\n\n", flush=True)
        pieces.append(piece)
    measured = "\n\n".join((BEGIN, *pieces, END))
    file.write_text(f"{before}{measured}{after}", encoding="utf-8")


def _around(readme: str) -> tuple[str, str]:
    """The text before and after what is measured."""
    before, begin, rest = readme.partition(BEGIN)
    _, end, after = rest.partition(END)
    if not begin or not end:
        raise SystemExit(f"benchmarks/README.md lacks the lines {BEGIN} and {END}")
    return before, after


def _pieces(folder: Path, sizes: Sizes, threads: int, effort: Effort) -> Iterator[str]:
    """The measured part of the README, paragraph by paragraph."""
    yield "## Where and with what"
    yield table(("", ""), machine.description(threads).items())
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


if __name__ == "__main__":
    main()
