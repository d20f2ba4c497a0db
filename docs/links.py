"""Whether links of the built site lead somewhere: those inside it, to pages and to places on pages."""

from __future__ import annotations

import sys
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlparse


class Page(HTMLParser):
    """The places and the links of a page."""

    def __init__(self, path: Path) -> None:
        super().__init__()
        self.places: set[str | None] = set()
        self.links: list[str] = []
        self.feed(path.read_text(encoding="utf-8"))

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Called at every tag."""
        found = dict(attrs)
        self.places.update((found.get("id"), found.get("name")))
        self.links += [link for name in ("href", "src") if (link := found.get(name))]


def dead_links(site: Path) -> list[str]:
    """The links that lead nowhere, each with a page that has it."""
    # The theme keeps templates there.
    paths = [path for path in site.rglob("*.html") if "_static" not in path.relative_to(site).parts]
    pages = {path.resolve(): Page(path) for path in paths}
    dead: dict[str, str] = {}
    for path, page in pages.items():
        for link in page.links:
            parts = urlparse(link)
            if parts.scheme or parts.netloc:
                continue
            target = (path.parent / unquote(parts.path)).resolve() if parts.path else path
            places = pages[target].places if target in pages else None
            if not target.exists() or (parts.fragment and places and unquote(parts.fragment) not in places):
                dead.setdefault(link, str(path.relative_to(site.resolve())))
    return [f"{link} on {page}" for link, page in sorted(dead.items())]


if __name__ == "__main__":
    found = dead_links(Path(sys.argv[1]))
    sys.exit("\n".join(["these links lead nowhere:", *found]) if found else 0)
