"""Morphs between drawings along the spline of their affine shapes."""

from __future__ import annotations

from importlib.util import find_spec
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from .._core import ValidationError
from ..arrays import as_array, read_only, shown
from ..convert.reading import refuse
from ..handed import times_of
from ..spaces import Euclidean, SpecialOrthogonal, SymmetricPositiveDefinite
from ..spline import CubicSpline
from .bases import Bases
from .landmarks import Array, orthonormal, place, placed, read, relative

if TYPE_CHECKING:
    from matplotlib.figure import Figure


class AffineMorph:
    """A C² film through drawings of the same landmarks, whose affine shapes follow their spline.

    The shape at time t has a basis X(t) that does not turn within it (`CubicSpline.lift`), and the drawing is
    X(t) A(t) at a place. With ``frame="all"`` A is interpolated between the drawings: its polar parts by splines on
    SO(n) and SPD(n), the places by one in Rⁿ, and the film goes through every drawing. With ``frame="first"`` A and
    the place stay as they are in the first drawing: everything is seen in its coordinates, and the film shows nothing
    but the change of shape. Source: §4.3 of the paper.

    Args:
        t: times of the drawings, as for `CubicSpline`.
        landmarks: drawings of k + 1 landmarks in Rⁿ, shape (N+1, k + 1, n), n >= 2, k > n. Those of one number belong
            together. From one drawing to the next a film turns by less than half a turn.
        base: as for `from_landmarks`.
        frame: ``"all"`` or ``"first"``.
        bc_type: the same for all splines: a word, or a pair of words, as for `CubicSpline`. With ``"periodic"`` the
            last drawing is the first one again.

    Raises:
        ValidationError: the landmarks of a drawing lie in a hyperplane; or, with ``frame="all"``, a drawing is
            mirrored beside those before it, or the last of a closed film is not the first.
        CutLocusError, ConvergenceError: as for `CubicSpline`.

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
        t: ArrayLike | None,
        landmarks: ArrayLike,
        base: int | None = None,
        *,
        frame: str = "all",
        bc_type: Any = "natural",
    ) -> None:
        if not isinstance(frame, str) or frame not in ("all", "first"):
            raise ValidationError(f"frame must be 'all' or 'first', not {shown(frame)}")
        words = (bc_type,) if isinstance(bc_type, str) else bc_type
        if not (isinstance(words, tuple) and all(isinstance(word, str) for word in words)):
            raise ValidationError(f"bc_type must be a word or a pair of words, not {shown(bc_type)}")
        drawings = read(landmarks, "landmarks", base)
        if drawings.ndim != 3 or drawings.shape[-1] < 2:
            raise ValidationError(
                f"landmarks must be of shape (drawings, landmarks, n) with n >= 2, not {drawings.shape}"
            )
        moved = relative(drawings, base)
        self._bases = Bases(t, orthonormal(moved, "landmarks"), bc_type)
        self._drawings, self._base = drawings, base
        places = place(drawings, base).copy()
        self._affine = (
            _Constant(self._bases.start.T @ moved[0], places[0])
            if frame == "first"
            else _Between(self._bases, moved, places, bc_type)
        )

    def __call__(self, x: ArrayLike) -> Array:
        """The drawings at times x, shape x.shape + (k + 1, n).

        Raises:
            ValidationError: a time is outside the knots.
        """
        times = as_array(times_of(x, "x")[0], "x")
        basis = self._bases(times)
        matrix, at = self._affine(times)
        return placed(basis @ matrix, at, self._base)

    @property
    def shape(self) -> CubicSpline:
        """The spline of the shapes, on a Grassmannian."""
        return self._bases.shape

    @property
    def t(self) -> Any:
        """The times of the drawings."""
        return self.shape.t

    @property
    def landmarks(self) -> Array:
        """The drawings, shape (N+1, k + 1, n)."""
        return read_only(self._drawings)

    @property
    def holonomy(self) -> Array:
        """By which linear map a closed film, seen in the coordinates of the first drawing, comes back as another one.

        Shape (n, n): the last drawing of ``frame="first"``, measured from its centre or base, is the first one times
        it. Of determinant −1 if that film ends mirrored.

        Raises:
            ValidationError: the film is not closed: ``bc_type`` is not ``"periodic"``.
        """
        if not self._bases.closed:
            raise ValidationError("only a closed film has a holonomy: one with bc_type='periodic'")
        # In the basis X(t₀) the first drawing has the coordinates A₀, and X comes back as X(t₀) h.
        first = self._bases.start.T @ relative(self._drawings[0], self._base)
        return np.linalg.solve(first, self._bases.turn() @ first)

    def plot(self, file: Any = None) -> Figure:
        """A film strip and small multiples of the film, in the plane or in space.

        Args:
            file: where to save the figure, if anywhere: a name such as ``"morph.pdf"``, or an open file.

        Returns:
            The figure, to change or to save.

        Raises:
            ImportError: matplotlib is not installed.
            ValidationError: the landmarks are in four or more dimensions.
        """
        if find_spec("matplotlib") is None:
            raise ImportError("plots need matplotlib; install it with: pip install 'symspline[plot]'")
        from ..plotting.film import plot_film

        figure: Figure = plot_film(self, file)
        return figure


class _Constant:
    """The affine map of the first drawing, at all times."""

    def __init__(self, matrix: Array, place: Array) -> None:
        self._matrix, self._place = matrix, place

    def __call__(self, x: Array) -> tuple[Array, Array]:
        return self._matrix, self._place


class _Between:
    """The affine maps A = S R that bring the bases of the shapes to the drawings, interpolated.

    S stretches in the basis and R turns the drawing: a film of one drawing that only turns stays rigid.
    """

    def __init__(self, bases: Bases, moved: Array, places: Array, bc_type: Any) -> None:
        t, n, closed = bases.shape.t, moved.shape[-1], bases.closed
        if closed:
            _check_closed(moved, places)
        matrices = np.swapaxes(bases(t), -1, -2) @ moved
        refuse(
            ~(np.linalg.det(matrices) > 0),
            "landmarks",
            lambda i: (
                "is mirrored: going along the shapes from the first drawing one comes to its mirror image; number its "
                "landmarks in the order of the others, mirror it (change the sign of a coordinate), put drawings "
                "between, or take frame='first'"
            ),
        )
        self._bases, self._group = bases, SpecialOrthogonal(n)
        # The basis of a closed film comes back turned by h = exp(w), and A turned by its inverse; exp(τw) A is
        # periodic, τ from 0 to 1.
        self._twist = self._group.log(np.eye(n), bases.turn()) if closed else np.zeros((n, n))
        left, sizes, right = np.linalg.svd(self._twisted(t, 1) @ matrices)
        stretches, turns = left * sizes[:, None] @ np.swapaxes(left, -1, -2), left @ right
        if closed:
            for values in (stretches, turns, places):
                values[-1] = values[0]
        self._stretches = CubicSpline(t, stretches, SymmetricPositiveDefinite(n), bc_type=bc_type)
        self._turns = CubicSpline(t, turns, self._group, bc_type=bc_type)
        self._places = CubicSpline(t, places, Euclidean(n), bc_type=bc_type)

    def __call__(self, x: Array) -> tuple[Array, Array]:
        return self._twisted(x, -1) @ self._stretches(x) @ self._turns(x), self._places(x)

    def _twisted(self, x: Array, sign: int) -> Array:
        """exp(±τw) at times x."""
        return self._group.exp(
            np.eye(len(self._twist)), sign * self._bases.share(x)[..., None, None] * self._twist
        )


def _check_closed(moved: Array, places: Array) -> None:
    off = max(np.abs(values[-1] - values[0]).max() for values in (moved, places))
    if not off <= 1e-8 * max(np.abs(moved[0]).max(), np.abs(places[0]).max()):
        raise ValidationError(
            f"the last drawing of a closed film must be the first, and is {off:.3e} away from it: repeat the first "
            "one at the end; frame='first' asks only for the same shape"
        )
