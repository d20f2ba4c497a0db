"""Six components in the order of each program."""

import numpy as np
import pytest
from refused import raises

from symspline.tensors import from_vectors, to_vectors

SKEWED = np.eye(3) + 1e-3 * np.eye(3, k=1)
# Every entry is named by its place: the tens are the row, the ones the column.
NAMED = np.array([[11, 12, 13], [12, 22, 23], [13, 23, 33]])
ORDERS = {
    # dipy.reconst.dti.from_lower_triangular: Dxx, Dxy, Dyy, Dxz, Dyz, Dzz
    "dipy": [11, 12, 22, 13, 23, 33],
    # dtifit: Dxx, Dxy, Dxz, Dyy, Dyz, Dzz
    "fsl": [11, 12, 13, 22, 23, 33],
    # dwi2tensor: D11, D22, D33, D12, D13, D23
    "mrtrix": [11, 22, 33, 12, 13, 23],
    # itkNiftiImageIO.cxx: a b c d e f for [[a b c], [b d e], [c e f]]
    "itk": [11, 12, 13, 22, 23, 33],
}


@pytest.mark.parametrize("order", ORDERS)
def test_the_documented_order(order):
    assert to_vectors(NAMED, order=order).tolist() == ORDERS[order]
    assert np.array_equal(from_vectors(ORDERS[order], order=order), NAMED)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("order", ORDERS)
def test_there_and_back(order, dtype):
    x = np.random.default_rng(0).standard_normal((4, 5, 6)).astype(dtype)
    x[0, 0], x[1, 1, 2] = 0, np.nan
    matrices = from_vectors(x, order=order)
    assert matrices.dtype == dtype and matrices.shape == (4, 5, 3, 3)
    assert np.array_equal(matrices, matrices.swapaxes(-1, -2), equal_nan=True)
    back = to_vectors(matrices, order=order)
    assert back.dtype == dtype and np.array_equal(back, x, equal_nan=True)


def test_invalid_tensors_raise():
    for match, call in [
        ("order must be 'dipy', 'fsl', 'mrtrix', 'itk', .* not 'ants'", lambda: from_vectors(np.ones(6), order="ants")),
        ("order must be .* not None: the numbers do not show it", lambda: to_vectors(np.eye(3), order=None)),
        (r"x has shape \(2, 5\), but needs shape \(..., 6\)", lambda: from_vectors(np.ones((2, 5)), order="fsl")),
        ("x must be an array of real numbers, not of complex", lambda: from_vectors(np.ones(6) * 1j, order="fsl")),
        (r"matrices has shape \(3,\)", lambda: to_vectors(np.ones(3), order="fsl")),
        (r"matrices\[1\] is not symmetric: .* is 1.000e-03", lambda: to_vectors([np.eye(3), SKEWED], order="fsl")),
    ]:
        raises(match, call)


def test_precision():
    for given, kept in (("f2", "f4"), ("f4", "f4"), ("f8", "f8"), ("i4", "f8"), ("?", "f8")):
        matrices = from_vectors(np.ones(6, given), order="fsl")
        assert matrices.dtype == kept and to_vectors(matrices, order="fsl").dtype == kept


def test_what_rounding_does_to_symmetry_is_allowed():
    matrix = np.array([[2, 0.3, 0], [0.3 * (1 + 1e-14), 1, 0], [0, 0, 1]])
    assert to_vectors(matrix, order="mrtrix")[3] == pytest.approx(0.3, rel=1e-13)
