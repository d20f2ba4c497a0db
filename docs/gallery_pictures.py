"""Which pictures of an example its page shows: every figure that it holds, those of pyplot and those of `plot`."""

from __future__ import annotations

from typing import Any

import matplotlib.pyplot as plt
from matplotlib.figure import Figure
from sphinx_gallery.scrapers import figure_rst


def figures(names: dict[str, Any]) -> list[Figure]:
    """The figures among the variables of an example, and those of pyplot, each once and the oldest first."""
    of_pyplot = [plt.figure(number) for number in plt.get_fignums()]
    return list(
        dict.fromkeys([*(value for value in names.values() if isinstance(value, Figure)), *of_pyplot])
    )


def scrape(block: Any, block_vars: dict[str, Any], gallery_conf: dict[str, Any]) -> str:
    """Sphinx-Gallery calls it after every block of code: saves the figures that are new, and says how to show them."""
    names = block_vars["example_globals"]
    shown = names.setdefault("__shown__", [])
    files = []
    for figure in figures(names):
        if any(figure is other for other in shown):
            continue
        shown.append(figure)
        path = next(block_vars["image_path_iterator"])
        figure.savefig(path, dpi=110)
        files.append(path)
    plt.close("all")
    return figure_rst(files, gallery_conf["src_dir"])


def _get_sg_image_scraper() -> Any:
    """The name by which Sphinx-Gallery finds a scraper in a module."""
    return scrape
