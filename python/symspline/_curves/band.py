"""Noisy data near a curve and the credible band of the curve, for plots."""

from __future__ import annotations

from typing import NamedTuple, Self

from .._spaces import Array, Doubles


class UncertaintyBand(NamedTuple):
    """Noisy data near one curve, and the credible band of the curve.

    Attributes
    ----------
    x : ndarray
        Times of the data as numbers of the core.
    points : list of ndarray
        The data in each factor.
    radii : list of ndarray
        Radii of the 95 % band around the curve at the requested times, in each factor.
    speed : ndarray or None
        Standard deviation of the velocity in one direction; None in a product.
    """

    x: Doubles
    points: list[Array]
    radii: list[Doubles]
    speed: Doubles | None

    def part(self, number: int) -> Self:
        """Return the data and the band in one factor of a product."""
        return self._replace(points=[self.points[number]], radii=[self.radii[number]], speed=None)
