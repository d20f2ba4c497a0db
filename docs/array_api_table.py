"""Which functions accept the arrays of which library: the table of ``array_api.md``.

python docs/array_api_table.py

Every entry is the result of a call. Columns of libraries that are not installed are left as they are.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

import symspline as ss

PAGE = Path(__file__).with_name("array_api.md")
BEGIN, END = "<!-- table: begin -->", "<!-- table: end -->"
ORDERS = ("none", "first", "first and second")
UNKNOWN = "–"

Call = Callable[..., Any]
# Knots, points, velocities and times.
DATA = [
    np.array([0.0, 1.0, 2.5]),
    np.array([[1.0, 0, 0], [0.6, 0.8, 0], [0.6, 0, 0.8]]),
    0.2 * np.array([[0.0, 0, 1], [0.8, -0.6, 0], [0, 1, 0]]),
    np.array([0.5, 1.7]),
]


def functions() -> dict[str, Call]:
    """Return calls of knots, points, velocities and times by the names of the functions."""
    space = ss.Sphere(2)
    found: dict[str, Call] = {
        "symspline.fit": lambda t, p, u, x: ss.fit(t, p, space)[0],
        "symspline.evaluate": lambda t, p, u, x: ss.evaluate(t, p, u, space, x),
        "symspline.CubicSpline": lambda t, p, u, x: ss.CubicSpline(t, p, space)(x),
        "symspline.HermiteSpline": lambda t, p, u, x: ss.HermiteSpline(t, p, u, space)(x),
        "symspline.make_smoothing_spline": lambda t, p, u, x: ss.make_smoothing_spline(t, p, space, 0.1)(x),
        "Space.exp": lambda t, p, u, x: space.exp(p, u),
        "Space.distance": lambda t, p, u, x: space.distance(p[:2, :], p[1:, :]),
    }
    for library in ("torch", "jax"):
        if find_spec(library):
            own: Any = import_module(f"symspline.{library}")
            found |= {
                f"symspline.{library}.curve": lambda t, p, u, x, own=own: own.curve(x, t, p, space),
                f"symspline.{library}.fit": lambda t, p, u, x, own=own: _first(own.fit(t, p, space)),
                f"symspline.{library}.evaluate": lambda t, p, u, x, own=own: own.evaluate(t, p, u, space, x),
            }
    return found


def _first(found: Any) -> Any:
    """Return the velocities of a fit, which JAX returns with a residual."""
    return found[0] if isinstance(found, tuple) else found


def strict_columns(call: Call) -> list[str]:
    """Return the entries for the reference implementation of the array API standard."""
    import array_api_strict as xp

    return [_accepted(call, [xp.asarray(a) for a in DATA], type(xp.asarray(0.0)))]


def torch_columns(call: Call) -> list[str]:
    """Return the entries for PyTorch: whether the call works, and its derivatives with respect to the points."""
    import torch

    arrays = [torch.tensor(a) for a in DATA]
    works = _accepted(call, arrays, torch.Tensor)
    t, p, u, x = arrays
    p.requires_grad_()
    order = 0
    try:
        value = (call(t, p, u, x) ** 3).sum()
        for _ in range(2):
            (gradient,) = torch.autograd.grad(value, p, create_graph=True)
            assert torch.isfinite(gradient).all()
            order, value = order + 1, (gradient**2).sum()
    except Exception:
        pass
    return [works, ORDERS[order]]


def jax_columns(call: Call) -> list[str]:
    """Return the entries for JAX: whether the call works, also under `jit`, and its derivatives."""
    import jax
    import jax.numpy as jnp

    with jax.enable_x64(True):
        t, p, u, x = (jnp.asarray(a) for a in DATA)
        compiled = _accepted(jax.jit(lambda p: call(t, p, u, x)), [p], jax.Array)
        # A call without `jit` compiles every operation by itself, which takes long.
        works = compiled if compiled == "yes" else _accepted(call, [t, p, u, x], jax.Array)
        first = lambda p: jax.jvp(lambda p: call(t, p, u, x), (p,), (u,))[1]  # noqa: E731
        second = lambda p: jax.jvp(first, (p,), (u,))[1]  # noqa: E731
        order = 2 if _finite(jax.jit(second), p) else int(_finite(jax.jit(first), p))
    return [works, compiled, ORDERS[order]]


# By the library that must be installed: the headings of its columns, and their entries.
COLUMNS: dict[str, tuple[list[str], Callable[[Call], list[str]]]] = {
    "array_api_strict": (["array-api-strict"], strict_columns),
    "torch": (["PyTorch (CPU)", "PyTorch derivatives"], torch_columns),
    "jax": (["JAX (CPU)", "JAX `jit`", "JAX derivatives"], jax_columns),
}


def _finite(function: Call, p: Any) -> bool:
    try:
        return bool(np.isfinite(np.asarray(function(p))).all())
    except Exception:
        return False


def _accepted(call: Call, arrays: list[Any], kind: type) -> str:
    """Return whether a call works, and whether its result is of the library of its arguments."""
    try:
        # PyTorch and NumPy warn of conversions.
        with warnings.catch_warnings(action="ignore"):
            found = call(*arrays)
    except Exception:
        return "no"
    return "yes" if isinstance(found, kind) else "returns NumPy"


def table(before: str) -> str:
    """Return the table, with the entries of another one for libraries that are not installed."""
    known = _entries(before)
    calls = functions()
    headings = ["function", *(heading for own, _ in COLUMNS.values() for heading in own)]
    lines = ["| " + " | ".join(headings) + " |", "|:--" + "|:--:" * (len(headings) - 1) + "|"]
    for name in [*calls, *(name for name in known if name not in calls and not _installed(name))]:
        cells = []
        for library, (own, columns) in COLUMNS.items():
            kept = [known.get(name, {}).get(heading, UNKNOWN) for heading in own]
            if name.split(".")[1] in COLUMNS and name.split(".")[1] != library:
                cells += [UNKNOWN] * len(own)
            else:
                cells += columns(calls[name]) if find_spec(library) and name in calls else kept
        lines.append("| `" + name + "` | " + " | ".join(cells) + " |")
    return "\n".join([lines[0], lines[1], *sorted(lines[2:], key=_order)])


def _installed(name: str) -> bool:
    """Return whether the library that a function belongs to is installed."""
    library = name.split(".")[1]
    return library not in COLUMNS or find_spec(library) is not None


def _order(line: str) -> tuple[bool, bool]:
    """Place functions of PyTorch and then of JAX behind the others."""
    return "`symspline.jax." in line, "`symspline.torch." in line


def _entries(text: str) -> dict[str, dict[str, str]]:
    """Return the entries of a table by function and heading."""
    rows = [
        [cell.strip() for cell in line.strip("|").split("|")] for line in text.splitlines() if line[:1] == "|"
    ]
    return {row[0].strip("`"): dict(zip(rows[0], row, strict=True)) for row in rows[2:]}


def page(text: str) -> str:
    """Return the page with a new table."""
    before, _, rest = text.partition(BEGIN)
    old, found, after = rest.partition(END)
    if not found:
        raise SystemExit(f"{PAGE} lacks the lines {BEGIN} and {END}")
    return f"{before}{BEGIN}\n{table(old)}\n{END}{after}"


if __name__ == "__main__":
    PAGE.write_text(page(PAGE.read_text("utf-8")), "utf-8")
