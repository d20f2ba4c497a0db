"""Makes the pictures of pages from their own code: the variable ``figure``, saved beside the page under its name.

``python docs/guide_figures.py [PAGE ...]`` runs the first blocks of a page, until one of them has made a figure.
"""

import os
import re
import shutil
import sys
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import matplotlib.style
from matplotlib.figure import Figure

DOCS = Path(__file__).parent
PAGES = (
    "jax",
    "manifolds",
    "smoothing",
    "start",
    "xarray",
    "guide/adaptive",
    "guide/batches",
    "guide/bsplines",
    "guide/ends",
    "guide/far_apart",
    "guide/fields",
    "guide/from_pandas",
    "guide/from_scipy",
    "guide/from_scipy_rotations",
    "guide/glossary",
    "guide/grids",
    "guide/lifts",
    "guide/measurements",
    "guide/motion",
    "guide/ode",
    "guide/plots",
    "guide/precision",
    "guide/quantum",
    "guide/rotations",
    "guide/spaces",
    "guide/statistics",
    "guide/symmetry",
    "guide/times",
    "guide/tutorial",
    "guide/which_function",
)
"""Pages with such a picture. That of guide/from_geomstats needs geomstats, and is made by its name."""


STYLE = DOCS.parent / "examples/gallery.mplstyle"


def figure_of(page: Path) -> Figure:
    """Run the code of the page, in the present folder, until there is a figure."""
    names: dict[str, Any] = {}
    for code in re.findall(r"^```python\n(.*?)^```$", page.read_text(encoding="utf-8"), re.M | re.S):
        exec(compile(code, page.name, "exec"), names)
        if isinstance(figure := names.get("figure"), Figure):
            return figure
    raise ValueError(f"the code of {page} makes no variable `figure`")


def main() -> None:
    here = Path.cwd()
    for name in sys.argv[1:] or PAGES:
        page = DOCS.resolve() / f"{name}.md"
        with TemporaryDirectory() as folder:
            for table in page.parent.glob("*.csv"):
                shutil.copy(table, folder)
            os.chdir(folder)
            try:
                with matplotlib.style.context(STYLE.resolve()):
                    figure_of(page).savefig(page.with_suffix(".png"), dpi=85, bbox_inches="tight")
            finally:
                os.chdir(here)


if __name__ == "__main__":
    main()
