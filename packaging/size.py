"""Lines of code by part of the package, beside the aims: without docstrings, comments and blank lines.

`make size` prints the table. A part is a folder that CONTRIBUTING lists, with the modules that belong to it.
"""

import ast
import io
import sys
import tokenize
from pathlib import Path

PACKAGE = Path(__file__).parents[1] / "python" / "symspline"

# From above: the modules of each part, and its aim.
PARTS = {
    "__init__, __main__": ("__init__ __main__", 120),
    "cli": ("cli", 1450),
    "poses, rotations, geo, xarray": ("geo poses rotations xarray", 1450),
    "_estimation": ("_estimation", 1050),
    "_smoothing": ("_smoothing", 1850),
    "jax, torch, _autodiff": ("_autodiff jax torch", 1100),
    "tensors, subspaces": ("subspaces tensors", 230),
    "_grid": ("_grid", 780),
    "quantum, shapes, testing": ("quantum shapes testing", 480),
    "_splines": ("_archive _splines", 1900),
    "_plotting": ("_plotting", 1900),
    "measure": ("measure", 170),
    "_curves": ("_curves", 1750),
    "manifolds, convert": ("convert manifolds", 940),
    "_spaces": ("_spaces _statistics", 1600),
    "_base": ("_base _cpu", 1000),
}
LAYOUT = {
    tokenize.NL,
    tokenize.NEWLINE,
    tokenize.INDENT,
    tokenize.DEDENT,
    tokenize.COMMENT,
    tokenize.ENDMARKER,
}


def lines_of_code(path):
    """Return the number of lines with code."""
    text = path.read_text("utf-8")
    lines = {
        line
        for token in tokenize.generate_tokens(io.StringIO(text).readline)
        if token.type not in LAYOUT
        for line in range(token.start[0], token.end[0] + 1)
    }
    for node in ast.walk(ast.parse(text)):
        if isinstance(
            node, (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)
        ) and ast.get_docstring(node):
            lines -= set(range(node.body[0].lineno, node.body[0].end_lineno + 1))
    return len(lines)


def modules(paths):
    """Return the files of modules and folders."""
    return [file for path in paths for file in (path.rglob("*.py") if path.is_dir() else [path])]


def main():
    """Print the table; the exit status is 1 if a module belongs to no part."""
    found = {path.stem for path in PACKAGE.iterdir() if path.suffix == ".py" or any(path.glob("*.py"))}
    print("| part | files | lines | aim |\n| :-- | --: | --: | --: |")
    totals = [0, 0, 0]
    for part, (names, aim) in PARTS.items():
        inside = found & set(names.split())
        found -= inside
        files = modules(
            PACKAGE / name if (PACKAGE / name).is_dir() else PACKAGE / f"{name}.py" for name in inside
        )
        row = len(files), sum(map(lines_of_code, files)), aim
        totals = [total + own for total, own in zip(totals, row, strict=True)]
        print(f"| {part} | {row[0]} | {row[1]} | {aim} |")
    print(f"| sum | {totals[0]} | {totals[1]} | {totals[2]} |")
    if found:
        sys.exit(f"no part contains {', '.join(sorted(found))}: add them to PARTS in {Path(__file__).name}")


if __name__ == "__main__":
    main()
