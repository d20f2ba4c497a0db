"""Docstrings of all public objects are complete and in numpydoc format, by the validator of numpydoc.

Names in backticks that lead to a module exist, in private docstrings too.
"""

import ast
import dataclasses
import importlib
import importlib.util
import inspect
import re
from itertools import pairwise
from pathlib import Path

import pytest
from numpydoc.docscrape import FunctionDoc
from numpydoc.validate import validate

import symspline

pytest.importorskip("jax")
pytest.importorskip("xarray")

MODULES = [
    "symspline",
    "symspline.jax",
    "symspline.xarray",
    *(f"symspline.{name}" for name in symspline.__all__ if inspect.ismodule(getattr(symspline, name))),
]
TITLES = {
    "Parameters",
    "Attributes",
    "Returns",
    "Yields",
    "Raises",
    "Warns",
    "See Also",
    "Notes",
    "References",
    "Examples",
}
# Not every object has related ones (SA01), or more to say than its summary (ES01).
IGNORED = {"ES01", "SA01"}
# Objects whose docstrings have not been revised yet. The goal is none.
PENDING = ("symspline.num_threads",)
ROOT = Path(symspline.__file__).parent


def fields_of(cls):
    """The fields of a dataclass, named tuple or exception, which its section Attributes describes."""
    if issubclass(cls, Exception):
        return set(vars(cls).get("__annotations__", ()))
    if dataclasses.is_dataclass(cls):
        return {field.name for field in dataclasses.fields(cls)}
    return set(getattr(cls, "_fields", ()))


def members(cls):
    """The public members of a class and of its private base classes, by name.

    A method without a docstring of its own inherits the one of the method that it overrides.
    """
    for name in sorted(set(dir(cls)) - fields_of(cls)):
        owner = next(base for base in cls.__mro__ if name in vars(base))
        public = owner is not cls and owner.__name__ in symspline.__all__
        if name.startswith("_") or public or not owner.__module__.startswith("symspline"):
            continue
        thing = inspect.getattr_static(cls, name)
        if thing.__doc__ or not inspect.getdoc(getattr(cls, name)):
            yield name, thing


def public_objects(module):
    """All public objects of a module that are not modules or constants, by their full names."""
    names = getattr(module, "__all__", None) or [name for name in vars(module) if not name.startswith("_")]
    for name in names:
        thing = getattr(module, name)
        if not callable(thing) or (module is not symspline and name in symspline.__all__):
            continue
        yield f"{module.__name__}.{name}", thing
        if inspect.isclass(thing):
            for member, value in members(thing):
                yield f"{module.__name__}.{name}.{member}", value


def problems(name, thing):
    """What the validator finds in the docstring of one object, and the fields that it does not describe."""
    ignored = set(IGNORED)
    missing = set()
    if inspect.isclass(thing):
        entries = FunctionDoc(None, doc=inspect.cleandoc(thing.__doc__ or ""))["Attributes"]
        missing = fields_of(thing) - {field for entry in entries for field in entry.name.split(", ")}
        if fields_of(thing):
            ignored.add("PR01")
    # Properties and exceptions need no example.
    if not (inspect.isroutine(thing) or inspect.isclass(thing)) or (
        inspect.isclass(thing) and issubclass(thing, Exception)
    ):
        ignored.add("EX01")
    found = [f"{name}: {code} {text}" for code, text in validate(name)["errors"] if code not in ignored]
    # The validator treats a title that is not underlined as text.
    lines = inspect.cleandoc(thing.__doc__ or "").splitlines()
    found += [
        f"{name}: {title} is not underlined"
        for title, line in pairwise(lines)
        if title in TITLES and line != "-" * len(title)
    ]
    return found + [f"{name}: field {field!r} is not described" for field in sorted(missing)]


@pytest.mark.parametrize("name", MODULES)
def test_docstrings_are_complete(name):
    found = []
    for full, thing in public_objects(importlib.import_module(name)):
        if not full.startswith(PENDING):
            found += problems(full, thing)
    assert not found, "\n".join(found)


def names_in(path):
    """Names in single backticks that lead to a module: dotted names, and in `__init__.py` also plain names."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, (ast.Module, ast.ClassDef, ast.FunctionDef)):
            text = ast.get_docstring(node) or ""
            yield from re.findall(r"(?<![`:])`([a-z_]\w*(?:\.\w+)+)`(?!`)", text)
            if isinstance(node, ast.Module) and path.name == "__init__.py":
                yield from re.findall(r"(?<![`:])`(\w+)`(?!`)", text)


def exists(name):
    """Whether a dotted name can be imported, as a module, an attribute of one, or a field of a class."""
    module, *rest = name.split(".")
    try:
        thing = importlib.import_module(module)
    except ImportError:
        return False
    for part in rest:
        module = f"{module}.{part}"
        if not hasattr(thing, part):
            if inspect.ismodule(thing) and importlib.util.find_spec(module):
                try:
                    thing = importlib.import_module(module)
                except ModuleNotFoundError:
                    # It needs a library that is not installed, such as PyTorch.
                    return True
                continue
            return inspect.isclass(thing) and part in fields_of(thing)
        thing = getattr(thing, part)
    return True


def unknown_names(path):
    """Names of a file that exist neither from its folder, nor from the package, nor from anywhere else."""
    folder = ".".join(["symspline", *path.relative_to(ROOT).parts[:-1]])
    for name in names_in(path):
        if not any(map(exists, (f"{folder}.{name}", f"symspline.{name}", name))):
            yield f"{path.relative_to(ROOT)}: {name}"


def test_names_of_modules_exist():
    paths = sorted(ROOT.rglob("*.py"))
    assert {"input.times_of", "on_manifold", "jax.vmap"} <= {name for path in paths for name in names_in(path)}
    assert [name for path in paths for name in unknown_names(path)] == []
    assert exists("symspline._base.input.times_of") and not exists("symspline.handed.times_of")
