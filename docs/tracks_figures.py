"""Makes tracks.png and tracks-dark.png, the pictures of the first page and of the README for light and dark pages."""

import sys
from pathlib import Path

import numpy as np
from PIL import Image, ImageColor

DOCS = Path(__file__).parent
sys.path.append(str(DOCS.parent / "examples" / "storms"))

from hurdat import read_sample  # noqa: E402
from maps import NIGHT, draw_tracks  # noqa: E402
from tracks import fit_tracks  # noqa: E402

_WIDTH = 1100
_COLOURS = 255


def reduced(picture: Image.Image, ground: str) -> Image.Image:
    """Return a picture of a width with few colours and one for the transparent ground, which is far smaller."""
    size = _WIDTH, round(picture.height * _WIDTH / picture.width)
    small = picture.convert("RGBA").resize(size, Image.Resampling.LANCZOS)
    whole = Image.new("RGBA", size, ground)
    whole.alpha_composite(small)
    few = whole.convert("RGB").quantize(_COLOURS, Image.Quantize.MEDIANCUT)
    palette = few.getpalette() or []
    few.putpalette([*palette[: 3 * _COLOURS], *ImageColor.getrgb(ground)])
    few.paste(_COLOURS, mask=small.getchannel("A").point([255] + 255 * [0]))
    return few


def main(folder: Path = DOCS) -> None:
    """Draw the storms for light and for dark pages."""
    storms = [storm.spaced(np.timedelta64(1, "h")) for storm in read_sample()]
    splines = fit_tracks(storms)
    for name, ground in (("tracks.png", "white"), ("tracks-dark.png", NIGHT)):
        draw_tracks(storms, splines, folder / name, dark=ground == NIGHT)
        with Image.open(folder / name) as picture:
            few = reduced(picture, ground)
        few.save(folder / name, optimize=True, transparency=_COLOURS)


if __name__ == "__main__":
    main()
