"""The base class of all curves."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator
from typing import Any, ClassVar, Generic, Self

import numpy as np
from numpy.typing import ArrayLike

from . import _archive
from ._arrays import short_repr
from ._curves.integrals import Evaluable, bending_energy, integrate
from ._spaces import Space
from ._typing import File, Number, P, Time


class Curve(ABC, Generic[P]):
    """A curve on a space, or a batch of curves.

    This is the base class of `CubicSpline`, `HermiteSpline`, `PiecewiseGeodesic`, `SmoothingSpline`, `BSpline` and
    `BezierCurve`. Call a curve to evaluate it or its derivatives. A batch is a sequence of curves.

    Examples
    --------
    >>> import symspline as ss
    >>> points = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]
    >>> curves = ss.CubicSpline(None, points, "sphere:2"), ss.BezierCurve(points, "sphere:2")
    >>> [isinstance(curve, ss.Curve) for curve in curves]
    [True, True]
    >>> [curve.length().round(4).item() for curve in curves]
    [3.2601, 2.4139]
    """

    # Name of the format in files and pickles.
    _format: ClassVar[str]
    _curve: Evaluable

    def __init_subclass__(cls) -> None:
        if "_format" in vars(cls):
            _archive.FORMATS[cls._format] = cls

    @abstractmethod
    def __call__(self, x: ArrayLike, nu: int = 0) -> P:
        """Evaluate the curve or its derivatives.

        Parameters
        ----------
        x : array_like
            Times, of any shape and in any order.
        nu : {0, 1, 2}, default 0
            Order of the derivative: 0 for points, 1 for the velocity, 2 for the covariant acceleration.

        Returns
        -------
        ndarray or tuple of ndarray
            Points or tangent vectors, shape ``(*batch axes, *x.shape, *point_shape)``.

        Examples
        --------
        >>> import symspline as ss
        >>> ss.BezierCurve([[0.0], [3.0]], "r:1")([0.5, 1.0], nu=1)
        array([[3.],
               [3.]])
        """

    @abstractmethod
    def speed(self, x: ArrayLike) -> Number:
        """Compute the speed of the curve, the norm of the velocity.

        Parameters
        ----------
        x : array_like
            Times, of any shape and in any order.

        Returns
        -------
        ndarray, shape ``(*batch axes, *x.shape)``
            The speed.

        Examples
        --------
        >>> import symspline as ss
        >>> ss.BezierCurve([[0.0], [3.0]], "r:1").speed([0.5, 1.0])
        array([3., 3.])
        """

    @property
    @abstractmethod
    def space(self) -> Space[P]:
        """Space of the curve."""

    @property
    @abstractmethod
    def domain(self) -> tuple[Time, Time]:
        """First and last time. They are arrays with the batch axes if every curve has its own times."""

    def length(self) -> Number:
        r"""Compute the length of the curve from the first to the last knot.

        Returns
        -------
        ndarray or float, shape ``batch axes``
            The integral of the speed, :math:`\int \lVert\gamma'\rVert \, dt`.

        Examples
        --------
        >>> import symspline as ss
        >>> quarter = ss.CubicSpline(None, [[1, 0, 0], [0, 1, 0]], ss.Sphere(2))
        >>> round(float(quarter.length()), 8)
        1.57079633
        """
        curve = self._curve
        return integrate(
            curve.times, lambda x: curve.evaluate(x, "speed", "continue", True), curve.batch, curve.quad_rtol
        )

    def bending_energy(self) -> Number:
        r"""Compute the bending energy of the curve.

        Returns
        -------
        ndarray or float, shape ``batch axes``
            The integral of the squared covariant acceleration.

        Notes
        -----
        The bending energy is :math:`\int \lVert\nabla_{\gamma'}\gamma'\rVert^2 \, dt`, equation (1) of the paper.
        Riemannian cubics minimise it.

        References
        ----------
        G. Bogfjellmo, K. Modin, O. Verdier, A Numerical Algorithm for C²-Splines on Symmetric Spaces, SIAM J. Numer.
        Anal. 56 (2018), equation (1).

        Examples
        --------
        >>> import symspline as ss
        >>> wave = ss.CubicSpline(None, [[0.0], [1.0], [0.0]], "r:1")
        >>> round(float(wave.bending_energy()), 8)
        6.0
        """
        return bending_energy(self._curve)

    @classmethod
    def _of(cls, *parts: Any) -> Self:
        """Return a curve with the given state, without checks or a fit."""
        self = cls.__new__(cls)
        self._fill(*parts)
        return self

    @abstractmethod
    def _fill(self, *parts: Any) -> None:
        """Set the state of the curve."""

    # ---- batches ----

    @property
    def _batch(self) -> tuple[int, ...]:
        return self._curve.batch

    @property
    def _batch_text(self) -> str:
        """The batch in the representation of the curve."""
        return f"{' x '.join(map(str, self._batch))} curves, " if self._batch else ""

    @abstractmethod
    def _picked(self, index: Any) -> Self:
        """Return one curve of a batch, or a slice of the batch."""

    def __len__(self) -> int:
        if not self._batch:
            raise TypeError("this is one curve; only a batch of curves has a length (see also .length())")
        return self._batch[0]

    def __getitem__(self, index: int | np.integer[Any] | slice[Any, Any, Any]) -> Self:
        """Return one curve of a batch, or a slice of the batch."""
        if not self._batch:
            raise TypeError("this is one curve; only a batch of curves can be indexed")
        if not isinstance(index, (int, np.integer, slice)):
            raise TypeError(f"the index of a curve must be an integer or a slice, not {short_repr(index)}")
        if not isinstance(index, slice) and not -len(self) <= index < len(self):
            raise IndexError(f"index {short_repr(index)} is out of range: there are {len(self)} curves")
        return self._picked(index)

    def __bool__(self) -> bool:
        return True

    def __iter__(self) -> Iterator[Self]:
        return (self[i] for i in range(len(self)))

    # ---- files and pickles ----

    __hash__: ClassVar[None] = None  # type: ignore[assignment]

    def save(self, file: File) -> None:
        """Write the curve to an NPZ file.

        `load` reads it back without a new fit.

        Parameters
        ----------
        file : str, path or file object
            Name of the file, or a binary file that is open for writing. An existing file of this name is replaced only
            when the new one is complete.

        Raises
        ------
        ValidationError
            If the space is a `Manifold` made of functions, which cannot be stored.
        OSError
            If the file cannot be written.

        See Also
        --------
        load : Read a curve.
        save : Write several curves to one file.

        Examples
        --------
        >>> import io, symspline as ss
        >>> file = io.BytesIO()
        >>> ss.CubicSpline(None, [[1, 0, 0], [0, 1, 0]], "sphere:2").save(file)
        >>> _ = file.seek(0)
        >>> ss.load(file)
        <CubicSpline on Sphere(2): 2 points, natural>
        """
        _archive.write(file, self._state())

    def __reduce__(self) -> tuple[Any, ...]:
        return _archive.restore, (self._state(),)

    @abstractmethod
    def _state(self) -> dict[str, Any]:
        """Return the entries of files and pickles."""

    @classmethod
    @abstractmethod
    def _from_state(cls, state: _archive.Entries) -> Self:
        """Return the curve of a state."""
