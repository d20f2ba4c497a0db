"""Draw curves

The picture shows one curve or several, of one file or several, with their speed and acceleration, or a grid. Tracks
that were fitted with --lonlat are drawn on the Earth with land, with their speed in km/h; --lonlat does so for any
curve on sphere:2. Segments of one recording are drawn together. The ending of the picture's name selects the format:
.png, .pdf, .svg or another one that matplotlib can write.

examples:
  symspline plot track.npz -o track.png
  symspline plot storms.npz --curve Ida --curve Julian --title "Storms of 2021" -o storms.pdf
  symspline plot monday.npz tuesday.npz --size 7,4 --dpi 300 -o week.png
"""

from __future__ import annotations

import argparse
import zipfile
from pathlib import Path
from typing import Any

from .. import geo
from .._grid import GridSpline
from .._splines.base import plot
from .._splines.composed import SegmentedCurve
from .._splines.files import load
from ._curves import Curves, read_curves
from ._messages import (
    STANDARD,
    Problem,
    Source,
    alternatives,
    called,
    check_inputs,
    check_target,
    counted,
    refuse,
    tell,
    writing,
)
from ._tables import CURVES, is_number

_NAMED = 12
"""The largest number of curves whose names are in the legend."""
_DPI = 10, 2400
_INCHES = 100


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of ``symspline plot``."""
    add = parser.add_argument
    add("curves", type=Path, nargs="+", metavar="CURVE", help="files of curves to read: .npz, or -")
    add("--curve", action="append", metavar="NAME", help="which curve; may be repeated (default: all)")
    add("--lonlat", action="store_true", help="draw any curve on sphere:2 on the Earth")
    add("--title", metavar="TEXT", help="title of the picture")
    add("--size", type=_size, metavar="W,H", help="width and height in inches")
    add("--dpi", type=_dpi, metavar="N", help="dots per inch of a picture made of dots (default: 150)")
    add("-o", "--output", type=Path, metavar="PICTURE", required=True, help="picture to write, or -")
    add("--to", metavar="FORMAT", help="format of the picture, such as pdf (default: as its name ends, PNG for -)")


def _size(text: str) -> tuple[float, float]:
    cells = text.split(",")
    if len(cells) != 2 or not all(is_number(cell) and 0 < float(cell) <= _INCHES for cell in cells):
        raise argparse.ArgumentTypeError(f"{text}: give width and height in inches, such as 7,4")
    return float(cells[0]), float(cells[1])


def _dpi(text: str) -> float:
    low, high = _DPI
    if not (is_number(text) and low <= float(text) <= high):
        raise argparse.ArgumentTypeError(f"{text}: give a number between {low} and {high}, such as 300")
    return float(text)


def run(options: argparse.Namespace) -> int:
    """Draw the curves, and write the picture."""
    check_inputs(*options.curves)
    check_target(options.output, *options.curves, binary=True)
    try:
        figure, what = _drawn(options)
    except ImportError as error:
        raise Problem(str(error)) from None
    # A still image in a format of animations would mislead.
    known = sorted(set(figure.canvas.get_supported_filetypes()) - {"gif", "apng"})
    form = options.to or ("png" if options.output == STANDARD else options.output.suffix[1:].lower())
    endings = alternatives([f".{end}" for end in known])
    refuse(options.output, (form not in known, f": the name of a picture must end in {endings}"))
    with writing(options.output) as temporary:
        figure.savefig(temporary, format=form, **({} if options.dpi is None else {"dpi": options.dpi}))
    tell(f"{called(options.output)}: a picture of {what}")
    return 0


def _drawn(options: argparse.Namespace) -> tuple[Any, str]:
    """Return the figure, and a description of what it shows."""
    look: dict[str, Any] = {"title": options.title, "figsize": options.size}
    grids = list(filter(None, map(_grid, options.curves)))
    if grids:
        several = len(options.curves) > 1 or options.curve is not None
        refuse(options.curves[0], (several, " is a grid, which is drawn alone and without --curve"))
        return grids[0].plot(**look), "the grid"
    files = [read_curves(path, options.lonlat) for path in options.curves]
    tracks = _tracks(files, options.curve)
    (name, first), *others = tracks.items()
    lonlat = all(file.columns.lonlat for file in files)
    if not others:
        figure = geo.plot(first, **look) if lonlat else first.plot(**look)
        return figure, "the curve" if options.curve is None else f"curve {name!r}"
    spaces = list(dict.fromkeys(str(curve.space) for curve in tracks.values()))
    refuse("curves of one picture are on one space, not on ", (len(spaces) > 1, " and ".join(spaces)))
    names = list(tracks) if len(tracks) <= _NAMED else None
    items = list(tracks.values())
    figure = geo.plot(tracks if names else items, **look) if lonlat else plot(items, labels=names, **look)
    return figure, counted(len(tracks), "curve")


def _grid(path: Path) -> GridSpline | None:
    """Return the grid in a file, None if it has something else."""
    with Source(path, CURVES[0]).open() as file:
        if not zipfile.is_zipfile(file):
            return None
        file.seek(0)
        content = load(file)
        return content if isinstance(content, GridSpline) else None


def _tracks(files: list[Curves], chosen: list[str] | None) -> dict[str, Any]:
    """Return the curves by their names, those of several files with the name of their file."""
    tracks: dict[str, Any] = {}
    for file in files:
        # A name may be in one of the files only.
        names = None if chosen is None else [name for name in chosen if name in {*file.splines, *file.recordings}]
        if names == [] and len(files) > 1:
            continue
        curves = file.chosen(chosen if len(files) == 1 else names)
        for name, segments in curves.recordings.items():
            splines = [curves.splines[segment] for segment in segments]
            stem = file.file.path.stem if file.file is not None else ""
            own = name if chosen is None or name else chosen[0]
            label = own if len(files) == 1 else f"{stem} {name}" if curves.named and name else stem
            tracks[label] = splines[0] if len(splines) == 1 else SegmentedCurve(splines)
    refuse("", (not tracks, f"no file has a curve {(chosen or [''])[0]!r}"))
    return tracks
