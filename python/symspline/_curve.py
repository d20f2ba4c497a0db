"""The base class of all curves."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import ArrayLike

from . import _archive
from ._arrays import short_repr
from ._curves.energy import Evaluable, bending_energy
from ._curves.integrals import integrate
from ._spaces import Space


class Curve(ABC):
    """A curve on a space, or a batch of curves.

    This is the base class of `CubicSpline`, `HermiteSpline`, `SmoothingSpline`, `BSpline` and `BezierCurve`. Call a
    curve to evaluate it or its derivatives. A batch is a sequence of curves.

    Examples
    --------
    >>> import symspline as ss
    >>> points = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]
    >>> curves = ss.CubicSpline(None, points, "sphere:2"), ss.BezierCurve(points, "sphere:2")
    >>> [isinstance(curve, ss.Curve) for curve in curves]
    [True, True]
    >>> [curve.length().round(4).item() for curve in curves]
    [3.1923, 2.2214]
    """

    # The name of its format in files and pickles.
    _format: ClassVar[str]
    _curve: Evaluable
    # The extrapolation policy in the words of the core.
    _outside: str = "raise"

    def __init_subclass__(cls) -> None:
        if "_format" in vars(cls):
            _archive.FORMATS[cls._format] = cls

    @abstractmethod
    def __call__(self, x: ArrayLike, nu: int = 0) -> Any:
        """Evaluate the curve at times x: its points, or for `nu` 1 or 2 its velocity or covariant acceleration."""

    @abstractmethod
    def speed(self, x: ArrayLike) -> Any:
        """Evaluate the speed, the norm of the velocity, at times x."""

    @property
    @abstractmethod
    def space(self) -> Space:
        """The space."""

    @property
    @abstractmethod
    def domain(self) -> tuple[Any, Any]:
        """First and last time; arrays with the batch axes where every curve has times of its own."""

    def length(self) -> Any:
        """Length of the curve over its domain, ∫ |γ'| dt; shape of the batch axes."""
        curve = self._curve
        return integrate(
            curve.times, lambda x: curve.evaluate(x, "speed", self._outside, True), curve.batch, curve.exact
        )

    def bending_energy(self) -> Any:
        """Bending energy ∫ ‖∇γ'‖² dt, (1) of the paper, which Riemannian cubics minimise; shape of the batch axes."""
        return bending_energy(self._curve, self._outside)

    # ---- a batch as a sequence ----

    @property
    def _batch(self) -> tuple[int, ...]:
        return self._curve.batch

    @abstractmethod
    def _picked(self, index: Any) -> Self:
        """A curve, or a slice of curves, of a batch."""

    def __len__(self) -> int:
        if not self._batch:
            raise TypeError("this is one curve; only a batch of curves has a length (see also .length())")
        return self._batch[0]

    def __getitem__(self, index: Any) -> Self:
        """A curve, or a slice of curves, of a batch."""
        if not self._batch:
            raise TypeError("this is one curve; only a batch of curves can be indexed")
        if not isinstance(index, (int, np.integer, slice)):
            raise TypeError(
                f"a curve is picked by a whole number or a slice as index, not {short_repr(index)}"
            )
        if not isinstance(index, slice) and not -len(self) <= index < len(self):
            raise IndexError(f"index {short_repr(index)} is out of range: there are {len(self)} curves")
        return self._picked(index)

    def __bool__(self) -> bool:
        return True

    def __iter__(self) -> Iterator[Self]:
        return (self[i] for i in range(len(self)))

    # ---- as a value ----

    __hash__ = None  # type: ignore[assignment]

    def save(self, file: Any) -> None:
        """Write the curve to an NPZ file, which `symspline.load` reads back without a new fit."""
        _archive.write(file, self._state())

    def __reduce__(self) -> tuple[Any, ...]:
        return _archive.restore, (self._state(),)

    @abstractmethod
    def _state(self) -> dict[str, Any]:
        """What files and pickles hold."""

    @classmethod
    @abstractmethod
    def _from_state(cls, state: _archive.Entries) -> Self:
        """Make the curve that a state describes."""
