"""Smooth C² curves through data in files, on spheres and other curved spaces

example:
  symspline fit track.csv --lonlat -o track.npz
  symspline check track.npz
  symspline sample track.npz --every 10min -o smooth.csv
  symspline plot track.npz -o track.png
  symspline grid dti.nii.gz --order fsl --zoom 2 -o fine.nii.gz

See also `symspline VERB --help`. Exit codes: 0 success, 1 not converged or check failed, 2 invalid input or usage,
130 interrupted. An output file appears only when it is complete; a failed run leaves an older file unchanged.
"""

from __future__ import annotations

import argparse
import io
import os
import sys
from collections.abc import Sequence
from typing import Any, NoReturn

from .._exceptions import ConvergenceError, SymsplineError
from .._version import VERSION
from . import _check, _fit, _grid, _plot, _sample
from ._messages import Problem, for_command_line, say

__all__ = ["main"]

_COMMON: dict[str, Any] = {"formatter_class": argparse.RawDescriptionHelpFormatter, "allow_abbrev": False}
FAILED, BAD, INTERRUPTED, BROKEN_PIPE = 1, 2, 130, 141


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line and return the exit code."""
    if isinstance(sys.stdout, io.TextIOWrapper):
        # Names of curves may contain characters that the terminal cannot show.
        sys.stdout.reconfigure(errors="backslashreplace")
    try:
        options = _parser().parse_args(arguments)
        # argparse makes an empty list of --option=--.
        if any(isinstance(value, list) for value in vars(options).values()):
            raise Problem("an option has the value --, which has no meaning here")
        code: int = options.run(options)
        print(end="", flush=True)
        return code
    except BrokenPipeError:
        _drop_output()
        return BROKEN_PIPE
    except KeyboardInterrupt:
        return _failed("interrupted", INTERRUPTED)
    except MemoryError:
        return _failed("there is not enough memory for this", BAD)
    except OSError as error:
        if error.filename is None:
            _drop_output()
        return _failed(f"cannot write {error.filename or 'the output'}: {error.strerror or error}", BAD)
    except Problem as error:
        return _failed(error, error.code)
    except SymsplineError as error:
        return _failed(for_command_line(error), FAILED if isinstance(error, ConvergenceError) else BAD)


def _failed(message: object, code: int) -> int:
    say(message)
    return code


def _drop_output() -> None:
    """Discard output that would be flushed at exit, as its reader has stopped."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


class _Parser(argparse.ArgumentParser):
    def error(self, message: str) -> NoReturn:
        raise Problem(f"{message} (see {self.prog} --help)")


def _parser() -> _Parser:
    parser = _Parser("symspline", **_texts(__doc__))
    parser.add_argument("--version", action="version", version=f"symspline {VERSION}")
    verbs = parser.add_subparsers(required=True, metavar="VERB")
    for verb in (_fit, _sample, _plot, _check, _grid):
        texts = _texts(verb.__doc__)
        summary = texts["description"].partition("\n")[0]
        own = verbs.add_parser(verb.__name__.rpartition("._")[2], help=summary, **texts)
        verb.add_arguments(own)
        own.set_defaults(run=verb.run)
    return parser


def _texts(doc: str | None) -> dict[str, Any]:
    """Return the help texts in the docstring of a module, which is absent under ``python -OO``."""
    description, _, examples = (doc or "").partition("\nexample")
    return {"description": description, "epilog": f"example{examples}", **_COMMON}
