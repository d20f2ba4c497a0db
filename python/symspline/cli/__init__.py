"""The command line: ``symspline fit``, ``sample``, ``plot``, ``check`` and ``demo``."""

from __future__ import annotations

import argparse
import io
import os
import sys
from collections.abc import Sequence
from typing import NoReturn

from .._core import ConvergenceError, CutLocusError, ValidationError
from ..version import VERSION
from . import check, demo, fit, plot, sample
from .errors import Problem, say, with_names

FAILED, BAD, INTERRUPTED, BROKEN_PIPE = 1, 2, 130, 141

_DESCRIPTION = "Smooth C2 curves through data in files, on spheres and other curved spaces."
_EPILOG = """\
example:
  symspline fit track.csv --lonlat -o track.npz
  symspline check track.npz
  symspline sample track.npz --every 10min -o smooth.csv
  symspline plot track.npz -o track.png

`symspline VERB --help` says more. Exit codes: 0 done, 1 not converged or check failed, 2 bad input or usage,
130 interrupted. An output file appears only when it is complete; until then an older one stays as it was.
"""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line; returns the exit code."""
    if isinstance(sys.stdout, io.TextIOWrapper):
        # Names of curves may hold letters that a terminal has not got.
        sys.stdout.reconfigure(errors="backslashreplace")
    try:
        options = _parser().parse_args(arguments)
        if any(isinstance(value, list) for value in vars(options).values()):
            # What argparse makes of --option=--
            raise Problem("an option has the value --, which means nothing here")
        code: int = options.run(options)
        print(end="", flush=True)
        return code
    except BrokenPipeError:
        _drop_output()
        return BROKEN_PIPE
    except KeyboardInterrupt:
        return _say("interrupted", INTERRUPTED)
    except ConvergenceError as error:
        return _say(error, FAILED)
    except MemoryError:
        return _say("there is not enough memory for this", BAD)
    except OSError as error:
        if error.filename is None:
            _drop_output()
        return _say(f"cannot write {error.filename or 'the output'}: {error.strerror or error}", BAD)
    except Problem as error:
        return _say(error, error.code)
    except (ValidationError, CutLocusError) as error:
        return _say(with_names(str(error)), BAD)


def _say(message: object, code: int) -> int:
    """Print one line on stderr; returns the exit code."""
    say(message)
    return code


def _drop_output() -> None:
    """Nobody reads on: what is still to be flushed at exit goes nowhere."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


class _Parser(argparse.ArgumentParser):
    def error(self, message: str) -> NoReturn:
        raise Problem(f"{message} (see {self.prog} --help)")


def _parser() -> _Parser:
    style = argparse.RawDescriptionHelpFormatter
    parser = _Parser(
        "symspline", description=_DESCRIPTION, epilog=_EPILOG, formatter_class=style, allow_abbrev=False
    )
    parser.add_argument("--version", action="version", version=f"symspline {VERSION}")
    verbs = parser.add_subparsers(required=True, metavar="VERB")
    for verb in (fit, sample, plot, check, demo):
        name = verb.__name__.rpartition(".")[2]
        own = verbs.add_parser(
            name,
            help=verb.SUMMARY,
            description=verb.DESCRIPTION,
            epilog=verb.EPILOG,
            formatter_class=style,
            allow_abbrev=False,
        )
        verb.add_arguments(own)
        own.set_defaults(run=verb.run)
    return parser
