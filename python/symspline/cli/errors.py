"""What can go wrong for a user, in one line."""

from __future__ import annotations

import os
import re
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from difflib import get_close_matches
from pathlib import Path

from ..arrays import brief
from ..disk import replacing
from ..spaces.base import CLASSES

_NAMES = {cls.__name__: name for name, cls in CLASSES.items()}
_SPACE = re.compile(rf"\b({'|'.join(_NAMES)})\(([\w, ]+)\)")


# Letters of a message, which may quote any file.
_LONGEST = 1000


def say(message: object) -> None:
    """Print one line on stderr."""
    print("symspline:", brief(message, _LONGEST), file=sys.stderr)


class Problem(Exception):
    """Bad input or usage; the message is for the user."""

    code = 2


class Failure(Problem):
    """Nothing is wrong with the input, but with what was found."""

    code = 1


def with_names(message: str) -> str:
    """A message of the library with spaces as --space takes them: so:3, not SpecialOrthogonal(3)."""
    return _SPACE.sub(lambda m: f"{_NAMES[m[1]]}:{m[2].replace(' ', '')}", message)


def did_you_mean(name: str, names: Sequence[str]) -> str:
    """Half a sentence with the name that was probably meant, or with all there are."""
    plain = {known.lower(): known for known in names}
    close = get_close_matches(name.lower(), plain, 1)
    if close:
        return f"did you mean {plain[close[0]]!r}?"
    return f"there are {listed(names)}"


def first_twice(names: Sequence[str]) -> str | None:
    """The first name that comes a second time."""
    seen: set[str] = set()
    for name in names:
        if name in seen:
            return name
        seen.add(name)
    return None


def listed(names: Sequence[str]) -> str:
    """The names, or the first of very many."""
    shown = ", ".join(names[:12])
    return shown if len(names) <= 12 else f"{shown}, … ({len(names)})"


@contextmanager
def reading(path: Path) -> Iterator[None]:
    """Says which file could not be read."""
    try:
        yield
    except OSError as error:
        raise Problem(f"cannot read {path}: {error.strerror or error}") from None


def check_target(path: Path) -> None:
    """Raise `Problem` if a file cannot be written: better before the work than after it."""
    if path.is_dir():
        raise Problem(f"cannot write {path}: it is a folder")
    if path.exists() and not path.is_file():
        raise Problem(
            f"cannot write {path}: it is a device, a pipe or a socket; give the name of a regular file"
        )
    # Of a symbolic link the target is written.
    folder = path.resolve().parent if path.is_symlink() else path.parent
    if not folder.is_dir():
        raise Problem(f"cannot write {path}: there is no folder {folder}")
    if not os.access(folder, os.W_OK):
        raise Problem(f"cannot write {path}: no permission to write into {folder}")


@contextmanager
def writing(path: Path) -> Iterator[Path]:
    """A temporary file that becomes ``path`` if all goes well."""
    try:
        with replacing(path) as temporary:
            yield temporary
    except OSError as error:
        raise Problem(f"cannot write {path}: {error.strerror or error}") from None
