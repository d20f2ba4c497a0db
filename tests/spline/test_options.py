"""Options of a fit: methods, limits, and invalid values."""

import numpy as np
import pytest
from cases import loop_over
from curves import KNOTS, S2, points_on
from refused import INF, NAN, P, fit_error, raises

import symspline as ss


def test_tol_and_max_iter_bound_the_work():
    p = points_on(S2, 6)
    fine, rough = (ss.CubicSpline(KNOTS, p, S2, tol=tol).report for tol in (1e-12, 1e-3))
    assert rough.iterations < fine.iterations
    assert fine.residual <= 1e-12 and rough.residual <= 1e-3
    few = ss.CubicSpline(KNOTS, p, S2, max_iter=2, on_failure="ignore").report
    assert few.iterations == 2 and not few.converged
    enough = ss.CubicSpline(KNOTS, p, S2, max_iter=fine.iterations).report
    assert enough.converged


@pytest.mark.parametrize(
    "options, match",
    [
        ({"method": "foo"}, r"method must be .*'auto'.*'quasi-newton'.*foo"),
        ({"tol": -1}, r"tol must be a number >= 0, not -1"),
        ({"tol": NAN}, r"tol must be a number >= 0, not NaN"),
        ({"tol": INF}, r"tol must be a number >= 0, not inf"),
        ({"max_iter": 0}, r"max_iter must be at least 1"),
        (
            {"extrapolate": "foo"},
            r"extrapolate must be None, 'raise', True, False, 'geodesic' or 'periodic', not 'foo'\. "
            r"To hold .* np\.clip\(x, \*curve\.domain\)",
        ),
        ({"on_failure": "foo"}, r"on_failure must be 'raise', 'warn' or 'ignore', not 'foo'"),
        ({"on_failure": None}, r"on_failure must be .*, not None"),
    ],
    ids=str,
)
@loop_over("how", ["class", "product", "fit", "fit_many"])
def test_invalid_options_raise(options, match, how):
    if how == "class":
        fit_error(match, **options)
    with pytest.raises(ss.ValidationError, match=match):
        if how == "product":
            ss.CubicSpline(None, (P, P), "sphere:2 x r:3", **options)
        elif how == "fit_many":
            ss.fit_many([(None, P)], S2, **options)
        else:
            ss.fit(None, P, S2, **options)


def test_messages_quote_no_large_arrays():
    # NumPy would write out all of it, as no axis is long.
    wrong = np.zeros((2,) * 20)
    raises(r"not an array of shape \(2, 2, 2, .*\)$", ss.CubicSpline, None, P, S2, on_failure=wrong)
