"""A recording as TUM file goes in, a curve comes out as TUM file: its error by evo, which robotics measures with."""

import gzip
from pathlib import Path

import numpy as np
import pytest
from evo.core.metrics import APE, PoseRelation
from evo.core.sync import associate_trajectories
from evo.tools import file_interface

import symspline as ss
from symspline import poses

RECORDING = Path(__file__).parents[2] / "docs/comparisons/data/freiburg1_xyz-groundtruth.txt.gz"


@pytest.fixture
def recording(tmp_path):
    """3000 poses at 100 Hz, of a camera that somebody holds."""
    path = tmp_path / "recorded.tum"
    path.write_bytes(gzip.decompress(RECORDING.read_bytes()))
    return path


def absolute_error(first, second, relation):
    tracks = (file_interface.read_tum_trajectory_file(str(path)) for path in (first, second))
    metric = APE(relation)
    metric.process_data(associate_trajectories(*tracks, max_diff=1e-6))
    return metric.get_all_statistics()


@pytest.mark.parametrize("space", ["se:3", "so:3 x r:3"])
def test_points_round_trip(space, recording, tmp_path):
    t, given = poses.read_tum(recording)
    curve = ss.CubicSpline(t, given if space == "se:3" else poses.split(given), space)
    out = tmp_path / "curve.tum"
    poses.write_tum(out, t, curve(t))
    assert absolute_error(recording, out, PoseRelation.translation_part)["max"] < 1e-12
    assert absolute_error(recording, out, PoseRelation.rotation_angle_deg)["max"] < 1e-12


@pytest.mark.parametrize("space", ["se:3", "so:3 x r:3"])
def test_poses_that_were_left_out(space, recording, tmp_path):
    """A curve through every fourth pose is at the others as good as the recording, which trembles."""
    t, given = poses.read_tum(recording)
    some = given[::4] if space == "se:3" else tuple(x[::4] for x in poses.split(given))
    others = np.setdiff1d(t[t < t[::4][-1]], t[::4])
    out = tmp_path / "curve.tum"
    poses.write_tum(out, others, ss.CubicSpline(t[::4], some, space)(others))
    assert absolute_error(recording, out, PoseRelation.translation_part)["rmse"] < 3e-4
    assert absolute_error(recording, out, PoseRelation.rotation_angle_deg)["rmse"] < 0.15
