"""Writes packaging/README-index.md: the README as package indexes show it, far from the files that it links to.

Relative links and the picture become absolute: they lead to the tag of this version in the repository whose address is
`project.urls.Repository` in pyproject.toml. Without such an address, links become plain text, and the picture and the
table of pages are omitted. The block between the comments ``checkout: begin`` and ``checkout: end`` is replaced by how
to install from an index.
"""

import re
import tomllib
from pathlib import Path

ROOT = Path(__file__).parent.parent
OUT = ROOT / "packaging/README-index.md"
INSTALL = """\
```sh
pip install symspline                # needs Python 3.11 or newer
pip install 'symspline[plot,cli]'    # with matplotlib, and pandas for the command line
```

A wheel runs on every processor of its platform. Where there is no wheel, pip compiles the library, for which it needs a
C compiler and a [Rust toolchain](https://rustup.rs).
"""


def for_index(text: str, repository: str | None, version: str) -> str:
    """Return the text of the README with absolute links."""
    text = re.sub(r"<!-- checkout: begin -->.*<!-- checkout: end -->\n", lambda _: INSTALL, text, flags=re.S)

    def picture(match: re.Match[str]) -> str:
        source, caption = match.groups()
        return f"![{caption}]({repository}/raw/v{version}/{source})\n\n" if repository else ""

    text = re.sub(
        r'<picture>.*?<img src="([^"]+)" alt="([^"]+)">.*?</picture>\n\n', picture, text, flags=re.S
    )
    if not repository:
        text = re.sub(r"^## Where to read on\n.*?(?=^## )", "", text, flags=re.S | re.M)
    target = rf"[\1]({repository}/blob/v{version}/\2)" if repository else r"\1"
    return re.sub(r"(?<!!)\[([^\]]+)\]\((?!https?:)([^)]+)\)", target, text)


def current() -> str:
    """Return the file as it must be."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    workspace = tomllib.loads((ROOT / "Cargo.toml").read_text("utf-8"))["workspace"]["package"]
    readme = (ROOT / "README.md").read_text("utf-8")
    return for_index(readme, project.get("urls", {}).get("Repository"), workspace["version"])


if __name__ == "__main__":
    OUT.write_text(current(), "utf-8", newline="\n")
