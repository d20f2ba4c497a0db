"""Estimated curves."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, Self

import numpy as np

from .._archive import Entries, entry, read_fitted, read_report
from .._core import ValidationError
from .._cubic import CubicSpline
from .._curves.curve import UncertaintyBand
from .._curves.ends import end_kinds
from .._smoothing.factors import grouped, smoothed_spaces
from .._smoothing.posterior import Parameter, Posterior
from .._smoothing.report import SmoothingReport
from .._smoothing.solve import Smoothed
from .._smoothing.spline import SmoothingSpline, radius
from .._spaces import Doubles
from .._typing import P
from .measurements import Points


def joint(report: SmoothingReport, band: Doubles, side: Doubles, corner: Doubles, size: int, first: int) -> Smoothed:
    """Return the result in one part, whose coordinates begin with number `first` of all coordinates.

    Given standard deviations are trusted, as with ``absolute_sigma`` of SciPy's ``curve_fit``.
    """
    posterior = Posterior(band, np.zeros((0, 0)), size, side, corner, first)
    return Smoothed(report, np.zeros((0, 4)), report.lam, 1.0, False, posterior)


class EstimatedSpline(SmoothingSpline[P, Any]):
    """A C² cubic spline estimated from measurements of any kind; see `estimate`."""

    _kind = "Estimated spline"
    _format = "symspline-estimate"
    _parameters: dict[str, Parameter]
    _measurements: tuple[Any, ...]
    _residuals: tuple[Doubles, ...]

    def _fill(self, *parts: Any) -> None:
        *own, self._parameters, self._measurements, self._residuals = parts
        super()._fill(*own)

    @property
    def parameters(self) -> Mapping[str, Parameter]:
        """Estimated constants by name, each with ``value``, ``std`` and ``cov``."""
        return MappingProxyType(self._parameters)

    @property
    def measurements(self) -> tuple[Any, ...]:
        """Measurements from which the curve was estimated; empty for a curve from a file."""
        return self._measurements

    @property
    def residuals(self) -> Any:
        """Residuals of each measurement in standard deviations, shape (n, components).

        On products and for poses, points have one array per part.
        """
        return self._residuals

    @property
    def data(self) -> Any:
        """Times and points of the first `Points` among the measurements."""
        for own in self._measurements:
            if isinstance(own, Points):
                return own.t, own.y
        raise ValidationError("the curve was estimated without points. See the attribute measurements.")

    def _spread(self, part: Smoothed, index: tuple[int, ...], x: Doubles, nu: int) -> Doubles:
        space = smoothed_spaces(self.space)[next(i for i, own in enumerate(self._smoothed) if own is part)]
        found = self._covariance(part, space, index, np.ascontiguousarray(x), None, [nu])
        return np.asarray(np.sqrt(np.trace(found, axis1=-2, axis2=-1) / space.dim))

    def _coupled(self, parts: list[int], index: tuple[int, ...], x: Doubles, orders: list[int]) -> Doubles:
        # The measurements may couple the parts, such as attitude and acceleration by an accelerometer.
        spaces, posterior = smoothed_spaces(self.space), self._posterior(self._smoothed[0])
        firsts = [self._posterior(self._smoothed[number]).first for number in parts]
        rows = [first + np.arange(spaces[number].dim) for number, first in zip(parts, firsts, strict=True)]
        kinds = end_kinds(self._bc_type)
        return posterior.coupled(self._knots_of(index), index, kinds, x, None, orders, np.concatenate(rows))

    @property
    def _made_of(self) -> str:
        return f"estimated, {self._times.shape[-1]} knots, {len(self._parameters)} parameters"

    def _noise_beside(self, index: tuple[int, ...], x: Doubles) -> UncertaintyBand:
        parts = list(zip(smoothed_spaces(self.space), self._smoothed, strict=True))
        radii = [radius(own[-1][0], 0.95) * self._spread(own[-1][1], index, x, 0) for own in grouped(self.space, parts)]
        return UncertaintyBand(np.empty(0), [], radii, None)

    # ---- batches, files and pickles ----

    @property
    def _parts(self) -> Any:
        return CubicSpline._of(
            self._time_axis, self._t, self._curve, self._bc_type, self._extrapolate, self._reports
        )._parts

    def _state(self) -> dict[str, Any]:
        posterior: Any = self._smoothed[0].posterior
        return CubicSpline._state(self) | {
            "noise": [vars(own.report) for own in self._smoothed],
            "parameters": {name: [own.value.tolist(), own.cov.tolist()] for name, own in self._parameters.items()},
            "matrix": posterior.band,
            "side": posterior.side,
            "corner": posterior.corner,
        }

    @classmethod
    def _from_state(cls, state: Entries) -> Self:
        parts = read_fitted(state)
        curve = parts[2]
        spaces, knots = smoothed_spaces(curve.space), curve.times.shape[-1]
        m = sum(space.dim for space in spaces)
        with entry("parameters"):
            parameters = {name: Parameter(*map(np.asarray, own)) for name, own in dict(state["parameters"]).items()}
            p = sum(len(own.value) for own in parameters.values())
            matrix, side, corner = (state[name] for name in ("matrix", "side", "corner"))
            shapes = [(knots * m, 4 * m), (knots * m, p), (p, p)]
            if [matrix.shape, side.shape, corner.shape] != shapes or any(
                own.cov.shape != 2 * own.value.shape for own in parameters.values()
            ):
                raise ValidationError("the matrices do not match the parameters and knots")
        smoothed, first = [], 0
        with entry("noise"):
            for space, numbers in zip(spaces, state["noise"], strict=True):
                report = read_report(SmoothingReport, dict(numbers), ())
                smoothed.append(joint(report, matrix, side, corner, m, first))
                first += space.dim
        return cls._of(*parts, None, smoothed, parameters, (), ())

    def __repr__(self) -> str:
        knots, parameters = self._times.shape[-1], ", ".join(self._parameters) or "no parameters"
        return f"<EstimatedSpline on {self.space!r}: {knots} knots, {parameters}>"
