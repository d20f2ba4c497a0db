"""Makes guide/grids.png, the figure of the first grid of that page."""

import re
from pathlib import Path
from typing import Any

HERE = Path(__file__).parent


def main() -> None:
    """Run the first block of code of the page, and save the figure that it makes."""
    page = HERE / "guide" / "grids.md"
    found = re.search(r"^```python\n(.*?)^```$", page.read_text(encoding="utf-8"), re.M | re.S)
    names: dict[str, Any] = {}
    exec(compile(found[1] if found else "", page.name, "exec"), names)
    names["figure"].savefig(page.with_suffix(".png"), dpi=85)


if __name__ == "__main__":
    main()
