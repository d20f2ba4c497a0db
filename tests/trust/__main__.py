"""Print the table of outcomes: python -m tests.trust [recordings per kind] [part of a kind's name]."""

import importlib
import pkgutil
import sys

import tests.trust

from .outcome import row_of


def main(count: int, part: str) -> None:
    """Print one row per kind of data, as soon as it is known."""
    print("| data | recordings | wrong | wrong without a warning | refused | false alarms |")
    print("|:--|--:|--:|--:|--:|--:|")
    for module in pkgutil.iter_modules(tests.trust.__path__):
        kinds = (
            getattr(importlib.import_module(f"tests.trust.{module.name}"), "KINDS", {}) if module.name[0] != "_" else {}
        )
        for kind, outcome in kinds.items():
            if part in kind:
                row = row_of(kind, map(outcome, range(count)))
                shares = " | ".join(f"{100 * share:.1f} %" for share in row[2:])
                print(f"| {kind} | {row.recordings} | {shares} |", flush=True)


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 1000, sys.argv[2] if len(sys.argv) > 2 else "")
