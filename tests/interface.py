"""The public interface as text: names, signatures, methods. `python tests/interface.py` writes it to interface.txt."""

import importlib
import inspect
from pathlib import Path

SNAPSHOT = Path(__file__).with_name("interface.txt")
MODULES = ["", "convert", "geo", "jax", "manifolds", "measure", "poses", "quantum", "rotations", "shapes", "subspaces"]
MODULES += ["tensors", "testing", "torch", "xarray"]


def signature(thing):
    """Parameters and defaults, without types, which may be made more precise."""
    try:
        parameters = inspect.signature(thing).parameters.values()
    except (TypeError, ValueError):
        return "(...)"
    return str(inspect.Signature([one.replace(annotation=inspect.Parameter.empty) for one in parameters]))


def members(kind):
    """What a class defines itself, or inherits from a base class that is not public."""
    public = vars(importlib.import_module("symspline")).values()
    bases = [base for base in kind.__mro__ if base.__module__.startswith("symspline") and base not in public]
    return {name: value for base in [*reversed(bases), kind] for name, value in vars(base).items()}


def described(name):
    """The lines of the interface of one module. PyTorch may be missing: then those of the snapshot stay."""
    try:
        module = importlib.import_module(name)
    except ModuleNotFoundError as error:
        if error.name != "torch":
            raise
        yield from (line for line in SNAPSHOT.read_text("utf-8").splitlines() if line.startswith(f"{name}."))
        return
    for public in sorted(module.__all__):
        thing = getattr(module, public)
        if inspect.ismodule(thing):
            continue
        if not callable(thing):
            yield f"{name}.{public}"
            continue
        yield f"{name}.{public}{signature(thing)}"
        if inspect.isclass(thing):
            for member, value in sorted(members(thing).items()):
                if not member.startswith("_") or member == "__call__":
                    yield f"    .{member}{signature(value) if inspect.isfunction(value) else ''}"


def interface():
    """The lines of the interface."""
    names = [".".join(filter(None, ["symspline", module])) for module in MODULES]
    return [line for name in names for line in described(name)]


if __name__ == "__main__":
    SNAPSHOT.write_text("\n".join(interface()) + "\n", encoding="utf-8")
