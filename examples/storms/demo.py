"""Storm tracks on a globe: what symspline does, on real data.

``python examples/storms/demo.py [--out FOLDER]`` turns the 37 Atlantic storms of NOAA's HURDAT2 sample into C²
curves on S², prints a table, and writes hourly positions, one of the splines and three pictures.
"""

from __future__ import annotations

import argparse
import csv
import sys
import time
from collections.abc import Sequence
from importlib.util import find_spec
from pathlib import Path
from textwrap import fill

import numpy as np
from hurdat import Storm, read_sample
from tracks import GLOBE, Positions, Summary, comparison, fit_tracks, hourly, summary

from symspline import CubicSpline
from symspline._base.system import replacing

_GAP = np.timedelta64(1, "h")
"""Extra fixes closer to another fix are left out. Rounding to 0.1 degree makes an error of 11.1/√12 =
3.2 km, of the step between two fixes 4.5 km: of the speed 9 km/h over half an hour, 0.8 km/h over six."""

_PORTRAIT = "Gaston 2022"
"""The storm that is saved and drawn on its own: it makes a long loop and never stands still."""


def run(folder: Path) -> None:
    """Run the demo; its files go to ``folder``, which exists."""
    start = time.perf_counter()
    fixes = read_sample()
    storms = [storm.spaced(_GAP) for storm in fixes]
    before = time.perf_counter()
    splines = fit_tracks(storms)
    fit_time = time.perf_counter() - before
    rows = _summaries(storms, splines)
    portrait = [storm.label for storm in storms].index(_PORTRAIT)

    _print_selection(fixes, rows)
    _print_text(
        f"All {len(storms)} tracks became C2 splines on S2 in one call of fit_many, "
        f"which took {1e3 * fit_time:.1f} ms."
    )
    _print_table(rows)
    _print_comparison(storms[portrait], splines[portrait])
    written = _write_data(folder, storms, splines, portrait)
    written += _write_pictures(folder, storms, splines, portrait)
    print("Written:", *written, sep="\n  ")
    print(f"Run time: {time.perf_counter() - start:.1f} s")


def _summaries(storms: Sequence[Storm], splines: Sequence[CubicSpline]) -> list[Summary]:
    return [summary(storm, spline) for storm, spline in zip(storms, splines, strict=True)]


# ---- text ----


def _print_text(paragraph: str) -> None:
    print(fill(paragraph, 105), end="\n\n")


def _print_selection(fixes: Sequence[Storm], rows: Sequence[Summary]) -> None:
    """What was read, what was left out, and what difference that makes."""
    read, kept = sum(map(len, fixes)), sum(row.points for row in rows)
    everything = _summaries(fixes, fit_tracks(fixes))
    changed = [
        f"{full.top_speed:.0f} instead of {row.top_speed:.0f} for {row.label}"
        for row, full in zip(rows, everything, strict=True)
        if full.top_speed - row.top_speed > 5
    ]
    _print_text(
        "Atlantic storms of 2021 and 2022, best tracks of NOAA's HURDAT2, times in UTC. "
        f"{len(fixes)} storms, {read} fixes; {read - kept} landfalls less than an hour from another fix are "
        "left out, because positions are rounded to 0.1 degree: of the speed that is an error of 9 km/h "
        "between fixes half an hour apart, 0.8 km/h between fixes six hours apart. With all fixes the top "
        f"speeds would be, in km/h, {', '.join(changed)}. Ends are natural: a not-a-knot end would follow the "
        "rounding of the last fixes."
    )


_HEADER = """\
                                          jump at the knots, relative   longest     top
storm           points  iter.  residual  position velocity   accel.    step km    km/h  when (UTC)"""


def _print_table(rows: Sequence[Summary]) -> None:
    """A line for every storm."""
    print(_HEADER)
    for row in rows:
        jumps = " ".join(f"{jump:8.1e}" for jump in row.jumps)
        print(
            f"{row.label:16}{row.points:6}{row.iterations:7}{row.residual:10.1e}  {jumps}"
            f"{row.longest_step:11.0f}{row.top_speed:8.0f}  {str(row.top_time).replace('T', ' ')}"
        )
    ratios = [row.top_speed / row.mean_speed for row in rows]
    print()
    _print_text(
        "A jump is the difference of the values of two segments, each evaluated on its own, where they meet, "
        "relative to the largest value. Top speeds are looked for minute by minute along the spline; they are "
        f"{min(ratios):.2f} to {max(ratios):.2f} times the largest mean speed between two fixes of the storm."
    )


def _print_comparison(storm: Storm, spline: CubicSpline) -> None:
    """What jumps at the fixes of one storm."""
    compared = comparison(storm, spline)
    print(f"{storm.label}, largest jumps at a fix:")
    for name in compared.motions:
        speed, course = compared.steps(name)
        print(f"  {name:22} speed {speed:8.2g} km/h, course {course:8.2g} degrees")
    print()


# ---- files ----


def _write_data(
    folder: Path, storms: Sequence[Storm], splines: Sequence[CubicSpline], portrait: int
) -> list[Path]:
    """Hourly positions as CSV and NPZ, and one spline."""
    positions = hourly(storms, splines)
    table, arrays, curve = (
        folder / "tracks.csv",
        folder / "tracks.npz",
        folder / f"{_PORTRAIT.lower().replace(' ', '-')}.npz",
    )
    _write_csv(table, positions)
    with replacing(arrays) as file:
        np.savez(file, **vars(positions))
    splines[portrait].save(curve)
    return [table, arrays, curve]


def _write_csv(path: Path, positions: Positions) -> None:
    columns = vars(positions)
    with replacing(path) as temporary, temporary.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(columns)
        for storm, when, lon, lat, speed in zip(*columns.values(), strict=True):
            writer.writerow([storm, when, f"{lon:.5f}", f"{lat:.5f}", f"{speed:.3f}"])


def _write_pictures(
    folder: Path, storms: Sequence[Storm], splines: Sequence[CubicSpline], portrait: int
) -> list[Path]:
    """The pictures, if matplotlib is there."""
    if find_spec("matplotlib") is None:
        print("No pictures without matplotlib; install it with: pip install 'symspline[plot]'")
        return []
    from maps import draw_comparison, draw_three_points, draw_tracks

    tracks, points, c2 = (folder / name for name in ("tracks.png", "three-points.png", "c2.png"))
    with replacing(tracks) as file:
        draw_tracks(storms, splines, file)
    with replacing(points) as file:
        # The example of Appendix D of the paper, with the natural ends that are the paper's default.
        draw_three_points(CubicSpline(None, np.eye(3), GLOBE), file)
    with replacing(c2) as file:
        draw_comparison(storms[portrait], splines[portrait], file)
    return [tracks, points, c2]


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the demo from the command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "--out", type=Path, default=Path("demo-output"), metavar="FOLDER", help="default: %(default)s"
    )
    folder: Path = parser.parse_args(arguments).out
    try:
        folder.mkdir(parents=True, exist_ok=True)
        run(folder)
    except OSError as error:
        print(f"demo: cannot write {error.filename or folder}: {error.strerror}", file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
