"""Six components in the order of each program."""

import numpy as np
import pytest

import symspline as ss
from symspline.tensors import from_vectors, to_vectors

# Every entry is named by its place: the tens are the row, the ones the column.
NAMED = np.array([[11, 12, 13], [12, 22, 23], [13, 23, 33]])
# As the programs document them.
DOCUMENTED = {
    "dipy": "Dxx, Dxy, Dyy, Dxz, Dyz, Dzz",  # dipy.reconst.dti.from_lower_triangular
    "fsl": "Dxx, Dxy, Dxz, Dyy, Dyz, Dzz",  # dtifit
    "mrtrix": "D11, D22, D33, D12, D13, D23",  # dwi2tensor
    "itk": "a b c d e f for [[a b c], [b d e], [c e f]]",  # itkNiftiImageIO.cxx
}
WORDS = dict(zip("xyz", "123", strict=True))


def documented(order):
    text = DOCUMENTED[order]
    if order == "itk":
        matrix = [["a", "b", "c"], ["b", "d", "e"], ["c", "e", "f"]]
        first = [next((i, j) for i in range(3) for j in range(3) if matrix[i][j] == letter) for letter in "abcdef"]
        return [NAMED[place] for place in first]
    digits = ["".join(WORDS.get(letter, letter) for letter in name[1:]) for name in text.split(", ")]
    return [int(name) for name in digits]


@pytest.mark.parametrize("order", DOCUMENTED)
def test_the_documented_order(order):
    assert to_vectors(NAMED, order=order).tolist() == documented(order)
    assert np.array_equal(from_vectors(documented(order), order=order), NAMED)


def test_dipy_indexes_in_the_same_way():
    """The table in dipy.reconst.dti."""
    d = np.arange(6.0)
    assert np.array_equal(from_vectors(d, order="dipy"), d[np.array([[0, 1, 3], [1, 2, 4], [3, 4, 5]])])


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("order", DOCUMENTED)
def test_there_and_back(order, dtype):
    x = np.random.default_rng(0).standard_normal((4, 5, 6)).astype(dtype)
    x[0, 0], x[1, 1, 2] = 0, np.nan
    matrices = from_vectors(x, order=order)
    assert matrices.dtype == dtype and matrices.shape == (4, 5, 3, 3)
    assert np.array_equal(matrices, matrices.swapaxes(-1, -2), equal_nan=True)
    back = to_vectors(matrices, order=order)
    assert back.dtype == dtype and np.array_equal(back, x, equal_nan=True)


def test_curves_through_many_voxels():
    rng = np.random.default_rng(0)
    voxels = ss.SymmetricPositiveDefinite(3).random_point(rng, (30, 4)).astype(np.float32)
    vectors = to_vectors(voxels, order="mrtrix")
    spline = ss.CubicSpline(None, from_vectors(vectors, order="mrtrix"), "spd:3")
    assert np.abs(to_vectors(spline(2.0), order="mrtrix") - vectors[:, 2]).max() < 1e-6 * np.abs(vectors).max()


@pytest.mark.parametrize(
    ("match", "call"),
    [
        ("order must be 'dipy', 'fsl', 'mrtrix', 'itk', .* not 'ants'", lambda: from_vectors(np.ones(6), order="ants")),
        ("order must be .* not None: the numbers do not show it", lambda: to_vectors(np.eye(3), order=None)),
        (r"x has shape \(2, 5\), but needs shape \(..., 6\)", lambda: from_vectors(np.ones((2, 5)), order="fsl")),
        ("x must be an array of real numbers, not of complex", lambda: from_vectors(np.ones(6) * 1j, order="fsl")),
        (r"matrices has shape \(3,\)", lambda: to_vectors(np.ones(3), order="fsl")),
        (r"matrices\[1\] is not symmetric: .* is 1.000e-03", lambda: to_vectors([np.eye(3), skewed()], order="fsl")),
    ],
)
def test_invalid_tensors_raise(match, call):
    with pytest.raises(ss.ValidationError, match=match):
        call()


def skewed():
    matrix = np.eye(3)
    matrix[0, 1] = 1e-3
    return matrix


def test_precision():
    for given, kept in (("f2", "f4"), ("f4", "f4"), ("f8", "f8"), ("i4", "f8"), ("?", "f8")):
        matrices = from_vectors(np.ones(6, given), order="fsl")
        assert matrices.dtype == kept and to_vectors(matrices, order="fsl").dtype == kept


def test_what_rounding_does_to_symmetry_is_allowed():
    matrix = np.array([[2, 0.3, 0], [0.3 * (1 + 1e-14), 1, 0], [0, 0, 1]])
    assert to_vectors(matrix, order="mrtrix")[3] == pytest.approx(0.3, rel=1e-13)
