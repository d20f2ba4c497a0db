"""Evaluation, lengths, batches and files of all curves."""

from __future__ import annotations

import re
from abc import abstractmethod
from collections.abc import Callable, Iterator
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import ArrayLike

from .._base.arrays import as_array, cast, checked_flag, refuse, short_repr
from .._base.time import TimeAxis
from .._base.typing import File, Number, P, Time, TimesLike
from .._core import ValidationError
from .._curves.composed import AnyCurve
from .._curves.length import ArcLength, bending_energy, length
from .._search.searchable import Searchable
from .._spaces import Doubles
from . import archive

# Relative rounding error of an arc length that a user computed.
_ROUNDING = 1e-12


class CurveBase(Searchable[P]):
    """The part of `Curve` that does not make new curves, except those of a batch."""

    # Name of the format in files and pickles.
    _format: ClassVar[str]
    _curve: AnyCurve
    _time_axis: TimeAxis

    def __init_subclass__(cls) -> None:
        if "_format" in vars(cls):
            archive.FORMATS[cls._format] = cls

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
    def domain(self) -> tuple[Time, Time]:
        """First and last time. They are arrays with the batch axes if every curve has its own times."""

    def length(self, a: TimesLike | None = None, b: TimesLike | None = None) -> Number:
        r"""Compute the length of the curve, or of the part between two times.

        Parameters
        ----------
        a, b : array_like of float or datetime64, optional
            Start and end of the part; b must not be before a. Both must be in the domain of the curve. Arrays are
            broadcast. By default, the first and the last time of the domain.

        Returns
        -------
        ndarray or float, shape ``(*batch axes, *shape of the times)``
            The integral of the speed, :math:`\int_a^b \lVert\gamma'\rVert \, dt`.

        Raises
        ------
        ValidationError
            If a time is not in the domain of the curve, or b is before a.

        See Also
        --------
        Curve.arc_length : Compute the length from the start of the domain to many times.

        Examples
        --------
        >>> import symspline as ss
        >>> quarter = ss.CubicSpline(None, [[1, 0, 0], [0, 1, 0]], ss.Sphere(2))
        >>> round(float(quarter.length()), 8)
        1.57079633
        >>> quarter.length([0, 0.25], [0.5, 1]).round(8)
        array([0.78539816, 1.17809725])
        """
        curve = self._curve
        if a is None and b is None:
            return length(curve)
        ends = [
            self._domain_ends[number] if x is None else self._core_times(x, name)
            for number, (x, name) in enumerate([(a, "a"), (b, "b")])
        ]
        shapes = [x.shape[len(self._batch) * own :] for x, own in ends]
        start, stop = (self._with_batch(x, own, max(map(len, shapes))) for x, own in ends)
        try:
            start, stop = np.broadcast_arrays(start, stop)
        except ValueError:
            raise ValidationError(f"a and b have shapes {shapes[0]} and {shapes[1]}, which do not broadcast") from None
        refuse(stop < start, "b", lambda _: "is before a. Exchange a and b.")
        return self._by_columns(ArcLength.between, start, stop)

    def arc_length(self, x: TimesLike, *, per_curve: bool = False) -> Number:
        """Compute the length of the curve from the start of its domain to given times.

        Parameters
        ----------
        x : array_like of float or datetime64
            Times in the domain of the curve, of any shape and in any order.
        per_curve : bool, default False
            True if every curve of a batch has its own times. The leading axes of x are then the batch axes.

        Returns
        -------
        ndarray or float, shape ``(*batch axes, *x.shape)``
            Arc lengths. With `per_curve`, the batch axes appear only once.

        Raises
        ------
        ValidationError
            If a time is not in the domain of the curve.

        See Also
        --------
        Curve.at_length : Compute the times at which the curve has given arc lengths.

        Examples
        --------
        >>> import symspline as ss
        >>> curve = ss.HermiteSpline([0, 1], [[0.0], [1.0]], [[0.0], [2.0]], "r:1")  # x = t²
        >>> curve.arc_length([0.0, 0.5, 1.0]).round(12)
        array([0.  , 0.25, 1.  ])
        """
        times, own = self._core_times(x, "x", checked_flag(per_curve, "per_curve"))
        return self._by_columns(ArcLength.at, self._with_batch(times, own, times.ndim - len(self._batch) * own))

    def at_length(self, s: ArrayLike, *, per_curve: bool = False) -> Time:
        """Compute the times at which the curve has given arc lengths.

        Use it to sample a curve at constant speed, that is at equal distances along the curve.

        Parameters
        ----------
        s : array_like
            Arc lengths from the start of the domain, between 0 and the length of the curve, of any shape.
        per_curve : bool, default False
            True if every curve of a batch has its own arc lengths. The leading axes of s are then the batch axes.

        Returns
        -------
        ndarray or float, shape ``(*batch axes, *s.shape)``
            Times, the inverse of `arc_length`. If the curve rests, this is the first time with this arc length. Dates
            are in nanoseconds. Curves that failed have NaN or NaT.

        Raises
        ------
        ValidationError
            If an arc length is negative or exceeds the length of the curve.

        See Also
        --------
        Curve.arc_length : Compute the length of the curve from its start to given times.

        Examples
        --------
        Five points at equal distances along a curve:

        >>> import numpy as np
        >>> import symspline as ss
        >>> curve = ss.HermiteSpline([0, 1], [[0.0], [1.0]], [[0.0], [2.0]], "r:1")  # x = t²
        >>> t = curve.at_length(np.linspace(0, curve.length(), 5))
        >>> curve(t)[:, 0].round(12)
        array([0.  , 0.25, 0.5 , 0.75, 1.  ])
        """
        array = as_array(s, "s")
        if array.dtype.kind not in "biuf":
            raise ValidationError(f"s must be real numbers, not {array.dtype}")
        batch, own = self._batch, checked_flag(per_curve, "per_curve")
        if own and array.shape[: len(batch)] != batch:
            raise ValidationError(
                f"with per_curve=True the shape of s must begin with the batch axes {batch}; got {array.shape}"
            )
        wanted = self._with_batch(cast(array), own, array.ndim - len(batch) * own)
        if 0 in batch:
            return self._shown_times(wanted)
        total = self._arc.lengths[:, -1].reshape(batch + (1,) * (wanted.ndim - len(batch)))
        # An arc length that exceeds the length by rounding is the length, such as the last of np.linspace.
        reach = _ROUNDING * total
        wrong = ~((wanted >= -reach) & (wanted <= total + reach)) & ~np.isnan(total)
        refuse(
            wrong | np.isnan(wanted),
            "s",
            lambda i: (
                f"= {wanted[i]} is not an arc length of the curve: it must be between 0 and "
                f"{np.broadcast_to(total, wanted.shape)[i]}"
            ),
        )
        times = np.asarray(self._by_columns(ArcLength.times_at, np.clip(wanted, 0.0, total)))
        found: Time = self._shown_times(times)[()]
        return found

    @abstractmethod
    def _core_times(self, x: TimesLike, name: str, per_curve: bool = False) -> tuple[Doubles, bool]:
        """Return times as numbers of the core, and whether each curve then has its own times.

        Raises
        ------
        ValidationError
            If a time is not in the domain of the curve.
        """

    @property
    def _domain_ends(self) -> list[tuple[Doubles, bool]]:
        """First and last time as numbers of the core, and whether each curve has its own."""
        times = self._curve.times
        return [(np.asarray(times[..., i]), times.ndim > 1) for i in (0, -1)]

    def _with_batch(self, x: Doubles, own: bool, inner: int) -> Doubles:
        """Return an array of one value per curve and sample, shape (*batch, ...) with `inner` axes of samples."""
        batch = self._batch
        lead, shape = (batch, x.shape[len(batch) :]) if own else ((1,) * len(batch), x.shape)
        ones = (1,) * (inner - len(shape))
        return np.broadcast_to(x.reshape(lead + ones + shape), batch + ones + shape)

    def _by_columns(self, call: Callable[..., Doubles], *arrays: Doubles) -> Number:
        """Call a method of the arc length, which takes shape (*batch, m), for any number of axes of samples."""
        shape = arrays[0].shape
        if 0 in shape:
            return np.zeros(shape)
        values: Number = call(self._arc, *arrays)[()]
        return values

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

    @property
    def _span_text(self) -> str:
        """The domain in the representation of the curve."""
        first, last = self.domain
        if np.ndim(first):
            return "each with its own times"
        return f"from {_time_text(first)} to {_time_text(last)}"

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
        <CubicSpline on Sphere(2): 2 points, from 0 to 1, natural>
        """
        archive.write(file, self._state())

    def __reduce__(self) -> tuple[Any, ...]:
        return archive.restore, (self._state(),)

    @abstractmethod
    def _state(self) -> dict[str, Any]:
        """Return the entries of files and pickles."""

    @classmethod
    @abstractmethod
    def _from_state(cls, state: archive.Entries) -> Self:
        """Return the curve of a state."""


def _time_text(x: Any) -> str:
    """Return a time in a few characters; dates without the zeros at their end."""
    if isinstance(x, np.datetime64):
        return re.sub(r"(:00)?\.?0*$", "", str(x)) if "." in str(x) else str(x)
    return f"{float(x):.6g}" if abs(float(x)) < 1e6 else f"{float(x):.13g}"
