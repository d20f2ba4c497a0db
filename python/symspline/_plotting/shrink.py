"""Lines, symbols and text of pictures that are smaller than their natural size."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
from matplotlib import rc_context, rcParams
from matplotlib.artist import Artist
from matplotlib.collections import Collection
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.quiver import Quiver
from matplotlib.text import Text
from matplotlib.transforms import Affine2D

_TEXT: Any = "font.size", "axes.labelpad", *(f"{axis}tick.major.{name}" for axis in "xy" for name in ("pad", "size"))


@contextmanager
def small_text(factor: float) -> Iterator[None]:
    """Draw text, and distances between text and axes, on a smaller scale."""
    with rc_context({name: factor * rcParams[name] for name in _TEXT} if factor < 1 else {}):
        yield


def shrink(artists: Iterable[Artist], factor: float, text: float = 1.0) -> None:
    """Multiply the sizes of lines and symbols by a factor, and those of text by another one."""
    for artist in artists:
        own: Any = artist
        if isinstance(artist, Line2D):
            own.set(markersize=factor * own.get_markersize(), markeredgewidth=factor * own.get_markeredgewidth())
        if isinstance(artist, Quiver):
            own.width *= factor
            own.scale /= factor
        elif isinstance(artist, (Line2D, Patch, Collection)):
            own.set_linewidth(factor * np.asarray(own.get_linewidth()))
        elif isinstance(artist, Text) and text < 1:
            own.set_fontsize(text * own.get_fontsize())
        if isinstance(artist, Collection) and not isinstance(artist, Quiver) and own.figure is not None:
            inches = own.get_figure(root=True).dpi_scale_trans
            if own.get_transform().contains_branch(inches):
                # Its paths are in inches.
                own.set_transform(Affine2D().scale(factor) + own.get_transform())
