"""Films between drawings."""

import numpy as np
import pytest
from cases import loop_over
from refused import raises
from scipy.interpolate import CubicSpline
from test_landmarks import affine_images, drawings

import symspline as ss
from symspline.shapes import AffineMorph, from_landmarks

KNOTS = np.array([0.0, 1.0, 1.7, 3.0, 4.0])
X = np.linspace(0, 4, 41)
NEAR = 2e-11


def turned(n, count, closed=False):
    """Drawings whose affine maps do not mirror them."""
    x = drawings(count, landmarks=6, n=n, spread=0.25)
    angle = np.linspace(0, 2, count)
    plane = np.eye(n) * np.ones((count, 1, 1))
    plane[:, 0, 0], plane[:, 0, 1] = np.cos(angle), -np.sin(angle)
    plane[:, 1, 0], plane[:, 1, 1] = np.sin(angle), np.cos(angle)
    x = x @ (plane * (1 + angle[:, None, None] / 4)) + angle[:, None, None] * np.arange(n)
    return np.concatenate([x[:-1], x[:1]]) if closed else x


def off_shape(morph, x, base=None):
    """How far the drawings of a film are from the spline of the shapes."""
    shapes = from_landmarks(morph(x), base=base)
    return morph.shape.space.distance(shapes, morph.shape(x)).max()


@pytest.mark.parametrize("base", [None, 2])
@loop_over("n", [2, 3])
@pytest.mark.parametrize("bc_type", ["natural", "not-a-knot", ("clamped", "natural")])
def test_the_film_goes_through_every_drawing(n, base, bc_type):
    x = turned(n, 5)
    morph = AffineMorph(KNOTS, x, base=base, bc_type=bc_type)
    assert np.abs(morph(KNOTS) - x).max() < NEAR
    assert off_shape(morph, X, base) < NEAR
    assert morph(X.reshape(1, 41)).shape == (1, 41, 6, n) and morph(0.3).shape == (6, n)
    assert np.array_equal(morph.landmarks, x) and np.array_equal(morph.t, KNOTS)


@pytest.mark.parametrize("base", [None, 2])
def test_in_the_coordinates_of_the_first_drawing_only_the_shape_changes(base):
    x = turned(2, 5)
    morph = AffineMorph(KNOTS, x, base=base, frame="first")
    assert np.abs(morph(0.0) - x[0]).max() < 1e-14
    assert off_shape(morph, X, base) < NEAR
    film = morph(X)
    # Whatever affine maps have done to the others, also mirror them.
    images = affine_images(x)
    images[0] = x[0]
    assert np.abs(AffineMorph(KNOTS, images, base=base, frame="first")(X) - film).max() < NEAR
    # And what is done to all of them is done to the film.
    linear, shift = np.array([[1.0, 2.0], [0.5, -1.0]]), [3.0, 4.0]
    assert (
        np.abs(AffineMorph(KNOTS, x @ linear + shift, base=base, frame="first")(X) - film @ linear - shift).max()
        < 10 * NEAR
    )


def test_drawings_of_one_shape_do_not_need_the_lift():
    """If all are similar, the film is that of the similarities."""
    angle, size, at = (np.array([0, 0.8, 1.5, 1.2, 2.0]), np.array([1, 1.5, 1, 2, 1.2]), np.array([0, 1, 5, 2, 0.0]))
    first = drawings(1)[0] - drawings(1)[0].mean(axis=0)

    def drawn(angle, size, at):
        turn = np.moveaxis(np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]]), -1, 0)
        return size[:, None, None] * first @ turn + at[:, None, None]

    morph = AffineMorph(KNOTS, drawn(angle, size, at))
    parts = (CubicSpline(KNOTS, part, bc_type="natural")(X) for part in (angle, np.log(size), at))
    turn, logarithm, middle = parts
    assert np.abs(morph(X) - drawn(turn, np.exp(logarithm), middle)).max() < NEAR


def one_sided(morph, t, side, step=2e-3):
    """Value, first and second derivative of a film at a time, from one side: a polynomial through nine drawings."""
    k = np.arange(9)
    film = morph(t + side * step * k)
    coefficients = np.linalg.solve(np.vander(k * side, increasing=True), film.reshape(9, -1))
    return [coefficients[i] * (1, 1, 2)[i] / step**i for i in range(3)]


@pytest.mark.parametrize("frame", ["all", "first"])
def test_films_are_c2(frame):
    morph = AffineMorph(KNOTS, turned(2, 5), frame=frame)
    for t in KNOTS[1:-1]:
        left, right = (one_sided(morph, t, side) for side in (-1, 1))
        for order, tol in enumerate((1e-12, 1e-8, 2e-5)):
            assert np.abs(left[order] - right[order]).max() < tol * max(1, np.abs(left[order]).max())


@pytest.mark.parametrize("base", [None, 0])
def test_closed_films_are_c2_where_they_close(base):
    x = turned(2, 5, closed=True)
    morph = AffineMorph(KNOTS, x, base=base, bc_type="periodic")
    assert np.abs(morph(KNOTS) - x).max() < NEAR
    # The basis itself comes back turned.
    assert np.abs(morph.holonomy - np.eye(2)).max() > 1e-3
    end, start = one_sided(morph, 4.0, -1), one_sided(morph, 0.0, 1)
    for order, tol in enumerate((1e-11, 1e-8, 2e-5)):
        assert np.abs(end[order] - start[order]).max() < tol * max(1, np.abs(end[order]).max())
    first = AffineMorph(KNOTS, x, base=base, frame="first", bc_type="periodic")
    middle = x[0].mean(axis=0) if base is None else x[0, base]
    assert np.abs(first(4.0) - middle - (x[0] - middle) @ first.holonomy).max() < NEAR
    assert np.abs(first.holonomy - morph.holonomy).max() < NEAR


def test_the_holonomy_of_four_landmarks_is_an_area():
    """By Gauss and Bonnet: planes in R³ are turned, going round, by the area that their normals enclose."""
    angle = 2 * np.pi * np.arange(9) / 8
    normals = np.stack([0.5 * np.cos(angle), 0.3 * np.sin(angle), np.ones(9)], axis=-1)
    planes = np.linalg.svd(normals[:, None])[2][:, 1:].swapaxes(1, 2)
    x = np.concatenate([np.zeros((9, 1, 2)), planes], axis=1)
    x[-1] = x[0]
    morph = AffineMorph(None, x, base=0, frame="first", bc_type="periodic")
    h = morph.holonomy
    bases = morph(np.linspace(0, 8, 4001))[:, 1:]
    n = np.cross(bases[..., 0], bases[..., 1])
    n /= np.linalg.norm(n, axis=1, keepdims=True) * np.sign(n[:, 2:])
    # The area by Green's theorem: ∫ (1 − z) dφ, with Simpson's rule.
    slope = np.cross(n[1:-1:2], (n[2::2] - n[:-2:2]))[:, 2] / (1 - n[1:-1:2, 2] ** 2)
    area = np.sum((1 - n[1:-1:2, 2]) * slope)
    start = x[0, 1:]
    turn = np.linalg.lstsq(start, start @ h, rcond=None)[0]
    side = np.sign(np.cross(start[:, 0], start[:, 1])[2])
    assert np.linalg.det(h) == pytest.approx(1, abs=1e-10)
    assert side * np.arctan2(turn[1, 0], turn[0, 0]) == pytest.approx(area, abs=1e-5)
    assert area > 0.3


def half_turn():
    """Planes whose normals go half round a great circle: the loop is not contractible."""
    angle = np.linspace(0, np.pi, 7)
    zero, one = np.zeros(7), np.ones(7)
    planes = np.stack([[zero, zero, one], [-np.sin(angle), np.cos(angle), zero]], axis=0).transpose(2, 1, 0)
    x = np.concatenate([np.zeros((7, 1, 2)), planes], axis=1)
    x[-1] = x[0]
    return x


def test_a_film_may_end_mirrored():
    morph = AffineMorph(None, half_turn(), base=0, frame="first", bc_type="periodic")
    assert np.abs(np.sort(np.linalg.eigvalsh(morph.holonomy)) - [-1, 1]).max() < 1e-10
    raises(r"landmarks\[6\] is mirrored", AffineMorph, None, half_turn(), base=0, bc_type="periodic")


def test_dates():
    dates = np.datetime64("2024-01-01") + (10 * KNOTS).astype("m8[D]")
    x = turned(2, 5)
    morph = AffineMorph(dates, x)
    assert np.abs(morph(dates) - x).max() < NEAR
    assert np.array_equal(morph(str(dates[1])), morph(dates[1]))


def spoiled(drawing, column, change):
    """Drawings of which one has another column of coordinates."""
    x = turned(2, 5)
    x[drawing, :, column] = change(x[drawing])
    return x


CLOSED, LAST = turned(2, 5, closed=True), np.reshape([0.0, 0, 0, 0, 1], (5, 1, 1))
NOT_CLOSED = "the last drawing of a closed film must equal the first, but differs by .*"


def test_invalid_films_raise():
    for match, x, options in [
        (r"\[2\] is mirrored: .* number its landmarks .* frame='first'", spoiled(2, 0, lambda x: -x[:, 0]), {}),
        (r"landmarks\[3\] lies in a hyperplane", spoiled(3, 1, lambda x: 2 * x[:, 0]), {}),
        ("frame must be 'all' or 'first', not 'last'", turned(2, 5), {"frame": "last"}),
        ("bc_type must be a string or a pair of strings", turned(2, 5), {"bc_type": ((1, 0), "natural")}),
        (r"landmarks must be of shape \(drawings, landmarks, n\)", turned(2, 5)[0], {}),
        (r"with n >= 2, not \(5, 6, 1\)", turned(2, 5)[..., :1], {}),
        (NOT_CLOSED + "e-07", CLOSED + 4e-7 * LAST, {"bc_type": "periodic"}),
        (NOT_CLOSED + "frame='first'", CLOSED * (1 + LAST), {"bc_type": "periodic"}),
    ]:
        raises(match, AffineMorph, KNOTS, x, **options)


def test_films_have_a_first_and_a_last_time():
    morph = AffineMorph(KNOTS, turned(2, 5))
    raises(r"x\[1\] is 4.5, but must be between the times .*, 0.0 and 4.0", morph, [1, 4.5])
    with pytest.raises(ss.ValidationError, match="only a closed film has a holonomy"):
        morph.holonomy  # noqa: B018
