"""`evaluate` at few times of many nodes reads the nodes around them only."""

import numpy as np
import pytest
from curves import parts, points_on

import symspline as ss

NODES = 300


def nodes(name, seed=0):
    space, rng = ss.space(name), np.random.default_rng(seed)
    t = np.cumsum(rng.uniform(0.3, 1.0, NODES))
    points = points_on(space, NODES, step=0.2, seed=seed)
    return t, points, ss.fit(t, points, space)[0], space


@pytest.mark.parametrize("name", ["sphere:2", "so:3", "rp:2", "gr:2,5", "u:2", "sphere:2 x r:3"])
@pytest.mark.parametrize("nu", [0, 1, 2])
def test_values_are_bit_identical_to_those_of_all_nodes(name, nu):
    t, points, velocities, space = nodes(name)
    rng = np.random.default_rng(1)
    times = [
        t[0],
        t[-1],
        t[7],
        float(t[-2]),
        rng.uniform(t[0], t[-1], 3),
        t[[5, 90]],
        np.sort(rng.choice(t, 4)),
    ]
    for x in times:
        few = ss.evaluate(t, points, velocities, space, x, nu=nu)
        # Knots in a list are read as a whole.
        every = ss.evaluate(t.tolist(), points, velocities, space, x, nu=nu)
        for own, expected in zip(parts(few), parts(every), strict=True):
            np.testing.assert_array_equal(own, expected)


def test_a_batch_is_cut_along_its_knots():
    t, points, velocities, space = nodes("sphere:2")
    two = [np.stack([own, own[::-1]]) for own in (points, velocities)]
    values = ss.evaluate(t, *two, space, t[40] + 0.1)
    np.testing.assert_array_equal(values[0], ss.evaluate(t, points, velocities, space, t[40] + 0.1))


def test_invalid_knots_raise_wherever_they_are():
    t, points, velocities, space = nodes("sphere:2")
    for wrong in (t[199], np.nan):
        bad = t.copy()
        bad[200] = wrong
        with pytest.raises(ss.ValidationError, match=r"t\[200\]"):
            ss.evaluate(bad, points, velocities, space, float(t[3]))


def test_messages_name_the_whole_domain_and_what_is_read():
    t, points, velocities, space = nodes("sphere:2")
    with pytest.raises(ss.ValidationError, match=rf"outside the knots \[{t[0]}"):
        ss.evaluate(t, points, velocities, space, [t[3], t[-1] + 1])
    bad = points * np.where(np.arange(NODES) == 50, 2, 1)[:, None]
    with pytest.raises(ss.ValidationError, match="off the space"):
        ss.evaluate(t, bad, velocities, space, float(t[50]))
