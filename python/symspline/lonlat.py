"""The old name of `symspline.geo`."""

from __future__ import annotations

from typing import Any
from warnings import warn

from . import geo


def __getattr__(name: str) -> Any:
    """A function of `symspline.geo`, with a warning that the old name will go."""
    if name not in ("from_lonlat", "to_lonlat", "compass"):
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    warn(f"symspline.lonlat is now symspline.geo; use symspline.geo.{name}", DeprecationWarning, stacklevel=2)
    return getattr(geo, name)
