"""Affine shapes: labelled landmarks up to affine maps, and morphs between drawings (§4.3 of the paper).

k + 1 landmarks in Rⁿ form a matrix with one row per landmark. Its centred columns span a subspace of Rᵏ⁺¹ that is
invariant under affine maps of Rⁿ: a point of ``Grassmannian(n, k + 1)``. If the landmarks are measured from one of
them, as in the paper, the result is a point of ``Grassmannian(n, k)``, which gives preference to that landmark.

Examples
--------
>>> import numpy as np, symspline as ss
>>> square = np.array([[0, 0], [1, 0], [1, 1], [0, 1]])
>>> sheared = square @ [[1, 0.5], [0, 1]] + 3
>>> space = ss.Grassmannian(2, 4)
>>> space.distance(*map(ss.shapes.from_landmarks, (square, sheared))).round(8)
np.float64(0.0)
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._base.arrays import as_array, read_only, refuse, short_repr
from ._base.input import times_of
from ._base.typing import AnyArray, BCWords, File, TimesLike
from ._base.validation import check_orthonormal, numbers, one_of
from ._core import ValidationError
from ._curves.options import require_matplotlib
from ._spaces import Euclidean, Grassmannian, SpecialOrthogonal, SymmetricPositiveDefinite
from ._splines.cubic import CubicSpline

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["AffineMorph", "from_landmarks", "to_landmarks"]


def __dir__() -> list[str]:
    return __all__


Array = NDArray[np.float64]

# If landmarks are closer to a hyperplane than this, in units of their largest extent, their shape is a rounding error.
_FLAT = 1e-10


# ---- landmarks ----


def from_landmarks(x: ArrayLike, *, base: int | None = None) -> Array:
    """Convert labelled landmarks to affine shapes.

    Parameters
    ----------
    x : array_like, shape (..., k + 1, n)
        Drawings of k + 1 landmarks in Rⁿ, with k > n.
    base : int, optional
        Landmark from which the others are measured, as in the paper. None means their centre, so that no landmark is
        preferred. The resulting curves differ slightly.

    Returns
    -------
    ndarray, shape (..., k + 1, n) or (..., k, n)
        Matrices with orthonormal columns: points of ``Grassmannian(n, k + 1)``, or with a base, whose row is dropped,
        of ``Grassmannian(n, k)``.

    Raises
    ------
    ValidationError
        If the landmarks of a drawing lie in a hyperplane, or are too few to have different shapes.

    Examples
    --------
    >>> from_landmarks([[0, 0], [1, 0], [1, 1], [0, 1]], base=0).round(8) + 0.0
    array([[ 0.78867513, -0.21132487],
           [ 0.57735027,  0.57735027],
           [-0.21132487,  0.78867513]])
    """
    drawing = _read(x, "x", base)
    return _orthonormal(_relative(drawing, base), "x")


def to_landmarks(shape: ArrayLike, like: ArrayLike, *, base: int | None = None) -> Array:
    """Convert affine shapes to drawings, choosing the affine image closest to a given drawing.

    Parameters
    ----------
    shape : array_like, shape (..., k + 1, n) or (..., k, n)
        Points of the Grassmannian in any basis, as returned by `from_landmarks`.
    like : array_like, shape (..., k + 1, n)
        Drawings, whose centre, or landmark `base`, is kept.
    base : int, optional
        See `from_landmarks`.

    Returns
    -------
    ndarray, shape (..., k + 1, n)
        Drawings.

    Raises
    ------
    ValidationError
        If the columns of a shape are not orthonormal, or the shapes do not fit the drawings.

    Examples
    --------
    >>> square = [[0, 0], [1, 0], [1, 1], [0, 1]]
    >>> to_landmarks(from_landmarks(square), square).round(8) + 0.0
    array([[0., 0.],
           [1., 0.],
           [1., 1.],
           [0., 1.]])
    """
    drawing = _read(like, "like", base)
    basis, tol = numbers(shape, "shape", 2)
    rows = drawing.shape[-2] - (base is not None)
    if basis.dtype.kind == "c" or basis.shape[-2:] != (rows, drawing.shape[-1]):
        raise ValidationError(
            f"shape must be real, of shape (..., {rows}, {drawing.shape[-1]}) for these drawings, not {basis.shape}"
        )
    check_orthonormal(basis, tol, "shape", "use from_landmarks")
    return _placed(basis @ (np.swapaxes(basis, -1, -2) @ _relative(drawing, base)), _place(drawing, base), base)


def _read(x: ArrayLike, name: str, base: Any) -> Array:
    """Validate drawings and the base landmark."""
    drawing, _ = numbers(x, name, 2)
    if drawing.dtype.kind == "c":
        raise ValidationError(f"{name} must be real landmarks, not complex; pass real and imaginary parts as columns")
    count, n = drawing.shape[-2:]
    if count < n + 2 or n < 1:
        raise ValidationError(
            f"{name} has shape {drawing.shape}: {count} landmarks in {n} dimensions; affine shapes in "
            f"{n} dimensions need at least {n + 2} landmarks"
        )
    whole = isinstance(base, (int, np.integer)) and not isinstance(base, bool)
    if base is not None and not (whole and 0 <= base < count):
        raise ValidationError(
            f"base must be None or the number of a landmark, 0 to {count - 1}, not {short_repr(base)}"
        )
    return drawing


def _relative(drawing: Array, base: int | None) -> Array:
    """Return landmarks measured from their centre, or from one of them, which is dropped."""
    moved = drawing - _place(drawing, base)[..., None, :]
    return moved if base is None else np.delete(moved, base, axis=-2)


def _place(drawing: Array, base: int | None) -> Array:
    """Return the centre of drawings, or the landmark ``base``, shape (..., n)."""
    return np.asarray(drawing.mean(axis=-2) if base is None else drawing[..., base, :])


def _placed(moved: Array, place: Array, base: int | None) -> Array:
    """Compute the inverse of `_relative`."""
    whole = moved if base is None else np.insert(moved, base, 0.0, axis=-2)
    return whole + place[..., None, :]


def _orthonormal(moved: Array, name: str) -> Array:
    """Return the nearest matrices with orthonormal columns, the polar factors."""
    left, sizes, right = np.linalg.svd(moved, full_matrices=False)
    refuse(
        ~(sizes[..., -1] > _FLAT * sizes[..., 0]),
        name,
        lambda i: (
            f"lies in a hyperplane: its extents are {', '.join(f'{size:.3g}' for size in sizes[i])}; landmarks "
            f"must span all {moved.shape[-1]} dimensions to have an affine shape"
        ),
    )
    return np.asarray(left @ right)


# ---- films ----


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
        one_of(frame, "frame", "all", "first")
        words = (bc_type,) if isinstance(bc_type, str) else bc_type
        if not (isinstance(words, tuple) and all(isinstance(word, str) for word in words)):
            raise ValidationError(f"bc_type must be a string or a pair of strings, not {short_repr(bc_type)}")
        drawings = _read(landmarks, "landmarks", base)
        if drawings.ndim != 3 or drawings.shape[-1] < 2:
            raise ValidationError(
                f"landmarks must be of shape (drawings, landmarks, n) with n >= 2, not {drawings.shape}"
            )
        moved, positions = _relative(drawings, base), _place(drawings, base).copy()
        bases = _orthonormal(moved, "landmarks")
        self._shape = CubicSpline(t, bases, Grassmannian(*bases.shape[:0:-1]), bc_type=bc_type)
        self._drawings, self._base = drawings, base
        self._start, self._closed = bases[0], bc_type == "periodic"
        self._first = bases[0].T @ moved[0], positions[0]
        self._fit = self._interpolate(moved, positions, bc_type) if frame == "all" else None

    def _interpolate(self, moved: Array, positions: Array, bc_type: Any) -> tuple[CubicSpline, ...]:
        """Interpolate the affine maps A = S R from the bases of the shapes to the drawings, and the positions.

        S scales in the basis and R rotates the drawing, so a film of a drawing that only rotates stays rigid.
        """
        t, n = self.t, moved.shape[-1]
        if self._closed:
            off = max(np.abs(values[-1] - values[0]).max() for values in (moved, positions))
            if not off <= 1e-8 * max(np.abs(moved[0]).max(), np.abs(positions[0]).max()):
                raise ValidationError(
                    f"the last drawing of a closed film must equal the first, but differs by {off:.3e}; repeat the "
                    "first drawing at the end, or pass frame='first', which requires the same shape only"
                )
        matrices = np.swapaxes(self._basis(t), -1, -2) @ moved
        why = (
            "is mirrored: along the spline of shapes, the first drawing becomes its mirror image; number its landmarks "
            "in the order of the others, mirror it (change the sign of a coordinate), add drawings in between, or pass "
            "frame='first'"
        )
        refuse(~(np.linalg.det(matrices) > 0), "landmarks", lambda _: why)
        # The basis of a closed film comes back turned by h = exp(w), and A turned by its inverse; exp(τw) A is
        # periodic, τ from 0 to 1.
        group = SpecialOrthogonal(n)
        self._twist = group.log(np.eye(n), self._turn()) if self._closed else np.zeros((n, n))
        left, sizes, right = np.linalg.svd(self._twisted(t, 1) @ matrices)
        stretches, turns = left * sizes[:, None] @ np.swapaxes(left, -1, -2), left @ right
        if self._closed:
            for values in (stretches, turns, positions):
                values[-1] = values[0]
        each = ((stretches, SymmetricPositiveDefinite(n)), (turns, group), (positions, Euclidean(n)))
        return tuple(CubicSpline(t, points, space, bc_type=bc_type) for points, space in each)

    def _twisted(self, x: Array, sign: int) -> Array:
        """Return exp(±τw) at times x."""
        times, knots = self._shape._time_axis.at(x, (), False, self._shape._times)[0], self._shape._times
        share = (times - knots[0]) / (knots[-1] - knots[0])
        n = len(self._twist)
        return SpecialOrthogonal(n).exp(np.eye(n), sign * share[..., None, None] * self._twist)

    def _basis(self, x: Array) -> Array:
        """Return the horizontal lift X at times x, shape x.shape + (rows, n)."""
        shape = self._shape
        first, last = shape.t[0], shape.t[-1]
        own = shape._time_axis.at(x, (), False, shape._times)[0]
        bad = ~((own >= shape._times[0]) & (own <= shape._times[-1]))
        where = f"the times of the first and last drawings, {first} and {last}"
        refuse(bad, "x", lambda i: f"is {x[i]}, but must be between {where}")
        return np.asarray(shape.lift(x, start=self._start))

    def _turn(self) -> Array:
        """Return the orthogonal matrix h by which X of a closed spline is rotated after one period."""
        return np.asarray(self._start.T @ self._basis(self.t[-1]))

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
        basis = self._basis(times)
        matrix, position = self._first
        if self._fit is not None:
            stretch, turn, position = (spline(times) for spline in self._fit)
            matrix = self._twisted(times, -1) @ stretch @ turn
        return _placed(basis @ matrix, position, self._base)

    @property
    def shape(self) -> CubicSpline:
        """Spline of the shapes, on a Grassmannian."""
        return self._shape

    @property
    def t(self) -> AnyArray:
        """Times of the drawings."""
        return self._shape.t

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
        if not self._closed:
            raise ValidationError("only a closed film has a holonomy; pass bc_type='periodic'")
        # In the basis X(t₀) the first drawing has the coordinates A₀, and X comes back as X(t₀) h.
        first = self._first[0]
        return np.linalg.solve(first, self._turn() @ first)

    def plot(self, file: File | None = None) -> Figure:
        """Plot a film strip and small multiples of the film, in the plane or in space.

        Up to twelve landmarks have their numbers; of more, only the first one has. Given drawings are filled in the
        strip, and have bold frames among the small multiples.

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
        require_matplotlib()
        from ._plotting.film import plot_film

        figure: Figure = plot_film(self.t, self.landmarks, self, file)
        return figure
