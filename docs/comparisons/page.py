"""Tables in Markdown, and their place on the page ``docs/comparisons_tables.md``."""

from __future__ import annotations

import re
from argparse import ArgumentParser, RawDescriptionHelpFormatter
from collections.abc import Iterable, Sequence
from importlib.metadata import version
from pathlib import Path

HERE = Path(__file__).parent
PAGE = HERE.parent / "comparisons_tables.md"


def table(head: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """A table; what is None stays empty. All columns but the first are set to the right."""
    lines = [head, [":--", *["--:"] * (len(head) - 1)], *rows]
    return "\n".join(
        f"| {' | '.join('' if cell is None else str(cell) for cell in line)} |" for line in lines
    )


def versions(*packages: str) -> str:
    """What the numbers were made with."""
    return "Made with " + ", ".join(f"{name} {version(name)}" for name in packages) + "."


def insert(part: str, text: str, page: Path = PAGE) -> None:
    """Put the text between the marks of a part of the page."""
    begin, end = f"<!-- {part}: begin -->", f"<!-- {part}: end -->"
    old = page.read_text(encoding="utf-8")
    pattern = re.compile(f"(?<={re.escape(begin)}).*?(?={re.escape(end)})", re.S)
    if len(pattern.findall(old)) != 1:
        raise ValueError(f"{page} needs the lines {begin} and {end}, once each")
    page.write_text(pattern.sub(lambda _: f"\n\n{text}\n\n", old), encoding="utf-8")


def parser(description: str | None) -> ArgumentParser:
    """Arguments that all comparisons take."""
    made = ArgumentParser(description=description, formatter_class=RawDescriptionHelpFormatter)
    made.add_argument("--write", action="store_true", help="write table and figure into the documentation")
    return made
