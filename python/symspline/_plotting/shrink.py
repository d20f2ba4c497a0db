"""Lines, symbols and text of pictures that are smaller than their natural size."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager

import numpy as np
from matplotlib import rc_context, rcParams
from matplotlib.artist import Artist
from matplotlib.collections import Collection
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.quiver import Quiver
from matplotlib.text import Text
from matplotlib.transforms import Affine2D

_TEXT = "font.size", "axes.labelpad", *(f"{axis}tick.major.{name}" for axis in "xy" for name in ("pad", "size"))


@contextmanager
def small_text(factor: float) -> Iterator[None]:
    """Draw text, and distances between text and axes, on a smaller scale."""
    with rc_context({name: factor * rcParams[name] for name in _TEXT} if factor < 1 else {}):
        yield


def shrink(artists: Iterable[Artist], factor: float, text: float = 1.0) -> None:
    """Multiply the sizes of lines and symbols by a factor, and those of text by another one."""
    if factor == 1:
        return
    for artist in artists:
        if isinstance(artist, Line2D):
            artist.set_linewidth(factor * artist.get_linewidth())
            artist.set(
                markersize=factor * artist.get_markersize(), markeredgewidth=factor * artist.get_markeredgewidth()
            )
        elif isinstance(artist, Quiver):
            artist.width *= factor
            artist.scale /= factor
        elif isinstance(artist, Collection):
            artist.set_linewidth(factor * np.asarray(artist.get_linewidth()))
            figure = artist.get_figure(root=True)
            if figure is not None and artist.get_transform().contains_branch(figure.dpi_scale_trans):
                # Its paths are in inches.
                artist.set_transform(Affine2D().scale(factor) + artist.get_transform())
        elif isinstance(artist, Patch):
            artist.set_linewidth(factor * artist.get_linewidth())
        elif isinstance(artist, Text) and text < 1:
            artist.set_fontsize(text * artist.get_fontsize())
