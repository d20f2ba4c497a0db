"""Help texts at the width of the terminal, suggestions for misspelt options and verbs, and completion in shells."""

from __future__ import annotations

import argparse
import re
import textwrap
from collections.abc import Sequence
from difflib import get_close_matches
from typing import Any, NoReturn

from ._messages import Problem

_SHELLS = ("bash", "zsh")
# The first column of a table in a help text, with the blanks after it.
_TERM = re.compile(r" *\S+(?: \S+)* {2,}")


class Parser(argparse.ArgumentParser):
    """A parser that raises `Problem` and suggests what was meant."""

    def error(self, message: str) -> NoReturn:
        """Raise `Problem`."""
        raise Problem(f"{message} (see {self.prog} --help)")

    def parse_known_args(self, args: Any = None, namespace: Any = None) -> Any:
        """Parse, and raise `Problem` for arguments that are not known."""
        known, unknown = super().parse_known_args(args, namespace)
        if unknown:
            self.error(f"unrecognized arguments: {' '.join(unknown)}{self._suggestion(unknown[0])}")
        return known, unknown

    def _suggestion(self, argument: str) -> str:
        """Return the option that was probably meant."""
        names = [name for action in self._actions for name in action.option_strings]
        close = get_close_matches(argument.partition("=")[0], names, 1) if argument.startswith("-") else []
        return f"; did you mean {close[0]}?" if close else ""

    def _check_value(self, action: argparse.Action, value: Any) -> None:
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


def texts_of(doc: str | None) -> dict[str, Any]:
    """Return the arguments of a parser with the docstring of a module, which is absent under ``python -OO``."""
    description, _, examples = (doc or "").partition("\nexample")
    return {
        "description": description,
        "epilog": f"example{examples}",
        "formatter_class": _Formatter,
        "allow_abbrev": False,
    }


class _Completion(argparse.Action):
    """Prints the completion of a shell, which the package shtab writes."""

    def __call__(self, parser: argparse.ArgumentParser, namespace: Any, value: Any, option: str | None = None) -> None:
        try:
            import shtab
        except ImportError:
            raise Problem("completion needs shtab; install it with: pip install 'symspline[completion]'") from None
        print(shtab.complete(parser, value))
        parser.exit(0)


def add_completion(parser: argparse.ArgumentParser) -> None:
    """Add the option that prints the completion of a shell."""
    text = "print the completion of a shell, such as for eval in .bashrc"
    parser.add_argument("--print-completion", action=_Completion, choices=_SHELLS, help=text)
