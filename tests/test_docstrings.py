"""Docstrings of all public objects are complete and in numpydoc format, by the validator of numpydoc."""

import dataclasses
import importlib
import inspect
from itertools import pairwise

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
