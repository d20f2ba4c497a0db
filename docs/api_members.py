"""The members of every class, in the groups in which its page of the reference lists them."""

from __future__ import annotations

import dataclasses
import inspect

import symspline

# The order of the groups, and of the members in them. Members that are not listed follow under `REST`.
OF_CURVES = {
    "Construct": "from_points fit",
    "Evaluate": "__call__ derivative grid section arc_length at_length speed transport lift frames",
    "Measure": "length bending_energy closest extrema solve",
    "Uncertainty": "std cov band sample sigma sigma_at lam_at residuals",
    "Cut and join": "restrict concatenate append reverse shift retime",
    "Differentiate by the data": "jvp vjp",
    "Plot and save": "plot animate save",
    "Data of the curve": (
        "t axes points velocities control_points knots degree bc_type extrapolate space domain symmetric gaps duration "
        "data parameters lam df report"
    ),
}
OF_SPACES = {
    "Geodesics": "exp log geodesic distance",
    "Metric and transport": "inner norm transport frame",
    "Group action": "act symmetry transvection",
    "Statistics": "mean median",
    "Validation and projection": "check_point check_tangent project project_tangent",
    "Random data": "random_point random_tangent",
    "Properties": "dim point_shape dtype curvature injectivity_radius",
}
REST = "More"


def fields_of(cls: type) -> set[str]:
    """The fields of named tuples, dataclasses and exceptions, which the docstring of the class describes."""
    if issubclass(cls, Exception):
        return set(getattr(cls, "__annotations__", ()))
    if dataclasses.is_dataclass(cls):
        return {field.name for field in dataclasses.fields(cls)}
    return set(getattr(cls, "_fields", ()))


def is_space(thing: object) -> bool:
    """Whether something is a class of spaces, other than the base class."""
    return isinstance(thing, type) and issubclass(thing, symspline.Space) and thing is not symspline.Space


def members(cls: type) -> dict[str, str]:
    """The documented members of a class: their names, with the directive that documents each."""
    found = {}
    for name in dir(cls):
        if (name.startswith("_") and name != "__call__") or name in fields_of(cls):
            continue
        owner = next((base for base in cls.__mro__ if name in vars(base)), None)
        if owner is None or not owner.__module__.startswith("symspline"):
            continue
        # A space's own page has its own members; those of all spaces are on the page of `Space`.
        if is_space(cls) and (owner in symspline.Space.__mro__ or not vars(owner)[name].__doc__):
            continue
        thing = inspect.getattr_static(cls, name)
        if inspect.getdoc(getattr(cls, name)):
            found[name] = "automethod" if callable(getattr(cls, name)) else _kind(thing)
    return found


def _kind(thing: object) -> str:
    return "autoproperty" if isinstance(thing, property) or hasattr(thing, "func") else "autoattribute"


def grouped(cls: type) -> list[tuple[str, list[tuple[str, str]]]]:
    """The groups of a class: title, and pairs of a directive and a name."""
    left, groups = members(cls), []
    for title, names in (OF_SPACES if issubclass(cls, symspline.Space) else OF_CURVES).items():
        present = [(left.pop(name), name) for name in names.split() if name in left]
        if present:
            groups.append((title, present))
    if left:
        groups.append((REST if groups else "Members", [(kind, name) for name, kind in sorted(left.items())]))
    return groups


def all_grouped() -> dict[str, list[tuple[str, list[tuple[str, str]]]]]:
    """The groups of every public class of the package and its modules, by the class's full name."""
    modules = [
        symspline,
        *(thing for name in symspline.__all__ if inspect.ismodule(thing := getattr(symspline, name))),
    ]
    return {
        f"{module.__name__}.{name}": grouped(thing)
        for module in modules
        for name in getattr(module, "__all__", ())
        if inspect.isclass(thing := getattr(module, name))
    }
