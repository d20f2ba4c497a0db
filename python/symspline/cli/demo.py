"""``symspline demo``: what symspline does, on real data."""

from __future__ import annotations

import argparse
from pathlib import Path

from .errors import Problem

SUMMARY = "turn 37 storms into C2 tracks on a globe"
DESCRIPTION = """\
Turn the 37 Atlantic storms of NOAA's best-track sample into C2 curves on S2, print a table, and write hourly
positions, one of the splines and pictures."""
EPILOG = """\
example:
  symspline demo --out storms"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The options of ``symspline demo``."""
    parser.add_argument(
        "--out", type=Path, default=Path("demo-output"), metavar="FOLDER", help="default: %(default)s"
    )


def run(options: argparse.Namespace) -> int:
    """Run the demo."""
    from .. import demo

    try:
        options.out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise Problem(f"cannot make the folder {options.out}: {error.strerror}") from None
    demo.run(options.out)
    return 0
