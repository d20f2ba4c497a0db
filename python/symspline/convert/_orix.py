"""Rotations as objects of orix."""

from __future__ import annotations

from typing import TYPE_CHECKING

from numpy.typing import ArrayLike

from ._quaternions import matrix_to_quaternion

if TYPE_CHECKING:
    from orix.quaternion import Misorientation, Orientation, Symmetry


def matrix_to_orix(
    matrix: ArrayLike, symmetry: Symmetry | tuple[Symmetry, Symmetry] | None = None
) -> Orientation | Misorientation:
    """Convert rotation matrices to orientations or misorientations of orix.

    In the other direction, objects of orix are accepted wherever points of ``so:3`` are, and `symspline.Quotient`
    accepts them as groups.

    Parameters
    ----------
    matrix : array_like, shape (..., 3, 3)
        Rotations, such as the values of a curve on ``Quotient("so:3", orientations)``.
    symmetry : orix.quaternion.Symmetry or pair, optional
        The symmetry of the crystal; or for misorientations a pair, for the first and the second crystal. By default
        there is none.

    Returns
    -------
    orix.quaternion.Orientation or orix.quaternion.Misorientation
        The same rotations, in the same shape.

    Raises
    ------
    ImportError
        If orix is not installed.
    ValidationError
        If a matrix is not a rotation.

    See Also
    --------
    symspline.Quotient : Orientations up to the symmetry of a crystal.

    Notes
    -----
    Orientations of orix map vectors of the sample to vectors of the crystal, so that symmetry multiplies their
    matrices from the left.

    Examples
    --------
    >>> from orix.quaternion import symmetry  # doctest: +SKIP
    >>> matrix_to_orix([[0, -1, 0], [1, 0, 0], [0, 0, 1]], symmetry.Oh)  # doctest: +SKIP
    Orientation () m-3m
    [0.7071 0.     0.     0.7071]
    """
    quaternions = matrix_to_quaternion(matrix, scalar_first=True)
    try:
        from orix.quaternion import Misorientation, Orientation
    except ImportError:
        raise ImportError("this conversion needs orix; install it with: pip install orix") from None
    kind = Misorientation if isinstance(symmetry, tuple) else Orientation
    return kind(quaternions, symmetry=symmetry)
