"""Messages and progress on stderr."""

from __future__ import annotations

import sys
import time
from typing import Self

from .._arrays import brief

# Messages may quote any part of a file.
_LONGEST = 1000
_WAIT = 0.3
"""Seconds between two updates; shorter work shows nothing."""


def say(message: object) -> None:
    """Print one line on stderr."""
    print("symspline:", brief(message, _LONGEST), file=sys.stderr)


class Progress:
    """Update one line on stderr if it is a terminal, and clear it at the end.

    Call an instance with the amount done and the total, from any loop or by the library.
    """

    def __init__(self, work: str) -> None:
        self._work = work
        self._width = 0

    def __enter__(self) -> Self:
        self._next = time.monotonic() + _WAIT
        self._shows = sys.stderr is not None and sys.stderr.isatty()
        return self

    def __call__(self, done: int, total: int) -> None:
        if not self._shows or total <= 0 or time.monotonic() < self._next:
            return
        self._next = time.monotonic() + _WAIT
        line = f"{self._work}: {100 * done // total} %"
        self._width = max(self._width, len(line))
        print("\r" + line, end="", file=sys.stderr, flush=True)

    def __exit__(self, *_: object) -> None:
        if self._width:
            print("\r" + " " * self._width, end="\r", file=sys.stderr, flush=True)
