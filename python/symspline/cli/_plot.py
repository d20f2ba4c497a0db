"""Draw a curve

The picture shows the curve, its speed and its acceleration. Tracks that were fitted with --lonlat are drawn on the
Earth with land, with their speed in km/h; --lonlat does so for any curve on sphere:2. The ending of the picture's name
selects the format: .png, .pdf, .svg or another one that matplotlib can write.

examples:
  symspline plot track.npz -o track.png
  symspline plot storms.npz --curve Ida -o ida.pdf
"""

from __future__ import annotations

import argparse
from pathlib import Path

from .. import geo
from .._splines.composed import SegmentedCurve
from ._curves import read_curves
from ._messages import STANDARD, Problem, alternatives, called, check_target, listed, refuse, tell, writing


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of ``symspline plot``."""
    add = parser.add_argument
    add("curves", type=Path, metavar="CURVE", help="file of curves to read: .npz, or -")
    which = "which curve, if there are several; segments of one recording are drawn together"
    add("--curve", metavar="NAME", help=which)
    add("--lonlat", action="store_true", help="draw any curve on sphere:2 on the Earth")
    add("-o", dest="output", type=Path, metavar="PICTURE", required=True, help="picture to write, or -")
    add("--to", metavar="FORMAT", help="format of the picture, such as pdf (default: as its name ends, PNG for -)")


def run(options: argparse.Namespace) -> int:
    """Draw the curve, and write the picture."""
    check_target(options.output, options.curves, binary=True)
    curves = read_curves(options.curves, options.lonlat)
    curves = curves.chosen(None if options.curve is None else [options.curve])
    recordings = curves.recordings
    several = f" has {len(recordings)} curves; say which with --curve: {listed([*recordings])}"
    refuse(curves.file, (len(recordings) > 1, several))
    (names,) = recordings.values()
    segments = [curves.splines[name] for name in names]
    curve = segments[0] if len(segments) == 1 else SegmentedCurve(segments)
    try:
        figure = geo.plot(curve) if curves.columns.lonlat else curve.plot()
    except ImportError as error:
        raise Problem(str(error)) from None
    # A still image in a format of animations would mislead.
    known = sorted(set(figure.canvas.get_supported_filetypes()) - {"gif", "apng"})
    form = options.to or ("png" if options.output == STANDARD else options.output.suffix[1:].lower())
    endings = alternatives([f".{end}" for end in known])
    refuse(options.output, (form not in known, f": the name of a picture must end in {endings}"))
    with writing(options.output) as temporary:
        figure.savefig(temporary, format=form)
    what = "the curve" if options.curve is None else f"curve {options.curve!r}"
    tell(f"{called(options.output)}: a picture of {what}")
    return 0
