"""Landmarks as points of Grassmannians: invariance under affine maps, and the way back."""

import numpy as np
import pytest
from refused import raises

import symspline as ss
from symspline.shapes import from_landmarks, to_landmarks

SQUARE = np.array([[0.0, 0], [1, 0], [1, 1], [0, 1]])


def drawings(count=3, landmarks=6, n=2, seed=0, spread=0.3):
    rng = np.random.default_rng(seed)
    return rng.standard_normal((landmarks, n)) + spread * rng.standard_normal((count, landmarks, n))


def affine_images(x, seed=1):
    """Each drawing under a map of its own."""
    rng = np.random.default_rng(seed)
    n = x.shape[-1]
    maps = rng.standard_normal((*x.shape[:-2], n, n)) + 2 * np.eye(n)
    return x @ maps + rng.standard_normal((*x.shape[:-2], 1, n))


@pytest.mark.parametrize("n", [1, 2, 3])
@pytest.mark.parametrize("base", [None, 0, 4])
def test_affine_images_have_one_shape(n, base):
    x = drawings(7, n=n)
    shapes, images = from_landmarks(x, base=base), from_landmarks(affine_images(x), base=base)
    space = ss.Grassmannian(n, shapes.shape[-2])
    assert shapes.shape == (7, 6 if base is None else 5, n)
    space.check_point(shapes)
    assert space.distance(shapes, images).max() < 1e-14
    assert space.distance(shapes[0], shapes[1]) > 0.1
    # The columns span what the landmarks' coordinates do.
    moved = x - x.mean(axis=1, keepdims=True) if base is None else np.delete(x - x[:, [base]], base, axis=1)
    assert np.abs(moved - shapes @ (shapes.swapaxes(1, 2) @ moved)).max() < 1e-14


def test_kernels_are_the_other_way_to_say_it():
    """Gr(2, 3) of row spaces is Gr(1, 3) of kernels, as in the paper."""
    x = drawings(8, landmarks=4)
    differences = (x[:, 1:] - x[:, :1]).swapaxes(1, 2)
    kernels = np.cross(differences[:, 0], differences[:, 1])
    kernels = (kernels / np.linalg.norm(kernels, axis=1, keepdims=True))[..., None]
    shapes = from_landmarks(x, base=0)
    planes = ss.Grassmannian(2, 3).distance(shapes[:-1], shapes[1:])
    assert np.abs(planes - ss.Grassmannian(1, 3).distance(kernels[:-1], kernels[1:])).max() < 1e-14


@pytest.mark.parametrize("base", [None, 0, 5])
def test_there_and_back_of_shapes(base):
    x = drawings(4, n=3)
    shapes = from_landmarks(x, base=base)
    assert np.abs(to_landmarks(shapes, x, base=base) - x).max() < 1e-14
    # Of all affine images the closest, whatever the basis.
    like = drawings(4, n=3, seed=5)
    turn = np.linalg.qr(np.random.default_rng(2).standard_normal((3, 3)))[0]
    found = to_landmarks(shapes @ turn, like, base=base)
    for image, drawing, wanted in zip(found, x, like, strict=True):
        if base is None:
            columns = np.c_[drawing, np.ones(6)]
            best = columns @ np.linalg.lstsq(columns, wanted, rcond=None)[0]
        else:
            moved = drawing - drawing[base]
            best = moved @ np.linalg.lstsq(moved, wanted - wanted[base], rcond=None)[0] + wanted[base]
        assert np.abs(image - best).max() < 1e-13


FLAT = np.array([[0.0, 0], [1, 1], [2, 2], [3, 3]])


def test_invalid_shapes_raise():
    for match, call in [
        (r"x\[1\] lies in a hyperplane: its extents are 3.16, \d", lambda: from_landmarks([SQUARE, FLAT])),
        (r"x lies in a hyperplane", lambda: from_landmarks(FLAT, base=2)),
        (r"x has shape \(3, 2\): 3 landmarks in 2 dim.* at least 4 landmarks", lambda: from_landmarks(FLAT[1:])),
        ("base must be None or the number of a landmark, 0 to 3, not 4", lambda: from_landmarks(SQUARE, base=4)),
        ("base must be .* not True", lambda: from_landmarks(SQUARE, base=True)),
        ("x must be real landmarks, not complex", lambda: from_landmarks(SQUARE * 1j)),
        (r"x\[2, 0\] is nan", lambda: from_landmarks([[0, 0], [1, 0], [np.nan, 1], [0, 1]])),
        (r"shape must be real, of shape \(..., 3, 2\)", lambda: to_landmarks(from_landmarks(SQUARE), SQUARE, base=0)),
        ("shape does not have orthonormal columns", lambda: to_landmarks(SQUARE, SQUARE)),
    ]:
        raises(match, call)


def test_nearly_flat_drawings_have_a_shape():
    """As long as rounding leaves a few digits of it."""
    thin = np.array(SQUARE) * [1, 1e-7]
    distance = ss.Grassmannian(2, 4).distance(*map(from_landmarks, (SQUARE, thin)))
    assert distance < 1e-8
    raises("hyperplane", from_landmarks, np.array(SQUARE) * [1, 1e-12])
