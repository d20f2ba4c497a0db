"""Morphs between drawings along the spline of their affine shapes."""

from __future__ import annotations

from importlib.util import find_spec
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from .._arrays import as_array, read_only, refuse, short_repr
from .._core import ValidationError
from .._cubic import CubicSpline
from .._input import times_of
from .._spaces import Euclidean, Grassmannian, SpecialOrthogonal, SymmetricPositiveDefinite
from .._typing import AnyArray, BCWords, File, TimesLike
from ._landmarks import Array, orthonormal, place, placed, read, relative

if TYPE_CHECKING:
    from matplotlib.figure import Figure


class Bases:
    """Horizontal lift X(t) of a spline of shapes.

    Attributes
    ----------
    shape : CubicSpline
        Spline on a Grassmannian.
    start : ndarray
        X at the first knot.
    closed : bool
        Whether the spline is closed.
    """

    def __init__(self, t: TimesLike | None, points: Array, bc_type: Any) -> None:
        self.shape = CubicSpline(t, points, Grassmannian(*points.shape[:0:-1]), bc_type=bc_type)
        self.start, self.closed = points[0], bc_type == "periodic"

    def __call__(self, x: Array) -> Array:
        """Return X at times x, shape x.shape + (rows, n); at the end of a closed spline, the lifted value."""
        shape = self.shape
        first, last = shape.t[0], shape.t[-1]
        own = shape._time_axis.at(x, (), False, shape._times)[0]
        bad = ~((own >= shape._times[0]) & (own <= shape._times[-1]))
        where = f"the times of the first and last drawings, {first} and {last}"
        refuse(bad, "x", lambda i: f"is {x[i]}, but must be between {where}")
        return np.asarray(self.shape.lift(x, start=self.start))

    def turn(self) -> Array:
        """Return the orthogonal matrix h by which X of a closed spline is rotated after one period."""
        return np.asarray(self.start.T @ self(self.shape.t[-1]))

    def share(self, x: Array) -> Array:
        """Map times to the interval from 0 at the first knot to 1 at the last."""
        times, knots = self.shape._time_axis.at(x, (), False, self.shape._times)[0], self.shape._times
        return np.asarray((times - knots[0]) / (knots[-1] - knots[0]))


class AffineMorph:
    """C² film through drawings of the same landmarks, along the spline of their affine shapes.

    Parameters
    ----------
    t : array_like or None
        Times of the drawings, as for `CubicSpline`.
    landmarks : array_like, shape (n_drawings, k + 1, n)
        Drawings of k + 1 landmarks in Rⁿ, with n >= 2 and k > n. Landmarks with the same index correspond to each
        other. Between neighbouring drawings a film rotates by less than half a turn.
    base : int, optional
        See `from_landmarks`.
    frame : {"all", "first"}, default "all"
        ``"all"`` to interpolate the affine maps between the drawings, so that the film passes through every drawing;
        ``"first"`` to keep the affine map of the first drawing, so that the film shows the change of shape only.
    bc_type : str or pair of str, default "natural"
        End conditions of all splines, as for `CubicSpline`. With ``"periodic"`` the last drawing must repeat the first.

    Raises
    ------
    ValidationError
        If the landmarks of a drawing lie in a hyperplane; or, with ``frame="all"``, a drawing is mirrored relative to
        the previous ones, or the last drawing of a closed film differs from the first.
    CutLocusError, ConvergenceError
        As for `CubicSpline`.

    Notes
    -----
    The shape at time t has a basis X(t), the horizontal lift of the spline (`CubicSpline.lift`), and the drawing is
    X(t) A(t) plus a position. With ``frame="all"`` the polar factors of A are interpolated by splines on SO(n) and
    SPD(n), and the position by a spline in Rⁿ. See §4.3 of the paper.

    Examples
    --------
    >>> import numpy as np
    >>> square = np.array([[0.0, 0], [1, 0], [1, 1], [0, 1]])
    >>> kite = np.array([[0.0, 0], [1, 0], [1.5, 1.5], [0, 1]])
    >>> morph = AffineMorph([0, 1], [square, kite])
    >>> morph(1.0).round(8) + 0.0
    array([[0. , 0. ],
           [1. , 0. ],
           [1.5, 1.5],
           [0. , 1. ]])
    """

    def __init__(
        self,
        t: TimesLike | None,
        landmarks: ArrayLike,
        *,
        base: int | None = None,
        frame: Literal["all", "first"] = "all",
        bc_type: BCWords = "natural",
    ) -> None:
        if not isinstance(frame, str) or frame not in ("all", "first"):
            raise ValidationError(f"frame must be 'all' or 'first', not {short_repr(frame)}")
        words = (bc_type,) if isinstance(bc_type, str) else bc_type
        if not (isinstance(words, tuple) and all(isinstance(word, str) for word in words)):
            raise ValidationError(f"bc_type must be a string or a pair of strings, not {short_repr(bc_type)}")
        drawings = read(landmarks, "landmarks", base)
        if drawings.ndim != 3 or drawings.shape[-1] < 2:
            raise ValidationError(
                f"landmarks must be of shape (drawings, landmarks, n) with n >= 2, not {drawings.shape}"
            )
        moved = relative(drawings, base)
        self._bases = Bases(t, orthonormal(moved, "landmarks"), bc_type)
        self._drawings, self._base = drawings, base
        positions = place(drawings, base).copy()
        self._affine = (
            _Constant(self._bases.start.T @ moved[0], positions[0])
            if frame == "first"
            else _Between(self._bases, moved, positions, bc_type)
        )

    def __call__(self, x: TimesLike) -> Array:
        """Evaluate the film.

        Parameters
        ----------
        x : array_like
            Times.

        Returns
        -------
        ndarray, shape ``(*x.shape, k + 1, n)``
            Drawings.

        Raises
        ------
        ValidationError
            If a time is outside the knots.
        """
        times = as_array(times_of(x, "x")[0], "x")
        basis = self._bases(times)
        matrix, at = self._affine(times)
        return placed(basis @ matrix, at, self._base)

    @property
    def shape(self) -> CubicSpline:
        """Spline of the shapes, on a Grassmannian."""
        return self._bases.shape

    @property
    def t(self) -> AnyArray:
        """Times of the drawings."""
        return self.shape.t

    @property
    def landmarks(self) -> Array:
        """Drawings, shape (n_drawings, k + 1, n)."""
        return read_only(self._drawings)

    @property
    def holonomy(self) -> Array:
        """Linear map by which a closed film with ``frame="first"`` changes its first drawing after one period.

        The map has shape (n, n): the last drawing, measured from its centre or base, is the first one times this
        matrix. Its determinant is −1 if the film ends mirrored.

        Raises
        ------
        ValidationError
            If the film is not closed: ``bc_type`` is not ``"periodic"``.
        """
        if not self._bases.closed:
            raise ValidationError("only a closed film has a holonomy; pass bc_type='periodic'")
        # In the basis X(t₀) the first drawing has the coordinates A₀, and X comes back as X(t₀) h.
        first = self._bases.start.T @ relative(self._drawings[0], self._base)
        return np.linalg.solve(first, self._bases.turn() @ first)

    def plot(self, file: File | None = None) -> Figure:
        """Plot a film strip and small multiples of the film, in the plane or in space.

        Parameters
        ----------
        file : path or file object, optional
            File to save the figure to, such as ``"morph.pdf"``.

        Returns
        -------
        matplotlib.figure.Figure
            Figure, which you can change or save.

        Raises
        ------
        ImportError
            If matplotlib is not installed.
        ValidationError
            If the landmarks have four or more dimensions.

        Examples
        --------
        >>> square, kite = [[0, 0], [1, 0], [1, 1], [0, 1]], [[0, 0], [1, 0], [1.5, 1.5], [0, 1]]
        >>> figure = AffineMorph([0, 1], [square, kite]).plot()
        """
        if find_spec("matplotlib") is None:
            raise ImportError("plots need matplotlib; install it with: pip install 'symspline[plot]'")
        from .._plotting.film import plot_film

        figure: Figure = plot_film(self.t, self.landmarks, self, file)
        return figure


class _Constant:
    """Affine map of the first drawing, for all times."""

    def __init__(self, matrix: Array, place: Array) -> None:
        self._matrix, self._place = matrix, place

    def __call__(self, x: Array) -> tuple[Array, Array]:
        return self._matrix, self._place


class _Between:
    """Affine maps A = S R from the bases of the shapes to the drawings, interpolated.

    S scales in the basis and R rotates the drawing, so a film of a drawing that only rotates stays rigid.
    """

    def __init__(self, bases: Bases, moved: Array, positions: Array, bc_type: Any) -> None:
        t, n, closed = bases.shape.t, moved.shape[-1], bases.closed
        if closed:
            _check_closed(moved, positions)
        matrices = np.swapaxes(bases(t), -1, -2) @ moved
        why = (
            "is mirrored: along the spline of shapes, the first drawing becomes its mirror image; number its landmarks "
            "in the order of the others, mirror it (change the sign of a coordinate), add drawings in between, or pass "
            "frame='first'"
        )
        refuse(~(np.linalg.det(matrices) > 0), "landmarks", lambda _: why)
        self._bases, self._group = bases, SpecialOrthogonal(n)
        # The basis of a closed film comes back turned by h = exp(w), and A turned by its inverse; exp(τw) A is
        # periodic, τ from 0 to 1.
        self._twist = self._group.log(np.eye(n), bases.turn()) if closed else np.zeros((n, n))
        left, sizes, right = np.linalg.svd(self._twisted(t, 1) @ matrices)
        stretches, turns = left * sizes[:, None] @ np.swapaxes(left, -1, -2), left @ right
        if closed:
            for values in (stretches, turns, positions):
                values[-1] = values[0]
        self._stretches = CubicSpline(t, stretches, SymmetricPositiveDefinite(n), bc_type=bc_type)
        self._turns = CubicSpline(t, turns, self._group, bc_type=bc_type)
        self._positions = CubicSpline(t, positions, Euclidean(n), bc_type=bc_type)

    def __call__(self, x: Array) -> tuple[Array, Array]:
        return self._twisted(x, -1) @ self._stretches(x) @ self._turns(x), self._positions(x)

    def _twisted(self, x: Array, sign: int) -> Array:
        """Return exp(±τw) at times x."""
        return self._group.exp(np.eye(len(self._twist)), sign * self._bases.share(x)[..., None, None] * self._twist)


def _check_closed(moved: Array, positions: Array) -> None:
    off = max(np.abs(values[-1] - values[0]).max() for values in (moved, positions))
    if not off <= 1e-8 * max(np.abs(moved[0]).max(), np.abs(positions[0]).max()):
        raise ValidationError(
            f"the last drawing of a closed film must equal the first, but differs by {off:.3e}; repeat the first "
            "drawing at the end, or pass frame='first', which requires the same shape only"
        )
