"""Makes guide/grids.png, the figure of the first grid of that page."""

import re
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

PAGE = Path(__file__).parent / "guide" / "grids.md"


def first_figure() -> Figure:
    """Run the first block of code of the page, and return the figure that it makes."""
    found = re.search(r"^```python\n(.*?)^```$", PAGE.read_text(encoding="utf-8"), re.M | re.S)
    names: dict[str, Any] = {}
    exec(compile(found[1] if found else "", PAGE.name, "exec"), names)
    figure: Figure = names["figure"]
    return figure


def main() -> None:
    first_figure().savefig(PAGE.with_suffix(".png"), dpi=85)


if __name__ == "__main__":
    main()
