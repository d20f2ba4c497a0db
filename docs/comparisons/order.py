"""How fast the error falls: symspline and SciPy's RotationSpline through a smooth motion in SO(3).

python docs/comparisons/order.py [--write]
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from angles import angle
from figure import loglog
from motions import DURATION, between, knots, tumble
from page import HERE, insert, parser, table, versions
from scipy.spatial.transform import Rotation, RotationSpline

import symspline as ss

SIZES = (21, 41, 81, 161, 321, 641, 1281)
NOT_A_KNOT, NATURAL, SCIPY = "symspline, not-a-knot", "symspline, natural", "RotationSpline"
Errors = dict[str, list[float]]


def errors(n: int) -> tuple[dict[str, float], dict[str, float]]:
    """Largest angle to the true motion with n knots: everywhere, and in the middle three fifths."""
    t = knots(n)
    x = between(t)
    points, true = tumble(t), tumble(x)
    curves = {
        NOT_A_KNOT: ss.CubicSpline(t, points, "so:3", bc_type="not-a-knot")(x),
        NATURAL: ss.CubicSpline(t, points, "so:3", bc_type="natural")(x),
        SCIPY: RotationSpline(t, Rotation.from_matrix(points))(x).as_matrix(),
    }
    found = {name: angle(true, curve) for name, curve in curves.items()}
    middle = np.abs(x - DURATION / 2) < 0.3 * DURATION
    return (
        {name: float(error.max()) for name, error in found.items()},
        {name: float(error[middle].max()) for name, error in found.items()},
    )


def measure(sizes: Sequence[int] = SIZES) -> tuple[Errors, Errors]:
    """The errors by method, a number for each size."""
    rows = [errors(n) for n in sizes]
    everywhere, middle = zip(*rows, strict=True)
    return tuple({name: [row[name] for row in part] for name in part[0]} for part in (everywhere, middle))


def text(sizes: Sequence[int], everywhere: Errors, middle: Errors) -> str:
    """The table, with the orders between the two largest sizes."""
    rows = []
    for i, n in enumerate(sizes):
        ratio = everywhere[SCIPY][i] / everywhere[NOT_A_KNOT][i]
        cells = [errors[i] for errors in (*everywhere.values(), middle[NOT_A_KNOT], middle[SCIPY])]
        rows.append(
            [n, *(f"{cell:.1e}" for cell in cells[:3]), f"{float(f'{ratio:.2g}'):,.0f}×".replace(",", " ")]
        )
        rows[-1] += [f"{cell:.1e}" for cell in cells[3:]]
    orders = [order(sizes, errors) for errors in everywhere.values()]
    inner = [order(sizes, middle[name]) for name in (NOT_A_KNOT, SCIPY)]
    rows.append(["order", *(f"{value:.2f}" for value in orders), None, *(f"{value:.2f}" for value in inner)])
    head = ["knots", *everywhere, "ratio", "not-a-knot, middle", "RotationSpline, middle"]
    return table(head, rows)


def order(sizes: Sequence[int], values: Sequence[float]) -> float:
    """p of error ~ hᵖ between the last two sizes."""
    return float(np.log(values[-2] / values[-1]) / np.log((sizes[-1] - 1) / (sizes[-2] - 1)))


def draw(sizes: Sequence[int], everywhere: Errors, file: str = "order.png") -> None:
    loglog(
        HERE / file,
        sizes,
        everywhere,
        {NOT_A_KNOT: 4, SCIPY: 2},
        "largest angle to the true motion, rad",
        "Reconstruction of a smooth rotation",
    )


def main() -> None:
    given = parser(__doc__).parse_args()
    everywhere, middle = measure()
    found = f"{text(SIZES, everywhere, middle)}\n\n{versions('symspline', 'scipy')}"
    print(found)
    if given.write:
        insert("order", found)
        draw(SIZES, everywhere)


if __name__ == "__main__":
    main()
