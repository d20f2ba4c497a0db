"""Messages, errors and progress of the command line, files and standard streams."""

from __future__ import annotations

import codecs
import gzip
import io
import os
import re
import shutil
import sys
import tempfile
import threading
import time
import warnings
import zlib
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from difflib import get_close_matches
from functools import cache
from pathlib import Path
from typing import BinaryIO, Self

from .._base.arrays import brief
from .._base.system import replacing
from .._base.time import REMEDY
from .._spaces.base import CLASSES

_NAMES = {cls.__name__: name for name, cls in CLASSES.items()}
_SPACE = re.compile(rf"\b({'|'.join(_NAMES)})\((.*?)\)")
_ALL_SPACES = re.compile("known names are .*")
_FOR_PYTHON = {
    "; use space.project(x) if these are meant to be points": "",
    " (np.linalg.qr gives an orthonormal basis)": "",
    ", or raise max_iter": "",
    "such as Sphere(2) or 'sphere:2'": "such as sphere:2",
    "; pass extrapolate=True or 'geodesic' to continue the spline there, or False for NaN": "",
    "symspline.fit_segments": "--max-gap",
    "fit_segments": "--max-gap",
    "make_smoothing_spline": "--smooth",
    REMEDY: "If they count from 1970, give the unit, such as --unix s.",
    "Pass skipna=True to omit": "--skipna omits",
}
"""Advice in messages of the library, and the same for the command line."""

# Messages may quote any part of a file.
_LONGEST = 1000
_WAIT = 1.0
"""Seconds between two updates; shorter work shows nothing."""


QUIET, USUAL, VERBOSE = -1, 0, 1
_level = USUAL


class Problem(Exception):
    """Invalid input or usage. The message is for the user."""

    code = 2


class Failure(Problem):
    """The input is valid, but its check failed."""

    code = 1


def refuse(where: object, *checks: tuple[object, str]) -> None:
    """Raise `Problem` for the first of these pairs of a condition and a message whose condition holds."""
    for bad, message in checks:
        if bad:
            raise Problem(f"{where}{message}")


def for_command_line(error: object) -> str:
    """Return a message of the library with advice for the command line, and with so:3 for SpecialOrthogonal(3)."""
    message = str(error)
    for advice, same in _FOR_PYTHON.items():
        message = message.replace(advice, same)
    message = _ALL_SPACES.sub("symspline info lists the names", message)
    return _SPACE.sub(lambda space: f"{_NAMES[space[1]]}:{space[2].replace(' ', '')}", message)


def did_you_mean(name: str, names: Sequence[str]) -> str:
    """Suggest the name that was probably meant, or list all of them."""
    plain = {known.lower(): known for known in names}
    close = get_close_matches(name.lower(), plain, 1)
    return f"did you mean {plain[close[0]]!r}?" if close else f"there are {listed(names)}"


def counted(count: int, what: str) -> str:
    """Return a count with its noun, such as "2 curves"."""
    return f"{count} {what}{'' if count == 1 else 's'}"


def first_duplicate(names: Sequence[str]) -> str | None:
    """Return the first name that occurs more than once."""
    return next((name for name, count in Counter(names).items() if count > 1), None)


def listed(names: Sequence[str]) -> str:
    """Join names by commas, at most twelve of them."""
    shown = ", ".join(names[:12])
    return shown if len(names) <= 12 else f"{shown}, … ({len(names)})"


def alternatives(names: Sequence[str]) -> str:
    """Join names by commas and "or"."""
    return " or ".join([*filter(None, [", ".join(names[:-1])]), names[-1]])


@contextmanager
def reading(path: object, verb: str = "read") -> Iterator[None]:
    """Raise `Problem` if the file cannot be read."""
    try:
        yield
    except OSError as error:
        raise Problem(f"cannot {verb} {path}: {error.strerror or error}") from None


def set_level(level: int) -> None:
    """Set how much `tell` and `Progress` print: ``QUIET``, ``USUAL`` or ``VERBOSE``."""
    global _level
    _level = level


def tell(message: object, level: int = USUAL) -> None:
    """Print a description of the work on stderr, if the level is reached."""
    if level <= _level and sys.stderr is not None:
        print(brief(message, _LONGEST), file=sys.stderr)


def say(message: object) -> None:
    """Print one line on stderr."""
    if sys.stderr is not None:
        print("symspline:", brief(message, _LONGEST), file=sys.stderr)


@contextmanager
def printed_warnings(text: Callable[[object], str] = str) -> Iterator[None]:
    """Print warnings of the library as messages, after the work; ``text`` returns the message of a warning."""
    with warnings.catch_warnings(record=True) as caught:
        yield
    for warning in caught:
        say(for_command_line(text(warning.message)))


class Progress:
    """Update one line on stderr every second if it is a terminal, and clear it at the end; with ``-v``, print the time.

    Call an instance with the amount done and the total, from any loop or by the library. The line has the time taken,
    too, so that it also moves during a single long step.
    """

    def __init__(self, work: str) -> None:
        self._work = work
        self._width = 0
        self._done = ""

    def __enter__(self) -> Self:
        self._start = time.monotonic()
        self._ended = threading.Event()
        self._line = threading.Thread(target=self._update, daemon=True)
        if _level > QUIET and sys.stderr is not None and sys.stderr.isatty():
            self._line.start()
        return self

    def __call__(self, done: int, total: int) -> None:
        self._done = f" {100 * done // total} %," if total > 0 else ""

    def _update(self) -> None:
        while not self._ended.wait(_WAIT):
            line = f"{self._work}:{self._done} {time.monotonic() - self._start:.0f} s"
            self._width = max(self._width, len(line))
            print("\r" + line.ljust(self._width), end="", file=sys.stderr, flush=True)

    def __exit__(self, *_: object) -> None:
        self._ended.set()
        if self._line.is_alive():
            self._line.join()
        if self._width:
            print("\r" + " " * self._width, end="\r", file=sys.stderr, flush=True)
        tell(f"{self._work} took {time.monotonic() - self._start:.2f} s", VERBOSE)


# ---- files and standard streams, and compressed text ----

STANDARD = Path("-")
"""The name of standard input or output on the command line."""

_GZIP = b"\x1f\x8b"


@dataclass(frozen=True)
class Source:
    """A file to read, or standard input."""

    path: Path
    format: str

    def __str__(self) -> str:
        """Return its name for messages."""
        return "standard input" if self.path == STANDARD else str(self.path)

    @contextmanager
    def open(self) -> Iterator[BinaryIO]:
        """Open the file, which can be done more than once; compressed text is decompressed."""
        with reading(self):
            whole = _standard_input() if self.path == STANDARD else _pipe(self.path) if self.path.is_fifo() else None
            file: BinaryIO = self.path.open("rb") if whole is None else io.BytesIO(whole)
            with file:
                packed = file.read(len(_GZIP)) == _GZIP
                file.seek(0)
                try:
                    unpacked = io.BytesIO(gzip.decompress(file.read())) if packed else file
                except (EOFError, zlib.error, gzip.BadGzipFile):
                    raise Problem(f"{self} is damaged: it cannot be decompressed") from None
                yield _in_utf8(unpacked)


def _in_utf8(file: BinaryIO) -> BinaryIO:
    """Return text in UTF-16, as spreadsheets export it, in UTF-8, and other files as they are."""
    start = file.read(2)
    file.seek(0)
    if start not in (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE):
        return file
    try:
        return io.BytesIO(file.read().decode("utf-16").encode())
    except UnicodeDecodeError:
        file.seek(0)
        return file


@cache
def _standard_input() -> bytes:
    # Python has no stream for a descriptor that is closed.
    if sys.stdin is None:
        raise Problem("standard input is closed; give the name of a file")
    return sys.stdin.buffer.read()


@cache
def _pipe(path: Path) -> bytes:
    """Return the content of a pipe, such as a process substitution of a shell, which can be read once only."""
    return path.read_bytes()


def check_inputs(*paths: Path | None) -> None:
    """Raise `Problem` if standard input is to be read twice."""
    refuse("", (paths.count(STANDARD) > 1, "standard input (-) can be read for one of the files only"))


def called(output: Path) -> str:
    """Return the name of an output for messages."""
    return "standard output" if output == STANDARD else str(output)


def check_target(path: Path, *inputs: Path | None, binary: bool = False) -> None:
    """Raise `Problem` before any work is done if the output file cannot be written, or is an input."""
    if path == STANDARD:
        if sys.stdout is None:
            raise Problem("standard output is closed; give the name of a file")
        refuse(
            "standard output ",
            (not hasattr(sys.stdout, "buffer"), "does not take bytes here; give the name of a file"),
            (binary and sys.stdout.isatty(), "is a terminal, to which binary data are not written; redirect it"),
        )
        return
    # The target of a symbolic link is written.
    folder = path.resolve().parent if path.is_symlink() else path.parent
    special = path.exists() and not path.is_file()
    same = any(given is not None and given.exists() and path.exists() and path.samefile(given) for given in inputs)
    refuse(
        f"cannot write {path}: ",
        (path.is_dir(), "it is a folder"),
        (special, "it is a device, a pipe or a socket; give the name of a regular file, or - for standard output"),
        (not folder.is_dir(), f"there is no folder {folder}"),
        (not os.access(folder, os.W_OK), f"no permission to write into {folder}"),
        (same, "it is an input; give the output another name"),
    )


@contextmanager
def writing(path: Path) -> Iterator[Path]:
    """Yield a temporary file that replaces ``path``, or is copied to standard output, if the body succeeds."""
    if path != STANDARD:
        with reading(path, "write"), replacing(path) as temporary:
            yield temporary
        return
    with tempfile.TemporaryDirectory() as folder:
        temporary = Path(folder, "output")
        yield temporary
        with open(temporary, "rb") as file:
            shutil.copyfileobj(file, sys.stdout.buffer)


@contextmanager
def written(path: Path) -> Iterator[BinaryIO]:
    """Open a file to write in binary mode; it is compressed if its name ends in .gz."""
    with writing(path) as temporary, open(temporary, "wb") as file:
        if path.suffix.lower() != ".gz":
            yield file
            return
        # Without a date, equal tables have equal files.
        with gzip.GzipFile("", "wb", 6, file, mtime=0) as packed:
            yield packed  # type: ignore[misc]
