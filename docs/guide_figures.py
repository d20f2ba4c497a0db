"""Makes the pictures of pages from their own code.

``python docs/guide_figures.py [PAGE ...]`` runs the code of a page. Where a block makes a new variable ``figure``, the
figure is saved under the name of the picture that the page shows after this block.
"""

import os
import re
import shutil
import sys
from collections.abc import Iterator
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


def code_of(page: Path) -> list[str]:
    """The blocks of Python of a page."""
    return re.findall(r"^```python\n(.*?)^```$", page.read_text(encoding="utf-8"), re.M | re.S)


def figures_of(page: Path) -> Iterator[tuple[str, Figure]]:
    """Run the code of the page, in the present folder, up to its last picture: names of pictures, and figures."""
    names: dict[str, Any] = {}
    text = page.read_text(encoding="utf-8")
    blocks = re.findall(r"^```python\n(.*?)^```$(.*?)(?=^```python$|\Z)", text, re.M | re.S)
    makes = [bool(re.search(r"^figure = ", code, re.M)) for code, _ in blocks]
    for code, after in blocks[: len(makes) - makes[::-1].index(True)]:
        names.pop("figure", None)
        exec(compile(code, page.name, "exec"), names)
        picture = re.search(r"\]\((\w+\.png)\)", after)
        if isinstance(figure := names.get("figure"), Figure) and picture:
            yield picture[1], figure


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
                    for picture, figure in figures_of(page):
                        figure.savefig(page.with_name(picture), dpi=85, bbox_inches="tight")
            finally:
                os.chdir(here)


if __name__ == "__main__":
    main()
