"""The pictures of the gallery: which figures a page shows, with what alternative text, style and thumbnail."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
from gallery_texts import TEXTS, Texts
from matplotlib.figure import Figure
from matplotlib.transforms import Bbox
from PIL import Image
from sphinx_gallery.scrapers import figure_rst

STYLE = Path(__file__).parents[1] / "examples" / "gallery.mplstyle"
_DPI = 110
_THUMBNAIL = 480, 320
_MARGIN = 0.06
"""Margin around the subject of a thumbnail in inches."""


_ORDER = [
    Path(line.strip()).stem
    for line in (Path(__file__).parents[1] / "examples" / "index.rst")
    .read_text(encoding="utf-8")
    .splitlines()
    if line.strip().startswith("../examples/")
]
"""Names of the examples in the order of the gallery."""


def place(path: str) -> int:
    """The place of an example in the gallery. Sphinx-Gallery sorts thumbnails by it."""
    return _ORDER.index(Path(path).stem)


def figures(names: dict[str, Any]) -> list[Figure]:
    """The figures among the variables of an example, and those of pyplot, each once and the oldest first."""
    of_pyplot = [plt.figure(number) for number in plt.get_fignums()]
    return list(
        dict.fromkeys([*(value for value in names.values() if isinstance(value, Figure)), *of_pyplot])
    )


def scrape(block: Any, block_vars: dict[str, Any], gallery_conf: dict[str, Any]) -> str:
    """Save the new figures of a block of code, and return how to show them. Sphinx-Gallery calls it."""
    names = block_vars["example_globals"]
    shown = names.setdefault("__shown__", [])
    texts = TEXTS[Path(block_vars["src_file"]).stem]
    found = ""
    for figure in figures(names):
        if any(figure is other for other in shown):
            continue
        shown.append(figure)
        path = Path(next(block_vars["image_path_iterator"]))
        figure.savefig(path, dpi=_DPI)
        if len(shown) == texts.subject[0]:
            _save_subject(figure, texts, path)
        found += figure_rst([str(path)], gallery_conf["src_dir"], texts.alt[len(shown) - 1])
    plt.close("all")
    return found


def _save_subject(figure: Figure, texts: Texts, path: Path) -> None:
    """Save the part of a figure that its thumbnail shows: one of its axes with their labels."""
    figure.canvas.draw()
    box = figure.axes[texts.subject[1]].get_tightbbox()
    assert box is not None
    inches = Bbox(figure.dpi_scale_trans.inverted().transform(box)).padded(_MARGIN)
    inches = Bbox.from_bounds(inches.x0, inches.y0, texts.share * inches.width, inches.height)
    folder = path.parent / "subjects"
    folder.mkdir(exist_ok=True)
    # Twice the resolution of the picture, as the subject is enlarged.
    figure.savefig(folder / f"{path.stem[:-4]}.png", dpi=2 * _DPI, bbox_inches=inches)


def put_thumbnails(app: Any) -> None:
    """Replace the thumbnails by the subjects of the figures, after Sphinx-Gallery has made its own."""
    images = Path(app.srcdir) / "gallery" / "images"
    for path in sorted(images.glob("subjects/*.png")):
        thumbnail = Image.new("RGB", _THUMBNAIL, "white")
        with Image.open(path) as file:
            subject = file.convert("RGB")
        subject.thumbnail(_THUMBNAIL, Image.Resampling.LANCZOS)
        thumbnail.paste(subject, tuple((a - b) // 2 for a, b in zip(_THUMBNAIL, subject.size, strict=True)))
        thumbnail.save(images / "thumb" / f"{path.stem}_thumb.png")


def use_style(gallery_conf: dict[str, Any], name: str) -> None:
    """Draw every example in the style of the gallery. Sphinx-Gallery calls it before and after each example."""
    plt.rcdefaults()
    plt.switch_backend("agg")
    plt.style.use(STYLE)


def _get_sg_image_scraper() -> Any:
    """The name by which Sphinx-Gallery finds a scraper in a module."""
    return scrape
