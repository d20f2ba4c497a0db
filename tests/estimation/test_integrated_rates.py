"""The bias of rates from turns between attitudes: its prior, and turns at a bias that is not that of the integral."""

import numpy as np
import pytest

from symspline._estimation.rates import Attitudes, Integral, Rates, _Problem


def attitudes_of(rates, bias, times):
    """Exact attitudes of a body whose rates have a bias."""
    return Attitudes(times, Integral(rates, np.asarray(bias)).at(times)[0], np.full(len(times), 0.1))


@pytest.mark.parametrize("apart", [1, 3])
def test_turns_at_a_shifted_bias(apart):
    s = np.linspace(0, 10, 2001)
    omega = np.stack([0.2 + 0.3 * np.sin(s), 0.4 + 0.3 * np.cos(1.3 * s), 3.0 + 0 * s], axis=-1)
    rates = Rates(s, omega, 1e-3, np.zeros(3), np.ones(3))
    attitudes = attitudes_of(rates, [0.02, -0.03, 0.01], np.linspace(0.5, 9.5, 13))
    shifted, where = np.array([0.006, -0.004, 0.005]), np.zeros(13, int)
    pairs = _Problem(rates).pairs(attitudes, where, shifted, apart, 0.0)
    fresh = _Problem(rates._replace(bias=shifted)).pairs(attitudes, where, shifted, apart, 0.0)
    # The change is of first order, and its error about the square of 0.006 rad/s times 2 s.
    np.testing.assert_allclose(pairs.rest, fresh.rest, atol=2e-4)
    assert np.abs(_Problem(rates).pairs(attitudes, where, np.zeros(3), apart, 0.0).rest - fresh.rest).max() > 2e-3


@pytest.mark.parametrize(("spread", "turns"), [(1.0, 0), (100.0, 1)])
def test_the_prior_decides_between_biases_that_differ_by_whole_turns(spread, turns):
    """With one more turn per second, the bias fits exactly; without it, nearly, and it is close to its prior mean."""
    s, whole = np.linspace(0, 10, 2001), 2 * np.pi
    rates = Rates(s, np.tile([0.0, 0.0, 8.0 + whole], (len(s), 1)), 1e-3, np.zeros(3), np.full(3, spread))
    times = np.linspace(0.5, 9.5, 10) + 0.03 * np.sin(np.arange(10.0) ** 2)
    problem = _Problem(rates)
    problem.precision = rates.spread**-2.0
    found = problem.consensus(attitudes_of(rates, [0.0, 0.0, 0.05 + whole], times))
    np.testing.assert_allclose(found, [0, 0, 0.05 + turns * whole], atol=0.1)
