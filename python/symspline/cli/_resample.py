"""Fit curves to a table and sample them, in one step

This is symspline fit and symspline sample with the same options, without a file of curves.

examples:
  symspline resample track.csv --lonlat --every 1min -o smooth.csv
  symspline resample run.gpx --every 10s -o run10.gpx
  symspline resample gps.csv --lonlat --smooth --every 1s --nu 0,1 -o smooth.csv
"""

from __future__ import annotations

import argparse

from ._fit import add_fit, fit_table
from ._messages import say, tell
from ._sample import add_output, check_output, sample


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of ``symspline resample``."""
    add_output(parser)
    add_fit(parser)
    parser.set_defaults(at=None)


def run(options: argparse.Namespace) -> int:
    """Read, fit, evaluate and write."""
    check_output(options, options.input)
    curves, description, notes = fit_table(options)
    tell(description)
    for note in notes:
        say(note)
    return sample(curves, curves, options, options.input)
