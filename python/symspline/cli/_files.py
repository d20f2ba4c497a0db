"""Files and standard streams, and compressed text."""

from __future__ import annotations

import gzip
import io
import os
import shutil
import sys
import tempfile
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import BinaryIO

from .._base.disk import replacing
from ._messages import Problem, reading, refuse

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
                yield unpacked


@cache
def _standard_input() -> bytes:
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
