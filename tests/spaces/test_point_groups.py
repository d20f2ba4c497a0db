"""Point groups of crystals, against SciPy's groups and the conventions of orix."""

import numpy as np
import pytest
from refused import raises
from scipy.spatial.transform import Rotation

import symspline as ss

# Laue group, order, and the group of SciPy.
TABLE = {
    "1 C1 -1 Ci": "C1",
    "2 C2 2/m C2h": "C2",
    "222 D2 mmm D2h": "D2",
    "4 C4 4/m C4h": "C4",
    "422 D4 4/mmm D4h": "D4",
    "3 C3 -3 S6": "C3",
    "32 D3 -3m D3d": "D3",
    "6 C6 6/m C6h": "C6",
    "622 D6 6/mmm D6h": "D6",
    "23 T m-3 Th": "T",
    "432 O m-3m Oh": "O",
}


@pytest.mark.parametrize("symbols, oracle", TABLE.items())
def test_groups_agree_with_scipy(symbols, oracle):
    first, *others = symbols.split()
    group = ss.rotations.point_group(first)
    known = Rotation.create_group(oracle).as_matrix()
    assert len(group) == len(known) and np.array_equal(group[0], np.eye(3))
    assert np.abs(group[:, None] - known).max(axis=(-2, -1)).min(axis=1).max() < 1e-15
    assert all(np.array_equal(group, ss.rotations.point_group(other)) for other in others)


def test_the_second_axis_of_32_and_622_is_x():
    half_x, half_y = np.diag([1.0, -1.0, -1.0]), np.diag([-1.0, 1.0, -1.0])
    for symbol, of_y in (("32", False), ("622", True), ("422", True)):
        group = ss.rotations.point_group(symbol).tolist()
        assert half_x.tolist() in group and (half_y.tolist() in group) is of_y


def test_results_can_be_changed():
    group = ss.rotations.point_group("4")
    group[:] = 0
    assert ss.rotations.point_group("4").any()


@pytest.mark.parametrize("symbol", ["m3m", "5", "", None, 432, ["432"]])
def test_unknown_symbols_raise(symbol):
    raises(r"not the symbol of a point group. Pass one of .*432 or O.*m-3m", ss.rotations.point_group, symbol)
