"""Noisy data beside a curve, as plots show them."""

from __future__ import annotations

from typing import NamedTuple, Self

from .._spaces import Array
from .curve import Doubles


class UncertaintyBand(NamedTuple):
    """Noisy data near one curve, and how well they determine it.

    Attributes:
        x: times of the data, as the core counts them.
        points: the data, in every factor.
        radii: of the 95 % band around the curve, at the times that were asked for, in every factor.
        speed: the standard deviation of the velocity in one direction; None in a product.
    """

    x: Doubles
    points: list[Array]
    radii: list[Doubles]
    speed: Doubles | None

    def part(self, number: int) -> Self:
        """The same in one factor of a product."""
        return self._replace(points=[self.points[number]], radii=[self.radii[number]], speed=None)
