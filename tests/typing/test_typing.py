"""Type checkers infer the types of `right.py`, reject the calls of `wrong.py`, and see no Any in public results."""

import functools
import importlib.util
import inspect
import os
import re
import subprocess
import sys
import sysconfig
from pathlib import Path
from typing import Any, get_overloads

import interface
import pytest

import symspline

HERE = Path(__file__).parent
FILES = ["right.py", "wrong.py"]


def check(module, *arguments):
    """Run a type checker that is installed as a module."""
    if importlib.util.find_spec(module) is None:
        pytest.skip(f"{module} is not installed")
    # The package that is tested, which need not be the one that is installed, and NumPy.
    paths = [str(Path(symspline.__file__).parents[1]), sysconfig.get_path("purelib")]
    paths.append(os.environ.get("PYTHONPATH", ""))
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, paths))}
    found = subprocess.run(
        [sys.executable, "-m", module, *arguments], cwd=HERE, env=environment, capture_output=True, text=True
    )
    assert found.returncode == 0, found.stdout + found.stderr


def test_mypy():
    check("mypy", "--strict", "--config-file=", f"--cache-dir={HERE.parents[1] / '.mypy_cache/typing'}", *FILES)


def test_pyright():
    check("basedpyright", "--project", "pyrightconfig.json", "--pythonpath", sys.executable)


def test_all_public_types_are_known():
    check("basedpyright", "--verifytypes", "symspline", "--ignoreexternal")


def test_annotations_may_omit_the_report_at_run_time():
    for spline in (symspline.CubicSpline, symspline.SmoothingSpline):
        assert (spline[Any] | None) != (spline[Any, Any] | None)


def functions_of(cls):
    """The public methods and properties of a class."""
    for base in cls.__mro__:
        if not base.__module__.startswith("symspline"):
            continue
        for name, value in vars(base).items():
            if name.startswith("_") and name not in ("__call__", "__getitem__", "__iter__"):
                continue
            value = getattr(value, "fget", None) or getattr(value, "func", value)
            function = getattr(value, "__func__", value)
            if inspect.isfunction(function):
                yield f"{base.__module__}.{base.__qualname__}.{name}", function


@functools.cache
def public_functions():
    """All public functions, methods and properties by their names."""
    found = {}
    for module in interface.MODULES:
        name = ".".join(filter(None, ["symspline", module]))
        if module == "torch" and not importlib.util.find_spec("torch"):
            continue
        imported = importlib.import_module(name)
        for public in imported.__all__:
            thing = getattr(imported, public)
            if inspect.isclass(thing):
                found.update(functions_of(thing))
            elif inspect.isfunction(thing):
                found[f"{name}.{public}"] = thing
    return found


def annotations(function):
    """Every annotation of the result of a function: one, or one for each overload."""
    # Modules with postponed annotations, which are text.
    return [str(one.__annotations__.get("return")) for one in get_overloads(function) or [function]]


def test_no_public_function_returns_any():
    pytest.importorskip("jax")
    pytest.importorskip("xarray")
    functions = public_functions()
    assert len(functions) > 150
    unknown = {
        name: result
        for name, function in functions.items()
        for result in annotations(function)
        # The numbers of an array may have any type.
        # The file determines the type of the result of `load`, as with `json.load`.
        if re.search(r"\bAny\b", result.replace("NDArray[Any]", "")) and name != "symspline.load"
    }
    assert not unknown
