"""Conversions of many rotations by the core, and the text of numbers in files."""

import io

import numpy as np
import pytest
from refused import raises
from scipy.spatial.transform import Rotation

import symspline as ss
from symspline import poses, rotations

EPS = np.finfo(float).eps
# From denormal angles to half a turn, with angles that are close to it.
ANGLES = np.concatenate([[0.0], 10.0 ** np.arange(-300, -10, 29), 10.0 ** np.arange(-10, 1), [2, 3]])
NEAR_PI = np.pi - np.concatenate([10.0 ** np.arange(-15, 0), [0.0]])


def exact_matrices(vectors):
    """Return rotation matrices in extended precision, by Rodrigues' formula with half angles."""
    v = np.asarray(vectors, np.longdouble)
    angle = np.sqrt((v * v).sum(axis=-1))[..., None, None]
    hat = np.zeros((*v.shape, 3), np.longdouble)
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        hat[..., k, j], hat[..., j, k] = v[..., i], -v[..., i]
    safe = np.where(angle > 0, angle, 1)
    once = np.where(angle > 0, np.sin(angle) / safe, 1)
    twice = np.where(angle > 0, 2 * (np.sin(angle / 2) / safe) ** 2, 0.5)
    return np.eye(3) + once * hat + twice * hat @ hat


def vectors_of(angles, rng):
    axes = rng.standard_normal((len(angles), 13, 3))
    axes[:, :3], axes[:, 3] = np.eye(3), [1, 1e-9, 0]
    return angles[:, None, None] * axes / np.linalg.norm(axes, axis=-1, keepdims=True)


def test_matrices_of_vectors_are_exact(rng):
    v = vectors_of(np.concatenate([ANGLES, NEAR_PI, [5.0, 6.3]]), rng)
    found, exact = rotations.from_rotation_vectors(v), exact_matrices(v)
    assert np.abs(found - exact).max() < 6 * EPS
    # Small entries off the diagonal have a small relative error.
    small = v[: len(ANGLES) - 4]
    skew = found[: len(small)] - np.swapaxes(found[: len(small)], -1, -2)
    shown = np.stack([skew[..., 2, 1], skew[..., 0, 2], skew[..., 1, 0]], axis=-1) / 2
    angle = np.linalg.norm(small.astype(np.longdouble), axis=-1, keepdims=True)
    expected = small * np.where(angle > 0, np.sin(angle) / np.where(angle > 0, angle, 1), 1)
    assert (np.abs(shown - expected) <= 4 * EPS * angle).all()


def test_vectors_of_matrices_are_exact(rng):
    small, large = vectors_of(ANGLES, rng), vectors_of(NEAR_PI, rng)
    assert np.allclose(rotations.as_rotation_vectors(exact_matrices(small).astype(float)), small, rtol=1e-14, atol=0)
    found = rotations.as_rotation_vectors(exact_matrices(large).astype(float))
    # At the angle π the axis may have either sign.
    error = np.minimum(np.abs(found - large).max(axis=-1), np.abs(found + large).max(axis=-1))
    assert error[:-2].max() < 4e-15 and error.max() < 4e-15
    assert np.linalg.norm(found, axis=-1).max() <= np.pi * (1 + EPS)


@pytest.mark.parametrize("shape", [(0,), (1,), (7,), (9,), (3, 0), (4, 5, 3), (1025,), (70_001,)], ids=str)
def test_all_shapes_agree_with_scipy(shape, rng):
    n = int(np.prod(shape))
    r = Rotation.from_rotvec(rng.standard_normal((n, 3))) if n else None
    m = r.as_matrix().reshape(*shape, 3, 3) if n else np.zeros((*shape, 3, 3))
    q = rotations.as_quaternions(m, scalar_first=False)
    v = rotations.as_rotation_vectors(m)
    assert q.shape == (*shape, 4) and v.shape == (*shape, 3)
    if n:
        assert np.abs(q.reshape(-1, 4) - r.as_quat(canonical=True)).max() < 1e-15
        assert np.abs(v.reshape(-1, 3) - r.as_rotvec()).max() < 2e-15
    assert np.array_equal(np.roll(rotations.as_quaternions(m, scalar_first=True), -1, axis=-1), q)
    for back in (rotations.from_quaternions(q, scalar_first=False), rotations.from_rotation_vectors(v)):
        assert back.shape == m.shape and np.allclose(back, m, rtol=0, atol=2e-15)


def test_other_layouts_and_types(rng):
    m = rotations.from_rotation_vectors(rng.standard_normal((50, 3)))
    expected = rotations.as_quaternions(m, scalar_first=True)
    records = np.zeros(50, [("flag", "i1"), ("m", "f8", (3, 3))])
    records["m"] = m
    for same in (records["m"], np.asfortranarray(m), m[::-1][::-1], m.astype(">f8"), m.tolist()):
        assert np.array_equal(rotations.as_quaternions(same, scalar_first=True), expected)
    single = rotations.as_quaternions(m.astype(np.float32), scalar_first=True)
    assert single.dtype == np.float64 and np.abs(single - expected).max() < 1e-6
    assert np.array_equal(rotations.as_quaternions(np.eye(3, dtype=int), scalar_first=True), [1, 0, 0, 0])


def test_tolerance_of_quaternions():
    rounded = np.array([[0.7071, 0.7071, 0, 0], [0.5, 0.5, 0.5, 0.5]]) / (1 + 1e-6 / 3)
    with pytest.raises(
        ss.ValidationError, match=r"quaternions\[0\] is not a unit quaternion: .* or pass a larger atol"
    ):
        rotations.from_quaternions(rounded, scalar_first=True)
    r = rotations.from_quaternions(rounded, scalar_first=True, atol=1e-4)
    assert np.abs(np.swapaxes(r, -1, -2) @ r - np.eye(3)).max() < 2e-15


@pytest.mark.parametrize("row", [0, 6, 1030])
@pytest.mark.parametrize(
    "bad, message",
    [
        (np.diag([1.0, 1.0, 1.1]), "is not a rotation"),
        (np.diag([1.0, 1.0, -1.0]), "is a reflection"),
        (np.full((3, 3), 1e200), "is not a rotation"),
        (np.zeros((3, 3)), "is not a rotation"),
        (np.diag([1.0, np.nan, 1.0]), r", 1, 1\] is nan, but must be finite"),
        (np.diag([1.0, np.inf, 1.0]), r", 1, 1\] is inf, but must be finite"),
    ],
)
def test_one_bad_matrix_among_many_raises(row, bad, message):
    m = np.tile(np.eye(3), (1031, 1, 1))
    m[row] = bad
    for call in (rotations.as_rotation_vectors, lambda m: rotations.as_quaternions(m, scalar_first=True)):
        raises(rf"rotations\[{row}.*{message.removeprefix(', ')}", call, m)


@pytest.mark.parametrize("value, message", [(np.nan, "is nan"), (-np.inf, "is -inf"), (1e200, "angles must be small")])
def test_vectors_without_a_rotation_raise(value, message):
    v = np.zeros((11, 3))
    v[10, 1] = value
    raises(rf"vectors\[10.*{message}", rotations.from_rotation_vectors, v)


def test_rotation_agrees_with_the_curve(rng):
    points = rotations.from_rotation_vectors(np.cumsum(0.4 * rng.standard_normal((30, 3)), axis=0))
    spline = ss.CubicSpline(np.cumsum(rng.uniform(0.1, 1, 30)), points, "so:3")
    x = rng.uniform(spline.t[0], spline.t[-1], 1000)
    assert np.abs(rotations.rotation(spline, x).as_matrix() - spline(x)).max() < 2e-15


# ---- files ----


def test_numbers_are_written_with_the_digits_of_python(rng):
    """Of two texts that are equally near, each may write another."""
    x = rng.integers(0, 2**64, 80_000, dtype=np.uint64).view(np.float64)
    x = np.concatenate([x[np.isfinite(x)], 10.0 ** np.arange(-330, 309), -(10.0 ** np.arange(-30, 30))])
    x = np.concatenate([x, [0.0, -0.0, 5e-324, 1e16, 123456789012345.6, 1e22, 9007199254740993.0, 0.1, 1 / 3]])
    x = np.concatenate([x, np.round(rng.standard_normal(999), 6)])
    x = x[: len(x) // 3 * 3].reshape(-1, 3)
    g = np.tile(np.eye(4), (len(x), 1, 1))
    g[:, :3, 3] = x
    file = io.StringIO()
    poses.write_kitti(file, g)
    found = [word for line in file.getvalue().splitlines() for word in line.split(" ")[3::4]]
    expected = list(map(repr, x.ravel().tolist()))
    assert np.array_equal(np.array(found, float), x.ravel())
    different = [(a, b) for a, b in zip(found, expected, strict=True) if a != b]
    assert len(different) < 20 and all(len(a) == len(b) and a[:14] == b[:14] for a, b in different)


def test_files_restore_every_number(rng, tmp_path):
    n = 2000
    t = 1.7e9 + np.cumsum(rng.uniform(0.001, 0.1, n))
    g = poses.join(rotations.from_rotation_vectors(rng.standard_normal((n, 3))), 1e3 * rng.standard_normal((n, 3)))
    poses.write_tum(tmp_path / "tum.txt", t, g)
    times, back = poses.read_tum(tmp_path / "tum.txt")
    assert np.array_equal(times, t) and np.array_equal(back[:, :3, 3], g[:, :3, 3])
    assert np.abs(back - g).max() < 2e-15
    dates = (1e9 * t).astype(np.int64).astype("M8[ns]")
    poses.write_euroc(tmp_path / "euroc.csv", dates, g)
    times, back = poses.read_euroc(tmp_path / "euroc.csv")
    assert np.array_equal(times, dates) and np.array_equal(back[:, :3, 3], g[:, :3, 3])
    assert (tmp_path / "euroc.csv").read_text().splitlines()[1].startswith(f"{dates[0].astype(int)},")
