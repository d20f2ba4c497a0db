"""Maps with boundaries between regions, which a smooth surface cannot follow."""

import warnings

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import symspline as ss

CUBIC = ss.Quotient("so:3", "432")
BOUNDARY = "the map has a boundary"


def grain_map(seed, noise=1.0, angle=40.0, shape=(18, 16)):
    """Orientations of two grains with random symmetric representatives, and where the second grain is."""
    rng = np.random.default_rng(seed)
    x, y = np.meshgrid(np.linspace(0, 1, shape[0]), np.linspace(0, 1, shape[1]), indexing="ij")
    slow = np.stack([0.6 + 0.2 * np.sin(3 * x + y), 0.2 + 0.15 * np.cos(4 * y - x), 0.9 + 0.3 * x * y], axis=-1)
    turns = Rotation.from_rotvec(slow.reshape(-1, 3))
    second = x + 0.3 * y > 0.6
    other = Rotation.from_euler("ZXZ", rng.permutation([angle, 0.75 * angle, 0.5 * angle]), degrees=True)
    truth = np.where(second.reshape(-1, 1, 1), (other * turns).as_matrix(), turns.as_matrix())
    group = Rotation.create_group("O").as_matrix()[rng.integers(0, 24, len(truth))]
    noisy = truth @ Rotation.from_rotvec(np.radians(noise) * rng.standard_normal((len(truth), 3))).as_matrix() @ group
    return truth.reshape(*shape, 3, 3), noisy.reshape(*shape, 3, 3), second


@pytest.mark.filterwarnings("ignore::symspline.SmoothingWarning")
@pytest.mark.parametrize("noise", [0.02, 1.0])
def test_a_map_of_two_grains_warns(noise):
    _, noisy, _ = grain_map(1, noise)
    with pytest.warns(ss.SmoothingWarning, match=BOUNDARY) as caught:
        ss.make_smoothing_grid((None, None), noisy, CUBIC, lam=1.0)
    assert sum(BOUNDARY in str(one.message) for one in caught) == 1


@pytest.mark.parametrize("space", ["r:1", "sphere:2", "spd:2"])
def test_regions_and_sound_maps(space):
    space = ss.space(space)
    rng = np.random.default_rng(3)
    x, y = np.meshgrid(np.linspace(0, 1, 14), np.linspace(0, 1, 17), indexing="ij")
    base = space.random_point(rng)
    frame = space.frame(base)
    vectors = np.stack([np.sin(3 * x + 2 * y), np.cos(2 * y)] + [x * y] * (space.dim - 2), axis=-1)[..., : space.dim]

    def smoothed(vectors):
        points = space.exp(base, 0.4 * np.tensordot(vectors, frame, 1))
        ss.make_smoothing_grid((None, None), points, space, lam=1.0)

    noise = 0.05 * rng.standard_normal(vectors.shape)
    peak = np.exp(-80 * ((x - 0.5) ** 2 + (y - 0.4) ** 2))[..., None]
    outliers = np.where(rng.uniform(size=(14, 17, 1)) < 0.03, 1.0, 0.0)
    for sound in (vectors + noise, vectors, vectors + peak, peak + 0.1 * vectors, vectors + noise + outliers):
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            smoothed(sound)
    with pytest.warns(ss.SmoothingWarning, match=BOUNDARY):
        smoothed(vectors + noise + np.where(x > y, 1.5, 0.0)[..., None])
