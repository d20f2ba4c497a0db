"""Validation of the options of plots."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.colors import is_color_like

from .._base.arrays import as_array, short_repr
from .._core import ValidationError

_LARGEST = 200.0
"""The largest side of a figure in inches."""


def checked_look(file: Any, ax: Any, color: Any, label: Any, title: Any, figsize: Any, show: Any) -> dict[str, Any]:
    """Return the options that were given as keyword arguments of the function that draws.

    Raises
    ------
    ValidationError
        If an option is invalid.
    """
    if not isinstance(show, bool):
        raise TypeError(f"show must be True or False, not {short_repr(show)}")
    look: dict[str, Any] = {}
    if color is not None:
        look["color"] = checked_color(color, "color")
    for name, text in (("label", label), ("title", title)):
        if text is not None:
            if not isinstance(text, str):
                raise TypeError(f"{name} must be a string, not {short_repr(text)}")
            look[name] = text
    if figsize is not None:
        look["figsize"] = _checked_size(figsize)
    if ax is not None and figsize is not None:
        raise ValidationError("figsize and ax exclude each other. The size of ax is that of its figure.")
    if ax is not None and file is not None:
        raise ValidationError("file and ax exclude each other. Save the figure of ax: ax.figure.savefig(file).")
    return look


def checked_color(color: Any, name: str) -> Any:
    """Return a colour in any form that matplotlib accepts."""
    try:
        valid = is_color_like(color)
    except (TypeError, ValueError):
        valid = False
    if not valid:
        raise ValidationError(f"{name} must be a colour of matplotlib, such as 'tab:red', not {short_repr(color)}")
    return color


def _checked_size(figsize: Any) -> tuple[float, float]:
    size = as_array(figsize, "figsize")
    valid = size.shape == (2,) and size.dtype.kind in "iuf"
    if not (valid and np.isfinite(size).all() and (size > 0).all() and (size <= _LARGEST).all()):
        raise ValidationError(
            f"figsize must be width and height in inches, two positive numbers up to {_LARGEST:g}, not "
            f"{short_repr(figsize)}"
        )
    return float(size[0]), float(size[1])
