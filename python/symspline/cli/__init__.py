"""Smooth C² curves through data in files, on spheres and other curved spaces

example:
  symspline fit track.csv --lonlat -o track.npz
  symspline check track.npz
  symspline sample track.npz --every 10min -o smooth.csv
  symspline plot track.npz -o track.png
  symspline grid wind.npz --space sphere:2 --zoom 2 -o fine.npz
  symspline fit - --lonlat -o - < track.csv | symspline sample - -n 100 -o - | head

See also `symspline VERB --help`, and `symspline info` for the spaces and formats of files. Exit codes: 0 success, 1 not
converged or check failed, 2 invalid input or usage, 130 interrupted. Results go to standard output only for -o -;
descriptions, warnings and errors go to standard error. An output file appears only when it is complete; a failed run
leaves an older file unchanged.
"""

from __future__ import annotations

import io
import os
import sys
from collections.abc import Sequence

from .._base.exceptions import ConvergenceError, SymsplineError
from .._base.version import VERSION
from . import _check, _fit, _grid, _info, _plot, _sample
from ._help import Parser, add_completion, texts_of
from ._messages import QUIET, USUAL, VERBOSE, Problem, for_command_line, say, set_level

__all__ = ["main"]

FAILED, BAD, INTERRUPTED, BROKEN_PIPE = 1, 2, 130, 141


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line and return the exit code."""
    if isinstance(sys.stdout, io.TextIOWrapper):
        # Names of curves may contain characters that the terminal cannot show.
        sys.stdout.reconfigure(errors="backslashreplace")
    try:
        parser = _parser()
        options = parser.parse_args(arguments)
        if not hasattr(options, "run"):
            parser.print_help()
            return 0
        set_level(options.level)
        # argparse makes an empty list of --option=--.
        if any(
            [] in (value if isinstance(value, list) else [value]) or value == [] for value in vars(options).values()
        ):
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


def _parser() -> Parser:
    parser = Parser("symspline", **texts_of(__doc__))
    parser.add_argument("--version", action="version", version=f"symspline {VERSION}")
    add_completion(parser)
    verbs = parser.add_subparsers(metavar="VERB")
    for verb in (_fit, _sample, _plot, _check, _info, _grid):
        texts = texts_of(verb.__doc__)
        summary = texts["description"].partition("\n")[0]
        own = verbs.add_parser(verb.__name__.rpartition("._")[2], help=summary, **texts)
        verb.add_arguments(own)
        level = own.add_mutually_exclusive_group().add_argument
        quiet = "print only warnings and errors, besides results"
        level("-q", "--quiet", dest="level", action="store_const", const=QUIET, default=USUAL, help=quiet)
        level("-v", "--verbose", dest="level", action="store_const", const=VERBOSE, help="print more about the work")
        own.set_defaults(run=verb.run)
    return parser
