"""Numbers in texts. Python's own ``float`` and ``int`` also take ``1_000``, and digits of any script."""

from __future__ import annotations

from argparse import ArgumentTypeError
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray


def is_number(text: str) -> bool:
    """Whether a text is a number."""
    try:
        float(text)
    except ValueError:
        return False
    return _is_usual(text)


def numbers(texts: Sequence[str]) -> NDArray[np.float64]:
    """The numbers in texts.

    Raises:
        ValueError: one of them is none.
    """
    # Looking at all letters at once takes no time beside reading the numbers.
    if not _is_usual("".join(texts)) and not all(map(is_number, texts)):
        raise ValueError
    return np.fromiter(map(float, texts), np.float64, len(texts))


def real(text: str) -> float:
    """A number in an option."""
    if not is_number(text):
        raise ArgumentTypeError(f"invalid float value: {text!r}")
    return float(text)


def whole(text: str) -> int:
    """A whole number in an option."""
    try:
        number = int(text)
    except ValueError:
        number = None
    if number is None or not _is_usual(text):
        raise ArgumentTypeError(f"invalid int value: {text!r}")
    return number


def _is_usual(text: str) -> bool:
    return "_" not in text and text.strip().isascii()
