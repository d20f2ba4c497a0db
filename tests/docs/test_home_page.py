"""The tasks on ``docs/index.md`` solve what they promise, and their pictures can be made."""

import operator
import re
from pathlib import Path

import home_figures
import numpy as np
import pytest

import symspline as ss


@pytest.fixture(scope="module")
def names():
    return home_figures.names_of_page()


def test_the_track_crosses_the_date_line(names):
    lon, lat = names["lon"], names["lat"]
    assert len(lon) == 18 and np.abs(lon).min() > 155 and (np.diff(lat) > 0).all()


def test_poses_in_the_hole_are_those_of_the_motion(names):
    rotation, position = names["flight"](5.5)
    expected = ss.rotations.from_rotation_vectors([0, 0, 0.7 * 5.5])
    assert ss.space("so:3").distance(rotation, expected) < 1e-3
    assert np.linalg.norm(position - [5 * np.cos(3.85), 5 * np.sin(3.85), 1.1]) < 0.5


def test_covariances_in_the_gap_are_within_their_band(names):
    smooth = names["smooth"]
    mix = np.array([[1, 1.5 * np.sin(22.5 / 8)], [0, 1]])
    assert smooth.space.distance(smooth(22.5), mix.T @ mix) < smooth.band(22.5)


def test_the_crystal_map_is_closer_to_the_truth_than_the_data(names):
    bunge = names["Rotation"].from_euler("ZXZ", names["bunge"].reshape(-1, 3), degrees=True).as_matrix()
    space, truth = names["grain"].space, bunge.reshape(50, 30, 3, 3)
    smooth, noisy = (space.distance(p, truth) for p in (names["grain"].points, names["matrices"]))
    assert np.sqrt(np.mean(smooth**2)) < 0.4 * np.sqrt(np.mean(noisy**2))


def test_the_robot_keeps_its_limits(names):
    x = np.linspace(0, names["law"].duration, 2000)
    largest = [np.abs(rates).max() for rates in names["motion"](x, nu=1)]
    assert (np.array(largest) <= 1.002 * np.array([2, 2, 3])).all() and max(largest[:2]) > 1.99


def test_the_reduced_basis_contains_waves_without_snapshots(names):
    basis, waves = names["reduced"].lift(6.5), np.cos(6.5 * names["z"] + np.linspace(0, 3, 30))
    assert np.linalg.norm(waves - basis @ (basis.T @ waves)) < 0.01 * np.linalg.norm(waves)


def test_the_bias_is_found(names):
    bias = names["attitude"].parameters["gyro bias"]
    assert (np.abs(bias.value - [0, 0, 0.1]) < 4 * bias.std).all() and (bias.std < 0.01).all()


def test_ten_thousand_curves_stay_on_the_sphere(names):
    assert names["samples"].shape == (10_000, 100, 3)
    assert np.abs(np.linalg.norm(names["samples"], axis=-1) - 1).max() < 1e-14


def test_names_on_the_way_in_exist():
    root = home_figures.PAGE.parents[1]
    for page in ("README.md", "docs/index.md", "docs/start.md", "docs/guide/which_function.md"):
        found = re.findall(r"\bss\.([a-z_]+(?:\.\w+)*)", (root / page).read_text(encoding="utf-8"))
        for name in found:
            assert operator.attrgetter(name)(ss), name


@pytest.mark.parametrize("draw", home_figures.PICTURES, ids=lambda draw: draw.__name__)
def test_pictures_can_be_made(names, draw, tmp_path):
    draw(names).savefig(tmp_path / "picture.png", dpi=40)
    name = f"home_{draw.__name__}.png"
    assert f"]({name})" in home_figures.PAGE.read_text(encoding="utf-8")
    assert (Path(home_figures.__file__).with_name(name)).stat().st_size < 80_000
