"""Tables in Markdown."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

from .timing import Result, ratio


def table(head: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """A table; what is None stays empty. All columns but the first are set to the right."""
    rule = [":--", *["--:"] * (len(head) - 1)]
    lines = [head, rule, *([_cell(cell) for cell in row] for row in rows)]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def versus(results: Mapping[str, Result], slow: str, fast: str, goal: float | None = None) -> list[object]:
    """Two cells: how many times faster, and the goal with whether it is reached."""
    found = ratio(results[slow], results[fast]) if slow in results else None
    return [times(found), None if goal is None else f"{times(goal)}: {verdict(found, goal)}"]


def times(factor: float | None) -> str | None:
    """4.31×, 43.1× or 431×."""
    if factor is None:
        return None
    return f"{factor:.3g}×" if factor < 999 else f"{count(factor)}×"


def count(number: float) -> str:
    """12 345 678."""
    return f"{number:,.0f}".replace(",", " ")


def verdict(found: float | None, least: float) -> str:
    return "not measured" if found is None else "reached" if found >= least else "not reached"


def _cell(cell: object) -> str:
    return "" if cell is None else str(cell).replace("|", "\\|").replace("\n", " ")
