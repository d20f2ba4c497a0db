"""Splines of the paper's own package, bsplinelab, stored by ``authors_splines.py``: ours are the same curves."""

from pathlib import Path

import numpy as np
import pytest

import symspline as ss

FILE = Path(__file__).parent / "authors_splines.npz"
with np.load(FILE) as stored:
    ARRAYS = dict(stored)
COUNT = len([key for key in ARRAYS if key.endswith("_name")])
# The package iterates to rounding (a tolerance of 0 and 500 sweeps), we to a residual of 1e-14. Found: 2.2e-15.
ALLOWED = 5e-15


def stored_curve(i):
    arrays = {key.partition("_")[2]: value for key, value in ARRAYS.items() if key.startswith(f"{i}_")}
    return str(arrays["name"]), ss.space(str(arrays["space"])), arrays


def apart(space, x, y):
    """The largest difference of arrays, or of the projections onto subspaces."""
    if isinstance(space, ss.Grassmannian):
        x, y = (z @ np.swapaxes(z, -1, -2) for z in (x, y))
    return np.abs(x - y).max()


def ours(space, arrays, **options):
    ends = arrays["ends"]
    bc = "natural" if not len(ends) else tuple((1, v) for v in ends)
    return ss.CubicSpline(None, arrays["points"], space, bc_type=bc, **options)


@pytest.mark.parametrize("method", ["auto", "fixed-point"])
@pytest.mark.parametrize("i", range(COUNT), ids=lambda i: f"{stored_curve(i)[1]} {stored_curve(i)[0]}")
def test_the_authors_package_makes_the_same_curve(i, method):
    _, space, arrays = stored_curve(i)
    spline = ours(space, arrays, method=method, tol=1e-14)
    assert apart(space, spline(arrays["times"]), arrays["values"]) <= ALLOWED
    # A curve that has not converged is farther off, so that the comparison would notice.
    coarse = ours(space, arrays, method="fixed-point", max_iter=12, tol=1e-14, on_failure="ignore")
    assert apart(space, coarse(arrays["times"]), arrays["values"]) > 20 * ALLOWED


def test_all_three_geometries_are_stored():
    assert COUNT == 11
    assert {type(stored_curve(i)[1]) for i in range(COUNT)} == {ss.Euclidean, ss.Sphere, ss.Grassmannian}
