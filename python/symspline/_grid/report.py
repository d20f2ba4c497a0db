"""The report of a grid."""

from __future__ import annotations

from functools import cached_property
from typing import Self

import numpy as np

from .._spaces import product_norm
from .axes import GridAxis, Sites
from .evaluation import FactorGrid, Found

# The number of cell centres at which the two orders of axes are compared.
_COMPARED = 4096


class GridReport:
    """Report of a `GridSpline`.

    Splines along the first axis are fitted when the grid is made, and those along the other axes when it is evaluated.

    See Also
    --------
    GridSpline.report : Report of a grid.

    Examples
    --------
    >>> import numpy as np, symspline as ss
    >>> u, v = np.linspace(0, 1, 9), np.linspace(0, 1, 8)
    >>> points = np.stack([u[:, None] + 0 * v, u[:, None] * v], axis=-1)
    >>> report = ss.GridSpline((u, v), points, "r:2").report
    >>> report.converged, report.missing, report.axis_order_gap < 1e-12
    (True, 0, True)
    """

    _axes: list[GridAxis]
    _factors: list[FactorGrid]

    @classmethod
    def _of(cls, axes: list[GridAxis], factors: list[FactorGrid]) -> Self:
        self = cls()
        self._axes, self._factors = axes, factors
        return self

    @cached_property
    def _found(self) -> Found:
        found = Found()
        for factor in self._factors:
            found = found.merged(factor.forward.found)
        return found

    @property
    def converged(self) -> bool:
        """Whether all splines along the first axis converged."""
        return self._found.failed == 0

    @property
    def residual(self) -> float:
        """Largest relative C² residual of the splines along the first axis."""
        return self._found.residual

    @cached_property
    def missing(self) -> int:
        """Number of missing nodes.

        Examples
        --------
        >>> import numpy as np, symspline as ss
        >>> u = np.linspace(0, 1, 8)
        >>> surface = ss.GridSpline((u, u), (u[:, None] * u)[..., None], "r:1")
        >>> surface.report.missing
        0
        """
        first = self._factors[0]
        return int(np.count_nonzero(~first.space._where_finite(first.points)))

    @cached_property
    def max_step(self) -> tuple[float, ...]:
        """Longest distance between neighbouring nodes along each axis.

        Examples
        --------
        >>> import numpy as np, symspline as ss
        >>> u = np.linspace(0, 1, 8)
        >>> surface = ss.GridSpline((u, u), (u[:, None] * u)[..., None], "r:1")
        >>> [round(step, 4) for step in surface.report.max_step]
        [0.1429, 0.1429]
        """
        longest: list[float] = []
        for k in range(len(self._axes)):
            steps = []
            for factor in self._factors:
                p, q = factor.space._neighbours(np.moveaxis(factor.points, k, len(self._axes) - 1))
                valid = factor.space._where_finite(p) & factor.space._where_finite(q)
                steps.append(factor.space.distance(p[valid], q[valid]))
            longest.append(float(np.max(product_norm(tuple(steps)), initial=0.0)))
        return tuple(longest)

    @cached_property
    def axis_order_gap(self) -> float:
        """Largest distance between the values in the given and in the reverse order of axes.

        It is computed on first access, over the centres of up to 4096 cells. For smooth data it is of order 8 in the
        spacing; it is large for rough or noisy data, whose interpolant then depends on an arbitrary choice.

        Examples
        --------
        >>> import numpy as np, symspline as ss
        >>> u = np.linspace(0, 1, 8)
        >>> surface = ss.GridSpline((u, u), (u[:, None] * u)[..., None], "r:1")
        >>> surface.report.axis_order_gap < 1e-12
        True
        """
        dims = len(self._axes)
        most = max(1, int(_COMPARED ** (1 / dims)))
        x = []
        for axis in self._axes:
            centres = (axis.knots[1:] + axis.knots[:-1]) / 2
            chosen = np.linspace(0, len(centres) - 1, min(most, len(centres))).round().astype(int)
            x.append(centres[chosen])
        sites = Sites(x, True, ["continue"] * dims)
        gaps = product_norm(tuple(factor.gap(sites) for factor in self._factors))
        return float(np.max(gaps, initial=0.0, where=np.isfinite(gaps)))

    def __repr__(self) -> str:
        state = "converged" if self.converged else "NOT converged"
        return f"<GridReport: {state}, residual {self.residual:.1e}, {self.missing} missing nodes>"
