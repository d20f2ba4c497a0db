"""Smooth C² curves through data in files, on spheres and other curved spaces

example:
  symspline fit track.csv --lonlat -o track.npz
  symspline check track.npz
  symspline sample track.npz --every 10min -o smooth.csv
  symspline plot track.npz -o track.png
  symspline resample track.csv --lonlat --every 10min -o smooth.csv
  symspline fit - --lonlat -o - < track.csv | symspline sample - -n 100 -o - | head

See also `symspline VERB -h` for the usual options, `symspline help VERB` for all, and `symspline info` for the spaces
and formats of files. Exit codes: 0 success, 1 not converged or check failed, 2 invalid input or usage, 130 interrupted.
Results go to standard output only for -o -; descriptions, warnings and errors go to standard error. An output file
appears only when it is complete; a failed run leaves an older file unchanged.
"""

from __future__ import annotations

import argparse
import io
import os
import re
import sys
import textwrap
from collections.abc import Callable, Sequence
from difflib import get_close_matches
from typing import Any, NoReturn

from .._base import VERSION
from .._base.exceptions import ConvergenceError, SymsplineError
from .._base.typing import Keywords
from .._spaces.base import CLASSES
from . import _check, _fit, _info, _plot, _resample, _sample
from ._info import name_of_example
from ._messages import QUIET, USUAL, VERBOSE, Problem, for_command_line, printed_warnings, say, set_level

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
        with printed_warnings():
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
        if error.errno is None:
            # Libraries raise such errors for files that they cannot read.
            return _failed(f"a file cannot be read: {error}", BAD)
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
    if sys.stdout is not None:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _parser() -> _Parser:
    parser = _Parser("symspline", **_texts_of(__doc__))
    parser.add_argument("-h", "--help", action="help", help="print this text")
    parser.add_argument("-V", "--version", action="version", version=f"symspline {VERSION}")
    _add_completion(parser)
    verbs = parser.add_subparsers(metavar="VERB")
    for verb in (_fit, _sample, _resample, _plot, _check, _info):
        texts = _texts_of(verb.__doc__)
        summary = texts["description"].partition("\n")[0]
        command = verbs.add_parser(verb.__name__.rpartition("._")[2], help=summary, **texts)
        command.add_argument("-h", action=_ShortHelp, nargs=0, help="print the usual options")
        command.add_argument("--help", action="help", help="print all options and details")
        verb.add_arguments(command)
        level = command.add_mutually_exclusive_group().add_argument
        quiet = "print only warnings and errors, besides results"
        level("-q", "--quiet", dest="level", action="store_const", const=QUIET, default=USUAL, help=quiet)
        level("-v", "--verbose", dest="level", action="store_const", const=VERBOSE, help="print more about the work")
        command.set_defaults(run=verb.run)
    known = dict(verbs.choices)
    about = verbs.add_parser("help", help="print all options and details of a verb", add_help=False)
    about.add_argument("verb", nargs="?", choices=list(known), metavar="VERB")

    def print_help(options: argparse.Namespace) -> int:
        known.get(options.verb, parser).print_help()
        return 0

    about.set_defaults(run=print_help, level=USUAL)
    return parser


# ---- help, suggestions and completion ----

_SHELLS = ("bash", "zsh", "fish")
_USUAL = {
    "fit": "--space --lonlat --degrees --time --columns --curve --skipna --max-gap --smooth --sigma --robust -o",
    "sample": "--every -n --at --nu --curve --lines -o",
    "resample": "--every -n --space --lonlat --time --columns --curve --skipna --max-gap --smooth -o",
    "plot": "--curve --lonlat --title --size -o",
    "check": "--curve",
    "info": "--time",
}
"""The options in the short help of each verb, which is one screen."""
_EXAMPLES = 4
"""Lines of examples in a short help."""
_CLAUSE = re.compile(r"[;:] ")
"""The end of the first clause of a help text."""
# The first column of a table in a help text, with the blanks after it.
_TERM = re.compile(r" *\S+(?: \S+)* {2,}")


class _Parser(argparse.ArgumentParser):
    """A parser that raises `Problem` and suggests what was meant."""

    def error(self, message: str) -> NoReturn:
        """Raise `Problem`."""
        raise Problem(f"{message} (see {self.prog} --help)")

    def parse_known_args(self, args: Any = None, namespace: Any = None) -> Any:
        """Parse, and raise `Problem` for arguments that are not known."""
        args = self._with_words(sys.argv[1:] if args is None else args)
        known, unknown = super().parse_known_args(args, namespace)
        if unknown:
            self.error(f"unrecognized arguments: {' '.join(unknown)}{self._suggestion(unknown[0])}")
        return known, unknown

    def _with_words(self, args: Sequence[str]) -> list[str]:
        """Join options and their optional words, so that options without one do not take the next argument."""
        words = {
            name: (action.choices, action.const)
            for action in self._actions
            if action.nargs == "?" and action.choices
            for name in action.option_strings
        }
        end = [*args, "--"].index("--")
        joined: list[str] = []
        for argument in args[:end]:
            # Missing values may begin with a minus.
            if joined and (joined[-1] == "--na" or (joined[-1] in words and argument in words[joined[-1]][0])):
                joined[-1] += f"={argument}"
            else:
                joined.append(argument)
        joined = [f"{argument}={words[argument][1]}" if argument in words else argument for argument in joined]
        return [*joined, *args[end:]]

    def _suggestion(self, argument: str) -> str:
        """Return the option that was probably meant."""
        names = [name for action in self._actions for name in action.option_strings]
        close = get_close_matches(argument.partition("=")[0], names, 1) if argument.startswith("-") else []
        return f"; did you mean {close[0]}?" if close else ""

    def _check_value(self, action: argparse.Action, value: object) -> None:
        if action.choices is None or value in action.choices:
            return
        names = list(action.choices)
        close = get_close_matches(str(value), names, 1)
        choices = f"did you mean {close[0]}?" if close else f"choose from {', '.join(names)}"
        raise argparse.ArgumentError(action, f"invalid choice: {value!r}; {choices}")


class _Formatter(argparse.HelpFormatter):
    """Wraps paragraphs; the lines of examples and of tables stay apart."""

    def _split_lines(self, text: str, width: int) -> list[str]:
        return _wrapped(text, width, 0).split("\n")

    def _fill_text(self, text: str, width: int, indent: str) -> str:
        return "\n\n".join(_filled(paragraph.split("\n"), width) for paragraph in text.strip().split("\n\n"))


def _filled(lines: Sequence[str], width: int) -> str:
    """Wrap one paragraph: lines that are indented continue the line before them if they are indented farther."""
    items: list[str] = []
    indents: list[int] = []
    for line in lines:
        indent = len(line) - len(line.lstrip())
        continues = items and (indent > indents[-1] or indent == indents[-1] == 0) and not items[-1].endswith(":")
        if continues:
            items[-1] += f" {line.strip()}"
        else:
            items.append(line.rstrip())
            indents.append(indent)
    wrapped = []
    for item, indent in zip(items, indents, strict=True):
        command = item.strip().startswith("symspline ")
        term = _TERM.match(item)
        hanging = 0 if not indent else term.end() if term else indent + 4
        # Commands can be copied as they are.
        wrapped.append(item if command and indent else _wrapped(item, width, hanging))
    return "\n".join(wrapped)


def _wrapped(item: str, width: int, hanging: int) -> str:
    return textwrap.fill(item, width, subsequent_indent=" " * hanging, break_long_words=False, break_on_hyphens=False)


def _texts_of(doc: str | None) -> Keywords:
    """Return the arguments of a parser with the docstring of a module, which is absent under ``python -OO``."""
    description, _, examples = (doc or "").partition("\nexample")
    return {
        "description": description,
        "epilog": f"example{examples}",
        "formatter_class": _Formatter,
        "allow_abbrev": False,
        "add_help": False,
    }


class _ShortHelp(argparse.Action):
    """Prints the summary, the usual options and the examples of a verb."""

    def __call__(
        self, parser: argparse.ArgumentParser, namespace: object, value: Any, option: str | None = None
    ) -> None:
        verb = parser.prog.rpartition(" ")[2]
        usual = [action for action in parser._actions if {*_USUAL[verb].split()} & {*action.option_strings}]
        inputs = parser._get_positional_actions()
        formatter = parser._get_formatter()
        formatter.add_usage(f"{parser.prog} {' '.join(str(action.metavar) for action in inputs)} [options]", [], [])
        formatter.add_text((parser.description or "").partition("\n")[0])
        formatter.start_section("usual options")
        for action in usual:
            short = _CLAUSE.split(action.help or "")[0]
            formatter.add_argument(argparse.Action(action.option_strings, "", action.nargs, help=short,
                                                   metavar=action.metavar, choices=action.choices))  # fmt: skip
        formatter.end_section()
        formatter.add_text("\n".join((parser.epilog or "").partition("\n\n")[0].split("\n")[:_EXAMPLES]))
        formatter.add_text(f"{parser.prog} --help prints all options and details.")
        print(formatter.format_help(), end="")
        parser.exit(0)


class _Completion(argparse.Action):
    """Prints the completion of a shell, which the package shtab writes."""

    def __call__(
        self, parser: argparse.ArgumentParser, namespace: object, value: Any, option: str | None = None
    ) -> None:
        try:
            import shtab
        except ImportError:
            raise Problem("completion needs shtab; install it with: pip install 'symspline[completion]'") from None
        if value not in shtab.SUPPORTED_SHELLS:
            raise Problem(f"this version of shtab has no completion for {value}; update it: pip install -U shtab")
        for verb in _actions_of(parser):
            for action in verb:
                # Words that are completed, but are not the only possible ones.
                words = next((_WORDS[name]() for name in action.option_strings if name in _WORDS), None)
                action.choices = words or action.choices
        print(shtab.complete(parser, value))
        parser.exit(0)


_WORDS: dict[str, Callable[[], list[str]]] = {
    "--space": lambda: [name_of_example(cls) for cls in CLASSES.values()],
    "--bc-type": lambda: ["natural", "not-a-knot", "clamped", "periodic"],
    "--method": lambda: ["auto", "quasi-newton", "newton", "homotopy", "fixed-point"],
}


def _actions_of(parser: argparse.ArgumentParser) -> list[list[argparse.Action]]:
    """Return the actions of every verb."""
    verbs = next(action for action in parser._actions if isinstance(action, argparse._SubParsersAction))
    return [verb._actions for verb in verbs.choices.values()]


def _add_completion(parser: argparse.ArgumentParser) -> None:
    """Add the option that prints the completion of a shell."""
    text = "print the completion of a shell, such as for eval in .bashrc"
    parser.add_argument("--print-completion", action=_Completion, choices=_SHELLS, help=text)
