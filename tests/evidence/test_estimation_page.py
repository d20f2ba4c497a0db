"""The tables of ``docs/estimation.md`` can be made, and the Kalman smoothers of the comparison are as accurate."""

import estimation
import estimation_others as others
import numpy as np
import pytest
from pages import cells

pytestmark = pytest.mark.filterwarnings("ignore::symspline.SmoothingWarning")


def test_tables():
    plain, fused, jerk = cells(estimation.fusion_table(2))
    assert float(fused[1]) < 0.7 * float(plain[1]) and float(jerk[2]) < 0.3 * float(plain[2])
    natural, free = cells(estimation.jerk_table(2))
    assert float(free[2]) < 0.5 * float(natural[2])
    found = dict(row[:2] for row in cells(estimation.imu_table(range(200, 201), 20.0)))
    assert found["recordings that converge"] == "1 of 1"
    for row in cells(estimation.poses_table(1))[:1]:
        assert all(0.9 < float(ratio) < 1.1 for ratio in row[3].split(","))
    assert {row[2] for row in cells(estimation.outlier_table(2))} == {"2 of 2"}


def test_drives_have_their_rates():
    t = np.linspace(0, 20, 2001)
    _, attitudes, rates = estimation.drive(t, 0.5)
    spin = np.swapaxes(attitudes, -1, -2)[1:-1] @ (attitudes[2:] - attitudes[:-2]) / (t[2:] - t[:-2])[:, None, None]
    assert np.abs(spin[:, 1, 0] - rates[1:-1, 2]).max() < 1e-4


def test_kalman_smoothers_agree_with_the_estimate():
    data = estimation.gyro(1)
    angles = []
    for run in (others.symspline, others.mekf, lambda data: others.wnoa(data, 0.2)):
        found = run(data)
        assert np.all(np.abs(found.bias - estimation.BIAS) < 4 * found.std)
        angles.append(estimation.rms(estimation.SO3.distance(found.attitudes, data.truth(data.t))))
    assert max(angles) < 1.2 * min(angles)
