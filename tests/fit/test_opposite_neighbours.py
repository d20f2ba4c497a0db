"""One pair of opposite neighbours divides a recording instead of refusing all of it."""

import numpy as np
import pytest

import symspline as ss

ANGLES = np.radians([10.0, 20, 30, 210, 220, 230])
TIMES = np.array([3.0, 4, 5.5, 6, 7, 9])


@pytest.mark.parametrize(
    ("space", "points"),
    [
        ("torus:1", ANGLES[:, None]),
        ("sphere:2", np.stack([np.cos(ANGLES), np.sin(ANGLES), 0 * ANGLES], -1)),
        ("so:3 x r:1", (ss.rotations.from_rotation_vectors(ANGLES[:, None] * [0, 0, 1]), TIMES[:, None])),
    ],
    ids=str,
)
def test_a_recording_is_divided_between_opposite_neighbours(space, points):
    with pytest.warns(ss.FarPointsWarning, match=r"`points\[2\]` and `points\[3\]`, at t = 5.5 and 6.0, lie") as caught:
        both = ss.fit_segments(TIMES, points, space, max_gap=3)
    assert len(caught) == 1 and caught[0].message.node == 2
    assert [list(one.t) for one in both] == [[3, 4, 5.5], [6, 7, 9]]
    first = tuple(x[:3] for x in points) if isinstance(points, tuple) else points[:3]
    alone = ss.CubicSpline(TIMES[:3], first, space)
    for a, b in zip(*(x if isinstance(x, tuple) else (x,) for x in (alone(4.7), both(4.7))), strict=True):
        np.testing.assert_array_equal(a, b)
    gap = both(5.7)
    assert all(np.isnan(x).all() for x in (gap if isinstance(gap, tuple) else (gap,)))
