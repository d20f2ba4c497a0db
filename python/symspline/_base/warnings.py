"""Warnings at the line that called the package."""

from __future__ import annotations

import os
import sys
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Any

_PACKAGE = os.path.dirname(os.path.dirname(__file__))
# Categories of warnings that the current call suppresses because its result describes the same.
_SILENT: ContextVar[tuple[type[Warning], ...]] = ContextVar("silent", default=())


@contextmanager
def silenced(category: type[Warning]) -> Iterator[None]:
    """Suppress warnings of this package in the current thread; filters of `warnings` are shared by all threads."""
    token = _SILENT.set((*_SILENT.get(), category))
    try:
        yield
    finally:
        _SILENT.reset(token)


def is_silent(category: type[Warning]) -> bool:
    """Whether warnings of this category are not issued, so that their checks are not needed."""
    return issubclass(category, _SILENT.get())


def warn(message: str, category: type[Warning], curve: tuple[int, ...] | None = None, node: int | None = None) -> None:
    """Issue a warning at the line that called this package.

    The warning has the attributes ``curve`` and ``node`` of a `SymsplineError`.
    """
    if is_silent(category):
        return
    warning: Any = category(message)
    warning.curve, warning.node = curve, node
    warnings.warn(warning, stacklevel=callers_level())


def callers_level() -> int:
    """Return the number of frames between this function and the code that called the package."""
    frame, level = sys._getframe(1), 1
    while frame.f_back is not None and frame.f_code.co_filename.startswith(_PACKAGE):
        frame, level = frame.f_back, level + 1
    return level
