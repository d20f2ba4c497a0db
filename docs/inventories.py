"""Inventories of the few names of other projects that this documentation links to: `python docs/inventories.py`.

Sphinx reads them instead of each project's whole inventory, so that `make docs` needs no network.
"""

from __future__ import annotations

import zlib
from pathlib import Path

HERE = Path(__file__).parent / "inventories"

# The address of each project, and its names: role and page. "$" in a page is the name itself.
PROJECTS = {
    "numpy": (
        "https://numpy.org/doc/stable/",
        {
            "array_like": ("std:term", "glossary.html#term-array_like"),
            "numpy.ndarray": ("py:class", "reference/generated/numpy.ndarray.html#$"),
            "numpy.random.Generator": ("py:class", "reference/random/generator.html#$"),
            "numpy.datetime64": ("py:class", "reference/arrays.scalars.html#$"),
            "numpy.timedelta64": ("py:class", "reference/arrays.scalars.html#$"),
        },
    ),
    "scipy": (
        "https://docs.scipy.org/doc/scipy/",
        {
            f"scipy.{name}": ("py:class", "reference/generated/$.html#$")
            for name in (
                "interpolate.CubicSpline",
                "interpolate.BSpline",
                "spatial.transform.Rotation",
                "spatial.transform.RigidTransform",
                "spatial.transform.RotationSpline",
                "spatial.transform.Slerp",
            )
        }
        | {
            f"scipy.interpolate.{name}": ("py:function", "reference/generated/$.html#$")
            for name in ("make_interp_spline", "make_lsq_spline", "make_smoothing_spline")
        },
    ),
    "matplotlib": (
        "https://matplotlib.org/stable/",
        {
            "matplotlib.figure.Figure": ("py:class", "api/figure_api.html#$"),
            "matplotlib.axes.Axes": ("py:class", "api/_as_gen/$.html#$"),
            "matplotlib.animation.FuncAnimation": ("py:class", "api/_as_gen/$.html#$"),
        },
    ),
    "xarray": (
        "https://docs.xarray.dev/en/stable/",
        {f"xarray.{name}": ("py:class", "generated/$.html#$") for name in ("DataArray", "Dataset")},
    ),
    "pandas": (
        "https://pandas.pydata.org/docs/",
        {
            f"pandas.{name}": ("py:class", "reference/api/$.html#$")
            for name in ("DataFrame", "DatetimeIndex", "Series")
        },
    ),
}


# The names as docstrings write them, with domain, role and target.
TYPES = {
    name: (*role.split(":"), name) for _, names in PROJECTS.values() for name, (role, _) in names.items()
} | {short: ("py", "class", f"numpy.{short}") for short in ("ndarray", "datetime64", "timedelta64")}


def inventory(project: str) -> bytes:
    """An inventory in the format of Sphinx, version 2."""
    head = f"# Sphinx inventory version 2\n# Project: {project}\n# Version: \n"
    head += "# The remainder of this file is compressed using zlib.\n"
    names = PROJECTS[project][1]
    lines = [f"{name} {role} 1 {page} -\n" for name, (role, page) in sorted(names.items())]
    return head.encode() + zlib.compress("".join(lines).encode(), 9)


def main() -> None:
    """Writes all inventories."""
    HERE.mkdir(exist_ok=True)
    for project in PROJECTS:
        (HERE / f"{project}.inv").write_bytes(inventory(project))


if __name__ == "__main__":
    main()
