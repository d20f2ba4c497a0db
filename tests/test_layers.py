"""Layers of the package: a module imports from its own layer and those below, and never in a circle."""

import ast
import importlib
from pathlib import Path

import pytest

import symspline

ROOT = Path(symspline.__file__).parent

# From below. A folder stands for all that is in it.
LAYERS = [
    ["_core", "_cpu"],
    ["_base"],
    ["_spaces"],
    ["manifolds"],
    ["_curves"],
    ["_plotting"],
    ["_splines"],
    ["_archive", "_autodiff", "_grid", "_smoothing", "_statistics", "convert", "jax", "torch"],
    ["measure"],
    ["_estimation"],
    ["geo", "poses", "quantum", "rotations", "shapes", "subspaces", "tensors", "testing"],
    ["cli", "xarray"],
    ["__init__", "__main__"],
]


def name_of(path):
    parts = path.relative_to(ROOT).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" and len(parts) > 1 else parts)


MODULES = {name_of(path): path for path in ROOT.rglob("*.py")} | {"_core": None}


def imports(name, path):
    """What a module of the package imports from it."""
    package = name.split(".") if path.name == "__init__.py" and name != "__init__" else name.split(".")[:-1]
    found = set()
    # Also within functions, and for type checkers only.
    for node in ast.walk(ast.parse(path.read_text("utf-8"))):
        if isinstance(node, ast.Import):
            # The package imports itself by dots only, so that nothing is missed here.
            assert not any(alias.name.split(".")[0] == "symspline" for alias in node.names)
        if not isinstance(node, ast.ImportFrom) or not node.level:
            continue
        base = package[: len(package) + 1 - node.level] + (node.module or "").split(".")
        base = ".".join(filter(None, base)) or "__init__"
        for alias in node.names:
            below = alias.name if base == "__init__" else f"{base}.{alias.name}"
            found.add(below if below in MODULES else base)
    assert found <= set(MODULES), found - set(MODULES)
    return found


GRAPH = {name: imports(name, path) if path else set() for name, path in MODULES.items()}


def layer(name):
    (number,) = [i for i, names in enumerate(LAYERS) if name.split(".")[0] in names]
    return number


def test_the_graph_is_that_of_the_package():
    assert {"_curves.reduced", "_base.arrays"} <= GRAPH["_curves.curve"] | GRAPH["_spaces.base"]
    # An import inside a function.
    assert "_plotting" in GRAPH["_splines.base"]


def test_every_module_imports_from_layers_below():
    wrong = [(name, used) for name, uses in GRAPH.items() for used in uses if layer(used) > layer(name)]
    assert not wrong


def in_circles(graph):
    """What is left of a graph without the names that are in no circle and above none."""
    left = {name: set(uses) for name, uses in graph.items()}
    while ends := [name for name, uses in left.items() if not uses]:
        left = {name: uses.difference(ends) for name, uses in left.items() if name not in ends}
    return left


def test_there_is_no_circle():
    assert not in_circles(GRAPH)


def test_there_is_no_circle_of_folders():
    folders = {}
    for name, uses in GRAPH.items():
        folder = name.split(".")[0]
        folders.setdefault(folder, set()).update({used.split(".")[0] for used in uses} - {folder})
    assert not in_circles(folders)
    assert in_circles({"a": {"b"}, "b": {"a"}, "c": {"a"}, "d": set()}) == {"a": {"b"}, "b": {"a"}, "c": {"a"}}


# What users import. The name of any other module, or of a folder around it, starts with an underscore.
PUBLIC = {
    *(
        "cli",
        "convert",
        "geo",
        "jax",
        "manifolds",
        "measure",
        "poses",
        "quantum",
        "rotations",
        "shapes",
        "subspaces",
        "tensors",
    ),
    *("testing", "torch", "xarray"),
}


def test_modules_are_public_by_name_only():
    parts = {name: name.split(".") for name in MODULES if not name.startswith("__")}
    public = {name for name, own in parts.items() if not any(part.startswith("_") for part in own)}
    assert public == PUBLIC


def test_dir_shows_public_names_only():
    assert {name for name in dir(symspline) if not name.startswith("__")} == set(symspline.__all__)


@pytest.mark.parametrize("name", sorted(PUBLIC - {"cli", "torch"}))
def test_dir_of_a_module_shows_public_names_only(name):
    module = importlib.import_module(f"symspline.{name}")
    assert {name for name in dir(module) if not name.startswith("_")} == set(module.__all__)
