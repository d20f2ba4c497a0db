"""What pickles of earlier versions call."""

from ._splines.archive import restore

__all__ = ["restore"]
