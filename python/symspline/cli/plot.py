"""``symspline plot``: a file of curves becomes a picture."""

from __future__ import annotations

import argparse
from pathlib import Path

from .curves import Curves, read_curves
from .errors import Problem, check_target, did_you_mean, listed, writing

SUMMARY = "draw a curve"
DESCRIPTION = """\
Draw a curve, its speed and its acceleration. The ending of the picture's name says how it is written: .png,
.pdf, .svg or another one that matplotlib knows."""
EPILOG = """\
examples:
  symspline plot track.npz -o track.png
  symspline plot storms.npz --curve Ida -o ida.pdf"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The options of ``symspline plot``."""
    add = parser.add_argument
    add("curves", type=Path, metavar="CURVE", help="file of curves to read: .npz")
    add("--curve", metavar="NAME", help="which curve, if there are several")
    add("-o", dest="output", type=Path, metavar="PICTURE", required=True, help="picture to write")


def run(options: argparse.Namespace) -> int:
    """Draw, and write the picture."""
    check_target(options.output)
    curves = read_curves(options.curves)
    name = _chosen(curves, options)
    try:
        figure = curves.splines[name].plot()
    except ImportError as error:
        raise Problem(str(error)) from None
    ending = options.output.suffix[1:].lower()
    known = figure.canvas.get_supported_filetypes()
    if ending not in known:
        raise Problem(f"{options.output}: the name of a picture must end in .{', .'.join(sorted(known))}")
    with writing(options.output) as temporary:
        figure.savefig(temporary)
    print(f"{options.output}: a picture of {curves.called(name)}")
    return 0


def _chosen(curves: Curves, options: argparse.Namespace) -> str:
    names = list(curves.splines)
    if options.curve is None:
        if len(names) > 1:
            raise Problem(
                f"{options.curves} has {len(names)} curves; say which with --curve: {listed(names)}"
            )
        return names[0]
    chosen: str = options.curve
    if chosen not in names:
        raise Problem(f"{options.curves} has no curve {chosen!r}; {did_you_mean(chosen, names)}")
    return chosen
