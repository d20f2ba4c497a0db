"""Bézier and B-spline curves, which approximate their control points without interpolating them."""

from __future__ import annotations

from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike

from .._base.arrays import whole_number
from .._base.typing import P
from .._core import ValidationError
from .._curves.controlled import ControlledCurve
from .._curves.fit import Points, unwrapped
from .._curves.representatives import warn_of_far_data
from .._spaces import Product, Space, space_named
from ..manifolds._manifold import refuse_functions
from .archive import VERSION, Entries, Stored, entry, read_array, read_space
from .controlled import ControlledSpline, checked_knots, checked_points, control_array


class BSpline(ControlledSpline[P]):
    """Construct a B-spline curve from control points.

    The curve is evaluated by de Boor's algorithm with geodesics in place of straight lines. On a Euclidean space the
    result equals SciPy's ``BSpline``. Leading axes of the control points are batch axes.

    Parameters
    ----------
    knots : array_like, shape (n + degree + 1,)
        Non-decreasing knots for n control points. A knot may repeat up to ``degree + 1`` times; the curve is less
        smooth there.
    control_points : array_like, shape (..., n, *space.point_shape)
        Control points. Rounded points are projected onto the manifold; the tolerance is that of `CubicSpline`.
    degree : int
        Degree, at least 1.
    space : Space or str
        A space or its name. Products and manifolds made of functions are not supported.

    Raises
    ------
    ValidationError
        If the input does not meet the requirements above.
    CutLocusError
        If two neighbouring control points are not joined by a unique shortest geodesic.

    Warns
    -----
    FarPointsWarning
        If there are at least five control points and more than half of the steps between them exceed 0.6 of the
        distance to the cut locus.

    See Also
    --------
    BezierCurve : Construct a Bézier curve of any degree.
    CubicSpline : Interpolate points by a C² curve.

    Notes
    -----
    On a curved space the curve is C¹ at simple knots, as long as the degree is at least two. Higher derivatives may
    jump at interior knots. There, the derivatives from the right are returned, and at the end of the curve those from
    the left.

    The methods ``transport`` and ``lift`` of `CubicSpline` are absent: they follow a curve through cubic Bézier
    segments, of which a B-spline on a curved space does not consist.

    References
    ----------
    T. Popiel, L. Noakes, Bézier curves and C² interpolation in Riemannian manifolds, J. Approx. Theory 148 (2007).

    Examples
    --------
    >>> import symspline as ss
    >>> corner = ss.BSpline([0, 0, 0, 1, 1, 1], [[1, 0, 0], [0, 1, 0], [0, 0, 1]], 2, ss.Sphere(2))
    >>> corner(0.5).round(8)
    array([0.40824829, 0.81649658, 0.40824829])
    """

    _format = "symspline-bspline"
    _kind = "B-spline"
    _curve: ControlledCurve

    def __init__(self, knots: ArrayLike, control_points: ArrayLike, degree: int, space: Space[P] | str) -> None:
        space = _factor(space)
        degree = whole_number(degree, "degree", 1)
        doubles, tol = control_array(control_points, space, 2)
        knots = checked_knots(knots, space._lead(doubles)[-1], degree)
        *batch, count = space._lead(doubles)
        data = unwrapped(space, Points(doubles, tol, tuple(batch), count))
        self._fill(ControlledCurve(space, knots, checked_points(space, data.numbers, tol), degree))
        warn_of_far_data(space, [data])

    def _picked(self, index: Any) -> Self:
        control = np.ascontiguousarray(self.control_points[index])
        return self._of(ControlledCurve(self.space, self.knots, control, self.degree))

    def _state(self) -> dict[str, Any]:
        head = {"format": self._format, "version": VERSION, "space": self.space}
        return head | {"knots": self.knots, "control_points": self.control_points, "degree": self.degree}

    @classmethod
    def _from_state(cls, state: Entries) -> Self:
        space, degree = _factor(read_space(state)), state["degree"]
        control, knots = read_array(state, "control_points", space), state["knots"]
        if isinstance(state, Stored):
            with entry("control_points"):
                # They keep the values that they had after projection.
                checked_points(space, *control_array(control, space, 2))
            with entry("degree"):
                degree = whole_number(degree, "degree", 1)
            with entry("knots"):
                knots = checked_knots(knots, space._lead(space._doubles(control, "control_points"))[-1], degree)
        return cls._of(ControlledCurve(space, knots, control, degree))


class BezierCurve(BSpline[P]):
    r"""Construct a Bézier curve of any degree, for times from 0 to 1.

    The curve is evaluated by de Casteljau's algorithm with geodesics in place of straight lines. The degree is the
    number of control points minus one.

    Parameters
    ----------
    control_points : array_like, shape (..., degree + 1, *space.point_shape)
        Control points, at least two per curve. Leading axes are batch axes.
    space : Space or str
        A space or its name. Products and manifolds made of functions are not supported.

    Raises
    ------
    ValidationError
        If the input does not meet the requirements above.
    CutLocusError
        If two neighbouring control points are not joined by a unique shortest geodesic.

    See Also
    --------
    BSpline : Construct a B-spline curve from control points.

    Notes
    -----
    A segment of a `CubicSpline` is a Bézier curve of degree three, equation (8) of the paper:

    .. math:: \gamma(t) = [\,[\,[p_0, q_0]_t, [q_0, q_1]_t\,]_t, [\,[q_0, q_1]_t, [q_1, p_1]_t\,]_t\,]_t,

    where :math:`[p, q]_t` is the geodesic from p to q.

    References
    ----------
    G. Bogfjellmo, K. Modin, O. Verdier, A Numerical Algorithm for C²-Splines on Symmetric Spaces, SIAM J. Numer.
    Anal. 56 (2018), equation (8).

    Examples
    --------
    >>> import symspline as ss
    >>> curve = ss.BezierCurve([[1, 0, 0], [0, 1, 0], [0, 0, 1]], ss.Sphere(2))
    >>> curve(0.5).round(8)
    array([0.40824829, 0.81649658, 0.40824829])
    >>> curve(0, nu=1).round(8) + 0.0
    array([0.        , 3.14159265, 0.        ])
    """

    _format = "symspline-bezier"
    _kind = "Bézier curve"

    def __init__(self, control_points: ArrayLike, space: Space[P] | str) -> None:
        space = _factor(space)
        count = space._lead(control_array(control_points, space, 2)[0])[-1]
        super().__init__([0.0] * count + [1.0] * count, control_points, count - 1, space)

    @classmethod
    def _from_state(cls, state: Entries) -> Self:
        curve = super()._from_state(state)
        count = curve.degree + 1
        if curve.knots.tolist() != [0.0] * count + [1.0] * count:
            raise ValidationError("entry 'knots' must be zeros and ones, as many of either as there are points")
        return curve


def _factor(space: Space[P] | str) -> Space[P]:
    """Return the space, which must not be a product."""
    space = space_named(space)
    if isinstance(space, Product):
        raise ValidationError(
            "B-spline and Bézier curves are not defined on a Product. Make one curve for each factor."
        )
    refuse_functions(space, "B-spline and Bézier curves are not made")
    return space
