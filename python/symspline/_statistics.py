"""Principal components of points and curves."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Generic

import numpy as np
from numpy.typing import ArrayLike

from ._base.arrays import as_array, same_fields, whole_number
from ._base.typing import Array, FloatArray, P, PointsLike
from ._core import ValidationError
from ._spaces import AnySpace, Product, Space, parts_of, require_metric, space_named

# Variances below this fraction of the largest one are rounding errors.
_LEAST = 1e-13


@dataclass(frozen=True, eq=False)
class TangentPCA(Generic[P]):
    """Principal components of points or curves in the tangent space at their mean.

    Attributes
    ----------
    space : Space
        The space.
    mean : ndarray, shape (*axes, *point_shape)
        The mean. On a `Product`, a tuple of arrays.
    components : ndarray, shape (k, *axes, *point_shape)
        Orthonormal tangent vectors at the mean, in order of decreasing variance. On a `Product`, a tuple of arrays.
    explained_variance : ndarray, shape (k,)
        Variance of the samples along each component.
    explained_variance_ratio : ndarray, shape (k,)
        Fraction of the total variance along each component.
    scores : ndarray, shape (n, k)
        Coordinates of the samples with respect to the components.

    See Also
    --------
    tangent_pca : Compute the components.

    Examples
    --------
    >>> import numpy as np, symspline as ss
    >>> points = [[np.cos(x), np.sin(x), 0] for x in (0.1, 0.2, 0.3)]
    >>> found = ss.tangent_pca(points, "sphere:2")
    >>> found.explained_variance.round(8), found.mean.round(8)
    (array([0.01]), array([0.98006658, 0.19866933, 0.        ]))
    """

    space: Space[P]
    mean: P
    components: P
    explained_variance: FloatArray
    explained_variance_ratio: FloatArray
    scores: FloatArray

    def __eq__(self, other: object) -> bool:
        """Whether both have equal arrays."""
        return same_fields(self, other) if isinstance(other, TangentPCA) else NotImplemented

    def reconstruct(self, scores: ArrayLike) -> P:
        r"""Compute the points with given coordinates.

        Parameters
        ----------
        scores : array_like, shape (..., m)
            Coordinates with respect to the first m components, m <= k.

        Returns
        -------
        ndarray, shape (..., *axes, *point_shape)
            The points :math:`\exp_\mu(\sum_j s_j v_j)`. On a `Product`, a tuple of arrays.

        Raises
        ------
        ValidationError
            If there are more coordinates than components, or they are not finite numbers.

        Examples
        --------
        The mode of the largest variance, from -2 to 2 standard deviations:

        >>> import numpy as np, symspline as ss
        >>> points = ss.Sphere(2).random_point(np.random.default_rng(0), 5) + [5, 0, 0]
        >>> found = ss.tangent_pca(ss.Sphere(2).project(points), "sphere:2")
        >>> scores = np.linspace(-2, 2, 9)[:, None] * np.sqrt(found.explained_variance[:1])
        >>> found.reconstruct(scores).shape
        (9, 3)
        """
        given = as_array(scores, "scores")
        count = len(self.explained_variance)
        if given.dtype.kind not in "biuf" or not given.ndim or given.shape[-1] > count or not np.isfinite(given).all():
            raise ValidationError(
                f"scores must be finite real numbers of shape (..., m) with m <= {count}, the number of components, "
                f"not of shape {given.shape} and type {given.dtype}."
            )
        given = given.astype(np.float64)
        vectors = [
            np.tensordot(given, component[: given.shape[-1]], 1)
            for component in parts_of(self.components, self.space, "")
        ]
        moved: P = self.space.exp(self.mean, _joined(vectors))
        return moved


def tangent_pca(points: PointsLike, space: Space[P] | str, *, n_components: int | None = None) -> TangentPCA[P]:
    r"""Compute principal components of points or curves in the tangent space at their mean.

    Parameters
    ----------
    points : array_like, shape (n, *axes, *point_shape)
        Samples, at least two. For points, there are no further axes. For curves, pass a batch of curves at common
        times, such as ``curves(np.linspace(0, 1, 50))``; the second axis is then time. On a `Product`, a tuple of
        such arrays.
    space : Space or str
        A space or its name.
    n_components : int, optional
        Number of components. By default all components whose variance exceeds rounding errors, at most n − 1.

    Returns
    -------
    TangentPCA
        The mean, the components as tangent vectors at the mean, their variances, and the coordinates of the samples.

    Raises
    ------
    ValidationError
        If `points` does not have the required shape, a point is not in the space, the space has no invariant,
        positive definite metric, or there are fewer components than `n_components`.
    CutLocusError, ConvergenceError
        If the samples are spread too far for a mean.

    See Also
    --------
    Space.mean : The mean of points.
    make_smoothing_spline : Fit a geodesic to points over time with ``lam=np.inf``.

    Notes
    -----
    Let :math:`\mu` be the Karcher mean of the samples :math:`x_i` at each index of the axes. The components are the
    eigenvectors of the covariance :math:`\frac{1}{n-1}\sum_i v_i v_i^*` of the tangent vectors :math:`v_i =
    \log_\mu(x_i)` [1]_. The squared length of a vector is the mean of its squared lengths over the axes, so that it
    approximates the mean over time and does not depend on the number of times. The computation uses the inner products
    of the samples only, so that points can have many entries.

    References
    ----------
    .. [1] P. T. Fletcher, C. Lu, S. M. Pizer, S. Joshi, Principal geodesic analysis for the study of nonlinear
       statistics of shape, IEEE Trans. Med. Imaging 23 (2004), Section III.

    Examples
    --------
    Rotations about one axis with random speeds have one component:

    >>> import numpy as np, symspline as ss
    >>> t, speeds = np.linspace(0, 1, 5), np.array([0.8, 0.9, 1.1, 1.2])
    >>> turns = ss.rotations.from_rotation_vectors(speeds[:, None, None] * t[:, None] * [0, 0, 1])
    >>> curves = ss.CubicSpline(t, turns, "so:3")
    >>> found = ss.tangent_pca(curves(np.linspace(0, 1, 50)), "so:3")
    >>> found.scores.shape, found.explained_variance_ratio.round(8)
    ((4, 1), array([1.]))
    """
    space = space_named(space)
    require_metric(space, "tangent PCA")
    given = parts_of(points, space, "points")
    factors = getattr(space, "factors", (space,))
    arrays = [part._numbers(part._doubles(x, "points")) for part, x in zip(factors, given, strict=True)]
    leads = [x.shape[: x.ndim - len(part.point_shape)] for part, x in zip(factors, arrays, strict=True)]
    if any(lead != leads[0] for lead in leads) or len(leads[0]) < 1 or leads[0][0] < 2:
        raise ValidationError(
            f"points has the leading axes {leads[0] if len(leads) == 1 else leads}, but at least two samples are "
            "needed, shape (n, *axes, *point_shape)."
        )
    count, axes = leads[0][0], leads[0][1:]
    wanted = None if n_components is None else whole_number(n_components, "n_components", 1)
    mean = space.mean(_joined([np.moveaxis(x, 0, len(axes)) for x in map(_as_given, given, arrays)]))
    at, flat, arrays, back = _well_conditioned(space, mean, arrays)
    vectors = list(parts_of(flat.log(at, _joined(arrays)), flat, "points"))
    gram = _gram(flat, at, vectors, vectors)
    values, u = np.linalg.eigh(gram)
    values, u = values[::-1], u[:, ::-1]
    rounding = float(np.max(8 * np.finfo(float).eps * flat._rounding(at)))
    rank = min(count - 1, int(np.sum(values > max(_LEAST * values[0], count * rounding**2))))
    if wanted is not None and wanted > rank:
        raise ValidationError(f"n_components is {wanted}, but the samples have only {rank} components.")
    kept = rank if wanted is None else wanted
    total = float(np.trace(gram))
    mixed = [np.tensordot((u[:, :kept] / np.sqrt(values[:kept])).T, part, 1) for part in vectors]
    # Eigenvectors of small variance are orthonormal after a second step only (Cholesky QR, twice).
    factor = np.linalg.cholesky(_gram(flat, at, mixed, mixed))
    components = [
        np.linalg.solve(factor, part.reshape(kept, math.prod(part.shape[1:]))).reshape(part.shape) for part in mixed
    ]
    scores = _gram(flat, at, vectors, components)
    variance = np.sum(scores**2, axis=0) / (count - 1)
    ratio = variance * (count - 1) / total if total > 0 else variance
    moved = [part(x) for part, x in zip(back, components, strict=True)]
    return TangentPCA(space, mean, _joined(moved), variance, ratio, scores)


def _well_conditioned(space: AnySpace, mean: object, arrays: list[Any]) -> tuple[Any, AnySpace, list[Any], list[Any]]:
    """Move points by isometries so that rounding errors do not depend on the units of positive definite matrices.

    Returns the moved mean, the space of the moved points, these points by factor, and the maps of tangent vectors back.
    """
    means, spaces, moved, back = [], [], [], []
    for factor, at, x in zip(getattr(space, "factors", (space,)), parts_of(mean, space, "mean"), arrays, strict=True):
        whitening = factor._whitening_at(at)
        spaces.append(factor if whitening is None else whitening.space)
        means.append(at if whitening is None else whitening.forward(at))
        moved.append(x if whitening is None else whitening.forward(x))
        back.append(np.asarray if whitening is None else whitening.back)
    whole = spaces[0] if len(spaces) == 1 else Product(*spaces)
    return _joined(means), whole, moved, back


def _as_given(given: object, array: Array) -> Array:
    """Return numbers of the precision in which they were given, on which the tolerance of points depends."""
    dtype = getattr(given, "dtype", None)
    return array.astype(dtype) if isinstance(dtype, np.dtype) and dtype.kind in "fc" else array


def _joined(parts: list[Any]) -> Any:
    """Return a tuple of factors, or the only one."""
    return parts[0] if len(parts) == 1 else tuple(parts)


def _gram(space: AnySpace, mean: Any, u: list[Any], v: list[Any]) -> FloatArray:
    """Return the inner products of samples of tangent vectors, the means over all axes."""
    if not len(u[0]) or not len(v[0]):
        return np.zeros((len(u[0]), len(v[0])))
    rows = [space.inner(mean, _joined([x[i] for x in u]), _joined(v)) for i in range(len(u[0]))]
    table = np.asarray(rows).reshape(len(u[0]), len(v[0]), -1)
    return np.asarray(table.mean(axis=-1))
